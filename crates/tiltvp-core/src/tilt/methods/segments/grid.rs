//! What is done where edges that agree are steps of the pixel grid: borders, what is burnt in, blocks of compression, broken columns.

use super::work::SegmentWork;
use crate::edges::is_grid_step;
use crate::geometry::tangent_basis;
use crate::image::ImageView;
use crate::segments::{EdgePoint, Segment, Segments};
use crate::tilt::estimate::TiltEstimate;
use crate::tilt::on_grid::{doubt, is_apart, is_as_sure};

/// Share of the pixels that agree from which on the others are asked: of views that are not harmed one in a hundred has as much.
const SHARE_MIN: f64 = 0.25;

/// About how many points of a segment are looked at.
const POINTS: usize = 5;

/// By how much in pixels what is along the grid strays from a column or a row at most: noise moves points by half of that.
const ALONG_PX: f32 = 1.0;

/// By how many standard deviations of theirs other edges tell another vertical.
const APART_SIGMAS: f64 = 3.0;

/// Share of what agrees from which on it is most of it.
const MOST: f64 = 0.5;

/// So much of what agrees is steps of the pixel grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnGrid {
    share: f64,
}

impl OnGrid {
    /// Of the last fit, if it is much.
    pub(super) fn of(image: &ImageView<'_>, work: &SegmentWork) -> Option<Self> {
        let SegmentWork { segments, weighed, .. } = work;
        let (mut all, mut steps) = (0, 0);
        for (i, _) in weighed.iter().filter(|(_, share)| *share > 0.5) {
            let segment = &segments.list[*i as usize];
            all += segment.support();
            steps += if share_of_steps(image, segments, segment) > 0.5 { segment.support() } else { 0 };
        }
        let share = steps as f64 / f64::max(all as f64, 1.0);
        (share >= SHARE_MIN).then_some(Self { share })
    }

    /// Doubts an estimate that the other edges contradict, or of which most is steps and the others tell nothing. Where steps are a part
    /// of the edges alone, the rest may agree and not be sure.
    pub(super) fn doubt(self, told: &mut TiltEstimate, others: &TiltEstimate) {
        let tells = others.tilt.is_some() && others.covariance_rad2[(0, 0)].is_finite();
        if contradicts(others, told) || !tells && self.share >= MOST {
            doubt(told, self.share);
        }
    }
}

/// Whether the other edges tell another vertical, and about as surely: of what is drawn without blur or noise by an upright camera
/// they are what is left.
pub(super) fn outdone(told: &TiltEstimate, others: &TiltEstimate) -> bool {
    is_as_sure(others, told) && contradicts(others, told)
}

/// Some points of a segment.
fn looked_at<'a>(segments: &'a Segments, segment: &Segment) -> impl Iterator<Item = &'a EdgePoint> + Clone + use<'a> {
    let points = segments.points_of(segment);
    let step = (points.len() / POINTS).max(1);
    points.iter().skip(step / 2).step_by(step)
}

/// Share of these that are steps.
fn share_of_steps(image: &ImageView<'_>, segments: &Segments, segment: &Segment) -> f64 {
    let (mut all, mut steps) = (0usize, 0usize);
    for point in looked_at(segments, segment) {
        all += 1;
        steps += usize::from(is_grid_step(image, point.pixel.map(|x| x.round() as usize), point.gradient));
    }
    steps as f64 / all.max(1) as f64
}

/// Whether a segment stays in a column or a row.
fn is_along_grid(segments: &Segments, segment: &Segment) -> bool {
    let points = looked_at(segments, segment);
    let range = |axis: usize| {
        let places = points.clone().map(|point| point.pixel[axis]);
        places.clone().fold(f32::NEG_INFINITY, f32::max) - places.fold(f32::INFINITY, f32::min)
    };
    range(0).min(range(1)) < ALONG_PX
}

/// Leaves edges without weight any point of which is a step of the pixel grid, for noise hides others, and those that are along it:
/// columns with offsets of their own are not steps all.
pub(super) fn leave_out(image: &ImageView<'_>, work: &mut SegmentWork) {
    let SegmentWork { segments, edges, .. } = work;
    for (edge, segment) in edges.iter_mut().zip(&segments.list) {
        if is_along_grid(segments, segment) || share_of_steps(image, segments, segment) > 0.0 {
            edge.weight = 0.0;
        }
    }
}

/// Whether the others tell another vertical, by more than they may err.
fn contradicts(others: &TiltEstimate, told: &TiltEstimate) -> bool {
    let (Some(others_tilt), Some(tilt)) = (others.tilt, told.tilt) else { return false };
    let away = tangent_basis(&others_tilt.normal()).transpose() * tilt.normal();
    let squares = others.covariance_rad2.try_inverse().map_or(0.0, |inverse| away.dot(&(inverse * away)));
    let is_opposite = others_tilt.normal().dot(&tilt.normal()) < 0.0;
    is_apart(others, told) && (is_opposite || squares > APART_SIGMAS * APART_SIGMAS)
}
