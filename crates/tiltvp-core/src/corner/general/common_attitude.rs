//! The attitude that the straight edges of a frame have in common, whether they meet at corners or not.

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::corner::closed_form::prior::rotation_vector;
use crate::segments::Segment;

/// Standard deviation of either end of a segment, in pixels. Doubled, the vertical of an office is 0.129 instead of
/// 0.107 degrees off; halved, heights of a real box scatter more (0.280 instead of 0.244 degrees from frame to frame).
const END_SIGMA_PX: f64 = 0.3;

/// How parallel edges of buildings and furniture are at best: 0.03 degrees, half a millimetre on a metre. Halved, a
/// real box turns 0.286 instead of 0.244 degrees from frame to frame.
pub(crate) const PARALLEL_SIGMA_RAD: f64 = 0.03 * std::f64::consts::PI / 180.0;

/// How far the attitude from which the search begins may be off, as a standard deviation: 3 degrees, below the 4
/// degrees at which corners still agree.
const START_SIGMA_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// How far from the direction of its axis an edge may pass at first: the sine of 2 degrees.
pub(super) const REACH_SINE: f64 = 0.0349;

/// Edges that miss their axis by this many standard deviations count half (Cauchy weights; 2.4 has 95 % efficiency).
pub(super) const HALF_SIGMAS: f64 = 2.0;

/// How far edges miss their axes at least, in the standard deviations that they should have: a tenth of a pixel at either
/// end, as those of a rendered cuboid do.
const SCATTER_MIN: f64 = 1.0 / 3.0;

/// Least length of a segment, in pixels: shorter ones are off by more than half a degree and add only other things'
/// edges.
const LENGTH_MIN_PX: f64 = 40.0;

/// Segments that err together: the two sides of a bar, and one edge in both images.
pub(crate) const ERRING_TOGETHER: f64 = 4.0;

/// Least number of segments along the three axes: twice a corner's own three in two images.
const LINES_MIN: usize = 12;

/// Gauss-Newton steps, each with weights of its own; the scatter is estimated after the first half.
const STEPS: usize = 10;

/// A straight edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StraightEdge {
    /// Unit normal of its great circle, left camera's frame.
    pub(super) normal: Vector3<f64>,
    /// Standard deviation of the angle between the plane and the edge's direction, radians.
    pub(super) sigma_rad: f64,
    /// How long it is seen, pixels.
    pub(super) length_px: f64,
}

impl StraightEdge {
    /// The lines of the segments of one image that are long enough.
    pub(crate) fn of<'a>(segments: &'a [Segment], left_from_own: &'a Matrix3<f64>) -> impl Iterator<Item = Self> + 'a {
        let long = segments.iter().map(|segment| (segment, segment.length_px())).filter(|(_, px)| *px >= LENGTH_MIN_PX);
        long.map(move |(segment, length_px)| Self {
            normal: left_from_own * segment.normal,
            sigma_rad: (END_SIGMA_PX * std::f64::consts::SQRT_2 / length_px).hypot(PARALLEL_SIGMA_RAD),
            length_px,
        })
    }

    /// The axis of an attitude that it misses least, and the sine of the angle by which it does.
    pub(super) fn missed(&self, attitude: &Matrix3<f64>) -> (usize, f64) {
        let off = attitude.tr_mul(&self.normal);
        let axis = off.abs().imin();
        (axis, off[axis])
    }

    /// Whether it may be the image of an edge along an axis of an attitude.
    pub(crate) fn runs_along(&self, attitude: &Matrix3<f64>) -> bool {
        self.missed(attitude).1.abs() <= REACH_SINE
    }
}

/// The share of the lines' length that may be images of edges along the axes of an attitude. Of random ones it is 0.105.
pub(crate) fn share_along_axes(lines: &[StraightEdge], attitude: &Matrix3<f64>) -> f64 {
    let (along_px, all_px) = lines.iter().fold((0.0, 0.0), |(along_px, all_px), line| {
        (along_px + f64::from(u8::from(line.runs_along(attitude))) * line.length_px, all_px + line.length_px)
    });
    along_px / all_px
}

