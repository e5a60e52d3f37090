//! Which pixels, which variant, how long a line must be, and how it is described.

use std::f64::consts::{FRAC_PI_2, PI};

use super::descriptor_options::DescriptorOptions;
use crate::edges::{EdgeOptions, Mask};
use crate::error::{Error, Result};

/// Names of the variants, the default first.
pub const LINE_METHODS: [&str; 2] = ["great-circle", "radial"];

/// How lines are found.
#[derive(Debug, Clone, PartialEq)]
pub enum LineMethod {
    /// Great circles through the true vertical, by the camera model.
    GreatCircle(GreatCircleOptions),
    /// Radial lines of the image, exactly as paper 001 section 2 has them.
    Radial(RadialOptions),
}

impl LineMethod {
    /// The name of the variant.
    pub fn name(&self) -> &'static str {
        match self {
            Self::GreatCircle(_) => LINE_METHODS[0],
            Self::Radial(_) => LINE_METHODS[1],
        }
    }
}

/// Options of the great circles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreatCircleOptions {
    /// How far from the vertical the great circle of an edge pixel may pass, in radians. Default 5 degrees.
    pub plane_max_rad: f64,
    /// Number of bins of the histogram over azimuth. Default 720.
    pub bins: usize,
    /// Least angle between two lines of the same polarity, in radians. Default 1 degree.
    pub separation_rad: f64,
    /// Least supported length of a line: the elevations that its runs of pixels cover, in radians. Default 15 degrees.
    pub length_min_rad: f64,
    /// Least number of pixels of a line. Default 15.
    pub support_min_px: u32,
    /// Widest gap within a run of pixels, in radians of elevation. Default 2 degrees.
    pub gap_max_rad: f64,
    /// Least number of pixels of a run. Default 6.
    pub run_min_px: u32,
    /// Least share of the elevations from the lowest to the highest pixel of a line that its runs cover, from 0 to 1: lines that
    /// cover less are short edges in line by chance. Default 0.6.
    pub covered_min: f64,
    /// Greatest standard deviation of the pixels about their line, in pixels: lines that scatter more are edges that blend.
    /// Default 0.36.
    pub scatter_max_px: f64,
    /// Standard deviation of the tilt that the frame is given, in radians: lines may slant by as much. Default 0.5 degrees.
    pub tilt_sigma_rad: f64,
    /// The most lines of an image, the longest ones; none for all. Default none.
    pub lines_max: Option<usize>,
}

impl Default for GreatCircleOptions {
    fn default() -> Self {
        Self {
            plane_max_rad: 5.0 * PI / 180.0,
            bins: 720,
            separation_rad: PI / 180.0,
            length_min_rad: 15.0 * PI / 180.0,
            support_min_px: 15,
            gap_max_rad: 2.0 * PI / 180.0,
            run_min_px: 6,
            covered_min: 0.6,
            scatter_max_px: 0.36,
            tilt_sigma_rad: 0.5 * PI / 180.0,
            lines_max: None,
        }
    }
}

/// Options of the paper's radial lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialOptions {
    /// How far a gradient may turn from the tangent of its circle about the centre, in radians. Default 5 degrees.
    pub radial_max_rad: f64,
    /// Number of sectors. Default 720.
    pub sectors: usize,
    /// Least length of a line as a fraction of `radius_max_px - radius_min_px`. Default 0.5.
    pub length_min: f64,
    /// Inner radius `R_min` of what is looked at in pixels; none for that of the elevation band. Default none.
    pub radius_min_px: Option<f64>,
    /// Outer radius `R_max` in pixels; none for that of the elevation band. Default none.
    pub radius_max_px: Option<f64>,
    /// Radius of the mirror's rim in pixels, by whose circle the centre is found in every frame; none for that of the
    /// camera's valid pixels. Default none.
    pub rim_radius_px: Option<f64>,
    /// How far from the calibrated centre the rim's centre is looked for, in pixels; 0 keeps the calibrated one. Default 8.
    pub center_search_px: f64,
}

impl Default for RadialOptions {
    fn default() -> Self {
        Self {
            radial_max_rad: 5.0 * PI / 180.0,
            sectors: 720,
            length_min: 0.5,
            radius_min_px: None,
            radius_max_px: None,
            rim_radius_px: None,
            center_search_px: 8.0,
        }
    }
}

