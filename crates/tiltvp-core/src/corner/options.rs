//! Options of the front ends.

use std::f64::consts::{FRAC_PI_2, PI};

use super::segmentation::ColorOptions;
use crate::edges::{EdgeOptions, Mask};
use crate::error::Result;
use crate::segments::{SegmentDetectorOptions, SegmentOptions};
use crate::{methods, options, words};

/// How long the pieces are of which segments are joined, at least, in lengths of the shortest segment.
const PIECE_SHARE: f64 = 0.6;

words! {
    /// Which way the cuboid's top may be in the image.
    pub enum OrientationChoice {
        /// Upright first, upside down where that finds nothing.
        Either = "either",
        /// The camera is held upright.
        Upright = "upright",
        /// The camera is upside down.
        UpsideDown = "upside-down",
    }
}

options! {
    /// How the three edges between the coloured faces are found in the labels of pixels (algorithm 1).
    #[derive(Copy)]
    pub struct EdgeLineOptions {
        /// When a pixel shows a face.
        [flat] color: ColorOptions = ColorOptions::default();
        /// Which way the camera is held.
        orientation: OrientationChoice = OrientationChoice::Either;
        /// How far apart the faces on both sides of an edge are looked for, in pixels (the paper's search width).
        search_width_px: u32 = 8 => 2.0..=100.0, "from 2 to 100 pixels";
        /// Least number of candidates of each edge, if every pixel were labelled.
        candidates_min: u32 = 40 => 2.0..=1e6, "from 2 to 1000000";
        /// Largest distance of a candidate from the line that RANSAC fits, in pixels.
        line_threshold_px: f64 = 1.5 => 0.1..=20.0, "from 0.1 to 20 pixels";
        /// Seed of the random samples.
        seed: u64 = 0;
    }
}

options! {
    /// Options of the front end for the coloured cuboid, whose rays run between pixels.
    #[derive(Copy)]
    pub struct ColouredOptions {
        /// How the edges are found in the labels.
        [flat] lines: EdgeLineOptions = EdgeLineOptions::default();
        /// Every how many-th pixel is labelled, along rows and columns; the rays are fitted to all pixels whatever it is. The
        /// paper's is 1.
        label_step_px: u32 = 2 => 1.0..=16.0, "from 1 to 16 pixels";
        /// How far from the candidates' line the edge is looked for, in pixels.
        search_px: f64 = 4.0 => 1.0..=15.0, "from 1 to 15 pixels";
        /// How far from the first ray it is looked for the second time, in pixels.
        refine_px: f64 = 2.0 => 1.0..=15.0, "from 1 to 15 pixels";
        /// Least step across an edge in the light of the two faces' primaries, out of 255.
        step_min: f64 = 8.0 => 0.1..=255.0, "a step of light from 0.1 to 255";
        /// Largest distance of a place of the edge from its ray, in pixels.
        threshold_px: f64 = 0.6 => 0.05..=10.0, "from 0.05 to 10 pixels";
        /// What places of an edge do not tell: how far either end of a ray may be off, in pixels.
        ray_sigma_px: f64 = 0.01 => 0.0..=10.0, "from 0 to 10 pixels";
        /// Least number of places that agree with a ray.
        support_min_px: u32 = 15 => 2.0..=1e6, "from 2 to 1000000 pixels";
        /// Largest root mean square distance of the vertex from the three rays, in pixels.
        residual_max_px: f64 = 1.0 => 0.01..=100.0, "from 0.01 to 100 pixels";
    }
}

options! {
    /// Options of the paper as it was published.
    #[derive(Copy)]
    pub struct PaperOptions {
        /// How the edges are found in the labels. The paper names neither a search width nor a threshold: these let the lines be
        /// fitted to all midpoints next to an edge, with which the method is at its best.
        [flat] lines: EdgeLineOptions = EdgeLineOptions { search_width_px: 4, line_threshold_px: 4.0, ..EdgeLineOptions::default() };
        /// How far colours and blur may shift all midpoints of an edge alike, in pixels: a standard deviation.
        line_sigma_px: f64 = 0.35 => 0.0..=10.0, "from 0 to 10 pixels";
        /// Largest root mean square distance of the vertex from the three rays, in pixels.
        residual_max_px: f64 = 3.0 => 0.01..=100.0, "from 0.01 to 100 pixels";
    }
}