/// An attitude with covariance of its rotation vector, left camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CommonAttitude {
    pub(crate) camera_from_object: Matrix3<f64>,
    pub(crate) covariance: Matrix3<f64>,
    /// How far the edges miss their axes, in the standard deviations that they should have: 1 at least.
    pub(crate) scatter: f64,
    /// How many edges run along the axes, those that miss them counting less.
    pub(crate) support: f64,
    /// How far the right image's edges are turned against the left one's, as a rotation vector back, left camera's frame;
    /// none where that may be noise, and of one image.
    pub(crate) turned_apart: Option<Vector3<f64>>,
}

/// The axes along which the edges of corners have to run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharedAxes<'a> {
    /// The attitude on which several corners agree, or most edges.
    pub(crate) attitude: Option<&'a Matrix3<f64>>,
    /// That which edges have in common.
    pub(crate) common: Option<&'a CommonAttitude>,
}

/// The attitude near `start` along whose axes most edges run, by robust least squares; none if there are too few.
///
/// An edge along an axis `a` has `normal . a = 0`. The scatter of the edges is that which they show.
pub(crate) fn common_attitude(lines: &[StraightEdge], start: &Matrix3<f64>) -> Option<CommonAttitude> {
    by_weights(lines, start, 1)
}

/// The same where edges of other things are many: in the end they have hardly any pull (Geman and McClure's weights).
pub(super) fn common_attitude_amid_others(lines: &[StraightEdge], start: &Matrix3<f64>) -> Option<CommonAttitude> {
    by_weights(lines, start, 2)
}

/// By Cauchy's weights, and in the later steps by this power of them; the covariance is of Cauchy's, and of edges that scatter as
/// they should at least.
fn by_weights(lines: &[StraightEdge], start: &Matrix3<f64>, power: i32) -> Option<CommonAttitude> {
    let mut rotation = *start;
    let mut scatter = 1.0;
    for step in 0..=STEPS {
        let mut information = Matrix3::from_diagonal_element(START_SIGMA_RAD.powi(-2));
        let mut pull = rotation_from(start, &rotation) * START_SIGMA_RAD.powi(-2);
        let last = step == STEPS;
        let power = if last || step <= STEPS / 2 { 1 } else { power };
        if last {
            scatter = f64::max(scatter, 1.0);
        }
        let (mut missed, mut support) = (Vec::with_capacity(lines.len()), 0.0);
        for line in lines {
            let (axis, miss) = line.missed(&rotation);
            if miss.abs() > REACH_SINE {
                continue;
            }
            let sigma = line.sigma_rad * scatter;
            missed.push(miss.abs() / line.sigma_rad);
            let trust = |sigma: f64| (1.0 + (miss / (HALF_SIGMAS * sigma)).powi(2)).recip();
            support += trust(line.sigma_rad);
            let weight = trust(sigma).powi(power) / (sigma * sigma);
            // Turning the axis by w changes normal . axis by w . (axis x normal).
            let by_turn = rotation.column(axis).cross(&line.normal);
            information += by_turn * by_turn.transpose() * weight;
            pull += by_turn * (miss * weight);
        }
        if missed.len() < LINES_MIN {
            return None;
        }
        let inverse = information.try_inverse()?;
        if last {
            let covariance = inverse * ERRING_TOGETHER;
            let turned_apart = None;
            return Some(CommonAttitude { camera_from_object: rotation, covariance, scatter, support, turned_apart });
        }
        if step == STEPS / 2 {
            let middle = missed.len() / 2;
            let (_, median, _) = missed.select_nth_unstable_by(middle, f64::total_cmp);
            scatter = (MEDIAN_TO_SIGMA * *median).max(SCATTER_MIN);
        }
        rotation = Rotation3::new(-(inverse * pull)).matrix() * rotation;
    }
    None
}

