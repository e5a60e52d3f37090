//! Straight lines overhead: of beams, lamps, table tops. Their great circles pass the vertical as near as those of upright edges,
//! and go on over it.

mod circle;

use nalgebra::Vector3;

use self::circle::{Circle, PAIRS, Pair};
use super::confidence::SECTORS;
use super::image_edges::EdgeOrigin;
use super::sharpness::step_min;
use super::tables::{PixelTables, sector};
use super::work::Work;
use crate::image::ImageView;

/// Angles from the vertical of the circles that lines overhead cross twice each: beyond the lean of a line, and where upright edges of
/// rooms end.
const CIRCLES_DEG: [f64; 5] = [40.0, 34.0, 28.0, 22.0, 16.0];

/// Steps that may be missing, of the eight on the other circles.
const MISSED_MAX: usize = 1;

/// Most lines: with more the view is of stripes, or of texture.
const LINES: usize = 8;

/// Cosine of the angle within which the normals of the edge pixels of one line are: four degrees.
const ONE_LINE: f64 = 0.9976;

/// Cosine of the angle within which the normals of the two sides of a line agree, each in the mean: one and a half degrees. Upright
/// edges that face each other do so in 1 of 756 views of panoramas and 4 of 160 of rooms.
const AGREE: f64 = 0.99966;

/// Rows of the two sides that are looked at first, or up to twice as many.
const ROWS: usize = 500;

/// Bands of elevation, and in how many of them a line is seen on each side: it ends above the horizon, and is hidden here and there.
const BANDS: usize = 8;
const BANDS_MIN: usize = 4;

/// Edge pixels of a band for each pixel of the length of a line: where it is seen two and more have a gradient.
const DENSE: f64 = 0.7;

/// Where lines overhead are looked for.
#[derive(Debug)]
pub(super) struct Overhead {
    /// None where the vertical is not in view.
    circles: Vec<Circle>,
    /// The band of elevations in which they are to be seen.
    band_deg: [f64; 2],
}

/// The normals of lines overhead, towards the brighter side.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct OverheadLines([Option<Vector3<f64>>; LINES]);

impl Overhead {
    pub(super) fn new(origin: &EdgeOrigin, pixels_per_rad: f64) -> Self {
        let circles = CIRCLES_DEG.map(|angle| Circle::new(origin, angle.to_radians(), pixels_per_rad));
        let is_seen = circles.iter().all(Circle::is_seen);
        let options = &origin.options;
        let band_deg = [options.elevation_min_rad.max(0.0), options.elevation_max_rad].map(f64::to_degrees);
        let circles = if is_seen && band_deg[0] < band_deg[1] { circles.into() } else { Vec::new() };
        Self { circles, band_deg }
    }

    /// The lines of an image by steps on the circles, which are those of pixels with such a gradient.
    pub(super) fn lines(&self, image: &ImageView<'_>, gradient_min: f64) -> OverheadLines {
        let mut lines = OverheadLines::default();
        let step_min = step_min(gradient_min);
        let Some((largest, others)) = self.circles.split_first() else { return lines };
        let mut pairs = [Pair::default(); PAIRS];
        let mut pairs = largest.pairs(image, step_min, &mut pairs);
        for circle in others {
            if pairs.is_empty() {
                return lines;
            }
            let kept = circle.keep(image, step_min, MISSED_MAX, pairs);
            pairs = &mut pairs[..kept];
        }
        for normal in pairs.iter().map(Pair::normal) {
            if lines.iter().all(|other| other.dot(&normal) < ONE_LINE) {
                let Some(line) = lines.0.iter_mut().find(|line| line.is_none()) else {
                    return OverheadLines::default();
                };
                *line = Some(normal);
            }
        }
        lines
    }

    /// Leaves out the rows of the lines that are seen on both sides of the vertical.
    pub(super) fn leave_out(&self, lines: &OverheadLines, pixels: &PixelTables, work: &mut Work) {
        for line in lines.iter() {
            if let Some(normal) = normal_of_both_sides(line, pixels, work)
                && self.is_seen_on_both_sides(&normal, pixels, work)
            {
                work.keep(|row, _, _| row.dot(&normal) < ONE_LINE);
            }
        }
    }

    /// Whether the rows of a line are seen in enough of the band, on both sides of the vertical.
    fn is_seen_on_both_sides(&self, normal: &Vector3<f64>, pixels: &PixelTables, work: &Work) -> bool {
        let [low, high] = self.band_deg;
        let (mut counts, side) = ([[0u32; BANDS]; 2], side_of(normal, pixels));
        for (_, slot) in work.rows.iter().zip(&work.slots).filter(|(row, _)| row.dot(normal) >= ONE_LINE) {
            let height = f64::from(pixels.heights_deg.get(*slot as usize).copied().unwrap_or(0));
            let band = BANDS as f64 * (height - low) / (high - low);
            if band >= 0.0 {
                counts[side(*slot)][(band as usize).min(BANDS - 1)] += 1;
            }
        }
        let least = DENSE * (high - low).to_radians() / BANDS as f64 * pixels.region.pixels_per_rad();
        counts.iter().all(|bands| bands.iter().filter(|count| f64::from(**count) >= least).count() >= BANDS_MIN)
    }
}

impl OverheadLines {
    /// Those with such normals, unless they are of another length than one, or too many.
    pub(super) fn of(normals: &[Vector3<f64>]) -> Option<Self> {
        let are_unit = normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-6);
        let mut lines = Self::default();
        lines.0.iter_mut().zip(normals).for_each(|(line, normal)| *line = Some(*normal));
        (are_unit && normals.len() <= LINES).then_some(lines)
    }

    /// Their normals. Allocates.
    pub(super) fn normals(&self) -> Vec<Vector3<f64>> {
        self.iter().copied().collect()
    }

    fn iter(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.0.iter().flatten()
    }
}

