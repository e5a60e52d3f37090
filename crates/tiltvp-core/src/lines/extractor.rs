//! From an image to its vertical lines and their descriptors: the tables of a camera, made once.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Matrix3;

use super::description::descriptor::{DescriptorScratch, DescriptorSpan, describe};
use super::description::patch::{Chart, Patch, Raster};
use super::description::profile;
use super::descriptor_options::DescriptorKind;
use super::extraction::great_circle::{self, GreatCircleScratch, MISS_MAX_RAD};
use super::extraction::radial::{self, RadialScratch, Radii};
use super::line::{Line, LineFrame, Lines, fingerprint};
use super::options::{GreatCircleOptions, LineMethod, LineOptions};
use super::tables::LineTables;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::geometry::Tilt;
use crate::image::{ImageView, check_size};
use crate::options::OptionValue;
use crate::segments::{FinderScratch, SegmentFinder, SegmentOptions, Segments};

/// Samples of a descriptor from the middle of an area to its rim, along great circles: about one a pixel where 90
/// degrees of elevation cover 110 pixels.
const SAMPLES: usize = 18;

/// Finds and describes the vertical lines of single images of one camera.
#[derive(Debug, Clone)]
pub struct LineExtractor {
    camera: Camera,
    robot_from_camera: Matrix3<f64>,
    options: LineOptions,
    tables: LineTables,
    finder: Option<SegmentFinder>,
    radii: Option<Radii>,
    seen_by: u32,
}

/// Memory for one thread.
#[derive(Debug, Clone)]
pub struct LineScratch {
    finder: Option<FinderScratch>,
    segments: Segments,
    great_circle: GreatCircleScratch,
    radial: RadialScratch,
    descriptor: DescriptorScratch,
}

impl LineExtractor {
    /// Makes the tables. `robot_from_camera` is `R`, which takes bearings of the camera frame to the robot frame.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] if an option is out of its domain, `R` is no rotation, the optical
    /// axis is far from the vertical and the method radial, the mask does not fit the camera, or no pixel sees the elevation band.
    pub fn new(camera: Camera, robot_from_camera: Matrix3<f64>, options: LineOptions) -> Result<Self> {
        options.validate()?;
        crate::geometry::validate_rotation(&robot_from_camera)?;
        if matches!(options.method, LineMethod::Radial(_)) {
            radial::check_axis(&robot_from_camera)?;
            if options.descriptor.kind == DescriptorKind::Profile {
                let expected = "areas for radial lines, which know no elevations";
                return Err(Error::option("descriptor_kind", DescriptorKind::Profile.to_value(), expected));
            }
        }
        let tables = LineTables::new(&camera, &robot_from_camera, &options)?;
        let radii = match &options.method {
            LineMethod::GreatCircle(_) => None,
            LineMethod::Radial(radial) => Some(Radii::new(&camera, &robot_from_camera, &tables, radial)),
        };
        let finder = match &options.method {
            LineMethod::GreatCircle(own) => {
                SegmentFinder::check_margin(&options.edges)?;
                Some(SegmentFinder::new(&camera, &tables.region, segment_options(own)))
            }
            LineMethod::Radial(_) => None,
        };
        if let Some(radii) = radii
            && radii.outer - radii.inner < 6.0
        {
            let got = format!("[{:.1}, {:.1}]", radii.inner, radii.outer);
            return Err(Error::option("radius_min_px, radius_max_px", got, "radii at least 6 pixels apart"));
        }
        let seen_by = fingerprint(&camera, &robot_from_camera, radii.is_some());
        Ok(Self { camera, robot_from_camera, options, tables, finder, radii, seen_by })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The rotation from the camera frame to the robot frame.
    pub fn robot_from_camera(&self) -> &Matrix3<f64> {
        &self.robot_from_camera
    }

    /// The options.
    pub fn options(&self) -> &LineOptions {
        &self.options
    }

    /// Lowest and highest elevation that descriptors cover, in radians.
    pub fn band_rad(&self) -> (f64, f64) {
        self.tables.band
    }

    /// Memory for one thread.
    pub fn scratch(&self) -> LineScratch {
        LineScratch {
            finder: self.finder.as_ref().map(|finder| finder.scratch(&self.tables.region, &self.options.edges)),
            segments: Segments::default(),
            great_circle: GreatCircleScratch::default(),
            radial: RadialScratch::default(),
            descriptor: DescriptorScratch::default(),
        }
    }

    fn check(&self, image: &ImageView<'_>, scratch: &LineScratch) -> Result<()> {
        let serves = match &scratch.finder {
            Some(work) => self.finder.is_some() && work.serves(&self.tables.region, &self.options.edges),
            None => self.finder.is_none(),
        };
        if !serves {
            return Err(Error::argument("scratch", "that of another extractor", "one made by this extractor"));
        }
        check_size((image.width(), image.height()), (self.tables.width, self.tables.height))
    }

    /// The vertical lines of an image, by rising bearing. `tilt` is the lean of the frame where it is known, and
    /// `tilt_sigma_rad` its standard deviation where that is known, as of an estimate; else that of the options. The
    /// radial variant has neither.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, the scratch is another extractor's, the tilt
    /// is of no finite angles, or the standard deviation is not an angle above 0.
    pub fn extract(
        &self,
        image: &ImageView<'_>,
        tilt: Option<&Tilt>,
        tilt_sigma_rad: Option<f64>,
        scratch: &mut LineScratch,
        out: &mut Lines,
    ) -> Result<()> {
        self.check(image, scratch)?;
        if let Some(sigma) = tilt_sigma_rad.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
            return Err(Error::argument("tilt_sigma_rad", sigma, "an angle above 0"));
        }
        if tilt.is_some_and(|tilt| Tilt::from_normal(&tilt.normal()).is_none()) {
            return Err(Error::argument("tilt", "angles that are not finite", "a lean"));
        }
        let edges = &self.options.edges;
        let LineScratch { finder: work, segments, great_circle, radial, .. } = scratch;
        match (&self.options.method, &self.finder, work, &self.radii) {
            (LineMethod::Radial(options), _, _, Some(radii)) => {
                radial::find(image, &self.tables, radii, edges.gradient_min, options, radial, out);
            }
            (LineMethod::GreatCircle(options), Some(finder), Some(work), _) => {
                let tilt = tilt.copied().unwrap_or(Tilt::UPRIGHT);
                let options = match tilt_sigma_rad {
                    Some(tilt_sigma_rad) => &GreatCircleOptions { tilt_sigma_rad, ..*options },
                    None => options,
                };
                let reach = (MISS_MAX_RAD.max(options.plane_max_rad) + tilt.alpha_rad()).min(FRAC_PI_2);
                let prefilter = self.tables.prefilter.with_limit(reach.sin());
                let gradients = finder.gradients(edges.gradient_min);
                finder.find(image, &self.tables.region, gradients, Some(&prefilter), work, segments);
                let frame = LineFrame { normal: tilt.normal(), ..LineFrame::default() };
                great_circle::find(&self.robot_from_camera, segments, frame, options, great_circle, out);
            }
            _ => {}
        }
        out.frame.seen_by = Some(self.seen_by);
        Ok(())
    }