options! {
    /// Options of the general front end.
    #[derive(Copy)]
    pub struct GeneralOptions {
        /// Least gradient magnitude of an edge pixel, Scharr kernel (3, 10, 3) on 8-bit grey levels. Poses are also looked for at half
        /// of this and of `gradient_start` where there is none.
        gradient_min: f64 = 30.0 => 1.0..=1e4, "a gradient magnitude from 1 to 10000";
        /// Gradient magnitude of which an edge has a pixel at least; it is followed down to `gradient_min`.
        gradient_start: f64 = 50.0 => 0.0..=1e4, "a gradient magnitude from 0 to 10000";
        /// Standard deviation of the Gaussian before the kernel, in pixels.
        smoothing_px: f64 = 1.0 => 0.0..=10.0, "a standard deviation from 0 to 10 pixels";
        /// Pixels kept clear of the image's border and the mask.
        margin_px: f64 = 4.0 => 0.0..=1000.0, "a width from 0 to 1000 pixels";
        /// Least length of a line segment, in pixels.
        segment_min_px: f64 = 20.0 => 5.0..=1e4, "from 5 to 10000 pixels";
        /// Largest distance of a segment's pixels from its great circle, in pixels.
        segment_threshold_px: f64 = 1.2 => 0.3..=10.0, "from 0.3 to 10 pixels";
        /// How far from the vertex a segment may begin, in pixels.
        gap_max_px: f64 = 40.0 => 0.0..=1000.0, "from 0 to 1000 pixels";
        /// The same as a share of the segment's length, if that is more.
        gap_max_share: f64 = 0.2 => 0.0..=10.0, "a share from 0 to 10";
        /// How far beyond the vertex a segment may reach, in pixels.
        overshoot_max_px: f64 = 5.0 => 0.0..=1000.0, "from 0 to 1000 pixels";
        /// Least angle between two rays at the vertex, in radians.
        ray_angle_min_rad: f64 = 10.0 * PI / 180.0 => 0.001..=1.5, "an angle from 0.001 to 1.5 rad";
        /// The angle between the two level edges of a corner, in radians.
        gamma_rad: f64 = FRAC_PI_2 => 0.1..=3.0, "an angle from 0.1 to 3 rad";
        /// How far the vertical edge may be from the prior's vertical, in radians.
        vertical_max_rad: f64 = 20.0 * PI / 180.0 => 0.001..=1.5, "an angle from 0.001 to 1.5 rad";
        /// How far from a segment the edge is looked for, in pixels.
        search_px: f64 = 2.5 => 1.0..=15.0, "from 1 to 15 pixels";
        /// How far from where it was a corner is looked for in the next frame, in pixels.
        follow_px: f64 = 8.0 => 1.0..=15.0, "from 1 to 15 pixels";
        /// Least step across an edge, in the light of grey levels out of 255.
        step_min: f64 = 1.0 => 0.1..=255.0, "a step of light from 0.1 to 255";
        /// Largest distance of a place of the edge from its ray, in pixels.
        threshold_px: f64 = 0.7 => 0.05..=10.0, "from 0.05 to 10 pixels";
        /// What places of an edge do not tell, as real edges are bevelled and worn: how far either end of a ray may be off, in
        /// pixels.
        ray_sigma_px: f64 = 0.2 => 0.0..=10.0, "from 0 to 10 pixels";
        /// Least number of places that agree with a ray.
        support_min_px: u32 = 20 => 2.0..=1e6, "from 2 to 1000000 pixels";
        /// Least share of the places along a ray that agree with it.
        support_min_share: f64 = 0.6 => 0.0..=1.0, "a share from 0 to 1";
        /// The same for a corner that is looked for near where it is expected.
        guided_min_share: f64 = 0.4 => 0.0..=1.0, "a share from 0 to 1";
        /// Largest root mean square distance of the vertex from the three rays, in pixels.
        residual_max_px: f64 = 1.5 => 0.01..=100.0, "from 0.01 to 100 pixels";
        /// Most corners of an image, the best ones.
        corners_max: u32 = 12 => 1.0..=1000.0, "from 1 to 1000";
    }
}

methods! {
    /// Which front end finds corners.
    pub enum CornerMethod {
        /// For a cuboid whose three faces are red, green and blue: the paper's labels, then rays between pixels.
        Coloured(ColouredOptions) = "coloured",
        /// For corners of rooms, boxes and buildings without colours.
        General(GeneralOptions) = "general",
        /// The paper as it was published, for the same cuboid.
        Paper(PaperOptions) = "paper",
    }
}

options! {
    /// Options of a corner detector.
    pub struct DetectorOptions {
        /// The exponent of the images' display curve, `level = light^(1 / gamma)`; 1 for linear images. The published method takes levels as they are.
        [where undoes_display, "it is one of method \"coloured\" and \"general\""] display_gamma: f64 = 2.2
            => 0.5..=4.0, "an exponent from 0.5 to 4";
        /// The front end.
        [flat] method: CornerMethod = CornerMethod::Coloured(ColouredOptions::default());
    }
}

fn undoes_display(options: &DetectorOptions) -> bool {
    !matches!(options.method, CornerMethod::Paper(_))
}

impl GeneralOptions {
    /// The straight edges of which corners are made.
    pub(crate) fn segments(&self, mask: Option<Mask>) -> SegmentDetectorOptions {
        let everywhere = SegmentDetectorOptions::default();
        let edges = EdgeOptions {
            gradient_min: self.gradient_min,
            smoothing_px: self.smoothing_px,
            margin_px: self.margin_px.max(everywhere.edges.margin_px),
            ..everywhere.edges
        };
        let segments = SegmentOptions {
            gradient_start: self.gradient_start,
            stray_max_px: self.segment_threshold_px,
            support_min_px: (PIECE_SHARE * self.segment_min_px).max(4.0) as u32,
            ..everywhere.segments
        };
        SegmentDetectorOptions { edges, mask, segments }
    }
}

impl DetectorOptions {
    /// The defaults of one of [`CornerMethod::NAMES`].
    ///
    /// # Errors
    /// [`Error::InvalidOption`](crate::Error::InvalidOption) for another name.
    pub fn for_method(name: &str) -> Result<Self> {
        Ok(Self { method: CornerMethod::from_name(name)?, ..Self::default() })
    }
}
