//! Frames of a vertical and two nearly orthogonal horizontals, and the edges that agree with them.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Matrix3, Matrix4, Rotation3, SMatrix, Vector3, Vector4};

use super::options::FLOOR_RAD;
use super::sectors::Sectors;
use crate::geometry::tangent_basis;
use crate::segments::Segment;
use crate::tilt::confidence::inverse_of_positive;

/// Scatter of the edges of horizontal things about their vanishing points, radians: beams sag, frames do not.
const HORIZONTAL_RAD: f64 = 0.4f64.to_radians();

/// The scatter in radians at which a segment that passes through a direction is as likely to be of it as of any other.
pub(super) const EVEN_RAD: f64 = 0.03;

/// The length in radians of a segment that counts as one observation; others by the square root of their length.
const LENGTH_RAD: f64 = 0.2;

/// Standard deviation in radians by which horizontal edges of one building miss the right angle.
const SKEW_RAD: f64 = 1f64.to_radians();

/// Its inverse variance.
const STIFFNESS: f64 = 1.0 / (SKEW_RAD * SKEW_RAD);

/// By how much variances exceed what the residuals of one image tell: set so that nine in ten truths are inside the regions of 90 % in
/// upward views of panoramas. In views ahead 83 to 87 % are, in rendered rooms all.
const GROWTH: f64 = 2.0;

/// Bins of azimuth, over the quarter turn after which two orthogonal horizontals are as before.
const BINS: usize = 45;

/// Least sine of the angle between an edge's plane and the horizontal one: planes that nearly coincide meet nowhere in particular.
const LEVEL_MIN: f64 = 0.05;

/// Steps of a refinement, and the longest of them in radians.
pub(super) const STEPS: u32 = 3;
const STEP_MAX_RAD: f64 = 0.05;

/// Least share of a probability at which an edge counts in a step. Only time depends on it.
const NEGLIGIBLE: f64 = 1e-3;

/// Squared distance in variances beyond which odds are nought: they are less than that.
const FARTHEST: f64 = 25.0;

/// A segment in the robot frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub normal: Vector3<f64>,
    pub middle: Vector3<f64>,
    pub length_rad: f64,
    /// How many observations it counts as.
    pub weight: f64,
    along: Vector3<f64>,
    /// Variances of the normal's turns about `along` and `middle`.
    offset: f64,
    slope: f64,
}

/// Odds that an edge is of a direction, and the variance of the angle by which its circle would miss it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Odds {
    pub odds: f64,
    pub variance: f64,
}

impl Edge {
    pub(super) fn new(robot_from_camera: &Matrix3<f64>, segment: &Segment) -> Self {
        let (normal, middle) = (robot_from_camera * segment.normal, robot_from_camera * segment.middle);
        let ([offset, slope], length_rad) = (segment.variances_rad2, segment.length_rad);
        let weight = (length_rad / LENGTH_RAD).sqrt();
        Self { normal, middle, length_rad, along: normal.cross(&middle), offset, slope, weight }
    }

    pub(super) fn odds(&self, direction: &Vector3<f64>, scatter_rad: f64) -> Odds {
        let distance = self.normal.dot(direction);
        let (across, variance) = self.variance(direction, scatter_rad);
        let squares = distance * distance / variance;
        // Most edges are far from most directions.
        let odds =
            if squares < FARTHEST { EVEN_RAD * chance(across) / variance.sqrt() * (-0.5 * squares).exp() } else { 0.0 };
        Odds { odds, variance }
    }

    /// The same if its circle passed through the direction.
    pub(super) fn odds_through(&self, direction: &Vector3<f64>, scatter_rad: f64) -> Odds {
        let (across, variance) = self.variance(direction, scatter_rad);
        Odds { odds: EVEN_RAD * chance(across) / variance.sqrt(), variance }
    }

    /// How near to the direction it is seen, as a cosine, and the variance of the angle by which its circle would miss it.
    fn variance(&self, direction: &Vector3<f64>, scatter_rad: f64) -> (f64, f64) {
        let (across, turn) = (self.middle.dot(direction), self.along.dot(direction));
        (across, self.offset * across * across + self.slope * turn * turn + scatter_rad * scatter_rad)
    }
}

