//! Central camera models: pixels to unit bearings and back, past 90 degrees where the lens is.
//!
//! A new lens takes these files:
//!
//! 1. `camera/my_lens.rs`: the struct, its `Parametric` (name, parameters, how it is made of them, their values; the order of
//!    the schema everywhere), and its projection: `Profile` if it is round about its axis and `r(theta)` has no inverse in
//!    closed form, `Lens` if it ends in an affine map to pixels, `CameraModel` otherwise. `equidistant.rs` is the shortest.
//! 2. `camera/mod.rs`: the module, its `pub use`, and its place in the list below.
//! 3. `testing.rs`: one calibration or more in the zoo, which `tests/camera_conformance.rs` holds to its promises; a test
//!    fails for a lens that is not there.
//! 4. `docs/cameras.md`: its row, with the formula; a test compares the parameters.
//! 5. `tests/golden/cases.py`: a camera, whose answers `just golden cameras` keeps.
//! 6. `python/tiltvp/formats/`: a reader, if files of other programs have the lens.
//! 7. `CHANGELOG.md`.
//!
//! Its constructor in Python, the reader and writer of our own files, resizing and the refusals follow from the schema; `just stub`
//! writes the stub of the constructors.

mod batch;
mod brown;
mod calibrated;
mod conformance;
mod dense;
mod difference;
mod double_sphere;
mod equidistant;
mod equirectangular;
mod extended_unified;
mod grid;
mod kannala_brandt;
mod lens;
mod model;
mod ocam;
mod parameters;
mod pinhole;
mod polynomial;
mod profile;
mod radial;
mod radial_polynomial;
mod rays;
mod rim;
mod scaled;
mod schema;
mod solve;
mod sphere;
mod table;
mod unified;
mod values;

pub use calibrated::{Camera, LARGEST_SIDE_PX, MOST_PIXELS};
pub use conformance::{Conformance, conformance};
pub(crate) use dense::{Interpolated, STEP, bearing_table, bearings, cubic};
pub use difference::{Derivative, derivative};
pub use double_sphere::DoubleSphere;
pub use equidistant::Equidistant;
pub use equirectangular::Equirectangular;
pub use extended_unified::ExtendedUnified;
pub use kannala_brandt::KannalaBrandt;
pub use model::CameraModel;
pub use ocam::Ocam;
pub use pinhole::Pinhole;
pub use radial_polynomial::RadialPolynomial;
pub use rays::PixelRays;
pub use schema::{Kind, LensSchema, MOST_COEFFICIENTS, Parameter, ParameterSchema, Resize};
pub use unified::Unified;

use values::{Parametric, Values};

use crate::error::Result;

/// A lens of the list: what it declares, and how it is made.
struct Entry {
    schema: &'static LensSchema,
    build: fn(&Values<'_>) -> Result<Model>,
}

/// Makes of the names of the lenses all that goes through them: the enum, its conversions, the table and `with_model`.
/// The first token is a dollar, which the macro inside needs.
macro_rules! lenses {
    ($d:tt $($name:ident),* $(,)?) => {
        /// Any of the central models, dispatched once per batch.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        pub enum Model {
            $(#[doc = concat!("[`", stringify!($name), "`](", stringify!($name), ")")] $name($name),)*
        }

        /// The lenses in the order of the list.
        const LENSES: &[Entry] = &[
            $(Entry { schema: &$name::SCHEMA, build: |values| $name::build(values).map(Model::$name) },)*
        ];

        $(impl From<$name> for Model {
            fn from(model: $name) -> Self {
                Self::$name(model)
            }
        })*

        /// Runs an expression with the concrete model behind a [`Model`], compiled once for each.
        macro_rules! with_model {
            ($d any:expr, $d model:ident => $d body:expr) => {
                match $d any {
                    $($crate::camera::Model::$name($d model) => $d body,)*
                }
            };
        }
    };
}

// The list of lenses.
lenses!($
    Pinhole, KannalaBrandt, Ocam, Unified, ExtendedUnified, DoubleSphere, Equidistant, Equirectangular,
    RadialPolynomial,
);
use with_model;

impl Model {
    /// The model as the one trait.
    pub fn as_dyn(&self) -> &dyn CameraModel {
        with_model!(self, model => model)
    }
}
