//! Corners of which two edges were found as segments and the third is known from an attitude.

use nalgebra::{Matrix3, Vector3};

use super::junctions::{RayEnd, are_clockwise, meeting};
use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::general::{AXIS_SINE, CLEAR_OF_END_PX, CLEAR_OF_VERTEX_PX, GeneralScratch, gray_search};
use crate::corner::options::GeneralOptions;
use crate::corner::ray::FittedRay;
use crate::corner::trace::{RaySearch, TraceScratch, TracedRay, trace_every};
use crate::image::{ImageView, LightTable};
use crate::segments::Segment;

/// Most crossings that are followed up, those of the longest segments, which bounds the time.
const CROSSINGS_MAX: usize = 60;

/// Least length along which a third edge is looked for, in pixels: more than the shortest segment, as nothing but the
/// attitude speaks for it.
const THIRD_MIN_PX: f64 = 30.0;

/// Length along which a third edge is looked for, as a share of the shorter segment: not all of it, as boxes are no
/// cubes.
const THIRD_SHARE: f64 = 0.8;

/// How long a third edge is where it ends early, as a table top's: less than a segment, so nearly all of it has to be
/// seen.
const SHORT_PX: f64 = 16.0;

/// Least share of a short third edge that is seen: 13 of its 16 pixels.
const SHORT_SHARE: f64 = 0.8;

/// How far apart the places of the first look are, in pixels: beyond the reach of one profile, so that they are
/// independent.
const GLIMPSE_PX: f64 = 3.0;

/// Share of [`GeneralOptions::support_min_share`] that the first look asks for: with a third of the places the share
/// scatters more.
const GLIMPSE_SHARE: f64 = 0.8;

/// A crossing of two segments along two of the axes.
pub(super) struct AxisCrossing {
    ends: [RayEnd; 2],
    axes: [usize; 2],
    pub(super) place: Vector3<f64>,
    shorter_px: f64,
}

impl AxisCrossing {
    /// The axis along which neither of the two runs.
    pub(super) fn third(&self) -> usize {
        3 - self.axes[0] - self.axes[1]
    }
}

/// What a third edge is looked for with.
pub(crate) struct CornerCompletion<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) image: &'a ImageView<'a>,
    pub(crate) options: &'a GeneralOptions,
    pub(crate) light: &'a LightTable,
    /// The axes along which the edges run, at right angles.
    pub(crate) camera_from_object: &'a Matrix3<f64>,
}