/// An edge that is seen near a direction passes through it by chance more often: by the inverse of this.
fn chance(across: f64) -> f64 {
    (1.0 - across * across).max(1e-3).sqrt()
}

/// Sum of the weighted logarithms of the odds that edges are of a direction.
pub(super) fn score(edges: &[Edge], direction: &Vector3<f64>, scatter_rad: f64) -> f64 {
    edges.iter().map(|edge| edge.weight * edge.odds(direction, scatter_rad).odds.ln_1p()).sum()
}

/// Three orthogonal directions (the horizontals nearly so) that edges agree with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// The horizontals, and what is vertical.
    pub axes: [Vector3<f64>; 3],
    /// Logarithm of the likelihood, up to a constant.
    pub log_likelihood: f64,
    /// Length in radians of the last step of the refinement.
    pub change: f64,
    /// Scatter in radians of the edges of each axis.
    scatters: [f64; 3],
}

impl Frame {
    /// About what is up, with the heading that is most likely, to half a bin.
    pub(super) fn about(edges: &[Edge], up: &Vector3<f64>, scatter_rad: f64) -> Self {
        const STEP: f64 = FRAC_PI_2 / BINS as f64;
        let basis = tangent_basis(up);
        let (a, b) = (basis.column(0).into_owned(), basis.column(1).into_owned());
        let (mut bins, mut base) = ([0.0; BINS], 0.0);
        for edge in edges {
            let vertical = edge.odds(up, scatter_rad).odds;
            let alone = edge.weight * vertical.ln_1p();
            base += alone;
            let meets = up.cross(&edge.normal);
            let length = meets.norm();
            if length < LEVEL_MIN {
                continue;
            }
            let horizontal = meets / length;
            let heading = horizontal.dot(&b).atan2(horizontal.dot(&a)).rem_euclid(FRAC_PI_2);
            let through = edge.odds_through(&horizontal, HORIZONTAL_RAD);
            let variance = through.variance / (length * length) + 0.25 * STEP * STEP;
            let odds = through.odds * (through.variance / variance).sqrt() / length;
            let reach = ((3.0 * variance.sqrt() / STEP) as usize + 1).min(BINS / 2);
            let nearest = (heading / STEP) as usize;
            for k in 0..=2 * reach {
                let place = nearest as f64 + k as f64 - reach as f64;
                let off = (place + 0.5) * STEP - heading;
                let both = vertical + odds * (-0.5 * off * off / variance).exp();
                bins[(nearest + k + BINS - reach) % BINS] += edge.weight * both.ln_1p() - alone;
            }
        }
        let best = (0..BINS).max_by(|i, k| bins[*i].total_cmp(&bins[*k])).unwrap_or(0);
        let (sin, cos) = ((best as f64 + 0.5) * STEP).sin_cos();
        let first = a * cos + b * sin;
        let scatters = [HORIZONTAL_RAD, HORIZONTAL_RAD, scatter_rad];
        Self {
            axes: [first, up.cross(&first), *up],
            log_likelihood: base + bins[best],
            change: f64::INFINITY,
            scatters,
        }
    }

    /// With another of its axes as the vertical, and horizontals across it.
    pub(super) fn turned(&self, turn: usize) -> Self {
        let mut axes = self.axes;
        axes.rotate_left(turn);
        let vertical = axes[2];
        let level = |h: Vector3<f64>| (h - vertical * vertical.dot(&h)).normalize();
        Self { axes: [level(axes[0]), level(axes[1]), vertical], ..*self }
    }

    /// Probabilities that an edge is of the two horizontals and of the vertical.
    pub(super) fn shares(&self, edge: &Edge) -> [f64; 3] {
        let odds = self.odds(edge).map(|odds| odds.odds);
        let sum = 1.0 + odds.iter().sum::<f64>();
        odds.map(|odds| odds / sum)
    }

