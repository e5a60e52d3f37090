//! From an image to its straight edges: the tables of a camera, made once.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use tiltvp_kernels::quadratic::Located;

use super::bearings::Bearings;
use super::chains::{Chains, Window};
use super::fit::fit;
use super::joining::Groups;
use super::options::{SegmentDetectorOptions, SegmentOptions};
use super::pieces::split;
use super::segment::{EdgePoint, Segment, Segments};
use crate::camera::Camera;
use crate::edges::{EdgeOptions, EdgePixels, Extent, Prefilter, Region, RidgeDetector, RidgePixels};
use crate::error::{Error, Result};
use crate::image::{ImageView, check_size};
use crate::interrupt::check;

/// Finds the straight edges of the region of a camera's images.
#[derive(Debug, Clone)]
pub(crate) struct SegmentFinder {
    bearings: Bearings,
    window: Window,
    options: SegmentOptions,
}

/// The least gradients of an edge's pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeastGradients {
    /// Of each of them.
    each: f64,
    /// Of one of them at least.
    one: f64,
}

/// Memory for one thread.
#[derive(Debug, Clone)]
pub(crate) struct FinderScratch {
    made_for: Extent,
    detector: RidgeDetector,
    pub(crate) ridge: RidgePixels,
    chains: Chains,
    stack: Vec<Range<usize>>,
    /// Where edges pass the ridge pixels.
    located: Located,
    /// Bearings of chains and their changes.
    lifted: Vec<[[f32; 4]; 2]>,
    /// Points of pieces, and the pieces as segments with the directions to their brighter sides.
    points: Vec<EdgePoint>,
    pieces: Vec<Segment>,
    toward: Vec<Vector3<f64>>,
    groups: Groups,
    cut: Vec<Range<usize>>,
}

impl FinderScratch {
    /// Whether it is that of a finder of such a region.
    pub(crate) fn serves(&self, region: &Region, edges: &EdgeOptions) -> bool {
        self.made_for == Extent::new(region, edges)
    }
}

impl SegmentFinder {
    /// Tables for a region of a camera that keeps at least two pixels clear of the border.
    pub(crate) fn new(camera: &Camera, region: &Region, options: SegmentOptions) -> Self {
        let window = Window::new(region);
        Self { bearings: Bearings::new(camera, &window), window, options }
    }

    /// Refuses options whose region does not keep clear of the border as far as the finder looks.
    pub(crate) fn check_margin(edges: &EdgeOptions) -> Result<()> {
        if edges.margin_px < 1.0 {
            return Err(Error::option(
                "margin_px",
                edges.margin_px,
                "at least 1 pixel: edges are told by their neighbours",
            ));
        }
        Ok(())
    }

    /// Memory for one thread.
    pub(crate) fn scratch(&self, region: &Region, edges: &EdgeOptions) -> FinderScratch {
        FinderScratch {
            made_for: Extent::new(region, edges),
            detector: RidgeDetector::new(region, edges),
            ridge: RidgePixels::default(),
            chains: Chains::new(self.window),
            stack: Vec::new(),
            located: Located::default(),
            lifted: Vec::new(),
            points: Vec::new(),
            pieces: Vec::new(),
            toward: Vec::new(),
            groups: Groups::default(),
            cut: Vec::new(),
        }
    }

    /// What the options ask for, the pixels being of at least `gradient_min`.
    pub(crate) fn gradients(&self, gradient_min: f64) -> LeastGradients {
        LeastGradients { each: gradient_min, one: self.options.gradient_start }
    }

    /// Writes the segments of an image whose pixels pass a prefilter, the longest first. Allocates nothing once `scratch` and `out` have grown.
    pub(crate) fn find(
        &self,
        image: &ImageView<'_>,
        region: &Region,
        gradients: LeastGradients,
        prefilter: Option<&Prefilter>,
        scratch: &mut FinderScratch,
        out: &mut Segments,
    ) {
        let FinderScratch {
            detector, ridge, chains, stack, located, lifted, points, pieces, toward, groups, cut, ..
        } = scratch;
        let SegmentOptions { stray_max_px, rms_max_px, support_min_px, gap_max, .. } = self.options;
        let least = support_min_px as usize;
        detector.detect(image, region, gradients.each, prefilter, ridge);
        chains.link(ridge, (gradients.one * gradients.one) as f32);
        points.clear();
        pieces.clear();
        toward.clear();
        self.bearings.locate(ridge, located);
        for chain in chains.of_at_least(least) {
            check();
            let begin = points.len();
            let lifted = self.bearings.of(located, chains.units(), chain, lifted);
            append(chain, lifted, located, &ridge.edges, points);
            cut.clear();
            split(&points[begin..], stray_max_px as f32, least, stack, |piece| cut.push(piece));
            for piece in cut.iter() {
                let brighter = brighter(&lifted[piece.clone()]);
                let range = begin + piece.start..begin + piece.end;
                if let Some(segment) = fit(&points[range.clone()], &brighter, range.start) {
                    pieces.push(segment);
                    toward.push(brighter);
                }
            }
        }
        groups.join(pieces, gap_max);
        out.list.clear();
        out.points.clear();
        for group in groups.iter() {
            let start = out.points.len();
            for i in group {
                out.points.extend_from_slice(&points[pieces[*i as usize].points.clone()]);
            }
            let first = group[0] as usize;
            let segment = if let [_] = group {
                Some(Segment { points: start..out.points.len(), ..pieces[first].clone() })
            } else {
                fit(&out.points[start..], &toward[first], start)
            };
            match segment {
                Some(segment) if segment.rms_px <= rms_max_px => out.list.push(segment),
                _ => out.points.truncate(start),
            }
        }
        // A stable sort would allocate.
        let order =
            |a: &Segment, b: &Segment| b.length_rad.total_cmp(&a.length_rad).then(a.points.start.cmp(&b.points.start));
        out.list.sort_unstable_by(order);
    }
}

