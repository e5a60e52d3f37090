//! The method of straight edges: the vertical by the odds that each segment of the image passes through it, fused with the vote of
//! the edge pixels.

mod any_hypothesis;
mod any_lightness;
mod anywhere;
mod aspect;
mod choice;
mod choice_weights;
mod near;
mod options;
pub(in crate::tilt) mod work;

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3};

use self::any_hypothesis::{Edge, Prior};
use self::any_lightness::Sample;
use self::aspect::Aspect;
use self::near::Near;
use self::options::FLOOR_RAD;
pub use self::options::SegmentsOptions;
use self::work::SegmentWork;
use super::method::{Fitter, ImageFitter, Prepared, Setting, TiltMethod};
use super::offsets::edge_offset;
use super::refined::{RefineOptions, Refined, TILT_MAX_RAD};
use crate::edges::{EdgeOptions, EdgePixels, RidgePixels};
use crate::error::{Error, Result};
use crate::geometry::{Tilt, tangent_basis};
use crate::image::ImageView;
use crate::parallel;
use crate::robust::Stop;
use crate::segments::{SegmentDetectorOptions, SegmentFinder};
use crate::tilt::estimate::{ALTERNATIVES, Alternative, EdgeElement, TiltEstimate};
use crate::tilt::fit::Fit;
use crate::tilt::image_circle::CentreOff;
use crate::tilt::lightness::LIGHTS;
use crate::tilt::scratch::Scratch;
use crate::tilt::tables::PixelTables;
use crate::tilt::trust::{ASPECT, Logit, Seen, Trust};
use crate::tilt::work::Work;

/// The largest lean up to which edges near the vertical are looked at alone. Beyond it those of horizontal things may be as near,
/// and frames of three directions are weighed.
const NEAR_MAX_RAD: f64 = 20f64.to_radians();

/// Least probability of being the right one of all alternatives, below which there is no answer.
const PROBABILITY_MIN: f64 = 0.5;

/// Standard deviation in radians, a side, by which the vote of the pixels errs beside what its covariance tells, by normals that
/// are told by the gradients of single pixels: set on the same locations.
const PIXELS_RAD: f64 = 0.7f64.to_radians();

/// By how much the variance of a frame exceeds what its edges tell as if each erred on its own: with it, 86 % of the errors below
/// five degrees are within the 90 % regions in 648 views of panoramas, on which it was set.
const ANYWHERE_GROWTH: f64 = 4.0;

/// How a fit tells whether it is of the vertical: `tiltvp measure trust --weights` prints it.
static TRUST: Trust = Trust {
    vertical: Logit { constant: 6.076, weights: [-1.849, -0.2967, 2.518, 1.689, 0.2796, 0.7166, 0.4877, -0.8669] },
    up: Logit {
        constant: 12.05,
        weights: [
            2.759, 0.4759, 0.1891, 0.01332, -1.238, -2.325, -2.188, -1.85, -0.8353, -4.988, 1.995, -0.7897, -0.7128,
            1.461, -0.2784, -1.52, -0.3289, 0.4191, -1.169, -0.2596, 1.512, -3.021, -7.596, -0.475, 2.213, 0.9599,
            -6.372,
        ],
    },
};

impl TiltMethod for SegmentsOptions {
    fn edges(&self) -> EdgeOptions {
        SegmentDetectorOptions::default().edges
    }

    fn tilt_limit_rad(&self) -> f64 {
        PI
    }

    fn prepare(&self, setting: &Setting<'_>) -> Result<Prepared> {
        let Setting { origin, pixels, .. } = *setting;
        if origin.row_stride != 1 {
            return Err(Error::option(
                "row_stride",
                origin.row_stride,
                "1: straight edges are followed from row to row",
            ));
        }
        SegmentFinder::check_margin(&origin.options)?;
        let finder = SegmentFinder::new(&origin.camera, &pixels.region, self.segments);
        let refined = RefineOptions::default();
        let usual = refined.edges();
        let heights = usual.elevation_min_rad.sin()..=usual.elevation_max_rad.sin();
        let in_band = |slot| heights.contains(&pixels.region.bearing(slot).z);
        let in_band = parallel::table(pixels.region.len(), in_band);
        let tilt_max_rad = setting.tilt_max_rad.unwrap_or(TILT_MAX_RAD);
        Ok(Prepared::Segments(Arc::new(SegmentFit {
            finder,
            edges: origin.options,
            robot_from_camera: origin.robot_from_camera,
            tilt_max_rad,
            near: Near::new(&origin.robot_from_camera, tilt_max_rad, *self),
            aspect: Aspect::new(&origin.robot_from_camera),
            pixels: Refined::new(setting, refined),
            strong: usual,
            in_band,
            sample: if tilt_max_rad > NEAR_MAX_RAD { Sample::new(&pixels.region) } else { Sample::default() },
        })))
    }
}

