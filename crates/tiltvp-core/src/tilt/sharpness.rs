//! How wide the steps of an image are: of a blurred one edges run into each other and draw a fit aside.

use tiltvp_kernels::vectorised;

use super::correction::VanishingPoint;
use crate::edges::Region;
use crate::image::ImageView;

/// Rows that are looked at, or up to twice as many: most views have hundreds of steps on them.
const ROWS: usize = 24;

/// Pixels for each radian of the views of panoramas by which the constants are set: elsewhere steps are as wide in angle.
const PIXELS_PER_RAD: f64 = 140.0;

/// How many times as far apart the far levels are as the near ones.
const FAR: usize = 8;

/// How many times as steep steps are along the row as across it.
const STEEP: i16 = 2;

/// Fewest pixels on steps that tell.
const LEAST: i64 = 20;

/// Far differences over near ones up to which nothing is blurred: of views of panoramas as they are one in eleven has more, one in
/// fifty 2.5; blurred by 1, 2, 3, 4 and 6 pixels half have more than 1.8, 3.0, 4.1, 4.8 and 5.5.
const SHARP: f64 = 1.75;

/// Standard deviation in radians, a side, by which a fit errs, over the square of the ratio beyond that: set on these views, of which
/// `refined` errs by 0.6, 0.8, 1.2, 2.0 and 4.2 degrees in the mean.
const ERROR_RAD: f64 = 0.15f64.to_radians();

/// A difference of levels two pixels apart has this gradient, by the Scharr kernel.
const SCHARR: f64 = 16.0;

/// Where steps are looked at: across what is upright there, for a camera that turns blurs nothing else.
#[derive(Debug)]
pub(super) struct Sharpness {
    runs: Vec<Run>,
    /// Pixels to each side of the near levels, and of the far ones.
    near: usize,
    far: usize,
    /// Standard deviation in radians over the squared ratio.
    error_rad: f64,
}

/// Pixels `first..end` of row `v`.
#[derive(Debug, Clone, Copy)]
struct Run {
    v: usize,
    first: usize,
    end: usize,
    /// Whether what is upright crosses the row, and not the columns.
    along_row: bool,
}

impl Sharpness {
    pub(super) fn new(region: &Region, vertical: Option<&VanishingPoint>) -> Self {
        let [width, height] = region.image_size();
        let scale = region.pixels_per_rad() / PIXELS_PER_RAD;
        let near = (scale.round() as usize).max(1);
        let far = FAR * near;
        let mut rows: Vec<usize> = region.spans().iter().map(|span| span.v).collect();
        rows.dedup();
        let chosen: Vec<usize> = rows.iter().copied().step_by((rows.len() / ROWS).max(1)).collect();
        let is_chosen = |v: usize| v >= far && v + far < height && chosen.binary_search(&v).is_ok();
        let mut runs = Vec::new();
        for span in region.spans().iter().filter(|span| is_chosen(span.v)) {
            let (first, end) = (span.first.max(far), span.end.min(width.saturating_sub(far)));
            // Above and below the point where the vertical is seen what is upright crosses rows.
            let [left, right] = vertical.map_or([first, end], |at| {
                let reach = (at.pixel.y - span.v as f64).abs();
                [at.pixel.x - reach, at.pixel.x + reach].map(|u| (u as usize).clamp(first.min(end), end))
            });
            let parts = [(first, left, false), (left, right, true), (right, end, false)];
            let parts = parts.into_iter().filter(|(first, end, _)| first < end);
            runs.extend(parts.map(|(first, end, along_row)| Run { v: span.v, first, end, along_row }));
        }
        Self { runs, near, far, error_rad: ERROR_RAD * near as f64 / scale }
    }

    /// Standard deviation in radians, a side, of the tilt for the width of the steps of an image, which are those of pixels with
    /// such a gradient; 0 if they are sharp, or few.
    pub(super) fn error_rad(&self, image: &ImageView<'_>, gradient_min: f64) -> f64 {
        let step_min = step_min(gradient_min);
        // What moves along a row blurs the edges that cross rows alone.
        let beyond = [true, false].map(|along_row| self.beyond(image, along_row, step_min));
        self.error_rad * f64::max(beyond[0], beyond[1]).powi(2)
    }

