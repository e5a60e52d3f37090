//! The estimate of a corner from one frame: hypotheses with probabilities, and why there is a pose or none.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::feature::CornerFeature;
use super::general::edge_ends::EdgeEnd;

/// Why there is a pose, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CornerVerdict {
    /// One hypothesis stands out.
    Found,
    /// No corner in the left image.
    NoneLeft,
    /// No corner in the right image.
    NoneRight,
    /// No corner of the one image fits one of the other, or none fits the included angle.
    NoneFits,
    /// There are several hypotheses and nothing to choose by.
    Ambiguous,
}

impl CornerVerdict {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Found, Self::NoneLeft, Self::NoneRight, Self::NoneFits, Self::Ambiguous];

    /// In words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Found => "",
            Self::NoneLeft => "no corner in the left image",
            Self::NoneRight => "no corner in the right image",
            Self::NoneFits => "no corner that fits",
            Self::Ambiguous => "several hypotheses and nothing to choose by",
        }
    }
}

/// One explanation of what is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The rotation from the object's frame to the left camera's.
    pub camera_from_object: Matrix3<f64>,
    /// The directions of the edges x, y, z of the corner away from its vertex, left camera's frame, unit vectors.
    pub edges: [Vector3<f64>; 3],
    /// The vertex in the left camera's frame, metres; none from one image without a known height.
    pub vertex_m: Option<Vector3<f64>>,
    /// Covariance of the attitude's rotation vector (left camera's frame, radians) and of the vertex (metres; zero where that is
    /// none).
    pub covariance: Matrix6<f64>,
    /// The probability that it is this one, in [0, 1].
    pub probability: f64,
    /// Whether the edges x, y, z are a right-handed triple.
    pub right_handed: bool,
    /// Root mean square misfit per degree of freedom, in standard deviations of the rays; 0 for a single feature.
    pub misfit: f64,
}

impl Hypothesis {
    /// Where the left camera is in the object's frame, metres.
    pub fn camera_in_object_m(&self) -> Option<Vector3<f64>> {
        self.vertex_m.map(|vertex| -(self.camera_from_object.transpose() * vertex))
    }
}

/// The estimate from one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerEstimate {
    /// All hypotheses, the likeliest first.
    pub hypotheses: Vec<Hypothesis>,
    /// Why there is a pose, or none.
    pub verdict: CornerVerdict,
    /// The corners of the left and of the right image.
    pub features: [Vec<CornerFeature>; 2],
    /// Which features of the left image the pose is from, the one that stands for the object first.
    pub chosen_left: Vec<usize>,
    /// Which feature of the right image it is from.
    pub chosen_right: Option<usize>,
    /// Where the edges x, y, z of the pose end, where lines along the others meet them; from two grey images with edges at right
    /// angles.
    pub ends: [Option<EdgeEnd>; 3],
    /// Whether the pose before was a prior.
    pub followed: bool,
    /// The number of the corner that is the object: it grows where another corner than before has become the object.
    pub object: u32,
}

impl CornerEstimate {
    /// The pose, if one stands out.
    pub fn pose(&self) -> Option<&Hypothesis> {
        self.hypotheses.first().filter(|_| self.verdict == CornerVerdict::Found)
    }
}