    /// Lines at any bearings in the frame of an image, without support: to describe places where there may be no line.
    pub fn lines_at(&self, bearings_rad: &[f64], tilt: Option<&Tilt>) -> Lines {
        let (elevation_min_rad, elevation_max_rad) = self.tables.band;
        let line = |bearing_rad: &f64| Line {
            bearing_rad: *bearing_rad,
            sigma_rad: 0.0,
            support_px: 0,
            elevation_min_rad,
            elevation_max_rad,
            polarity: 0.0,
        };
        let center_px = self.radii.map(|radii| radii.center);
        let normal = tilt.filter(|_| center_px.is_none()).unwrap_or(&Tilt::UPRIGHT).normal();
        let frame = LineFrame { normal, center_px, seen_by: Some(self.seen_by) };
        Lines { lines: bearings_rad.iter().map(line).collect(), frame }
    }

    /// Where along lines of a frame descriptors reach: elevations, or radii in pixels.
    fn range(&self, frame: &LineFrame) -> (f64, f64) {
        match (frame.center_px, &self.radii) {
            (Some(_), Some(radii)) => (radii.inner, radii.outer),
            _ => self.tables.band,
        }
    }

    fn check_lines(&self, lines: &Lines) -> Result<()> {
        lines.check()?;
        if lines.frame.center_px.is_some() != self.radii.is_some() {
            return Err(Error::argument(
                "lines",
                "lines of the other method",
                "lines that this extractor's method found",
            ));
        }
        lines.frame.check_seen_by(self.seen_by)
    }

    /// The descriptors of the lines of an image, one after the other (Scaramuzza, Siegwart and Martinelli 2009, section 3): along the lines' great circles, or
    /// along radii for lines of the radial variant.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, the scratch is another extractor's, or the
    /// lines are of the other method or of another camera or mounting, or fail [`Lines::check`].
    pub fn describe(
        &self,
        image: &ImageView<'_>,
        lines: &Lines,
        scratch: &mut LineScratch,
        out: &mut Vec<f32>,
    ) -> Result<()> {
        self.check(image, scratch)?;
        self.check_lines(lines)?;
        let chart = Chart::new(&self.camera, &self.robot_from_camera, &lines.frame);
        if self.options.descriptor.kind == DescriptorKind::Profile {
            profile::describe(image, &self.tables, &chart, lines, out);
            return Ok(());
        }
        let samples = lines.frame.center_px.is_none().then_some(SAMPLES);
        let (low, high) = self.range(&lines.frame);
        let course = DescriptorSpan { chart, low, high, samples };
        describe(image, &self.tables, &course, lines, &self.options.descriptor, &mut scratch.descriptor, out);
        Ok(())
    }

    /// The grey levels of the rectangle about each line (Scaramuzza, Siegwart and Martinelli 2009, section 5): as wide as an area of the descriptor, as long
    /// as the line's range; NaN where the world is not seen. Returns rows, which run along the line, and columns.
    ///
    /// # Errors
    /// Those of [`describe`](Self::describe).
    pub fn patches(
        &self,
        image: &ImageView<'_>,
        lines: &Lines,
        scratch: &LineScratch,
        out: &mut Vec<f32>,
    ) -> Result<(usize, usize)> {
        self.check(image, scratch)?;
        self.check_lines(lines)?;
        let chart = Chart::new(&self.camera, &self.robot_from_camera, &lines.frame);
        let (low, high) = self.range(&lines.frame);
        let (rows, columns) = (6 * SAMPLES + 1, 2 * SAMPLES + 1);
        let raster = Raster { pitch: (high - low) / (6 * SAMPLES) as f64, rows, columns, reach: None };
        let mut patch = Patch::default();
        out.clear();
        for line in &lines.lines {
            patch.sample(image, &self.tables, &chart, (line.bearing_rad, 0.5 * (low + high)), &raster);
            out.extend_from_slice(&patch.levels);
        }
        Ok((rows, columns))
    }
}

/// Short pieces, wherever one begins: lines join them by what is known of the vertical.
fn segment_options(options: &GreatCircleOptions) -> SegmentOptions {
    SegmentOptions {
        gradient_start: 0.0,
        support_min_px: options.run_min_px,
        gap_max: 0.0,
        ..SegmentOptions::default()
    }
}
