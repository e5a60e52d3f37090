//! Where the search for the vertical starts if the robot leans little: the leans that most edges near the upright pass through.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Vector3};
use tiltvp_kernels::vectorised;

use super::frame::{Edge, Frame};

/// How far beyond the largest lean the circles of edges may pass: ten times their usual scatter.
pub(super) const BEYOND_RAD: f64 = 3f64.to_radians();

/// Leans from the upright to the largest one that are tried: steps of a degree by default.
const GRID: i32 = 12;

/// Standard deviation of the leans that are expected before the image is seen, in largest leans: 5 degrees by default.
const LEAN_SIGMA: f64 = 5.0 / 12.0;

/// How many starts, how many steps of the grid they are apart, for two refinements from nearer ones mostly end in one place, and
/// how many of their frames are refined, the most likely ones. Of 144 views ahead of rendered rooms 9 % are off by more than two
/// degrees from one start, 3 % from six, of which in 753 of 759 views the answer's is among the three.
const STARTS: usize = 6;
const APART_STEPS: f64 = 2.0;
pub(super) const REFINED: usize = 3;

/// By how much the sum of log odds of a start may be less than the greatest, as a share of that: of one in a hundred answers it is
/// less by more.
const GAP_MAX: f32 = 0.6;

/// Sums that are added up side by side: a vector of 256 bits.
const LANES: usize = 8;

/// The leans that are tried.
#[derive(Debug)]
pub(super) struct Near {
    expected_max_rad: f64,
    tilt_max_rad: f64,
    /// Distance of neighbouring leans.
    step_rad: f64,
    leans: Vec<Lean>,
}

/// The memory of one thread.
#[derive(Debug, Clone, Default)]
pub(super) struct NearWork {
    columns: Columns,
    scores: Vec<(f32, u32)>,
    pub starts: Vec<Vector3<f64>>,
    pub frames: Vec<Frame>,
    /// The refined ones with the logarithms of their probabilities, up to a constant.
    pub refined: Vec<(f64, Frame)>,
}

/// A lean that is tried.
#[derive(Debug, Clone, Copy)]
struct Lean {
    normal: [f32; 3],
    /// Logarithm of what was expected of it, up to a constant.
    prior: f32,
}

/// Edges by their numbers: normals, half the inverse variances, logarithms of the odds, weights.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    half: Vec<f32>,
    log_odds: Vec<f32>,
    weight: Vec<f32>,
}

impl Near {
    /// The leans up to the largest one that is looked for, of which leans up to another are expected.
    pub(super) fn new(expected_max_rad: f64, tilt_max_rad: f64) -> Self {
        let step_rad = tilt_max_rad / f64::from(GRID);
        let mut near = Self { expected_max_rad, tilt_max_rad, step_rad, leans: Vec::new() };
        let places = (-GRID..=GRID).flat_map(|i| (-GRID..=GRID).map(move |k| (i, k)));
        let within = places.filter(|(i, k)| i * i + k * k <= GRID * GRID);
        near.leans.extend(within.map(|(i, k)| {
            let (x, y) = (f64::from(i) * step_rad, f64::from(k) * step_rad);
            let lean = x.hypot(y);
            let sine = if lean > 0.0 { lean.sin() / lean } else { 1.0 };
            let normal = Vector3::new(x * sine, y * sine, lean.cos());
            Lean { normal: normal.cast::<f32>().into(), prior: log_prior(lean, expected_max_rad) as f32 }
        }));
        near
    }

    /// Logarithm of what was expected of a normal, up to a constant; `None` beyond the largest lean.
    pub(super) fn log_prior(&self, normal: &Vector3<f64>) -> Option<f64> {
        let lean = normal.z.clamp(-1.0, 1.0).acos();
        (lean <= self.tilt_max_rad + BEYOND_RAD).then(|| log_prior(lean, self.expected_max_rad))
    }

    /// Whether a covariance tells anything in every direction: by less than the largest lean.
    pub(super) fn tells(&self, covariance: &Matrix2<f64>) -> bool {
        covariance.symmetric_eigenvalues().max() < self.expected_max_rad.powi(2)
    }

