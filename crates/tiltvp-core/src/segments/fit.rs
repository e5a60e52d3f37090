//! The great circle through the points of a piece, with what is known of its error.

use nalgebra::{Matrix2, Vector2, Vector3};
use tiltvp_kernels::vectorised;

use super::segment::{EdgePoint, Segment};

/// Points farther than so many standard deviations are left out of the second fit.
const TRIM: f64 = 2.5;

/// Least standard deviation in pixels that trimming assumes: places are told no better.
const TRIM_SIGMA_MIN_PX: f64 = 0.1;

/// Least standard deviation of one point in pixels, for the covariance.
const POINT_SIGMA_PX: f64 = 0.25;

/// Points in a row whose errors are one: those that a kernel of smoothing and gradient sees together.
const CORRELATED: f64 = 3.0;

/// Standard deviation in pixels of what moves a whole edge sideways: what is beside it, tone curves, lenses. Of edges of rendered
/// rooms 84 to 93 % are within the regions of 90 % then.
const MOVED_SIGMA_PX: f64 = 0.25;

/// Standard deviation in pixels of what moves its ends apart. Of the same edges 92 to 95 % are within the regions of 90 %; uprights of
/// panoramas turn by more, by 0.4 pixels over their length.
const TURNED_SIGMA_PX: f64 = 0.28;

/// Units of the Scharr kernel in a gradient of one grey level per pixel.
pub(super) const SCHARR: f64 = 32.0;

#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(super) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn bearing(point: &EdgePoint) -> Vector3<f64> {
    Vector3::from(point.bearing.map(f64::from))
}

/// A circle near the points: its normal, the middle of the points and the direction along it there.
struct Frame {
    normal: Vector3<f64>,
    middle: Vector3<f64>,
    along: Vector3<f64>,
}

impl Frame {
    #[inline(always)]
    fn new(normal: Vector3<f64>, middle: &Vector3<f64>) -> Option<Self> {
        let middle = (middle - normal * normal.dot(middle)).try_normalize(1e-9)?;
        Some(Self { normal, middle, along: normal.cross(&middle) })
    }

    /// One step of least squares of the points within `limit` pixels: the normal, and how many of these there are.
    #[inline(always)]
    fn step(&self, points: &[EdgePoint], limit: f64) -> Option<(Vector3<f64>, usize)> {
        let (mut information, mut pull, mut count) = (Matrix2::zeros(), Vector2::zeros(), 0);
        for point in points {
            let (b, scale) = (bearing(point), f64::from(point.px_per_rad));
            let distance = scale * self.normal.dot(&b);
            if distance.abs() <= limit {
                let (x, y) = (scale * self.middle.dot(&b), scale * self.along.dot(&b));
                information += Matrix2::new(x * x, x * y, x * y, y * y);
                pull += Vector2::new(x * distance, y * distance);
                count += 1;
            }
        }
        let turn = -(information.try_inverse()? * pull);
        let normal = (self.normal + self.middle * turn.x + self.along * turn.y).try_normalize(1e-9)?;
        Some((normal, count))
    }
}

/// Root mean square distance in pixels of the points within `limit` pixels of a circle.
#[inline(always)]
fn rms(points: &[EdgePoint], normal: &Vector3<f64>, limit: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for point in points {
        let distance = f64::from(point.px_per_rad) * normal.dot(&bearing(point));
        if distance.abs() <= limit {
            sum += distance * distance;
            count += 1;
        }
    }
    (sum / f64::from(count.max(1))).sqrt()
}

vectorised! {
    /// The circle of points of which the brighter side is where `toward` is: least squares of distances in pixels, trimmed once.
    /// The points are those of a [`Segments`](super::Segments) that begin at `start` there. None for points that determine no circle.
    pub(super) fn fit(points: &[EdgePoint], toward: &Vector3<f64>, start: usize) -> Option<Segment> {
        let (first, last) = (bearing(points.first()?), bearing(points.last()?));
        let mean: Vector3<f64> = points.iter().map(bearing).sum();
        // Points of a joined segment are in no order: any that lie far apart will do to begin with.
        let chord = first.cross(&last).try_normalize(1e-9)?;
        let mut frame = Frame::new(chord, &mean)?;
        let (normal, _) = frame.step(points, f64::INFINITY)?;
        frame = Frame::new(normal, &mean)?;
        let sigma = rms(points, &frame.normal, f64::INFINITY).max(TRIM_SIGMA_MIN_PX);
        let (normal, inliers) = frame.step(points, TRIM * sigma)?;
        if inliers < points.len().div_ceil(2) {
            return None;
        }
        let rms_px = rms(points, &normal, TRIM * sigma);
        let normal = if normal.dot(toward) < 0.0 { -normal } else { normal };
        let Frame { normal, middle, along } = Frame::new(normal, &mean)?;

        // Arcs are shorter than half a turn, so that the tangent of the angle from the middle rises along them.
        let (mut low, mut high, mut px_per_rad, mut gradient) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0);
        for point in points {
            let b = bearing(point);
            let x = middle.dot(&b);
            if x <= 0.0 {
                return None;
            }
            let tangent = along.dot(&b) / x;
            (low, high) = (low.min(tangent), high.max(tangent));
            px_per_rad += f64::from(point.px_per_rad);
            let [gx, gy] = point.gradient;
            gradient += f64::from((gx * gx + gy * gy).sqrt());
        }
        let n = points.len() as f64;
        let (px_per_rad, contrast) = (px_per_rad / n, gradient / n / SCHARR);
        let ends = [low, high].map(|tangent| (middle + along * tangent).normalize());
        let length_rad = high.atan() - low.atan();
        if length_rad.is_nan() || length_rad * px_per_rad < 1.0 {
            return None;
        }
        let point_px2 = rms_px.max(POINT_SIGMA_PX).powi(2) * CORRELATED / inliers as f64;
        let offset = (point_px2 + MOVED_SIGMA_PX.powi(2)) / px_per_rad.powi(2);
        // The variance of the slope of points spread evenly over a length is twelve times that of their mean.
        let slope = (12.0 * point_px2 + TURNED_SIGMA_PX.powi(2)) / (px_per_rad * length_rad).powi(2);
        Some(Segment {
            normal,
            middle,
            ends,
            length_rad,
            variances_rad2: [offset, slope],
            contrast,
            rms_px,
            px_per_rad,
            points: start..start + points.len(),
        })
    }
}