    fn odds(&self, edge: &Edge) -> [Odds; 3] {
        [0, 1, 2].map(|d| edge.odds(&self.axes[d], self.scatters[d]))
    }

    /// Gauss-Newton over a turn of the axes and the angle between the horizontals.
    pub(super) fn refined(mut self, edges: &[Edge]) -> Self {
        let (mut skew, mut done) = (0.0, 0);
        loop {
            let (mut information, mut pull) = (Matrix4::zeros(), Vector4::zeros());
            self.log_likelihood = self.for_each(edges, |row| {
                information += row.slope * row.slope.transpose() * row.weight;
                pull += row.slope * (row.weight * row.distance);
            });
            if done == STEPS {
                return self;
            }
            pull[3] += STIFFNESS * skew;
            let Some(inverse) = (information + prior()).try_inverse() else { return self };
            let step = -(inverse * pull);
            let turn = Vector3::new(step.x, step.y, step.z);
            let turn = turn * (STEP_MAX_RAD / turn.norm().max(STEP_MAX_RAD));
            let rotation = Rotation3::from_scaled_axis(turn);
            self.axes = self.axes.map(|axis| rotation * axis);
            self.axes[1] = Rotation3::from_scaled_axis(self.axes[2] * step[3]) * self.axes[1];
            skew += step[3];
            self.change = turn.norm();
            done += 1;
        }
    }

    /// Calls for each edge and axis that it may be of; the logarithm of the likelihood.
    fn for_each(&self, edges: &[Edge], mut call: impl FnMut(&Row)) -> f64 {
        let second_turns = self.axes[2].cross(&self.axes[1]);
        let mut likelihood = 0.0;
        for edge in edges {
            let odds = self.odds(edge);
            let sum = 1.0 + odds.iter().map(|odds| odds.odds).sum::<f64>();
            if sum == 1.0 {
                continue;
            }
            likelihood += edge.weight * sum.ln();
            for (d, odds) in odds.iter().enumerate() {
                let share = odds.odds / sum;
                if share < NEGLIGIBLE {
                    continue;
                }
                let turn = self.axes[d].cross(&edge.normal);
                let bend = if d == 1 { edge.normal.dot(&second_turns) } else { 0.0 };
                let slope = Vector4::new(turn.x, turn.y, turn.z, bend);
                let distance = edge.normal.dot(&self.axes[d]);
                let weight = edge.weight * share / odds.variance;
                // Odds fall with the distance: what is far off holds nothing.
                let held = 1.0 - (1.0 - share) * distance * distance / odds.variance;
                let curvature = weight * held.max(0.0);
                call(&Row { middle: &edge.middle, slope, distance, weight, curvature });
            }
        }
        likelihood
    }

    /// Covariance of the vertical in the tangent plane of `up`, which it is or whose opposite, in squared radians, with no regard to
    /// which axis is up.
    ///
    /// That of least squares whose errors those of one sector of azimuth share, with the pull of one edge that is of none of the axes;
    /// see `confidence::clustered_covariance`.
    pub(super) fn covariance(&self, edges: &[Edge], up: &Vector3<f64>) -> Option<Matrix2<f64>> {
        let (mut sectors, mut curvature) = (Sectors::new(), prior());
        self.for_each(edges, |row| {
            let azimuth = row.middle.dot(&self.axes[1]).atan2(row.middle.dot(&self.axes[0]));
            let outer = row.slope * row.slope.transpose();
            sectors.add(azimuth, &(outer * row.weight), &(row.slope * (row.weight * row.distance)));
            curvature += outer * row.curvature;
        });
        let inverse = curvature.cholesky()?.inverse();
        let clutter = self.scatters[2].powi(-2);
        let spread =
            sectors.spread(&inverse) + Matrix4::from_diagonal(&Vector4::new(clutter, clutter, clutter, STIFFNESS));
        let turns: Matrix3<f64> = (inverse * spread * inverse).fixed_view::<3, 3>(0, 0).into();
        let moves: SMatrix<f64, 2, 3> = -tangent_basis(up).transpose() * up.cross_matrix();
        let covariance = moves * turns * moves.transpose() * GROWTH;
        let floor = Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD);
        Some(0.5 * (covariance + covariance.transpose()) + floor).filter(|found| inverse_of_positive(found).is_some())
    }
}