    /// Whether the circle of an edge passes near a lean that is looked at.
    pub(super) fn may_be_vertical(&self, edge: &Edge) -> bool {
        edge.normal.z.abs() < (self.tilt_max_rad + BEYOND_RAD).min(FRAC_PI_2).sin()
    }

    /// Fills the starts: the normals of the leans with the greatest sums of odds, the best first.
    pub(super) fn find(&self, edges: &[Edge], scatter_rad: f64, work: &mut NearWork) {
        let NearWork { columns, scores, starts, .. } = work;
        // As far as half a step of the grid makes them miss it.
        let scatter_rad = scatter_rad.hypot(0.5 * self.step_rad);
        columns.clear();
        for edge in edges.iter().filter(|edge| self.may_be_vertical(edge)) {
            columns.push(edge, &Vector3::z(), scatter_rad);
        }
        scores.clear();
        scores.extend(
            self.leans.iter().enumerate().map(|(i, lean)| (lean.prior + columns.score(&lean.normal), i as u32)),
        );
        scores.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // To a tenth of a step, for neighbours are at right angles on a sphere.
        let together = ((APART_STEPS - 0.1) * self.step_rad).cos();
        starts.clear();
        let least = scores.first().map_or(0.0, |best| best.0 - GAP_MAX * best.0.abs());
        for (_, i) in scores.iter().take_while(|score| score.0 >= least) {
            let normal = Vector3::from(self.leans[*i as usize].normal.map(f64::from));
            if starts.iter().all(|other| other.dot(&normal) < together) {
                starts.push(normal);
            }
            if starts.len() == STARTS {
                break;
            }
        }
    }
}

fn log_prior(lean_rad: f64, expected_max_rad: f64) -> f64 {
    -0.5 * (lean_rad / (LEAN_SIGMA * expected_max_rad)).powi(2)
}

impl Columns {
    /// Removes all edges and keeps the memory.
    pub(super) fn clear(&mut self) {
        let Self { x, y, z, half, log_odds, weight } = self;
        [x, y, z, half, log_odds, weight].into_iter().for_each(Vec::clear);
    }

    /// Appends an edge with the variance and the odds that it has if it is of a direction near an axis.
    pub(super) fn push(&mut self, edge: &Edge, axis: &Vector3<f64>, scatter_rad: f64) {
        let through = edge.odds_through(axis, scatter_rad);
        self.x.push(edge.normal.x as f32);
        self.y.push(edge.normal.y as f32);
        self.z.push(edge.normal.z as f32);
        self.half.push((0.5 / through.variance) as f32);
        self.log_odds.push(through.odds.ln() as f32);
        self.weight.push(edge.weight as f32);
    }

    /// Sum of the weighted logarithms of the odds of a direction, of those above even.
    pub(super) fn score(&self, normal: &[f32; 3]) -> f32 {
        sum_of_odds(self, *normal)
    }
}

vectorised! {
    fn sum_of_odds(columns: &Columns, [a, b, c]: [f32; 3]) -> f32 {
        let Columns { x, y, z, half, log_odds, weight } = columns;
        let chunks = |values| <[f32]>::as_chunks::<LANES>(values);
        let [x, y, z, half, log_odds, weight] = [x, y, z, half, log_odds, weight].map(|values| chunks(values));
        let mut lanes = [0.0f32; LANES];
        let mut add = |lane: usize, [x, y, z, half, log_odds, weight]: [f32; 6]| {
            let distance = x * a + y * b + z * c;
            lanes[lane] += weight * (log_odds - distance * distance * half).max(0.0);
        };
        let whole = x.0.iter().zip(y.0).zip(z.0).zip(half.0.iter().zip(log_odds.0).zip(weight.0));
        for (((x, y), z), ((half, log_odds), weight)) in whole {
            for k in 0..LANES {
                add(k, [x[k], y[k], z[k], half[k], log_odds[k], weight[k]]);
            }
        }
        for k in 0..x.1.len() {
            add(k, [x.1[k], y.1[k], z.1[k], half.1[k], log_odds.1[k], weight.1[k]]);
        }
        lanes.iter().sum()
    }
}
