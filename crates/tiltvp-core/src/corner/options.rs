//! Options of the front ends.

use std::f64::consts::{FRAC_PI_2, PI};

use super::segmentation::ColorOptions;
use crate::error::{Error, Result};

/// Names of the front ends, the default first.
pub const CORNER_METHODS: [&str; 2] = ["coloured", "general"];

/// Which front end finds corners.
#[derive(Debug, Clone, PartialEq)]
pub enum CornerMethod {
    /// The paper's, for a cuboid whose three faces are red, green and blue.
    Coloured(ColouredOptions),
    /// For corners of rooms, boxes and buildings without colours.
    General(GeneralOptions),
}

impl CornerMethod {
    /// The name of the front end.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Coloured(_) => CORNER_METHODS[0],
            Self::General(_) => CORNER_METHODS[1],
        }
    }
}

/// Which way the cuboid's top may be in the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OrientationChoice {
    /// The camera is held upright.
    Upright,
    /// The camera is upside down.
    UpsideDown,
    /// Upright first, upside down where that finds nothing. The default.
    #[default]
    Either,
}

/// Options of the paper's front end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColouredOptions {
    /// When a pixel shows a face.
    pub color: ColorOptions,
    /// Which way the camera is held.
    pub orientation: OrientationChoice,
    /// Every how many-th pixel is labelled, along rows and columns; the rays are fitted to all pixels whatever it is.
    /// Default 2; the paper's is 1.
    pub label_step_px: u32,
    /// How far apart the faces on both sides of an edge are looked for, in pixels (the paper's search width). Default 8.
    pub search_width_px: u32,
    /// Least number of candidates of each edge, if every pixel were labelled. Default 40.
    pub candidates_min: u32,
    /// Largest distance of a candidate from the line that RANSAC fits, in pixels. Default 1.5.
    pub line_threshold_px: f64,
    /// Seed of the random samples. Default 0.
    pub seed: u64,
    /// How far from the candidates' line the edge is looked for, in pixels. Default 4.
    pub search_px: f64,
    /// How far from the first ray it is looked for the second time, in pixels. Default 2.
    pub refine_px: f64,
    /// Least step across an edge in the light of the two faces' primaries, out of 255. Default 8.
    pub step_min: f64,
    /// Largest distance of a place of the edge from its ray, in pixels. Default 0.6.
    pub threshold_px: f64,
    /// What places of an edge do not tell: how far either end of a ray may be off, in pixels. Default 0.01.
    pub ray_sigma_px: f64,
    /// Least number of places that agree with a ray. Default 15.
    pub support_min_px: u32,
    /// Largest root mean square distance of the vertex from the three rays, in pixels. Default 1.
    pub residual_max_px: f64,
}

impl Default for ColouredOptions {
    fn default() -> Self {
        Self {
            color: ColorOptions::default(),
            orientation: OrientationChoice::default(),
            label_step_px: 2,
            search_width_px: 8,
            candidates_min: 40,
            line_threshold_px: 1.5,
            seed: 0,
            search_px: 4.0,
            refine_px: 2.0,
            step_min: 8.0,
            threshold_px: 0.6,
            ray_sigma_px: 0.01,
            support_min_px: 15,
            residual_max_px: 1.0,
        }
    }
}

