//! From an image to a tilt, at once or by way of its edge pixels: the tables of a camera, made once.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::estimate::{EdgeElement, TiltEstimate};
use super::fit::Fit;
use super::image_circle::CentreOff;
use super::image_edges::{EdgeOrigin, ImageEdges};
use super::lightness::LIGHTS;
use super::methods::{Fitter, Prepared, Setting, edge_offset};
use super::on_grid::{self, Steps};
use super::options::TiltOptions;
use super::overhead::OverheadLines;
use super::scratch::Scratch;
use super::tables::PixelTables;
use super::trust::{ASPECT, Seen};
use super::work::Work;
use crate::camera::Camera;
use crate::edges::{EdgeOptions, EdgePixels};
use crate::error::{Error, Result};
use crate::geometry::validate_rotation;
use crate::image::{ImageView, check_size};
use crate::interrupt::{Interrupt, check};

/// Estimates the tilt of a robot from single images of one camera.
///
/// Everything that depends only on the camera is computed here once; [`estimate`](Self::estimate) borrows it, so one
/// estimator serves many threads, each with a [`Scratch`] of its own. Clones and what [`with_options`](Self::with_options)
/// makes share the tables.
#[derive(Debug, Clone)]
pub struct TiltEstimator {
    pub(super) origin: Arc<EdgeOrigin>,
    pub(super) options: TiltOptions,
    pub(super) pixels: Arc<PixelTables>,
    method: Prepared,
}

/// What the estimate of edge pixels is told of their image beside them.
struct Told<'a> {
    off_px: Option<Vector2<f64>>,
    lights: &'a [f64; LIGHTS],
    blur_rad: f64,
    overhead: OverheadLines,
    steps: Steps<'a>,
}

impl TiltEstimator {
    /// Makes the tables, on all cores. `robot_from_camera` is `R`, which takes bearings of the camera frame to the robot frame.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] if an option is out of its domain, `R` is no rotation, the mask
    /// does not fit the camera, no pixel sees the elevation band, or the image-space methods cannot see the vertical.
    pub fn new(camera: Camera, robot_from_camera: Matrix3<f64>, options: TiltOptions) -> Result<Self> {
        options.validate()?;
        validate_rotation(&robot_from_camera)?;
        let (edges, mask) = (options.edges, options.mask.clone());
        let origin = EdgeOrigin { camera, robot_from_camera, options: edges, mask, row_stride: options.row_stride };
        let pixels = Arc::new(PixelTables::new(&origin)?);
        Self::prepared(Arc::new(origin), options, pixels)
    }

    /// The estimator of checked options.
    fn prepared(origin: Arc<EdgeOrigin>, options: TiltOptions, pixels: Arc<PixelTables>) -> Result<Self> {
        let setting = Setting {
            origin: &origin,
            pixels: &pixels,
            method: options.method.name(),
            tilt_max_rad: options.tilt_max_rad,
            seed: options.seed,
        };
        let chosen = options.method.chosen();
        let limit = chosen.tilt_limit_rad();
        if let Some(tilt_max) = options.tilt_max_rad.filter(|tilt_max| *tilt_max >= limit && limit < PI) {
            let expected = "an angle below pi/2: the method segments alone takes more";
            return Err(Error::option("tilt_max_rad", tilt_max, expected));
        }
        let method = chosen.prepare(&setting)?;
        Ok(Self { origin, options, pixels, method })
    }