impl CornerCompletion<'_> {
    /// Adds the corners of an image to `out`. Two edges of each are segments of the image that was looked at last, the third
    /// is followed from where these cross.
    pub(crate) fn run(&self, scratch: &mut GeneralScratch, out: &mut Vec<CornerFeature>) {
        let GeneralScratch { segments, trace: memory, .. } = scratch;
        for crossing in &self.crossings(&segments.list) {
            let Some(px_per_rad) = self.camera.px_per_rad(&crossing.place) else { continue };
            self.complete(crossing, px_per_rad, &segments.list, memory, out);
        }
    }

    /// Where two segments along different axes cross, those of the longest segments first.
    pub(super) fn crossings(&self, segments: &[Segment]) -> Vec<AxisCrossing> {
        let axis_of = |normal: &Vector3<f64>| {
            let sines = self.camera_from_object.tr_mul(normal).abs();
            Some(sines.imin()).filter(|axis| sines[*axis] < AXIS_SINE)
        };
        let along: Vec<(usize, usize)> = segments
            .iter()
            .enumerate()
            .filter_map(|(place, segment)| axis_of(&segment.normal).map(|axis| (place, axis)))
            .collect();
        let mut crossings = Vec::new();
        for (i, (first, a)) in along.iter().enumerate() {
            for (second, b) in along.iter().skip(i + 1) {
                if a == b {
                    continue;
                }
                let shorter_px = segments[*first].length_px().min(segments[*second].length_px());
                for (end, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let ends = [RayEnd { segment: *first, end }, RayEnd { segment: *second, end: other }];
                    if let Some(found) = meeting(segments, ends[0], ends[1], self.options) {
                        crossings.push(AxisCrossing { ends, axes: [*a, *b], place: found.place, shorter_px });
                    }
                }
            }
        }
        crossings.sort_by(|a, b| b.shorter_px.total_cmp(&a.shorter_px));
        crossings.truncate(CROSSINGS_MAX);
        crossings
    }

    /// The two edges of a crossing, each at the place of its axis.
    pub(super) fn own_edges(
        &self,
        crossing: &AxisCrossing,
        px_per_rad: f64,
        segments: &[Segment],
        memory: &mut TraceScratch,
    ) -> Option<[Option<TracedRay>; 3]> {
        let mut rays: [Option<TracedRay>; 3] = [None; 3];
        for (ray, axis) in crossing.ends.iter().zip(crossing.axes) {
            let segment = &segments[ray.segment];
            let normal = if ray.end == 0 { segment.normal } else { -segment.normal };
            let to_rad = crossing.place.angle(ray.far(segments)) - CLEAR_OF_END_PX / px_per_rad;
            let search = self.search(crossing, px_per_rad, normal, to_rad);
            rays[axis] = Some(self.follow(&search, px_per_rad, 1.0, self.options.support_min_share, memory)?);
        }
        Some(rays)
    }

    /// The search for an edge of a crossing.
    fn search(&self, crossing: &AxisCrossing, px_per_rad: f64, normal: Vector3<f64>, to_rad: f64) -> RaySearch {
        let vertex = (crossing.place - normal * normal.dot(&crossing.place)).normalize();
        gray_search(self.options, normal, vertex, [CLEAR_OF_VERTEX_PX / px_per_rad, to_rad])
    }

    /// The edge where it is looked for, if it begins there, as far as every so many pixels tell.
    fn follow(
        &self,
        search: &RaySearch,
        px_per_rad: f64,
        stride_px: f64,
        share_min: f64,
        memory: &mut TraceScratch,
    ) -> Option<TracedRay> {
        let signal = |at: &_, step: &_, out: &mut [f64]| self.light.gray_profile(self.image, at, step, out);
        let length_px = (search.to_rad - search.from_rad) * px_per_rad;
        let support_min_px = f64::from(self.options.support_min_px).min(SHORT_SHARE * length_px);
        let search = RaySearch { share_min, ..*search };
        trace_every(stride_px, self.camera, &search, support_min_px, signal, memory)
            .filter(|found| stride_px > 1.0 || found.begins_at_vertex())
    }

    /// Adds the corners at a crossing.
    fn complete(
        &self,
        crossing: &AxisCrossing,
        px_per_rad: f64,
        segments: &[Segment],
        memory: &mut TraceScratch,
        out: &mut Vec<CornerFeature>,
    ) {
        let options = self.options;
        let share_min = options.support_min_share;
        let third = crossing.third();
        let to_rad = THIRD_MIN_PX.max(THIRD_SHARE * crossing.shorter_px) / px_per_rad;
        let direction = self.camera_from_object.column(third).into_owned();
        // Most crossings have no third edge. A look at every third pixel shows that.
        let thirds = [direction, -direction].map(|direction| {
            let normal = crossing.place.cross(&direction).try_normalize(0.05)?;
            let long = self.search(crossing, px_per_rad, normal, to_rad);
            let is_long = self.follow(&long, px_per_rad, GLIMPSE_PX, GLIMPSE_SHARE * share_min, memory).is_some();
            Some(if is_long {
                (long, share_min)
            } else {
                (RaySearch { to_rad: SHORT_PX / px_per_rad, ..long }, SHORT_SHARE)
            })
        });
        let thirds =
            thirds.map(|look| look.and_then(|(search, least)| self.follow(&search, px_per_rad, 1.0, least, memory)));
        if thirds.iter().all(Option::is_none) {
            return;
        }
        let Some(mut rays) = self.own_edges(crossing, px_per_rad, segments, memory) else { return };
        for found in thirds.into_iter().flatten() {
            rays[third] = Some(found);
            let [Some(x), Some(y), Some(z)] = rays else { continue };
            let Some(corner) = clockwise(&[x.ray, y.ray, z.ray]) else { continue };
            let good = corner.residual_rad() * px_per_rad <= options.residual_max_px;
            if good && corner.rays_apart(options.ray_angle_min_rad) {
                out.push(corner);
            }
        }
    }
}

/// The feature of three rays with x and z named so that x, y, z are clockwise in the image.
pub(super) fn clockwise(&[x, y, z]: &[FittedRay; 3]) -> Option<CornerFeature> {
    let corner = CornerFeature::from_rays([x, y, z])?;
    let vertex = corner.vertex();
    let along = corner.rays().map(|ray| ray.normal.cross(&vertex));
    if are_clockwise(&vertex, &along) { Some(corner) } else { CornerFeature::from_rays([z, y, x]) }
}