/// The normal of the rows of a line, if those of both sides of the vertical agree.
fn normal_of_both_sides(line: &Vector3<f64>, pixels: &PixelTables, work: &Work) -> Option<Vector3<f64>> {
    let stride = (work.rows.len() / ROWS).max(1);
    let mut normal = *line;
    let mut agreement = 0.0;
    for _ in 0..2 {
        let (mut sums, side) = ([Vector3::zeros(); 2], side_of(&normal, pixels));
        for row in (0..work.rows.len()).step_by(stride) {
            if let Some(own) = work.rows.get(row).filter(|own| own.dot(&normal) >= ONE_LINE) {
                sums[side(work.slots[row])] += own;
            }
        }
        let [left, right] = [sums[0].try_normalize(0.0)?, sums[1].try_normalize(0.0)?];
        agreement = left.dot(&right);
        // Both sides count alike.
        normal = (left + right).normalize();
    }
    (agreement >= AGREE).then_some(normal)
}

/// To which side of the normal of a line a pixel is seen.
fn side_of<'a>(normal: &Vector3<f64>, pixels: &'a PixelTables) -> impl Fn(u32) -> usize + use<'a> {
    let own = usize::from(sector(normal.x, normal.y));
    move |slot| {
        let seen = usize::from(pixels.sectors.get(slot as usize).copied().unwrap_or(0));
        usize::from((seen + SECTORS - own) % SECTORS >= SECTORS / 2)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::f64::consts::TAU;

    use nalgebra::{Matrix3, Vector2};

    use super::*;
    use crate::camera::{Camera, Equidistant};
    use crate::tilt::{TiltEstimate, TiltEstimator, TiltOptions};

    /// Twelve upright edges of a robot that leans by three degrees, and a border overhead between the levels, if there is one.
    fn image(lean: f64, border: Option<Vector3<f64>>) -> Vec<u8> {
        let camera = camera();
        let up = Vector3::new(-lean.sin(), 0.0, lean.cos());
        let [east, north] = [Vector3::y().cross(&up).normalize(), Vector3::y()];
        let level = |u: f64, v: f64| {
            let bearing = camera.unproject(&Vector2::new(u, v)).unwrap_or_default();
            let stripe = 6.0 / TAU * bearing.dot(&north).atan2(bearing.dot(&east)) + 0.3;
            let is_dark = bearing.dot(&up) < 0.8 && stripe.rem_euclid(1.0) < 0.5;
            if border.is_some_and(|normal| normal.dot(&bearing) < 0.0) {
                20.0
            } else if is_dark {
                90.0
            } else {
                150.0
            }
        };
        let parts = || (0..16).map(|k| (0.25 * f64::from(k / 4) - 0.375, 0.25 * f64::from(k % 4) - 0.375));
        let mean = |k: usize| {
            let [u, v] = [k % 320, k / 320].map(|x| x as f64);
            (parts().map(|(right, down)| level(u + right, v + down)).sum::<f64>() / 16.0).round() as u8
        };
        (0..320 * 240).map(mean).collect()
    }

    fn camera() -> Camera {
        Camera::new(320, 240, Equidistant::new(70.0, 159.5, 119.5).unwrap().into()).unwrap()
    }

    /// The border through a point six degrees from the vertical of the camera.
    fn border() -> Vector3<f64> {
        Vector3::new(0.4, 0.9, 0.1).normalize()
    }

    /// The lines overhead, the estimate, and that of the edges.
    fn seen(image: &[u8]) -> (Vec<Vector3<f64>>, [TiltEstimate; 2]) {
        let options = TiltOptions::for_method("refined").unwrap();
        let estimator = TiltEstimator::new(camera(), Matrix3::identity(), options).unwrap();
        let mut scratch = estimator.scratch();
        let image = ImageView::new(image, 320, 240, 320).unwrap();
        let edges = estimator.detect(&image, &mut scratch).unwrap();
        let of_edges = estimator.estimate_edges(&edges, &mut scratch).unwrap();
        (edges.overhead(), [estimator.estimate(&image, &mut scratch).unwrap(), of_edges])
    }

    #[test]
    fn a_border_overhead_is_left_out_and_upright_edges_are_not() {
        let lean = 3f64.to_radians();
        let (none, [alone, _]) = seen(&image(lean, None));
        assert!(none.is_empty());
        let (found, [beneath, of_edges]) = seen(&image(lean, Some(border())));
        assert!(found.iter().any(|normal| normal.angle(&border()) < 2f64.to_radians()), "{found:?}");
        let up = Vector3::new(-lean.sin(), 0.0, lean.cos());
        let [alone, beneath] = [alone, beneath].map(|own| (own.tilt.unwrap().normal().angle(&up).to_degrees(), own));
        assert!(alone.0 < 0.3 && beneath.0 < 0.5, "{} {}", alone.0, beneath.0);
        assert_eq!(beneath.1, of_edges);
    }

    #[test]
    fn edges_take_unit_normals_alone() {
        assert_eq!(OverheadLines::of(&[border()]).unwrap().normals(), [border()]);
        assert!(OverheadLines::of(&[2.0 * border()]).is_none());
        assert!(OverheadLines::of(&[Vector3::repeat(f64::NAN)]).is_none());
        assert!(OverheadLines::of(&[border(); LINES + 1]).is_none());
    }
}
