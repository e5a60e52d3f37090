//! The estimate of a corner from one frame: hypotheses with probabilities, and why there is a pose or none.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::feature::CornerFeature;

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
    /// None fits, and edges of both images contradict how the cameras sit to each other.
    NotOfOnePair,
    /// None fits, and most edges contradict the direction of gravity that is told.
    AgainstGravity,
    /// The edges of one image leave a turn of the attitude open.
    LeftOpen,
}

impl CornerVerdict {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Found,
        Self::NoneLeft,
        Self::NoneRight,
        Self::NoneFits,
        Self::Ambiguous,
        Self::NotOfOnePair,
        Self::AgainstGravity,
        Self::LeftOpen,
    ];

    /// In words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Found => "",
            Self::NoneLeft => "no corner in the left image",
            Self::NoneRight => "no corner in the right image",
            Self::NoneFits => "no corner that fits",
            Self::Ambiguous => "several hypotheses and nothing to choose by",
            Self::NotOfOnePair => "edges of both images contradict the calibration of the pair",
            Self::AgainstGravity => "no corner that fits, and most edges contradict the gravity that is told",
            Self::LeftOpen => "too few edges along some axis to tell the attitude from one image",
        }
    }
}

/// Why a pose has a place, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceVerdict {
    /// It has one, or there is no hypothesis.
    Told,
    /// One camera alone has no scale.
    NoScale,
    /// It is told from an upright edge, and any may be that.
    NotUpright,
    /// The known height is above what is not below the camera.
    NotBelow,
    /// The known height is above the floor, and what is seen hangs or stands above it.
    NotStanding,
    /// What is known tells too little of it.
    Uncertain,
    /// It would be nearer or farther than a vertex may be.
    OutOfReach,
    /// No edge of known length is seen up to its end.
    EndHidden,
    /// The edges of known length leave the image.
    EndOutside,
    /// The edges seen do not fit the known lengths.
    NotTheSize,
    /// The known lengths fit the edges in several ways.
    WhichEdge,
    /// There are other corners, and nothing tells whose edge is known.
    WhichCorner,
}

impl PlaceVerdict {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Told,
        Self::NoScale,
        Self::NotUpright,
        Self::NotBelow,
        Self::NotStanding,
        Self::Uncertain,
        Self::OutOfReach,
        Self::EndHidden,
        Self::EndOutside,
        Self::NotTheSize,
        Self::WhichEdge,
        Self::WhichCorner,
    ];

    /// In words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Told => "",
            Self::NoScale => "one camera, of which neither its height nor a length is known",
            Self::NotUpright => "nothing tells which edge is the upright one",
            Self::NotBelow => "the corner is not below the camera",
            Self::NotStanding => "no upright edge rises from a corner, as of what stands on the floor",
            Self::Uncertain => "the distance would be known to less than a tenth",
            Self::OutOfReach => "beyond distance_min_m or distance_max_m",
            Self::EndHidden => "no edge of known length is seen up to its end",
            Self::EndOutside => "the edges of known length leave the image",
            Self::NotTheSize => "the edges do not fit the known lengths",
            Self::WhichEdge => "the known lengths fit the edges in several ways",
            Self::WhichCorner => "several corners, and nothing tells whose edge is known",
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
    /// The vertex in the left camera's frame, metres; none from one image where neither its height nor a
    /// length is known.
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

    /// The covariance of the attitude's rotation vector, left camera's frame.
    pub fn attitude_covariance(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }
}

/// The far end of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeEnd {
    /// How far it is from the vertex, metres: along the edge where one camera sees it, else the distance of the two points.
    pub length_m: f64,
    /// The standard deviation of that length, metres.
    pub sigma_m: f64,
    /// Where it is in the left camera's frame, metres, from its bearings in both images alone; none where one image shows it.
    pub place_m: Option<Vector3<f64>>,
}

/// The angle between two edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeAngle {
    /// The angle, radians, in [0, pi].
    pub angle_rad: f64,
    /// Its standard deviation, radians.
    pub sigma_rad: f64,
}

/// A corner of a frame that is believed: seen in all images, with one interpretation that stands out.
#[derive(Debug, Clone, PartialEq)]
pub struct BelievedCorner {
    /// The name of its place in the world, from 1: kept from frame to frame, and when the corner was out of sight and is seen again.
    /// None where it has no place or one that is hardly known, and where it is too near to a named place to be told from it.
    pub id: Option<u32>,
    /// All of its hypotheses, the likeliest first; that is its pose.
    pub hypotheses: Vec<Hypothesis>,
    /// Which feature of the left image it is.
    pub left: usize,
    /// Which feature of the right image it is.
    pub right: Option<usize>,
    /// Where its edges x, y, z end.
    pub ends: [Option<EdgeEnd>; 3],
    /// The angles between the edges y and z, z and x, x and y, from the planes of each edge in two images alone: right angles
    /// are not in them. None from one image, and where both planes of an edge nearly coincide.
    pub angles: [Option<EdgeAngle>; 3],
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
    /// angles, and from one image with a known length.
    pub ends: [Option<EdgeEnd>; 3],
    /// All corners that are believed, that of the pose first.
    pub corners: Vec<BelievedCorner>,
    /// Why the pose has no place.
    pub place: PlaceVerdict,
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
