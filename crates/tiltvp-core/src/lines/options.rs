//! Which pixels, which method, how long a line must be, and how it is described.

use std::f64::consts::{FRAC_PI_2, PI};

use super::descriptor_options::DescriptorOptions;
use crate::edges::{EdgeOptions, Mask};
use crate::error::Result;
use crate::{methods, options};

options! {
    /// Options of the great circles.
    #[derive(Copy)]
    pub struct GreatCircleOptions {
        /// How far from the vertical the great circle of a straight edge may pass, in radians, beyond what is unknown of it.
        plane_max_rad: f64 = 5.0 * PI / 180.0 => 1e-4..=0.5, "an angle from 1e-4 to 0.5 rad";
        /// Least distance of two lines, in pixels: of two closer ones the longer stays.
        separation_px: f64 = 1.0 => 0.0..=100.0, "a distance from 0 to 100 pixels";
        /// Least supported length of a line: the elevations that its pieces cover, in radians.
        length_min_rad: f64 = 15.0 * PI / 180.0 => 0.0..=PI, "an angle from 0 to pi";
        /// Least number of pixels of a line.
        support_min_px: u32 = 15 => 3.0..=1e6, "at least 3 pixels";
        /// Widest gap between two pieces of a line that counts as covered, in radians of elevation.
        gap_max_rad: f64 = 2.0 * PI / 180.0 => 1e-4..=PI, "an angle from 1e-4 to pi";
        /// Least number of pixels of a piece.
        run_min_px: u32 = 8 => 4.0..=1e6, "at least 4 pixels";
        /// Least share of the elevations from the lowest to the highest pixel of a line that its pieces cover, from 0 to 1: lines
        /// that cover less are short edges in line by chance.
        covered_min: f64 = 0.4 => 0.0..=1.0, "a share from 0 to 1";
        /// Greatest standard deviation of the pixels about their line, in pixels: lines that scatter more are edges that blend.
        scatter_max_px: f64 = 0.36 => 0.01..=100.0, "a distance from 0.01 to 100 pixels";
        /// Standard deviation of the tilt that the frame is given, in radians, where the tilt does not tell its own as estimates do: lines
        /// may slant by as much.
        tilt_sigma_rad: f64 = 0.5 * PI / 180.0 => 1e-6..=0.5, "an angle from 1e-6 to 0.5 rad";
        /// The most lines of an image, the longest ones; none for all.
        lines_max: Option<usize> = None => 1.0..f64::INFINITY, "at least 1, or none";
    }
}

options! {
    /// Options of the paper's radial lines.
    #[derive(Copy)]
    pub struct RadialOptions {
        /// How far a gradient may turn from the tangent of its circle about the centre, in radians.
        radial_max_rad: f64 = 5.0 * PI / 180.0 => 1e-4..=FRAC_PI_2, "an angle from 1e-4 to pi/2";
        /// Number of sectors.
        sectors: usize = 720 => 16.0..=1e5, "a whole number from 16 to 100000";
        /// Least length of a line as a fraction of `radius_max_px - radius_min_px`.
        length_min: f64 = 0.5 => 0.0..=1.0, "a fraction from 0 to 1";
        /// Inner radius `R_min` of what is looked at in pixels; none for that of the elevation band.
        radius_min_px: Option<f64> = None
            => |o: &RadialOptions, x| (0.0..=1e6).contains(&x) && x < o.radius_max_px.unwrap_or(1e6),
            "a radius from 0 to 1e6 pixels, less than radius_max_px";
        /// Outer radius `R_max` in pixels; none for that of the elevation band.
        radius_max_px: Option<f64> = None => 1.0..=1e6, "a radius from 1 to 1e6 pixels";
        /// Radius of the mirror's rim in pixels, by whose circle the centre is found in every frame; none for that of the
        /// camera's valid pixels.
        rim_radius_px: Option<f64> = None => 4.0..=1e6, "a radius from 4 to 1e6 pixels";
        /// How far from the calibrated centre the rim's centre is looked for, in pixels; 0 keeps the calibrated one.
        center_search_px: f64 = 8.0 => 0.0..=200.0, "a distance from 0 to 200 pixels";
    }
}

methods! {
    /// How lines are found.
    pub enum LineMethod {
        /// Great circles through the true vertical, by the camera model.
        GreatCircle(GreatCircleOptions) = "great-circle",
        /// Radial lines of the image, exactly as Scaramuzza, Siegwart and Martinelli 2009, section 2, have them.
        Radial(RadialOptions) = "radial",
    }
}

options! {
    /// Options of a line extractor.
    pub struct LineOptions {
        /// Which pixels are looked at for edges: from 30 degrees below the horizon to 60 above it, after smoothing by 0.5 pixels;
        /// else as for tilt.
        [flat] edges: EdgeOptions = EdgeOptions {
            smoothing_px: 0.5,
            elevation_min_rad: -PI / 6.0,
            elevation_max_rad: PI / 3.0,
            ..EdgeOptions::default()
        };
        /// Pixels that show the world and not the robot; none for all.
        mask: Option<Mask> = None;
        /// How lines are found.
        [flat] method: LineMethod = LineMethod::GreatCircle(GreatCircleOptions::default());
        /// How lines are described.
        [flat "descriptor_"] descriptor: DescriptorOptions = DescriptorOptions::default();
    }
}

impl LineOptions {
    /// The defaults of one of [`LineMethod::NAMES`].
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for another name.
    pub fn for_method(name: &str) -> Result<Self> {
        Ok(Self { method: LineMethod::from_name(name)?, ..Self::default() })
    }
}
