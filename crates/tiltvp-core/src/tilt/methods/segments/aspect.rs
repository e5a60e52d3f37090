//! Where straight edges stand, and of which polarity they are: what tells whether the camera is mounted as told.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};

use super::near::{Columns, EVEN_RAD, LENGTH_RAD};
use crate::segments::Segments;
use crate::tilt::trust::ASPECT;

/// The longest segments, which are looked at.
const LONGEST: usize = 120;

/// By how much in radians the edges of things along a direction miss it, with half a step of the grid.
const SCATTER_RAD: f64 = 0.8f64.to_radians();

/// How far from each axis of the robot edges may agree: 10 degrees of lean, and 4 by which mountings are off.
const REACH_RAD: f64 = 14f64.to_radians();

/// Distance of neighbouring directions that are tried, twice the scatter.
const STEP_RAD: f64 = 1.75f64.to_radians();

/// Beyond the reach, in radians: three times the scatter, from where on edges add nothing.
const BEYOND_RAD: f64 = 3.0 * SCATTER_RAD;

/// What is looked for, made once.
#[derive(Debug)]
pub(super) struct Aspect {
    robot_from_camera: Matrix3<f64>,
    /// Directions about an axis, which is their last component.
    directions: Vec<[f32; 3]>,
}

/// Puts an axis of the robot last.
type Axis = fn(&Vector3<f64>) -> Vector3<f64>;

/// The memory of one thread.
#[derive(Debug, Clone, Default)]
pub(super) struct AspectWork {
    edges: Vec<Edge>,
    columns: Columns,
}

/// A segment in the robot frame.
#[derive(Debug, Clone, Copy)]
struct Edge {
    normal: Vector3<f64>,
    middle: Vector3<f64>,
    variance: f64,
    weight: f64,
}

impl Edge {
    /// Odds at no distance that it is of a direction near this axis and not of any.
    fn odds(&self, along_axis: f64) -> f64 {
        EVEN_RAD * ((1.0 - along_axis * along_axis).max(1e-3) / self.variance).sqrt()
    }
}

impl Aspect {
    pub(super) fn new(robot_from_camera: &Matrix3<f64>) -> Self {
        let steps = (REACH_RAD / STEP_RAD) as i32;
        let places = (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |k| (i, k)));
        let within = places.filter(|(i, k)| i * i + k * k <= steps * steps);
        let directions = within.map(|(i, k)| {
            let [x, y] = [i, k].map(|i| (f64::from(i) * STEP_RAD).sin());
            Vector3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()).cast::<f32>().into()
        });
        Self { robot_from_camera: *robot_from_camera, directions: directions.collect() }
    }

    /// How far from the horizon what is vertical stands, how much what is level is lighter above, how high it stands, and how much
    /// agrees with a direction near the upright, and near the one of two level axes with which more does.
    pub(super) fn of(&self, segments: &Segments, up: &Vector3<f64>, work: &mut AspectWork) -> [f64; ASPECT] {
        let AspectWork { edges, columns } = work;
        let turn = &self.robot_from_camera;
        edges.clear();
        edges.extend(segments.list.iter().take(LONGEST).map(|segment| Edge {
            normal: turn * segment.normal,
            middle: turn * segment.middle,
            variance: SCATTER_RAD * SCATTER_RAD + segment.variances_rad2[0].max(segment.variances_rad2[1]),
            weight: (segment.length_rad / LENGTH_RAD).sqrt(),
        }));
        let total = 1.0 + edges.iter().map(|edge| edge.weight).sum::<f64>();
        let (mut vertical, mut distance, mut polarity, mut height) = (1.0, 0.0, 0.0, 0.0);
        for edge in &*edges {
            let (miss, rise) = (edge.normal.dot(up), edge.middle.dot(up));
            let odds = edge.odds(rise) * (-0.5 * miss * miss / edge.variance).exp();
            let share = odds / (1.0 + odds);
            vertical += edge.weight * share;
            distance += edge.weight * share * rise.abs();
            polarity += edge.weight * (1.0 - share) * miss;
            height += edge.weight * (1.0 - share) * rise;
        }
        let axes: [Axis; 3] = [|v| *v, |v| v.yzx(), |v| v.zxy()];
        let [own, first, second] = axes.map(|axis| self.most(edges, columns, axis) / total);
        [distance / vertical, polarity / total, height / total, own, first.max(second)]
    }

    /// The greatest sum of odds of a direction near an axis that is made the last one.
    fn most(&self, edges: &[Edge], columns: &mut Columns, axis: Axis) -> f64 {
        let limit = (REACH_RAD + BEYOND_RAD).min(FRAC_PI_2).sin();
        columns.clear();
        for edge in edges {
            let normal = axis(&edge.normal);
            if normal.z.abs() < limit {
                columns.push(&normal, edge.variance, edge.odds(axis(&edge.middle).z), edge.weight);
            }
        }
        f64::from(self.directions.iter().map(|direction| columns.score(direction)).fold(0.0, f32::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segments::Segment;

    /// Long edges through the zenith at many azimuths, and short ones along x below the horizon, lighter above.
    fn edges() -> Segments {
        let segment = |normal: Vector3<f64>, middle: Vector3<f64>, length_rad| Segment {
            normal: normal.normalize(),
            middle: middle.normalize(),
            ends: [middle; 2],
            length_rad,
            variances_rad2: [1e-6; 2],
            contrast: 1.0,
            rms_px: 0.0,
            px_per_rad: 100.0,
            points: 0..0,
        };
        let upright = (0..12).map(|i| {
            let (sin, cos) = (0.5 * f64::from(i)).sin_cos();
            segment(Vector3::new(-sin, cos, 0.0), Vector3::new(cos, sin, 0.1), 0.4)
        });
        let level = (0..6).map(|i| {
            let down = 0.3 + 0.1 * f64::from(i);
            segment(Vector3::new(0.0, down, 1.0), Vector3::new(0.0, 1.0, -down), 0.1)
        });
        Segments { list: upright.chain(level).collect(), points: Vec::new() }
    }

    #[test]
    fn the_axis_with_which_edges_agree_is_told_and_what_is_level_and_light_above() {
        let aspect = |robot_from_camera: Matrix3<f64>| {
            Aspect::new(&robot_from_camera).of(&edges(), &Vector3::z(), &mut AspectWork::default())
        };
        let ahead = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let [rise, polarity, height, own, other] = aspect(Matrix3::identity());
        assert!(rise < 0.12 && polarity > 0.1 && height < -0.05, "{rise} {polarity} {height}");
        assert!(own > 3.0 * other, "{own} {other}");
        let [.., own_ahead, other_ahead] = aspect(ahead);
        assert!(other_ahead > 3.0 * own_ahead, "{own_ahead} {other_ahead}");
        assert!((own - other_ahead).abs() < 1e-3, "{own} {other_ahead}");
        let [_, polarity_down, height_down, ..] = aspect(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)));
        assert!((polarity_down + polarity).abs() < 1e-9 && (height_down + height).abs() < 1e-9);
    }
}