/// The standard deviation of a normal distribution over the median of its absolute values.
const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// The small rotation vector that takes one attitude to another.
fn rotation_from(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    rotation_vector(&(to * from.transpose()))
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// `count` lines along each axis of an attitude, off by the given misses in turn, seen from many sides.
    pub(crate) fn lines(attitude: &Matrix3<f64>, count: u32, misses: &[f64]) -> Vec<StraightEdge> {
        let mut out = Vec::new();
        for axis in 0..3 {
            for k in 0..count {
                let along = attitude.column(axis).into_owned();
                let aside = Vector3::new(f64::from(k).sin(), f64::from(2 * k + 1).cos(), 1.5).cross(&along).normalize();
                let miss = misses[out.len() % misses.len()];
                out.push(StraightEdge {
                    normal: aside * miss.cos() + along * miss.sin(),
                    sigma_rad: 0.002,
                    length_px: 60.0,
                });
            }
        }
        out
    }

    /// How far an attitude is off, however its level axes are named.
    pub(crate) fn off_in_any_naming_rad(found: &Matrix3<f64>, attitude: &Matrix3<f64>) -> f64 {
        let turns = (0..4).map(|k| Rotation3::from_axis_angle(&Vector3::y_axis(), f64::from(k) * FRAC_PI_2));
        turns.map(|turn| rotation_from(&(attitude * turn.matrix()), found).norm()).fold(f64::INFINITY, f64::min)
    }

    fn off_rad(found: &CommonAttitude, attitude: &Matrix3<f64>) -> f64 {
        rotation_from(attitude, &found.camera_from_object).norm()
    }

    #[test]
    fn edges_of_other_things_hardly_move_the_attitude() {
        let attitude = *Rotation3::from_euler_angles(0.5, -0.3, 0.2).matrix();
        let start = Rotation3::from_euler_angles(0.01, -0.015, 0.01).matrix() * attitude;
        let true_ones = lines(&attitude, 12, &[0.001, -0.001, 0.0]);
        let found = common_attitude(&true_ones, &start).unwrap();
        // Ten times as near as the start; each line misses by 1e-3.
        assert!(off_rad(&found, &attitude) < 2e-3, "{}", off_rad(&found, &attitude));
        assert_eq!(found.scatter, 1.0);
        let other = Rotation3::from_euler_angles(0.0, 0.4, 0.0).matrix() * attitude;
        let both: Vec<StraightEdge> = true_ones.iter().copied().chain(lines(&other, 4, &[0.0])).collect();
        assert!(off_rad(&common_attitude(&both, &start).unwrap(), &attitude) < 2e-3);
        assert!(common_attitude(&true_ones[..9], &start).is_none());
    }

    #[test]
    fn edges_that_scatter_say_so() {
        let attitude = *Rotation3::from_euler_angles(-0.4, 0.2, 0.1).matrix();
        let steady = common_attitude(&lines(&attitude, 12, &[0.001, -0.001]), &attitude).unwrap();
        let loose = common_attitude(&lines(&attitude, 12, &[0.008, -0.008]), &attitude).unwrap();
        assert!(loose.scatter > 3.0 && loose.covariance.trace() > 4.0 * steady.covariance.trace());
        assert!(loose.support < steady.support);
        // Nearer than they should be, edges are worth no more.
        let close = common_attitude(&lines(&attitude, 12, &[1e-5, -1e-5]), &attitude).unwrap();
        assert_eq!(close.scatter, 1.0);
        assert!(close.covariance.trace() > 0.6 * steady.covariance.trace());
    }

    #[test]
    fn a_tenth_of_random_edges_runs_along_axes() {
        let attitude = *Rotation3::from_euler_angles(0.5, -0.3, 0.2).matrix();
        let own = lines(&attitude, 12, &[0.0]);
        assert!((share_along_axes(&own, &attitude) - 1.0).abs() < 1e-12);
        // Points evenly over a sphere.
        let random: Vec<StraightEdge> = (0..2000)
            .map(|k| {
                let (height, turn) = ((f64::from(k) + 0.5) / 1000.0 - 1.0, 2.399_963 * f64::from(k));
                let radius = (1.0 - height * height).sqrt();
                let normal = Vector3::new(radius * turn.cos(), radius * turn.sin(), height);
                StraightEdge { normal, sigma_rad: 0.002, length_px: 50.0 }
            })
            .collect();
        let share = share_along_axes(&random, &attitude);
        assert!((0.095..0.115).contains(&share), "{share}");
        // Three long edges of a corner beside them.
        let corner = lines(&attitude, 1, &[0.0]).into_iter().map(|line| StraightEdge { length_px: 5000.0, ..line });
        let both: Vec<StraightEdge> = random.iter().copied().chain(corner).collect();
        let expected = (share * 100_000.0 + 15_000.0) / 115_000.0;
        assert!((share_along_axes(&both, &attitude) - expected).abs() < 1e-9);
    }
}