/// Options of a line extractor.
#[derive(Debug, Clone, PartialEq)]
pub struct LineOptions {
    /// Which pixels are looked at for edges. Default from 30 degrees below the horizon to 60 above it, after smoothing by 0.5
    /// pixels; else as for tilt.
    pub edges: EdgeOptions,
    /// Which pixels may be used at all. Default none: all.
    pub mask: Option<Mask>,
    /// How lines are found.
    pub method: LineMethod,
    /// How lines are described.
    pub descriptor: DescriptorOptions,
}

impl LineOptions {
    /// The defaults of one of [`LINE_METHODS`].
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for another name.
    pub fn for_method(name: &str) -> Result<Self> {
        let method = match name {
            "great-circle" => LineMethod::GreatCircle(GreatCircleOptions::default()),
            "radial" => LineMethod::Radial(RadialOptions::default()),
            _ => return Err(Error::option("method", name, "\"great-circle\" or \"radial\"")),
        };
        let edges = EdgeOptions {
            smoothing_px: 0.5,
            elevation_min_rad: -PI / 6.0,
            elevation_max_rad: PI / 3.0,
            ..EdgeOptions::default()
        };
        Ok(Self { edges, mask: None, method, descriptor: DescriptorOptions::default() })
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        self.edges.validate()?;
        self.descriptor.validate()?;
        match &self.method {
            LineMethod::GreatCircle(options) => options.validate(),
            LineMethod::Radial(options) => options.validate(),
        }
    }
}

fn within(name: &'static str, value: f64, range: std::ops::RangeInclusive<f64>, expected: &'static str) -> Result<()> {
    if range.contains(&value) { Ok(()) } else { Err(Error::option(name, value, expected)) }
}

impl GreatCircleOptions {
    fn validate(&self) -> Result<()> {
        let angle = "an angle from 1e-4 to 0.5 rad";
        within("plane_max_rad", self.plane_max_rad, 1e-4..=0.5, angle)?;
        within("bins", self.bins as f64, 16.0..=1e5, "a whole number from 16 to 100000")?;
        within("separation_rad", self.separation_rad, 1e-4..=0.5, angle)?;
        within("length_min_rad", self.length_min_rad, 0.0..=PI, "an angle from 0 to pi")?;
        within("support_min_px", f64::from(self.support_min_px), 3.0..=1e6, "at least 3 pixels")?;
        within("gap_max_rad", self.gap_max_rad, 1e-4..=PI, "an angle from 1e-4 to pi")?;
        within("run_min_px", f64::from(self.run_min_px), 1.0..=1e6, "at least 1 pixel")?;
        within("covered_min", self.covered_min, 0.0..=1.0, "a share from 0 to 1")?;
        within("scatter_max_px", self.scatter_max_px, 0.01..=100.0, "a distance from 0.01 to 100 pixels")?;
        within("tilt_sigma_rad", self.tilt_sigma_rad, 1e-6..=0.5, "an angle from 1e-6 to 0.5 rad")?;
        if self.lines_max == Some(0) {
            return Err(Error::option("lines_max", 0, "at least 1, or none"));
        }
        Ok(())
    }
}

impl RadialOptions {
    fn validate(&self) -> Result<()> {
        within("radial_max_rad", self.radial_max_rad, 1e-4..=FRAC_PI_2, "an angle from 1e-4 to pi/2")?;
        within("sectors", self.sectors as f64, 16.0..=1e5, "a whole number from 16 to 100000")?;
        within("length_min", self.length_min, 0.0..=1.0, "a fraction from 0 to 1")?;
        let (low, high) = (self.radius_min_px.unwrap_or(0.0), self.radius_max_px.unwrap_or(1e6));
        within("radius_min_px", low, 0.0..=1e6, "a radius from 0 to 1e6 pixels")?;
        within("radius_max_px", high, 1.0..=1e6, "a radius from 1 to 1e6 pixels")?;
        if low >= high {
            return Err(Error::option("radius_min_px", low, "less than radius_max_px"));
        }
        within("rim_radius_px", self.rim_radius_px.unwrap_or(4.0), 4.0..=1e6, "a radius from 4 to 1e6 pixels")?;
        within("center_search_px", self.center_search_px, 0.0..=200.0, "a distance from 0 to 200 pixels")
    }
}