/// Options of the general front end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeneralOptions {
    /// Least gradient magnitude of an edge pixel, Scharr kernel (3, 10, 3) on 8-bit grey levels. Default 60.
    pub gradient_min: f64,
    /// Standard deviation of the Gaussian before the kernel, in pixels. Default 1.
    pub smoothing_px: f64,
    /// Pixels kept clear of the image's border and the mask. Default 4.
    pub margin_px: f64,
    /// Least length of a line segment, in pixels. Default 20.
    pub segment_min_px: f64,
    /// Largest distance of a segment's pixels from its great circle, in pixels. Default 1.2.
    pub segment_threshold_px: f64,
    /// How far from the vertex a segment may begin, in pixels. Default 40.
    pub gap_max_px: f64,
    /// The same as a share of the segment's length, if that is more. Default 0.2.
    pub gap_max_share: f64,
    /// How far beyond the vertex a segment may reach, in pixels. Default 5.
    pub overshoot_max_px: f64,
    /// Least angle between two rays at the vertex, in radians. Default 10 degrees.
    pub ray_angle_min_rad: f64,
    /// The angle between the two level edges of a corner, in radians. Default a right angle.
    pub gamma_rad: f64,
    /// How far the vertical edge may be from the prior's vertical, in radians. Default 20 degrees.
    pub vertical_max_rad: f64,
    /// How far from a segment the edge is looked for, in pixels. Default 2.5.
    pub search_px: f64,
    /// How far from where it was a corner is looked for in the next frame, in pixels. Default 8.
    pub follow_px: f64,
    /// Least step across an edge, in the light of grey levels out of 255. Default 1.
    pub step_min: f64,
    /// Largest distance of a place of the edge from its ray, in pixels. Default 0.7.
    pub threshold_px: f64,
    /// What places of an edge do not tell, as real edges are bevelled and worn: how far either end of a ray may be off, in
    /// pixels. Default 0.2.
    pub ray_sigma_px: f64,
    /// Least number of places that agree with a ray. Default 20.
    pub support_min_px: u32,
    /// Least share of the places along a ray that agree with it. Default 0.6.
    pub support_min_share: f64,
    /// The same for a corner that is looked for near where it is expected. Default 0.4.
    pub guided_min_share: f64,
    /// Largest root mean square distance of the vertex from the three rays, in pixels. Default 1.5.
    pub residual_max_px: f64,
    /// Most corners of an image, the best ones. Default 12.
    pub corners_max: u32,
}

impl Default for GeneralOptions {
    fn default() -> Self {
        Self {
            gradient_min: 60.0,
            smoothing_px: 1.0,
            margin_px: 4.0,
            segment_min_px: 20.0,
            segment_threshold_px: 1.2,
            gap_max_px: 40.0,
            gap_max_share: 0.2,
            overshoot_max_px: 5.0,
            ray_angle_min_rad: 10.0 * PI / 180.0,
            gamma_rad: FRAC_PI_2,
            vertical_max_rad: 20.0 * PI / 180.0,
            search_px: 2.5,
            follow_px: 8.0,
            step_min: 1.0,
            threshold_px: 0.7,
            ray_sigma_px: 0.2,
            support_min_px: 20,
            support_min_share: 0.6,
            guided_min_share: 0.4,
            residual_max_px: 1.5,
            corners_max: 12,
        }
    }
}

/// Options of a corner detector.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectorOptions {
    /// The exponent of the images' display curve, `level = light^(1 / gamma)`; 1 for linear images. Default 2.2.
    pub display_gamma: f64,
    /// The front end.
    pub method: CornerMethod,
}

impl DetectorOptions {
    /// The defaults of one of [`CORNER_METHODS`].
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for another name.
    pub fn for_method(name: &str) -> Result<Self> {
        let method = match name {
            "coloured" => CornerMethod::Coloured(ColouredOptions::default()),
            "general" => CornerMethod::General(GeneralOptions::default()),
            _ => return Err(Error::option("method", name, "\"coloured\" or \"general\"")),
        };
        Ok(Self { display_gamma: 2.2, method })
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        match &self.method {
            CornerMethod::Coloured(options) => options.validate(),
            CornerMethod::General(options) => options.validate(),
        }
    }
}

fn within(name: &'static str, value: f64, range: std::ops::RangeInclusive<f64>, expected: &'static str) -> Result<()> {
    if range.contains(&value) { Ok(()) } else { Err(Error::option(name, value, expected)) }
}

