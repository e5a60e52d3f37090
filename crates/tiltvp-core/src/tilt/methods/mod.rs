//! The tilt methods: the one list of them, and what each has to bring.
//!
//! # A new method
//!
//! 1. `methods/<name>.rs`: its options with docs, defaults and domains, its tables and its fit. Implement `TiltMethod` of
//!    `method.rs` for the options, and `Fitter` for the tables of a method of edge pixels. Take what the others share where it
//!    fits: `normals.rs` for great circles, `image_space.rs` for edge offsets, `sampling.rs` for random samples.
//! 2. This file: the module, and one entry in the list of `tilt_methods!`.
//! 3. The tests of the core: `tests/options.rs` has a second value for each option, and matches on the methods, as in
//!    `tests/allocation.rs`, name it until they have it.
//! 4. The package: the docs of `TiltEstimator` in `python/tiltvp/tilt.py`, and the help of `--method` in `cli/options.py`.
//! 5. Its tests: the largest error in `tests/test_tilt.py`, the options in `tests/test_tilt_options.py`, a line in
//!    `tests/golden/cases.py`, whose answers `just golden tilt` keeps.
//! 6. For evaluations `tiltvp/lab`: `evaluation/combinations.py`, the order in `evaluation/summary.py`, its name in `report/sheets.py`.
//! 7. `docs/tilt.md`: how it works and when to choose it.
//! 8. `CHANGELOG.md`.
//!
//! Names, the refusal of unknown ones, options by name, bindings, the options of the command line, `just stub` and `just options`
//! follow from the list.

mod image_space;
mod image_space_ransac;
mod image_space_reject_refit;
mod method;
mod normals;
mod offsets;
mod refined;
pub(super) mod sampling;
pub(super) mod segments;
pub(super) mod subsample;
mod vector_consensus;

pub use self::image_space::ImageSpaceOptions;
pub use self::image_space_ransac::ImageSpaceRansacOptions;
pub use self::image_space_reject_refit::ImageSpaceRejectRefitOptions;
use self::method::TiltMethod;
pub(super) use self::method::{Fitter, Prepared, Setting};
pub(super) use self::offsets::edge_offset;
pub use self::refined::RefineOptions;
pub(super) use self::refined::refine;
pub use self::segments::SegmentsOptions;
pub use self::vector_consensus::VectorConsensusOptions;

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
