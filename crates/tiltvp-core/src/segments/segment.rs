//! What the detector finds.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

/// How far in pixels an edge goes on beyond the outermost pixels that show it: the kernel of a gradient takes in one to each side,
/// and nearer to an end than that it takes in what is behind, too.
const REACH_PX: f64 = 1.0;

/// A pixel of an edge: where the edge passes, between pixel centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePoint {
    /// Unit bearing in the camera frame.
    pub bearing: [f32; 3],
    /// Pixels per radian across the edge.
    pub px_per_rad: f32,
    /// Gradient along `u` and `v`, for the Scharr kernel.
    pub gradient: [f32; 2],
    /// Column and row.
    pub pixel: [f32; 2],
    /// Number of the pixel within the region that the detector looks at.
    pub slot: u32,
}

/// A straight edge: an arc of a great circle, of less than half a turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Unit normal of the great circle, towards the brighter side, in the camera frame.
    pub normal: Vector3<f64>,
    /// Unit bearing of the middle of the pixels, on the circle.
    pub middle: Vector3<f64>,
    /// Unit bearings of the outermost pixels, on the circle: from the first to the second is a positive turn about the normal.
    pub ends: [Vector3<f64>; 2],
    /// Angle between these in radians.
    pub length_rad: f64,
    /// Variances in squared radians of the normal's turn about [`along`](Self::along), which moves the arc sideways, and about
    /// `middle`, which turns it.
    pub variances_rad2: [f64; 2],
    /// Mean gradient in grey levels per pixel.
    pub contrast: f64,
    /// Root mean square distance of the pixels from the circle, in pixels.
    pub rms_px: f64,
    /// Pixels per radian across the edge, in the mean.
    pub px_per_rad: f64,
    /// Its points within [`Segments::points`].
    pub points: Range<usize>,
}

impl Segment {
    /// The unit direction along the arc at its middle: `normal` x `middle`.
    pub fn along(&self) -> Vector3<f64> {
        self.normal.cross(&self.middle)
    }

    /// Unit bearings of where the edge itself ends, a pixel beyond its outermost ones; an arc of less than half a turn as before.
    /// What sets edges beside each other goes by `ends`, which its limits in pixels are made for.
    pub fn edge_ends(&self) -> [Vector3<f64>; 2] {
        let (sin, cos) = self.reach_rad().sin_cos();
        let [first, last] = self.ends;
        [first * cos - self.normal.cross(&first) * sin, last * cos + self.normal.cross(&last) * sin]
    }

    /// Angle between these in radians.
    pub fn edge_length_rad(&self) -> f64 {
        self.length_rad + 2.0 * self.reach_rad()
    }

    fn reach_rad(&self) -> f64 {
        (REACH_PX / self.px_per_rad).min(0.25 * (PI - self.length_rad))
    }

    /// Length in pixels, at the image's scale across the edge.
    pub fn length_px(&self) -> f64 {
        self.length_rad * self.px_per_rad
    }

    /// How many pixels support it.
    pub fn support(&self) -> usize {
        self.points.len()
    }

    /// Covariance of the normal in squared radians: of rank two, in the plane across the normal.
    pub fn covariance(&self) -> Matrix3<f64> {
        Self::covariance_of(&self.normal, &self.middle, self.variances_rad2)
    }

    /// The covariance of the normal of an arc with such a middle and such variances.
    pub fn covariance_of(normal: &Vector3<f64>, middle: &Vector3<f64>, [offset, slope]: [f64; 2]) -> Matrix3<f64> {
        let along = normal.cross(middle);
        middle * middle.transpose() * offset + along * along.transpose() * slope
    }

    /// Variance in squared radians of the angle by which the circle misses a unit direction.
    pub fn variance_at(&self, direction: &Vector3<f64>) -> f64 {
        let [offset, slope] = self.variances_rad2;
        offset * self.middle.dot(direction).powi(2) + slope * self.along().dot(direction).powi(2)
    }
}

/// The straight edges of one image, the longest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Segments {
    /// The segments.
    pub list: Vec<Segment>,
    /// The points of all of them.
    pub points: Vec<EdgePoint>,
}

impl Segments {
    /// The points of a segment.
    pub fn points_of(&self, segment: &Segment) -> &[EdgePoint] {
        self.points.get(segment.points.clone()).unwrap_or(&[])
    }
}