/// Appends the points of a chain, of bearings that were [lifted](Bearings::of).
fn append(chain: &[u32], lifted: &[[[f32; 4]; 2]], located: &Located, edges: &EdgePixels, points: &mut Vec<EdgePoint>) {
    let (slots, gx, gy) = (edges.slot(), edges.gx(), edges.gy());
    points.extend(chain.iter().zip(lifted).map(|(i, [[x, y, z, px_per_rad], _])| {
        let k = *i as usize;
        EdgePoint {
            bearing: [*x, *y, *z],
            px_per_rad: *px_per_rad,
            gradient: [gx[k], gy[k]],
            pixel: located.pixel[k],
            slot: slots[k],
        }
    }));
}

/// The direction across a piece of a chain to its brighter side: the sum of three points', for one may be noisy.
fn brighter(lifted: &[[[f32; 4]; 2]]) -> Vector3<f64> {
    let n = lifted.len();
    let change = |i: usize| {
        let [x, y, z, _] = lifted[i][1].map(f64::from);
        Vector3::new(x, y, z)
    };
    change(n / 4) + change(n / 2) + change(3 * n / 4)
}

/// Finds the straight edges of the images of one camera as arcs of great circles, in any central image.
#[derive(Debug, Clone)]
pub struct SegmentDetector {
    camera: Camera,
    options: SegmentDetectorOptions,
    region: Region,
    finder: SegmentFinder,
}

/// Memory for one thread.
#[derive(Debug, Clone)]
pub struct SegmentScratch {
    finder: FinderScratch,
}

impl SegmentDetector {
    /// Makes the tables.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] if an option is out of its domain, the mask does not fit the
    /// camera, or no pixel is left.
    pub fn new(camera: Camera, options: SegmentDetectorOptions) -> Result<Self> {
        options.validate()?;
        SegmentFinder::check_margin(&options.edges)?;
        let region = Region::new(&camera, &Matrix3::identity(), &options.edges, options.mask.as_ref())?;
        let finder = SegmentFinder::new(&camera, &region, options.segments);
        Ok(Self { camera, options, region, finder })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The options.
    pub fn options(&self) -> &SegmentDetectorOptions {
        &self.options
    }

    /// Memory for one thread.
    pub fn scratch(&self) -> SegmentScratch {
        SegmentScratch { finder: self.finder.scratch(&self.region, &self.options.edges) }
    }

    /// Writes the straight edges of an image, the longest first. Allocates nothing once `scratch` and `out` have grown.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, or the scratch is another detector's.
    pub fn detect(&self, image: &ImageView<'_>, scratch: &mut SegmentScratch, out: &mut Segments) -> Result<()> {
        self.detect_fainter(image, 1.0, scratch, out)
    }

    /// The same with edges whose gradients are a `share` of what the options ask for.
    pub(crate) fn detect_fainter(
        &self,
        image: &ImageView<'_>,
        share: f64,
        scratch: &mut SegmentScratch,
        out: &mut Segments,
    ) -> Result<()> {
        if !scratch.finder.serves(&self.region, &self.options.edges) {
            return Err(Error::argument("scratch", "that of another detector", "one made by this detector"));
        }
        let size = (self.camera.width() as usize, self.camera.height() as usize);
        check_size((image.width(), image.height()), size)?;
        let LeastGradients { each, one } = self.finder.gradients(self.options.edges.gradient_min);
        let gradients = LeastGradients { each: share * each, one: share * one };
        self.finder.find(image, &self.region, gradients, None, &mut scratch.finder, out);
        Ok(())
    }
}