    /// An estimator of the same camera with other options. It shares every table that the change leaves alone, so that one
    /// for each of many thresholds takes next to no time and memory.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_options(&self, options: TiltOptions) -> Result<Self> {
        options.validate()?;
        let all_strengths = |edges: EdgeOptions| EdgeOptions { gradient_min: 1.0, ..edges };
        let same_pixels = self.options.mask == options.mask && self.options.row_stride == options.row_stride;
        let origin = if same_pixels && self.options.edges == options.edges {
            Arc::clone(&self.origin)
        } else {
            let (edges, mask, row_stride) = (options.edges, options.mask.clone(), options.row_stride);
            Arc::new(EdgeOrigin { options: edges, mask, row_stride, ..(*self.origin).clone() })
        };
        let same_tables = same_pixels && all_strengths(self.options.edges) == all_strengths(options.edges);
        let pixels = if same_tables { Arc::clone(&self.pixels) } else { Arc::new(PixelTables::new(&origin)?) };
        Self::prepared(origin, options, pixels)
    }

    /// The camera whose images are read.
    pub fn camera(&self) -> &Camera {
        &self.origin.camera
    }

    /// The rotation from the camera frame to the robot frame.
    pub fn robot_from_camera(&self) -> &Matrix3<f64> {
        &self.origin.robot_from_camera
    }

    /// The options.
    pub fn options(&self) -> &TiltOptions {
        &self.options
    }

    /// How many pixels are looked at.
    pub fn region_pixels(&self) -> usize {
        self.pixels.region.len()
    }

    /// What tells whether the estimate of an image is of the vertical at all, for training. Allocates.
    ///
    /// # Errors
    /// Those of [`estimate`](Self::estimate).
    pub fn trust_features(&self, image: &ImageView<'_>, scratch: &mut Scratch) -> Result<Vec<f64>> {
        self.estimate(image, scratch)?;
        Ok(scratch.work.trusted.to_vec())
    }

    /// Memory for one thread, with room for an image in which every pixel is an edge.
    pub fn scratch(&self) -> Scratch {
        Scratch::new(&self.pixels.region, &self.options.edges)
    }

    /// Whether the other estimator works with the same scratch.
    pub fn shares_scratch_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.pixels, &other.pixels)
    }

    fn check_scratch(&self, scratch: &Scratch) -> Result<()> {
        if scratch.serves(&self.pixels.region, &self.options.edges) {
            return Ok(());
        }
        Err(Error::argument("scratch", "that of another estimator", "one made by this estimator"))
    }

    fn check_image(&self, image: &ImageView<'_>) -> Result<()> {
        let size = (self.camera().width() as usize, self.camera().height() as usize);
        check_size((image.width(), image.height()), size)
    }

    /// The tilt of one image. An image without enough edges has an estimate without a tilt, not an error.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, or the scratch is that of an estimator
    /// that looks at other pixels.
    pub fn estimate(&self, image: &ImageView<'_>, scratch: &mut Scratch) -> Result<TiltEstimate> {
        self.check_image(image)?;
        self.check_scratch(scratch)?;
        let gradient_min = self.options.edges.gradient_min;
        let off_px = self.centre_off_px(image);
        match &self.method {
            Prepared::Pixels(method) => {
                let Scratch { detector, edges, work, .. } = scratch;
                detector.detect(image, &self.pixels.region, gradient_min, method.prefilter(), edges);
                let of_up = method.trust().and_then(|trust| trust.up.as_ref());
                let lights = of_up.map_or([0.0; LIGHTS], |_| self.pixels.lightness.of(image));
                let blur_rad = self.pixels.sharpness.error_rad(image, gradient_min);
                let overhead = method.leaves_out_overhead().then(|| self.pixels.overhead.lines(image, gradient_min));
                let overhead = overhead.unwrap_or_default();
                let told = Told { off_px, lights: &lights, blur_rad, overhead, steps: Steps::Of(image) };
                Ok(self.fit(&**method, edges, &told, work))
            }
            Prepared::Segments(method) => Ok(method.estimate(image, &self.pixels, self.centre_off(off_px), scratch)),
        }
    }

    /// The edge pixels of one image, for [`estimate_edges`](Self::estimate_edges) of this estimator and of those with equal
    /// edge options. Allocates what it returns.
    ///
    /// # Errors
    /// Those of [`estimate`](Self::estimate); [`Error::InvalidArgument`] for a method that looks at no single pixels.
    pub fn detect(&self, image: &ImageView<'_>, scratch: &mut Scratch) -> Result<ImageEdges> {
        self.pixel_method()?;
        self.check_image(image)?;
        self.check_scratch(scratch)?;
        let gradient_min = self.options.edges.gradient_min;
        let Scratch { detector, edges, .. } = scratch;
        detector.detect(image, &self.pixels.region, gradient_min, None, edges);
        ImageEdges::new(Arc::clone(&self.origin), edges.slot(), edges.gx(), edges.gy())?
            .with_centre_off_px(self.centre_off_px(image))?
            .with_steps(&Steps::Of(image).all(edges, &self.pixels.region))?
            .with_lights(&self.pixels.lightness.of(image))?
            .with_blur_rad(self.pixels.sharpness.error_rad(image, gradient_min))?
            .with_overhead(&self.pixels.overhead.lines(image, gradient_min).normals())
    }

    /// How far the image circle lies beside the calibration's, where both are seen.
    fn centre_off_px(&self, image: &ImageView<'_>) -> Option<Vector2<f64>> {
        self.pixels.circle.as_ref()?.off_px(image)
    }

    /// The same, with what it does to estimates.
    fn centre_off(&self, off_px: Option<Vector2<f64>>) -> Option<CentreOff<'_>> {
        let (circle, robot_from_camera) = (self.pixels.circle.as_ref()?, &self.origin.robot_from_camera);
        off_px.map(|off_px| CentreOff { circle, robot_from_camera, off_px })
    }

    /// The tilt of the image that the edge pixels are of: the same, to the last bit, as [`estimate`](Self::estimate) gives.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the edges are of another camera, mounting, mask or edge options (it says which), or the
    /// scratch is that of an estimator that looks at other pixels.
    pub fn estimate_edges(&self, image_edges: &ImageEdges, scratch: &mut Scratch) -> Result<TiltEstimate> {
        let method = self.pixel_method()?;
        self.check_scratch(scratch)?;
        let Scratch { edges, work, .. } = scratch;
        image_edges.copy_to(&self.origin, &self.pixels.region, edges)?;
        let told = Told {
            off_px: image_edges.centre_off_px(),
            lights: image_edges.lights(),
            blur_rad: image_edges.blur_rad(),
            overhead: image_edges.lines_overhead(),
            steps: Steps::Known(image_edges.steps()),
        };
        Ok(self.fit(method, edges, &told, work))
    }

    /// The method, if it looks at edge pixels.
    fn pixel_method(&self) -> Result<&dyn Fitter> {
        match &self.method {
            Prepared::Pixels(method) => Ok(&**method),
            Prepared::Segments(_) => {
                let name = self.options.method.name();
                Err(Error::argument("method", name, "a method of edge pixels: this one looks at straight edges"))
            }
        }
    }

    /// The estimate of the edge pixels of an image. What passed a prefilter and what passed none give the same one: prefilters
    /// keep out only what the prefilters reject.
    fn fit(&self, method: &dyn Fitter, edges: &EdgePixels, told: &Told<'_>, work: &mut Work) -> TiltEstimate {
        let pixels = &*self.pixels;
        work.overhead = told.overhead;
        let fit = method.fit(edges, pixels, work);
        let estimate = self.conclude(method, edges, told, &fit, work);
        let Some(refitter) = method.refitter().filter(|_| estimate.tilt.is_some()) else { return estimate };
        let Some(share) = told.steps.share(edges, &pixels.region, work) else { return estimate };
        told.steps.leave_out(edges, &pixels.region, work);
        let others = refitter.refit(pixels, work);
        let others = self.conclude(method, edges, told, &others, work);
        let is_as_sure = on_grid::is_as_sure(&others, &estimate);
        if is_as_sure && on_grid::is_apart(&others, &estimate) {
            return others;
        }
        // Again: what is asked of single pixels is answered from the last fit.
        let fit = method.fit(edges, pixels, work);
        let mut estimate = self.conclude(method, edges, told, &fit, work);
        if !is_as_sure {
            on_grid::doubt(&mut estimate, share);
        }
        estimate
    }

    /// The estimate of a fit, by what else is known of the image.
    fn conclude(
        &self,
        method: &dyn Fitter,
        edges: &EdgePixels,
        told: &Told<'_>,
        fit: &Fit,
        work: &mut Work,
    ) -> TiltEstimate {
        let [own_max_rad, tilt_max_rad] = method.lean_limits_rad();
        let seen = Seen {
            edge_pixels: edges.strong(),
            pixels: self.pixels.region.len(),
            prefiltered_pixels: work.rows.len(),
            pixels_per_rad: self.pixels.region.pixels_per_rad(),
            tilt_max_rad,
            expected_max_rad: self.options.tilt_max_rad.unwrap_or(own_max_rad),
            lights: told.lights,
            aspect: method.trust().map_or([0.0; ASPECT], |_| method.aspect(&self.pixels, work)),
            trust: method.trust(),
            centre_off: self.centre_off(told.off_px),
            blur_rad: told.blur_rad,
        };
        fit.into_estimate(&seen, &mut work.trusted)
    }

    /// The directions that may be up and what tells which one is, [`estimate`](Self::estimate)'s way where it looks anywhere: for
    /// training. Empty of other methods and smaller leans. Allocates.
    ///
    /// # Errors
    /// Those of [`estimate`](Self::estimate).
    pub fn hypotheses(&self, image: &ImageView<'_>, scratch: &mut Scratch) -> Result<Vec<(Vector3<f64>, Vec<f64>)>> {
        self.estimate(image, scratch)?;
        Ok(scratch.segments.as_ref().map_or_else(Vec::new, |work| work.hypotheses()))
    }

    /// The tilts of many images on `threads` threads, in the order of the images, the same whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for no threads at all, otherwise those of [`estimate`](Self::estimate), for the first image
    /// that has one.
    #[cfg(feature = "rayon")]
    pub fn estimate_many(&self, images: &[ImageView<'_>], threads: usize) -> Result<Vec<TiltEstimate>> {
        use std::sync::atomic::{AtomicUsize, Ordering};
        if threads == 0 {
            return Err(Error::option("threads", threads, "at least 1"));
        }
        let one = |image: &ImageView<'_>, scratch: &mut Scratch| {
            check();
            self.estimate(image, scratch)
        };
        if threads == 1 || images.len() < 2 {
            let mut scratch = self.scratch();
            return images.iter().map(|image| one(image, &mut scratch)).collect();
        }
        let flag = Interrupt::current();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.min(images.len()))
            .start_handler(move |_| Interrupt::adopt(flag.as_ref()))
            .build()
            .map_err(|error| {
                Error::option("threads", format!("{threads} ({error})"), "a number that the system can start")
            })?;
        // Each thread has one memory, and takes the next image when it has done the one before.
        let next = AtomicUsize::new(0);
        let by_thread = pool.broadcast(|_| {
            let mut scratch = self.scratch();
            let number = || next.fetch_add(1, Ordering::Relaxed);
            std::iter::repeat_with(number)
                .map_while(|i| images.get(i).map(|image| (i, one(image, &mut scratch))))
                .collect::<Vec<_>>()
        });
        let mut answers: Vec<_> = by_thread.into_iter().flatten().collect();
        answers.sort_unstable_by_key(|(i, _)| *i);
        answers.into_iter().map(|(_, answer)| answer).collect()
    }

    /// The tilt of one image as [`estimate`](Self::estimate) gives it, and all its edge pixels; of the method of straight edges
    /// those that are part of one. Allocates.
    ///
    /// # Errors
    /// Those of [`estimate`](Self::estimate).
    pub fn estimate_with_elements(
        &self,
        image: &ImageView<'_>,
        scratch: &mut Scratch,
    ) -> Result<(TiltEstimate, Vec<EdgeElement>)> {
        let estimate = self.estimate(image, scratch)?;
        let centre =
            self.pixels.vertical.as_ref().map_or((f32::NAN, f32::NAN), |c| (c.pixel.x as f32, c.pixel.y as f32));
        let method = match &self.method {
            Prepared::Pixels(method) => method,
            Prepared::Segments(method) => return Ok((estimate, method.elements(centre, scratch))),
        };
        let Scratch { detector, work, .. } = scratch;
        let rows: Vec<(u32, bool)> =
            work.slots.iter().enumerate().map(|(row, slot)| (*slot, work.is_inlier(row))).collect();
        let mut all = EdgePixels::with_capacity(self.pixels.region.len());
        detector.detect(image, &self.pixels.region, self.options.edges.gradient_min, None, &mut all);
        let mut rows = rows.into_iter().peekable();
        let elements = all.slot().iter().zip(all.gx()).zip(all.gy()).map(|((slot, gx), gy)| {
            let (u, v) = self.pixels.region.place(*slot as usize);
            let [cos, sin, s] = edge_offset(f32::from(u) - centre.0, f32::from(v) - centre.1, *gx, *gy);
            let row = rows.next_if(|(place, _)| place == slot);
            let normal = method.normal(*slot as usize, *gx, *gy);
            EdgeElement {
                u,
                v,
                phi_rad: f64::from(sin).atan2(f64::from(cos)),
                offset_px: f64::from(s),
                normal: normal.unwrap_or([f32::NAN; 3]),
                prefiltered: row.is_some(),
                inlier: row.is_some_and(|(_, inlier)| inlier),
            }
        });
        let elements = elements.collect();
        Ok((estimate, elements))
    }
}
