//! The edge pixels of one image as a value of its own, and where they come from.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::lightness::LIGHTS;
use super::overhead::OverheadLines;
use crate::camera::Camera;
use crate::edges::{EdgeOptions, EdgePixels, Mask, Region};
use crate::error::{Error, Result};

/// What edge pixels depend on beside the image.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeOrigin {
    /// The camera.
    pub camera: Camera,
    /// The rotation from the camera frame to the robot frame.
    pub robot_from_camera: Matrix3<f64>,
    /// Which pixels are edges.
    pub options: EdgeOptions,
    /// The pixels that may be used.
    pub mask: Option<Mask>,
    /// Only one row in so many is looked at.
    pub row_stride: u32,
}

impl EdgeOrigin {
    /// What differs first, with both values: (name, own, other's).
    fn difference(&self, other: &Self) -> Option<(&'static str, String, String)> {
        if self.camera != other.camera {
            return Some(("camera", "another camera".to_owned(), "the estimator's".to_owned()));
        }
        if self.robot_from_camera != other.robot_from_camera {
            return Some(("robot_from_camera", "another rotation".to_owned(), "the estimator's".to_owned()));
        }
        let (a, b) = (&self.options, &other.options);
        let numbers = [
            ("gradient_min", a.gradient_min, b.gradient_min),
            ("smoothing_px", a.smoothing_px, b.smoothing_px),
            ("elevation_min_rad", a.elevation_min_rad, b.elevation_min_rad),
            ("elevation_max_rad", a.elevation_max_rad, b.elevation_max_rad),
            ("margin_px", a.margin_px, b.margin_px),
            ("row_stride", f64::from(self.row_stride), f64::from(other.row_stride)),
        ];
        let different = numbers.into_iter().find(|(_, own, other)| own != other);
        let different = different.map(|(name, own, other)| (name, own.to_string(), other.to_string()));
        let word = |mask: &Option<Mask>| if mask.is_some() { "a mask" } else { "no mask" };
        different.or_else(|| {
            let own = if other.mask.is_some() && self.mask.is_some() { "another mask" } else { word(&self.mask) };
            (self.mask != other.mask).then(|| ("mask", own.to_owned(), word(&other.mask).to_owned()))
        })
    }
}

/// The edge pixels of one image: every pixel of the band with a gradient of at least `gradient_min`, whatever the method.
///
/// [`TiltEstimator::detect`](super::TiltEstimator::detect) makes them; every estimator with an equal [`EdgeOrigin`] takes them.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageEdges {
    origin: Arc<EdgeOrigin>,
    slots: Arc<[u32]>,
    gx: Arc<[f32]>,
    gy: Arc<[f32]>,
    centre_off_px: Option<Vector2<f64>>,
    lights: [f64; LIGHTS],
    steps: Arc<[u32]>,
    blur_rad: f64,
    overhead: OverheadLines,
}

impl ImageEdges {
    /// Edge pixels by their numbers within the region, ascending, and their gradients along `u` and `v`.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there are as many gradients as pixels, all finite, and the numbers ascend.
    pub fn new(origin: Arc<EdgeOrigin>, slots: &[u32], gx: &[f32], gy: &[f32]) -> Result<Self> {
        if slots.len() != gx.len() || slots.len() != gy.len() {
            let got = format!("{} pixels, {} and {} gradients", slots.len(), gx.len(), gy.len());
            return Err(Error::argument("edges", got, "as many gradients as pixels"));
        }
        check_ascending(slots)?;
        if !gx.iter().chain(gy).all(|g| g.is_finite()) {
            return Err(Error::argument("edges", "gradients that are not finite", "finite gradients"));
        }
        Ok(Self {
            origin,
            slots: slots.into(),
            gx: gx.into(),
            gy: gy.into(),
            centre_off_px: None,
            lights: [0.0; LIGHTS],
            steps: Arc::default(),
            blur_rad: 0.0,
            overhead: OverheadLines::default(),
        })
    }

    /// The same with how far the image circle lies beside the calibration's, which no edge pixel tells.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless it is finite.
    pub fn with_centre_off_px(mut self, centre_off_px: Option<Vector2<f64>>) -> Result<Self> {
        if let Some(off) = centre_off_px.filter(|off| !off.iter().all(|x| x.is_finite())) {
            return Err(Error::argument("edges", format!("a centre off by {}, {} px", off.x, off.y), "finite pixels"));
        }
        self.centre_off_px = centre_off_px;
        Ok(self)
    }

