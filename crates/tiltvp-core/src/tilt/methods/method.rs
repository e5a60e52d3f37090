//! What each method has to bring.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Debug;
use std::sync::Arc;

use crate::edges::{EdgeOptions, EdgePixels, Prefilter};
use crate::error::Result;
use crate::image::ImageView;
use crate::tilt::estimate::{EdgeElement, TiltEstimate};
use crate::tilt::fit::Fit;
use crate::tilt::image_circle::CentreOff;
use crate::tilt::image_edges::EdgeOrigin;
use crate::tilt::scratch::Scratch;
use crate::tilt::tables::PixelTables;
use crate::tilt::trust::{ASPECT, Trust};
use crate::tilt::work::Work;

/// What a method brings, by its options.
pub(in crate::tilt) trait TiltMethod {
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
pub(in crate::tilt) struct Setting<'a> {
    pub origin: &'a EdgeOrigin,
    pub pixels: &'a PixelTables,
    /// Name of the method.
    pub method: &'static str,
    /// Largest lean expected, where it is told.
    pub tilt_max_rad: Option<f64>,
    /// Seed of random samples.
    pub seed: u64,
}

impl Setting<'_> {
    /// Up to which lean edges are looked at: the largest one expected, but no less than a method's own. Those that are left of a
    /// larger lean agree on a smaller one: told 2 degrees, six of nine views that leaned by 18 were 16 off and sure.
    pub(super) fn searched_rad(&self, own_max_rad: f64) -> f64 {
        self.tilt_max_rad.map_or(own_max_rad, |told| told.max(own_max_rad))
    }
}

/// A method ready for the images of one camera, by what it looks at.
#[derive(Debug, Clone)]
pub(in crate::tilt) enum Prepared {
    /// Edge pixels.
    Pixels(Arc<dyn Fitter>),
    /// Straight edges.
    Segments(Arc<dyn ImageFitter>),
}

/// A method that looks for more in an image than edge pixels.
pub(in crate::tilt) trait ImageFitter: Debug + Send + Sync {
    /// The tilt of an image. Allocates nothing in a scratch that has served before.
    fn estimate(
        &self,
        image: &ImageView<'_>,
        pixels: &PixelTables,
        centre_off: Option<CentreOff<'_>>,
        scratch: &mut Scratch,
    ) -> TiltEstimate;

    /// The edge pixels that the last image was seen to have, in their order.
    fn elements(&self, centre: (f32, f32), scratch: &Scratch) -> Vec<EdgeElement>;
}

/// A method of edge pixels with its options and its tables.
pub(in crate::tilt) trait Fitter: Debug + Send + Sync {
    /// Keeps out edge pixels that the prefilter rejects anyway; none if the method takes every edge pixel.
    fn prefilter(&self) -> Option<&Prefilter>;

    /// How its fits tell whether they are of the vertical at all, if that has been learned.
    fn trust(&self) -> Option<&'static Trust> {
        None
    }

    /// The largest lean that is expected where none is told, and that beyond which the prefilter rejects edges, in radians: the
    /// edges that are left of a larger lean agree on a smaller one. Infinite where that is not so.
    fn lean_limits_rad(&self) -> [f64; 2] {
        [f64::INFINITY; 2]
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

    /// Whether it leaves out lines overhead.
    fn leaves_out_overhead(&self) -> bool {
        false
    }

    /// What fits again without steps of the pixel grid, if the method leaves them out.
    fn refitter(&self) -> Option<&dyn Refitter> {
        None
    }
}

/// A method that fits again when rows have been left out.
pub(in crate::tilt) trait Refitter {
    /// The fit of the rows that are left of the last one.
    fn refit(&self, pixels: &PixelTables, work: &mut Work) -> Fit;
}
