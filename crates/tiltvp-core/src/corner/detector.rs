//! From an image to its corners: the tables of a camera, made once.

use nalgebra::{Matrix3, Vector3};

use super::closed_form::attitude::{IncludedAngle, corner_attitudes, meant_by};
use super::coloured::{self, ColouredScratch, Window};
use super::estimate::Hypothesis;
use super::feature::CornerFeature;
use super::frame::Frame;
use super::general::beginnings::{Beginnings, beginnings};
use super::general::completion::CornerCompletion;
use super::general::double_edges::double_edges_rad;
use super::general::edge_ends::{ObservedCorner, ObservedEnd, seen_ends};
use super::general::guided::{ExpectedCorner, find_near};
use super::general::{self, GeneralScratch};
use super::options::{CornerMethod, DetectorOptions};
use super::sized::{BoxView, SeenEnd, Unseen};
use crate::camera::Camera;
use crate::edges::Mask;
use crate::error::{Error, Result};
use crate::geometry::RigidMotion;
use crate::image::{ColorView, ImageView, LightTable, check_size};
use crate::segments::{Segment, SegmentDetector};

/// Finds corners in single images of one camera.
#[derive(Debug, Clone)]
pub struct CornerDetector {
    camera: Camera,
    options: DetectorOptions,
    mask: Option<Mask>,
    light: LightTable,
    segments: Option<SegmentDetector>,
}

/// Memory for one thread.
#[derive(Debug, Clone)]
pub struct CornerScratch {
    coloured: ColouredScratch,
    general: Option<GeneralScratch>,
}