    /// The same with how light the image is at each height, as [`lights`](Self::lights) tells it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless there are sixteen finite numbers.
    pub fn with_lights(mut self, lights: &[f64]) -> Result<Self> {
        match <[f64; LIGHTS]>::try_from(lights) {
            Ok(lights) if lights.iter().all(|x| x.is_finite()) => self.lights = lights,
            _ => {
                return Err(Error::argument("edges", "other numbers of lightness", format!("{LIGHTS} finite numbers")));
            }
        }
        Ok(self)
    }

    /// The same with which of them are steps of the pixel grid, as no lens draws them, by their numbers within the region, ascending.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless the numbers ascend.
    pub fn with_steps(mut self, steps: &[u32]) -> Result<Self> {
        check_ascending(steps)?;
        self.steps = steps.into();
        Ok(self)
    }

    /// The same with by how much a tilt errs for the blur of the image, as [`blur_rad`](Self::blur_rad) tells it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless it is a finite number from 0 on.
    pub fn with_blur_rad(mut self, blur_rad: f64) -> Result<Self> {
        if !(blur_rad.is_finite() && blur_rad >= 0.0) {
            return Err(Error::argument("edges", format!("a blur of {blur_rad} rad"), "a finite number from 0 on"));
        }
        self.blur_rad = blur_rad;
        Ok(self)
    }

    /// The same with the lines overhead of the image, as [`overhead`](Self::overhead) tells them.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] unless they are unit vectors, eight at most.
    pub fn with_overhead(mut self, normals: &[Vector3<f64>]) -> Result<Self> {
        let got = || Error::argument("edges", format!("{} lines overhead", normals.len()), "up to eight unit vectors");
        self.overhead = OverheadLines::of(normals).ok_or_else(got)?;
        Ok(self)
    }

    /// What they depend on beside the image.
    pub fn origin(&self) -> &Arc<EdgeOrigin> {
        &self.origin
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Number of each pixel within the region.
    pub fn slots(&self) -> &[u32] {
        &self.slots
    }

    /// Gradient of each pixel along `u` (Scharr, unnormalised).
    pub fn gx(&self) -> &[f32] {
        &self.gx
    }

    /// Gradient of each pixel along `v`.
    pub fn gy(&self) -> &[f32] {
        &self.gy
    }

    /// How far in pixels the image circle lies beside the calibration's; `None` where no dark surround tells.
    pub fn centre_off_px(&self) -> Option<Vector2<f64>> {
        self.centre_off_px
    }

    /// How light the image is in eight bands from straight down to straight up, and by how much each varies, in standard deviations.
    pub fn lights(&self) -> &[f64; LIGHTS] {
        &self.lights
    }

    /// Numbers within the region of those that are steps of the pixel grid.
    pub fn steps(&self) -> &[u32] {
        &self.steps
    }

    /// Standard deviation in radians, in each direction, by which a tilt errs for the blur of the image.
    pub fn blur_rad(&self) -> f64 {
        self.blur_rad
    }

    /// Normals in the robot frame, towards the brighter side, of the great circles of straight lines that go on over the vertical: none is an
    /// upright edge.
    pub fn overhead(&self) -> Vec<Vector3<f64>> {
        self.overhead.normals()
    }

    pub(super) fn lines_overhead(&self) -> OverheadLines {
        self.overhead
    }

    /// Copies them to where the fits read them, if they are of this origin.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] that says what differs, or that there are pixels beyond the region.
    pub(super) fn copy_to(&self, origin: &Arc<EdgeOrigin>, region: &Region, out: &mut EdgePixels) -> Result<()> {
        if !Arc::ptr_eq(&self.origin, origin)
            && let Some((name, own, expected)) = self.origin.difference(origin)
        {
            return Err(Error::argument("edges", format!("edges with {name} = {own}"), format!("{name} = {expected}")));
        }
        if let Some(last) = self.slots.last().filter(|last| **last as usize >= region.len()) {
            return Err(Error::argument("edges", format!("pixel {last}"), format!("pixels below {}", region.len())));
        }
        out.refill(region, &self.slots, &self.gx, &self.gy);
        Ok(())
    }
}

fn check_ascending(slots: &[u32]) -> Result<()> {
    if slots.is_sorted_by(|a, b| a < b) {
        return Ok(());
    }
    Err(Error::argument("edges", "pixels out of order", "each pixel once, in ascending order"))
}
