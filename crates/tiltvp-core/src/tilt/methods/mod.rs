//! The tilt methods: the one list of them, and what each has to bring.
//!
//! # A new method
//!
//! 1. `methods/<name>.rs`: its options with docs, defaults and domains, its tables and its fit. Implement [`TiltMethod`] for
//!    the options and [`Fitter`] for the tables of a method of edge pixels. Take what the others share where it fits: `normals.rs` for great circles,
//!    `image_space.rs` for edge offsets, `sampling.rs` for random samples.
//! 2. This file: the module, and one entry in the list of `tilt_methods!`.
//! 3. `tests/options.rs`: a second value for each option.
//! 4. `docs/tilt.md`: how it works and when to choose it.
//! 5. `CHANGELOG.md`.
//!
//! Names, the refusal of unknown ones, options by name, bindings and the command line follow from the list.

mod image_space;
mod image_space_ransac;
mod image_space_reject_refit;
mod normals;
mod offsets;
mod refined;
mod sampling;
mod segments;
mod vector_consensus;

use std::f64::consts::FRAC_PI_2;
use std::fmt::Debug;
use std::sync::Arc;

pub use self::image_space::ImageSpaceOptions;
pub use self::image_space_ransac::ImageSpaceRansacOptions;
pub use self::image_space_reject_refit::ImageSpaceRejectRefitOptions;
pub(super) use self::offsets::edge_offset;
pub use self::refined::RefineOptions;
pub(super) use self::refined::{Subsample, TILT_MAX_RAD, refine};
pub(super) use self::sampling::SamplingScratch;
pub use self::segments::SegmentsOptions;
pub(super) use self::segments::{SegmentFit, SegmentWork};
pub use self::vector_consensus::VectorConsensusOptions;
use super::fit::Fit;
use super::image_edges::EdgeOrigin;
use super::options::TiltOptions;
use super::scratch::Work;
use super::tables::PixelTables;
use super::trust::{ASPECT, Trust};
use crate::edges::{EdgeOptions, EdgePixels, Prefilter};
use crate::error::Result;

/// The list of methods: for each its doc, its variant with its options, and the name under which users ask for it.
macro_rules! tilt_methods {
    ($($(#[$doc:meta])* $Method:ident($Options:ty) = $name:literal,)+) => {
        crate::methods! {
            /// How the tilt is estimated from the edge pixels.
            pub enum Method {
                $($(#[$doc])* $Method($Options) = $name,)+
            }
        }

        /// The methods by name, the default first.
        pub const METHODS: [&str; Method::NAMES.len()] = [$($name),+];

        impl Method {
            /// The chosen method's options as what every method brings.
            pub(super) fn chosen(&self) -> &dyn TiltMethod {
                match self {
                    $(Self::$Method(options) => options,)+
                }
            }
        }
    };
}

tilt_methods! {
    /// Ours: tangent normals weighted by their gradients, trimmed from the upright prior, then a fading soft gate.
    Refined(RefineOptions) = "refined",
    /// Fleer 2017 section 2.1 with random sampling.
    ImageSpaceRansac(ImageSpaceRansacOptions) = "image-space-ransac",
    /// Fleer 2017 section 2.1 with repeated trimming.
    ImageSpaceRejectRefit(ImageSpaceRejectRefitOptions) = "image-space-reject-refit",
    /// Fleer 2017 section 2.2.
    VectorConsensus(VectorConsensusOptions) = "vector-consensus",
    /// Ours: straight edges of the whole image, by the odds that each is vertical.
    Segments(SegmentsOptions) = "segments",
}

/// What a method brings, by its options.
pub(super) trait TiltMethod {
    /// Which pixels are edges by default.
    fn edges(&self) -> EdgeOptions;

    /// `tilt_max_rad` must be below this, or for pi may be equal to it.
    fn tilt_limit_rad(&self) -> f64 {
        FRAC_PI_2
    }

    /// Makes the tables for one camera.
    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared>;
}

/// What a method is prepared for.
#[derive(Clone, Copy)]
pub(super) struct Setting<'a> {
    pub origin: &'a EdgeOrigin,
    pub options: &'a TiltOptions,
    pub pixels: &'a PixelTables,
}

/// A method ready for the images of one camera, by what it looks at.
#[derive(Debug, Clone)]
pub(super) enum Prepared {
    /// Edge pixels.
    Pixels(Arc<dyn Fitter>),
    /// Straight edges.
    Segments(Arc<SegmentFit>),
}

/// A method of edge pixels with its options and its tables.
pub(super) trait Fitter: Debug + Send + Sync {
    /// Keeps out edge pixels that the prefilter rejects anyway; none if the method takes every edge pixel.
    fn prefilter(&self) -> Option<&Prefilter>;

    /// How its fits tell whether they are of the vertical at all, if that has been learned.
    fn trust(&self) -> Option<&'static Trust> {
        None
    }

    /// Where what the last fit looked at stands.
    fn aspect(&self, _pixels: &PixelTables, _work: &Work) -> [f64; ASPECT] {
        [0.0; ASPECT]
    }

    /// Unit normal in the robot frame of the great circle of an edge pixel, by its place in the region and its gradient, if the
    /// method makes normals.
    fn normal(&self, _slot: usize, _gx: f32, _gy: f32) -> Option<[f32; 3]> {
        None
    }

    /// The fit to the edge pixels of an image, with or without those that the prefilter rejects. Allocates nothing in a scratch
    /// that has served before.
    fn fit(&self, edges: &EdgePixels, pixels: &PixelTables, work: &mut Work) -> Fit;
}

/// Tables that estimators of the same pixels share, whatever their methods; each is made when it is first asked for.
#[derive(Debug, Default)]
pub(super) struct SharedTables {
    normals: normals::Shared,
    image_space: image_space::Shared,
}