impl CornerDetector {
    /// Makes the tables. An included angle within 1e-3 radians of the right one is that.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] if an option is out of its domain, or the mask does not fit the
    /// camera, leaves nothing, or is given to the coloured front end, which takes none.
    pub fn new(camera: Camera, mut options: DetectorOptions, mask: Option<Mask>) -> Result<Self> {
        options.validate()?;
        if let CornerMethod::General(own) = &mut options.method {
            own.gamma_rad = meant_by(own.gamma_rad);
        }
        let light = LightTable::new(options.display_gamma)?;
        let segments = match &options.method {
            CornerMethod::Coloured(_) | CornerMethod::Paper(_) if mask.is_some() => {
                let got = format!("one for method \"{}\"", options.method.name());
                return Err(Error::argument("mask", got, "a mask for method \"general\" alone"));
            }
            CornerMethod::Coloured(_) | CornerMethod::Paper(_) => None,
            CornerMethod::General(general) => {
                Some(SegmentDetector::new(camera.clone(), general.segments(mask.clone()))?)
            }
        };
        Ok(Self { camera, options, mask, light, segments })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The options.
    pub fn options(&self) -> &DetectorOptions {
        &self.options
    }

    /// Which pixels may be used; none for all.
    pub fn mask(&self) -> Option<&Mask> {
        self.mask.as_ref()
    }

    /// Memory for one thread.
    pub fn scratch(&self) -> CornerScratch {
        CornerScratch {
            coloured: ColouredScratch::default(),
            general: self.segments.as_ref().map(|detector| GeneralScratch::new(detector.scratch())),
        }
    }

    /// Refuses images of another size than the camera's, and of another kind than the front end's.
    pub(super) fn check(&self, frame: &Frame<'_>) -> Result<()> {
        self.check_size(frame.size())?;
        match (&self.options.method, frame) {
            (CornerMethod::General(_), Frame::Gray(_))
            | (CornerMethod::Coloured(_) | CornerMethod::Paper(_), Frame::Color(_)) => Ok(()),
            _ => Err(self.wrong_kind()),
        }
    }

    fn wrong_kind(&self) -> Error {
        let expected = match &self.options.method {
            CornerMethod::General(_) => "coloured or paper, for images in colour",
            CornerMethod::Coloured(_) | CornerMethod::Paper(_) => "general, for grey images",
        };
        Error::argument("method", self.options.method.name(), expected)
    }

    fn check_size(&self, size: (usize, usize)) -> Result<()> {
        check_size(size, (self.camera.width() as usize, self.camera.height() as usize))
    }

    /// The coloured cuboid's corner; at most one. `window` is the part of the image to look at, none for all of it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, or the detector is for grey images.
    pub fn detect_coloured(
        &self,
        image: &ColorView<'_>,
        window: Option<&Window>,
        scratch: &mut CornerScratch,
    ) -> Result<Option<CornerFeature>> {
        self.check_size((image.width(), image.height()))?;
        let whole = Window { columns: 0..image.width(), rows: 0..image.height() };
        let window = window.map_or(whole.clone(), |window| Window {
            columns: window.columns.start.min(whole.columns.end)..window.columns.end.min(whole.columns.end),
            rows: window.rows.start.min(whole.rows.end)..window.rows.end.min(whole.rows.end),
        });
        match &self.options.method {
            CornerMethod::Coloured(options) => {
                Ok(coloured::find(&self.camera, image, options, &self.light, &window, &mut scratch.coloured))
            }
            CornerMethod::Paper(options) => {
                Ok(coloured::paper::find(&self.camera, image, options, &window, &mut scratch.coloured))
            }
            CornerMethod::General(_) => Err(self.wrong_kind()),
        }
    }

    /// The corners of a grey image, the best first. `vertical` is a unit vector along the vertical in the camera frame, either
    /// way: the vertical ray is the one that agrees with it, and features without one are screened out. Without it that ray
    /// may be any, which all the same leaves the attitude of a corner with right angles but for the names of its edges.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, the detector is for coloured images, or the
    /// scratch is another detector's.
    pub fn detect_general(
        &self,
        image: &ImageView<'_>,
        vertical: Option<&Vector3<f64>>,
        scratch: &mut CornerScratch,
        out: &mut Vec<CornerFeature>,
    ) -> Result<()> {
        self.detect_fainter(image, 1.0, vertical, scratch, out)
    }

    /// The same with edges whose gradients are a `share` of what the options ask for.
    pub(super) fn detect_fainter(
        &self,
        image: &ImageView<'_>,
        share: f64,
        vertical: Option<&Vector3<f64>>,
        scratch: &mut CornerScratch,
        out: &mut Vec<CornerFeature>,
    ) -> Result<()> {
        self.check_size((image.width(), image.height()))?;
        let (CornerMethod::General(options), Some(detector)) = (&self.options.method, &self.segments) else {
            return Err(self.wrong_kind());
        };
        let Some(memory) = &mut scratch.general else {
            return Err(Error::argument("scratch", "that of another detector", "one made by this detector"));
        };
        let (angle, least) = (IncludedAngle::exact(options.gamma_rad), options.vertical_max_rad.cos());
        // The vertical is the edge nearest to the prior, or to the image's columns where there is none.
        let closeness = |corner: &CornerFeature| {
            let attitudes = corner_attitudes(corner, &angle).ok()?;
            let near = |upright: &Vector3<f64>| {
                let cosines = attitudes.iter().map(|attitude| attitude.edges[1].dot(upright).abs());
                cosines.max_by(f64::total_cmp)
            };
            match vertical {
                Some(vertical) => near(vertical).filter(|cosine| *cosine >= least),
                None => near(&Vector3::y()),
            }
        };
        let search = general::Search { camera: &self.camera, detector, options, light: &self.light, share, vertical };
        general::find(&search, image, closeness, memory, out)
    }

    /// The corner near where it is expected; none if it is not there, and for coloured cuboids, which are found
    /// anywhere. `search_px` is how far from there, none for the option.
    pub(super) fn find_near(
        &self,
        image: &ImageView<'_>,
        expected: &ExpectedCorner,
        search_px: Option<f64>,
        scratch: &mut CornerScratch,
    ) -> Option<CornerFeature> {
        let (CornerMethod::General(options), Some(memory)) = (&self.options.method, &mut scratch.general) else {
            return None;
        };
        let search_px = search_px.unwrap_or(options.follow_px);
        find_near(&self.camera, image, expected, search_px, options, &self.light, &mut memory.trace)
    }

    /// The corners whose edges run along the columns of a rotation, two of them among the segments of the image that was looked
    /// at last with this scratch; added to `out`. None for the coloured front end and where edges are not at right angles.
    pub(super) fn complete(
        &self,
        image: &ImageView<'_>,
        camera_from_object: &Matrix3<f64>,
        scratch: &mut CornerScratch,
        out: &mut Vec<CornerFeature>,
    ) {
        if let Some((completion, memory)) = self.completion(image, camera_from_object, scratch) {
            completion.run(memory, out);
        }
    }

    /// The same of which no third edge is looked for.
    pub(super) fn l_junctions(
        &self,
        image: &ImageView<'_>,
        camera_from_object: &Matrix3<f64>,
        scratch: &mut CornerScratch,
        out: &mut Vec<CornerFeature>,
    ) {
        if let Some((completion, memory)) = self.completion(image, camera_from_object, scratch) {
            completion.l_junctions(memory, out);
        }
    }

    fn completion<'a>(
        &'a self,
        image: &'a ImageView<'a>,
        camera_from_object: &'a Matrix3<f64>,
        scratch: &'a mut CornerScratch,
    ) -> Option<(CornerCompletion<'a>, &'a mut GeneralScratch)> {
        let Self { camera, light, .. } = self;
        match (&self.options.method, &mut scratch.general) {
            (CornerMethod::General(options), Some(memory)) if options.gamma_rad == std::f64::consts::FRAC_PI_2 => {
                Some((CornerCompletion { camera, image, options, light, camera_from_object }, memory))
            }
            _ => None,
        }
    }