/// The method ready for images.
#[derive(Debug)]
struct SegmentFit {
    finder: SegmentFinder,
    edges: EdgeOptions,
    robot_from_camera: Matrix3<f64>,
    tilt_max_rad: f64,
    near: Near,
    aspect: Aspect,
    /// The method of the pixels, and which of them vote.
    pixels: Refined,
    strong: EdgeOptions,
    /// Whether each pixel of the region is in the band of elevations of those that vote.
    in_band: Vec<bool>,
    /// Pixels whose levels tell what is up: none where the lean is small.
    sample: Sample,
}

/// Determinant of a covariance in shares of its squared trace, about the ratio of its variances, below which rounding of a gain is seen
/// in what is left: its square times that of a float is then above 1e-4.
const NEARLY_SINGULAR: f64 = 1e-6;

/// The fit to the segments with the vote of the pixels, by information. Where they differ by more than they may, the covariance
/// grows with the square of it (Birge 1932). The vote alone where the segments tell nothing.
fn fused(fit: &Fit, vote: &Fit) -> Fit {
    let (Some(tilt), Some(covariance)) = (fit.tilt, fit.covariance) else {
        return if vote.covariance.is_some() { Fit { inliers: fit.inliers, ..*vote } } else { *fit };
    };
    let (Some(other), Some(other_covariance)) = (vote.tilt, vote.covariance) else { return *fit };
    let basis = tangent_basis(&tilt.normal());
    let away = basis.transpose() * other.normal();
    let theirs = other_covariance + Matrix2::identity() * (PIXELS_RAD * PIXELS_RAD);
    let Some(inverse) = (covariance + theirs).try_inverse() else { return *fit };
    let gain = covariance * inverse;
    let normal = tilt.normal() + basis * (gain * away);
    // Its expectation is one.
    let disagreement = 0.5 * away.dot(&(inverse * away));
    let keep = Matrix2::identity() - gain;
    let together = if covariance.determinant() > NEARLY_SINGULAR * covariance.trace().powi(2) {
        keep * covariance * disagreement.max(1.0)
    } else {
        // Joseph's form, which leaves a covariance whatever rounding has done to the gain.
        (keep * covariance * keep.transpose() + gain * theirs * gain.transpose()) * disagreement.max(1.0)
    };
    let symmetric = 0.5 * (together + together.transpose());
    Fit { tilt: Tilt::from_normal(&normal), covariance: Some(symmetric), ..*fit }
}

impl ImageFitter for SegmentFit {
    fn estimate(
        &self,
        image: &ImageView<'_>,
        tables: &PixelTables,
        centre_off: Option<CentreOff<'_>>,
        scratch: &mut Scratch,
    ) -> TiltEstimate {
        let region = &tables.region;
        let Scratch { work: pixel_work, segments, .. } = scratch;
        let work = segments.get_or_insert_with(|| Box::new(SegmentWork::new(self.finder.scratch(region, &self.edges))));
        self.finder.find(image, region, self.edges.gradient_min, None, &mut work.finder, &mut work.segments);
        let fit = if self.tilt_max_rad > NEAR_MAX_RAD {
            self.fit_anywhere(image, work)
        } else {
            let fit = self.near.fit(&work.segments, &mut work.weighed, &mut work.near);
            fused(&fit, &self.vote(&work.finder.ridge, tables, &mut work.strong, pixel_work))
        };
        let considered = work.weighed.iter().map(|(i, _)| work.segments.list[*i as usize].support()).sum();
        let trust = (self.tilt_max_rad <= NEAR_MAX_RAD).then_some(&TRUST);
        let lights = trust.map_or([0.0; LIGHTS], |_| tables.lightness.of(image));
        let up = fit.tilt.filter(|_| trust.is_some()).map(|tilt| tilt.normal());
        let seen = Seen {
            lights: &lights,
            aspect: up.map_or([0.0; ASPECT], |up| self.aspect.of(&work.segments, &up, &mut work.aspect)),
            edge_pixels: work.segments.points.len(),
            prefiltered_pixels: considered,
            pixels_per_rad: region.pixels_per_rad(),
            tilt_max_rad: self.tilt_max_rad,
            trust,
            centre_off,
        };
        fit.into_estimate(&seen, &mut pixel_work.trusted)
    }

    fn elements(&self, centre: (f32, f32), scratch: &Scratch) -> Vec<EdgeElement> {
        let Some(work) = scratch.segments.as_deref() else { return Vec::new() };
        let SegmentWork { segments, weighed, .. } = work;
        let mut vertical = vec![None; segments.list.len()];
        for (i, share) in weighed {
            vertical[*i as usize] = Some(*share > 0.5);
        }
        let of_segment = |(segment, vertical): (&crate::segments::Segment, Option<bool>)| {
            let normal = (self.robot_from_camera * segment.normal).cast::<f32>().into();
            let points = segments.points_of(segment).iter();
            let elements = points.map(move |point| {
                let (u, v) = (point.pixel[0].round(), point.pixel[1].round());
                let [cos, sin, offset] = edge_offset(u - centre.0, v - centre.1, point.gradient[0], point.gradient[1]);
                EdgeElement {
                    u: u as u16,
                    v: v as u16,
                    phi_rad: f64::from(sin).atan2(f64::from(cos)),
                    offset_px: f64::from(offset),
                    normal,
                    prefiltered: vertical.is_some(),
                    inlier: vertical == Some(true),
                }
            });
            elements.collect::<Vec<_>>()
        };
        segments.list.iter().zip(vertical).flat_map(of_segment).collect()
    }
}