/// An edge as one of an axis.
struct Row<'a> {
    middle: &'a Vector3<f64>,
    /// How its distance from the axis changes with a turn of the axes, in the robot frame, and with the angle between the horizontals.
    slope: Vector4<f64>,
    distance: f64,
    weight: f64,
    curvature: f64,
}

/// What is known before: the angle between the horizontals, and a turn to one radian.
fn prior() -> Matrix4<f64> {
    Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0 + STIFFNESS))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCATTER_RAD: f64 = 0.3f64.to_radians();

    /// An edge along a direction, through a point beside it.
    fn edge(along: &Vector3<f64>, through: Vector3<f64>) -> Edge {
        let middle = through.normalize();
        let normal = middle.cross(along).normalize();
        let ends = [middle; 2];
        let [contrast, rms_px, px_per_rad] = [1.0, 0.0, 100.0];
        let variances_rad2 = [1e-7, 1e-5];
        let (length_rad, points) = (0.3, 0..0);
        let own = Segment { normal, middle, ends, length_rad, variances_rad2, contrast, rms_px, px_per_rad, points };
        Edge::new(&Matrix3::identity(), &own)
    }

    /// What a camera sees that looks ahead: edges of three directions, or of some of them, all at most 45 degrees from x.
    fn ahead(axes: &[Vector3<f64>]) -> Vec<Edge> {
        let places = [(0.5, 0.2), (-0.6, 0.3), (0.1, -0.5), (-0.3, -0.2), (0.7, -0.4), (0.2, 0.6)];
        axes.iter().flat_map(|axis| places.map(|(y, z)| edge(axis, Vector3::new(1.0, y, z)))).collect()
    }

    fn leaning() -> [Vector3<f64>; 3] {
        let turn = Rotation3::from_euler_angles(0.03, -0.05, 0.4);
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| turn * axis)
    }

    #[test]
    fn level_edges_alone_tell_the_vertical() {
        let axes = leaning();
        for edges in [ahead(&axes), ahead(&axes[..2])] {
            let found = Frame::about(&edges, &Vector3::z(), SCATTER_RAD).refined(&edges).refined(&edges);
            assert!(found.axes[2].angle(&axes[2]) < 1e-6, "{}", found.axes[2]);
            assert!(found.change < 1e-4, "{}", found.change);
        }
    }

    /// Edges ahead of a camera that pass the vertical hardly tell the lean along its axis.
    #[test]
    fn level_edges_narrow_the_lean_along_the_axis() {
        let axes = leaning();
        let along = |edges: &[Edge]| {
            let found = Frame::about(edges, &axes[2], SCATTER_RAD).refined(edges);
            let covariance = found.covariance(edges, &found.axes[2]).unwrap();
            let direction = tangent_basis(&found.axes[2]).transpose() * Vector3::x();
            direction.dot(&(covariance * direction)) - FLOOR_RAD * FLOOR_RAD
        };
        let few: Vec<Edge> = ahead(&axes[2..]).into_iter().take(4).collect();
        let with_level: Vec<Edge> = few.iter().copied().chain(ahead(&axes[..2])).collect();
        let [alone, together] = [along(&few), along(&with_level)];
        assert!(together < 0.2 * alone, "{alone} {together}");
    }

    #[test]
    fn a_turned_frame_has_another_vertical_and_right_angles() {
        let edges = ahead(&leaning());
        let found = Frame::about(&edges, &Vector3::z(), SCATTER_RAD).refined(&edges);
        for turn in 1..3 {
            let turned = found.turned(turn);
            assert!(turned.axes[2].angle(&found.axes[(turn + 2) % 3]) < 1e-12);
            assert!(turned.axes[0].dot(&turned.axes[2]).abs() < 1e-12);
            assert!(turned.axes[1].dot(&turned.axes[2]).abs() < 1e-12);
        }
    }
}