    /// Which rays of a corner begin at its vertex; all of the coloured front end's, which follows them from there.
    pub(super) fn beginnings(&self, frame: &Frame<'_>, corner: &CornerFeature) -> Beginnings {
        match (&self.options.method, frame) {
            (CornerMethod::General(options), Frame::Gray(image)) => {
                beginnings(&self.camera, image, &self.light, options, corner)
            }
            _ => Beginnings::ALL,
        }
    }

    /// How far aside in the image that was looked at last with this scratch the edges of a corner may be meant, in radians; 0 for the
    /// coloured front end.
    pub(super) fn double_edges_rad(&self, corner: &CornerFeature, scratch: &CornerScratch) -> f64 {
        double_edges_rad(corner, self.segments(scratch))
    }

    /// Where the edges of a corner end in the image that was looked at last with this scratch; none for the coloured front end.
    /// `pose` is of the left camera, `camera_from_left` takes it to this one.
    pub(super) fn ends(
        &self,
        image: &ImageView<'_>,
        corner: &CornerFeature,
        pose: &Hypothesis,
        camera_from_left: &RigidMotion,
        scratch: &mut CornerScratch,
    ) -> [Option<ObservedEnd>; 3] {
        match (self.observed(image, corner, pose, camera_from_left), &mut scratch.general) {
            (Some(seen), Some(memory)) => seen_ends(&seen, memory),
            _ => [None; 3],
        }
    }

    /// Whether an image shows an edge of a corner up to where another camera has its end, as far as that is in view. `pose` is of the
    /// left camera, `camera_from_left` takes it to this one.
    pub(super) fn shows_end(
        &self,
        image: &ImageView<'_>,
        corner: &CornerFeature,
        pose: &Hypothesis,
        camera_from_left: &RigidMotion,
        (axis, end): (usize, &ObservedEnd),
        scratch: &mut CornerScratch,
    ) -> bool {
        match (self.observed(image, corner, pose, camera_from_left), &mut scratch.general) {
            (Some(seen), Some(memory)) => seen.shows(axis, end, memory),
            _ => true,
        }
    }

    /// What an image shows of a corner with this pose of the left camera; none for the coloured front end.
    fn observed<'a>(
        &'a self,
        image: &'a ImageView<'a>,
        corner: &'a CornerFeature,
        pose: &Hypothesis,
        camera_from_left: &RigidMotion,
    ) -> Option<ObservedCorner<'a>> {
        let (CornerMethod::General(options), Some(vertex_m)) = (&self.options.method, &pose.vertex_m) else {
            return None;
        };
        Some(ObservedCorner {
            camera: &self.camera,
            image,
            options,
            light: &self.light,
            corner,
            camera_from_object: camera_from_left.rotation * pose.camera_from_object,
            edges: pose.edges.map(|edge| camera_from_left.rotation * edge),
            vertex_m: camera_from_left.point(vertex_m),
        })
    }

    /// The end of an edge of a corner with edges in these directions, in the image that was looked at last with this scratch; hidden
    /// for the method as published and for an image of the other kind.
    pub(super) fn end(
        &self,
        frame: &Frame<'_>,
        corner: &CornerFeature,
        edges: &[Vector3<f64>; 3],
        axis: usize,
        scratch: &mut CornerScratch,
    ) -> std::result::Result<SeenEnd, Unseen> {
        let camera = &self.camera;
        match (&self.options.method, frame, &mut scratch.general) {
            (CornerMethod::Coloured(options), Frame::Color(image), _) => {
                let view = BoxView { camera, corner, edges, search: coloured::box_search(options) };
                coloured::find_end(&view, axis, image, options, &self.light, &mut scratch.coloured)
            }
            (CornerMethod::General(options), Frame::Gray(image), Some(memory)) => {
                let view = BoxView { camera, corner, edges, search: general::box_search(options) };
                general::find_end(&view, axis, image, &self.light, memory)
            }
            _ => Err(Unseen::Hidden),
        }
    }

    /// The line segments of the last grey image, the longest first; none for the coloured front end.
    pub fn segments<'a>(&self, scratch: &'a CornerScratch) -> &'a [Segment] {
        scratch.general.as_ref().map_or(&[], |memory| &memory.segments.list)
    }
}