    /// By how much the ratio of differences is beyond that of sharp steps, of edges that cross rows or columns.
    fn beyond(&self, image: &ImageView<'_>, along_row: bool, step_min: i16) -> f64 {
        let mut sums = [0i64; 3];
        for run in self.runs.iter().filter(|run| run.along_row == along_row) {
            sums.iter_mut().zip(self.of_run(image, run, step_min)).for_each(|(sum, own)| *sum += i64::from(own));
        }
        let [near, far, steps] = sums;
        if steps < LEAST { 0.0 } else { (far as f64 / near as f64 - SHARP).max(0.0) }
    }

    /// The [`sums`] of a run.
    fn of_run(&self, image: &ImageView<'_>, &Run { v, first, end, along_row }: &Run, step_min: i16) -> [i32; 3] {
        let in_row = |by: usize| [&image.row(v)[first - by..end - by], &image.row(v)[first + by..end + by]];
        let in_columns = |by: usize| [&image.row(v - by)[first..end], &image.row(v + by)[first..end]];
        let (near, far) = (self.near, self.far);
        if along_row {
            sums(&in_row(near), &in_columns(near), &in_row(far), step_min)
        } else {
            sums(&in_columns(near), &in_row(near), &in_columns(far), step_min)
        }
    }
}

/// The difference of levels two pixels apart of an edge with such a gradient.
pub(super) fn step_min(gradient_min: f64) -> i16 {
    (gradient_min / SCHARR).clamp(1.0, 255.0) as i16
}

vectorised! {
    /// Sums of the near and the far differences over the steps of a run, uphill, and how many pixels of it are on steps.
    fn sums(along: &[&[u8]; 2], across: &[&[u8]; 2], farther: &[&[u8]; 2], step_min: i16) -> [i32; 3] {
        let [along, across, farther] = [along, across, farther].map(|[a, b]| {
            // Of bytes: no difference overflows.
            a.iter().zip(*b).map(|(a, b)| i16::from(*b).wrapping_sub(i16::from(*a)))
        });
        let mut sums = [0i32; 3];
        for ((along, across), farther) in along.zip(across).zip(farther) {
            let (near, sign) = (along.wrapping_abs(), along >> 15);
            let is_step = (near >= step_min) & (near >= across.wrapping_abs().wrapping_mul(STEEP));
            // All bits of a step, and the sign's: what has to be kept, and what has to be turned.
            let step = i16::from(is_step).wrapping_neg();
            let own = [near & step, (farther ^ sign).wrapping_sub(sign) & step, step & 1];
            for (sum, own) in sums.iter_mut().zip(own) {
                *sum = sum.wrapping_add(i32::from(own));
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use nalgebra::Matrix3;

    use super::*;
    use crate::camera::{Camera, Model, Parameter};
    use crate::edges::EdgeOptions;

    /// Of a camera that looks up, with stripes that go over into each other within so many pixels.
    fn of(size: u32, width_px: f64) -> f64 {
        let side = f64::from(size);
        let numbers = [("focal_px", 140.0 * side / 480.0), ("cx", 0.5 * side), ("cy", 0.5 * side)];
        let numbers: Vec<_> = numbers.iter().map(|(name, x)| ((*name).to_owned(), Parameter::Scalar(*x))).collect();
        let model = Model::from_parameters("equidistant", size, size, &numbers).unwrap();
        let camera = Camera::new(size, size, model).unwrap();
        let region = Region::new(&camera, &Matrix3::identity(), &EdgeOptions::default(), None).unwrap();
        let stripe = side / 12.0;
        let level = |u: f64| {
            let off = (u / stripe - (u / stripe).round()) * stripe / width_px;
            let up = (u / stripe).round() as i64 % 2 == 0;
            let share = (0.5 + off).clamp(0.0, 1.0);
            60.0 + 80.0 * if up { share } else { 1.0 - share }
        };
        let image: Vec<u8> = (0..size * size).map(|i| level(f64::from(i % size)) as u8).collect();
        let size = size as usize;
        let image = ImageView::new(&image, size, size, size).unwrap();
        Sharpness::new(&region, None).error_rad(&image, 150.0).to_degrees()
    }

    #[test]
    fn a_fit_errs_by_the_width_of_steps_in_angle() {
        assert_eq!(of(480, 1.0), 0.0);
        assert!(of(480, 3.0) < 0.2);
        let [wide, wider] = [of(480, 8.0), of(480, 14.0)];
        assert!((0.5..2.0).contains(&wide) && wider > 2.0 * wide, "{wide} {wider}");
        assert_eq!(of(960, 3.0), 0.0);
        let large = of(960, 16.0);
        assert!((0.7 * wide..1.4 * wide).contains(&large), "{large}");
    }
}