impl SegmentFit {
    /// The most probable of the directions that may be up, unless none is more probable than all others together.
    fn fit_anywhere(&self, image: &ImageView<'_>, work: &mut SegmentWork) -> Fit {
        let SegmentWork { segments, weighed, search, levels, .. } = work;
        let turn = &self.robot_from_camera;
        search
            .take(segments.list.iter().map(|s| Edge::new(turn, &s.normal, &s.middle, s.variances_rad2, s.length_rad)));
        let lightness = self.sample.lightness(image, levels);
        search.run(&Prior { reach_rad: self.tilt_max_rad, robot_from_camera: *turn }, &lightness);
        weighed.clear();
        let Some(best) = search.hypotheses.first() else {
            return Fit::failed(Stop::TooFew { have: search.edges.len(), need: 3 });
        };
        let shares = search.edges.iter().map(|edge| best.shares(edge)[2]);
        weighed.extend(shares.enumerate().map(|(i, share)| (i as u32, share)));
        let mut alternatives = [None; ALTERNATIVES];
        for (slot, hypothesis) in alternatives.iter_mut().zip(&search.hypotheses) {
            *slot = Some(Alternative { normal: hypothesis.up, probability: hypothesis.probability });
        }
        let (probability, limit) = (best.probability, PROBABILITY_MIN);
        if probability < limit {
            for (_, share) in weighed.iter_mut() {
                *share = 0.0;
            }
            let stop = Stop::Ambiguous { probability, limit, of: search.hypotheses.len() };
            return Fit { alternatives, ..Fit::failed(stop) };
        }
        let vertical = || search.edges.iter().zip(weighed.iter()).filter(|(_, (_, share))| *share > 0.5);
        let (mut squares, mut count) = (0.0, 0.0);
        for (edge, _) in vertical() {
            squares += edge.normal.dot(&best.up).powi(2);
            count += 1.0;
        }
        let floor = Matrix2::identity() * (FLOOR_RAD * FLOOR_RAD);
        Fit {
            tilt: Tilt::from_normal(&best.up),
            covariance: best.covariance().map(|covariance| covariance * ANYWHERE_GROWTH + floor),
            inliers: vertical().map(|(_, (i, _))| segments.list[*i as usize].support()).sum(),
            rms: (squares / count).sqrt(),
            iterations: search.hypotheses.len() as u32,
            alternatives,
            ..Fit::failed(Stop::Chosen { probability, of: search.hypotheses.len() })
        }
    }

    /// What the strong ridge pixels near the horizon say by their gradients.
    fn vote(&self, ridge: &RidgePixels, tables: &PixelTables, strong: &mut EdgePixels, work: &mut Work) -> Fit {
        let least = (self.strong.gradient_min * self.strong.gradient_min) as f32;
        strong.refill_where(&ridge.edges, |slot, gx, gy| (gx * gx + gy * gy >= least) & self.in_band[slot as usize]);
        self.pixels.fit(strong, tables, work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tilt::confidence::inverse_of_positive;

    /// A fit of one wall's edges, which says next to nothing about the lean along it, and the pixels' vote: of variances as far apart
    /// as those of a fit can be.
    #[test]
    fn a_fit_that_tells_one_direction_alone_takes_the_other_from_the_vote() {
        let fit = |covariance| Fit {
            tilt: Some(Tilt::from_alpha_beta(0.1, 0.3)),
            covariance: Some(covariance),
            ..Fit::failed(Stop::TooFew { have: 0, need: 1 })
        };
        let (strong, vote) = (1e-5, 1e-4);
        let together = |own: f64| {
            let theirs = vote + PIXELS_RAD * PIXELS_RAD;
            own * theirs / (own + theirs)
        };
        for (turn, weak) in
            [0.0, 0.3, 0.8, 2.0].into_iter().flat_map(|turn| [1e-2, 10.0, 1e4, 1e6].map(|weak| (turn, weak)))
        {
            let axes = *nalgebra::Rotation2::new(turn).matrix();
            let of = |a, b| axes * Matrix2::new(a, 0.0, 0.0, b) * axes.transpose();
            let found = fused(&fit(of(weak, strong)), &fit(Matrix2::identity() * vote)).covariance.unwrap();
            let expected = of(together(weak), together(strong));
            assert!((found - expected).amax() < 0.05 * expected.amax(), "{weak} {turn}: {found} {expected}");
            assert!(inverse_of_positive(&found).is_some(), "{weak} {turn}: {found}");
        }
    }
}