impl ColouredOptions {
    fn validate(&self) -> Result<()> {
        self.color.validate()?;
        within("label_step_px", f64::from(self.label_step_px), 1.0..=16.0, "from 1 to 16 pixels")?;
        within("search_width_px", f64::from(self.search_width_px), 2.0..=100.0, "from 2 to 100 pixels")?;
        within("candidates_min", f64::from(self.candidates_min), 2.0..=1e6, "from 2 to 1000000")?;
        within("line_threshold_px", self.line_threshold_px, 0.1..=20.0, "from 0.1 to 20 pixels")?;
        within("search_px", self.search_px, 1.0..=15.0, "from 1 to 15 pixels")?;
        within("refine_px", self.refine_px, 1.0..=15.0, "from 1 to 15 pixels")?;
        within("step_min", self.step_min, 0.1..=255.0, "a step of light from 0.1 to 255")?;
        within("threshold_px", self.threshold_px, 0.05..=10.0, "from 0.05 to 10 pixels")?;
        within("ray_sigma_px", self.ray_sigma_px, 0.0..=10.0, "from 0 to 10 pixels")?;
        within("support_min_px", f64::from(self.support_min_px), 2.0..=1e6, "from 2 to 1000000 pixels")?;
        within("residual_max_px", self.residual_max_px, 0.01..=100.0, "from 0.01 to 100 pixels")
    }
}

impl GeneralOptions {
    fn validate(&self) -> Result<()> {
        let angle = "an angle from 0.001 to 1.5 rad";
        within("gradient_min", self.gradient_min, 1.0..=1e4, "a gradient magnitude from 1 to 10000")?;
        within("smoothing_px", self.smoothing_px, 0.0..=10.0, "a standard deviation from 0 to 10 pixels")?;
        within("margin_px", self.margin_px, 0.0..=1000.0, "a width from 0 to 1000 pixels")?;
        within("segment_min_px", self.segment_min_px, 5.0..=1e4, "from 5 to 10000 pixels")?;
        within("segment_threshold_px", self.segment_threshold_px, 0.3..=10.0, "from 0.3 to 10 pixels")?;
        within("gap_max_px", self.gap_max_px, 0.0..=1000.0, "from 0 to 1000 pixels")?;
        within("gap_max_share", self.gap_max_share, 0.0..=10.0, "a share from 0 to 10")?;
        within("overshoot_max_px", self.overshoot_max_px, 0.0..=1000.0, "from 0 to 1000 pixels")?;
        within("ray_angle_min_rad", self.ray_angle_min_rad, 0.001..=1.5, angle)?;
        within("gamma_rad", self.gamma_rad, 0.1..=3.0, "an angle from 0.1 to 3 rad")?;
        within("vertical_max_rad", self.vertical_max_rad, 0.001..=1.5, angle)?;
        within("search_px", self.search_px, 1.0..=15.0, "from 1 to 15 pixels")?;
        within("follow_px", self.follow_px, 1.0..=15.0, "from 1 to 15 pixels")?;
        within("step_min", self.step_min, 0.1..=255.0, "a step of light from 0.1 to 255")?;
        within("threshold_px", self.threshold_px, 0.05..=10.0, "from 0.05 to 10 pixels")?;
        within("ray_sigma_px", self.ray_sigma_px, 0.0..=10.0, "from 0 to 10 pixels")?;
        within("support_min_px", f64::from(self.support_min_px), 2.0..=1e6, "from 2 to 1000000 pixels")?;
        within("support_min_share", self.support_min_share, 0.0..=1.0, "a share from 0 to 1")?;
        within("guided_min_share", self.guided_min_share, 0.0..=1.0, "a share from 0 to 1")?;
        within("residual_max_px", self.residual_max_px, 0.01..=100.0, "from 0.01 to 100 pixels")?;
        within("corners_max", f64::from(self.corners_max), 1.0..=1000.0, "from 1 to 1000")
    }
}
