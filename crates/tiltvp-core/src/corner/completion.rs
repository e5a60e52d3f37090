//! Corners of which two edges were found as segments and the third is known from an attitude.

use nalgebra::{Matrix3, Vector3};

use super::consensus::rays_apart;
use super::general::{ERRING_TOGETHER, GeneralScratch};
use super::junctions::{RayEnd, meeting};
use super::options::GeneralOptions;
use super::trace::{Course, Traced, trace_every};
use super::vertex::CornerFeature;
use crate::camera::Camera;
use crate::image::{ImageView, LightTable};

/// How far from the direction of its axis a segment's great circle may pass: 2.5 degrees.
const AXIS_SINE: f64 = 0.0436;

/// Most crossings that are followed up, those of the longest segments.
const CROSSINGS_MAX: usize = 60;

/// Least length along which a third edge is looked for, in pixels.
const THIRD_MIN_PX: f64 = 30.0;

/// How long a third edge is where it ends early, as a table top's: nearly all of it has to be seen.
const SHORT_PX: f64 = 16.0;

/// Least share of a short third edge that is seen.
const SHORT_SHARE: f64 = 0.8;

/// How far apart the places are that tell at first whether there is a third edge, in pixels.
const GLIMPSE_PX: f64 = 3.0;

/// A crossing of two segments along two of the axes.
struct Crossing {
    ends: [RayEnd; 2],
    axes: [usize; 2],
    place: Vector3<f64>,
    shorter_px: f64,
}

/// Corners of an image whose edges run along the columns of `camera_from_object`, at right angles, added to `out`: two of
/// their edges are segments of the image that was looked at last, the third is followed from where these cross.
pub(super) fn complete(
    camera: &Camera,
    image: &ImageView<'_>,
    camera_from_object: &Matrix3<f64>,
    options: &GeneralOptions,
    light: &LightTable,
    scratch: &mut GeneralScratch,
    out: &mut Vec<CornerFeature>,
) {
    let segments = &scratch.segments.segments;
    let axis_of = |normal: &Vector3<f64>| {
        let sines = camera_from_object.tr_mul(normal).abs();
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
            let shorter_px = segments[*first].length_px.min(segments[*second].length_px);
            for (end, other) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let ends = [RayEnd { segment: *first, end }, RayEnd { segment: *second, end: other }];
                if let Some(found) = meeting(segments, ends[0], ends[1], options) {
                    crossings.push(Crossing { ends, axes: [*a, *b], place: found.place, shorter_px });
                }
            }
        }
    }
    crossings.sort_by(|a, b| b.shorter_px.total_cmp(&a.shorter_px));
    crossings.truncate(CROSSINGS_MAX);
    for crossing in &crossings {
        let Some(place) = camera.project_jacobian(&crossing.place) else { continue };
        let px_per_rad = place.1.norm() / 2f64.sqrt();
        let course = |normal: Vector3<f64>, to_rad: f64| Course {
            normal,
            vertex: (crossing.place - normal * normal.dot(&crossing.place)).normalize(),
            from_rad: 4.0 / px_per_rad,
            to_rad,
            search_px: options.search_px,
            step_min: options.step_min,
            step_share_min: 0.0,
            threshold_px: options.threshold_px,
            erring_together: ERRING_TOGETHER,
            ray_sigma_px: options.ray_sigma_px,
        };
        let support_min = f64::from(options.support_min_px);
        let memory = &mut scratch.trace;
        let mut follow = |course: &Course, stride_px: f64, least_share: f64| -> Option<Traced> {
            let signal = |u, v| light.gray(image, u, v);
            let profiles = (course.to_rad - course.from_rad) * px_per_rad;
            let support_min = support_min.min(SHORT_SHARE * profiles);
            let found = trace_every(stride_px, camera, course, (support_min / stride_px) as usize, signal, memory)?;
            Some(found).filter(|found| found.share >= least_share && (stride_px > 1.0 || found.begins_at_vertex()))
        };
        let share_min = options.support_min_share;
        let third = 3 - crossing.axes[0] - crossing.axes[1];
        let to_rad = THIRD_MIN_PX.max(0.8 * crossing.shorter_px) / px_per_rad;
        let direction = camera_from_object.column(third).into_owned();
        // Most crossings have no third edge, which every third pixel tells.
        let thirds = [direction, -direction].map(|direction| {
            let course = course(crossing.place.cross(&direction).try_normalize(0.05)?, to_rad);
            let long = follow(&course, GLIMPSE_PX, 0.8 * share_min).map(|_| (course, share_min));
            long.or(Some((Course { to_rad: SHORT_PX / px_per_rad, ..course }, SHORT_SHARE)))
        });
        if thirds.iter().all(Option::is_none) {
            continue;
        }
        let mut rays: [Option<Traced>; 3] = [None; 3];
        for (ray, axis) in crossing.ends.iter().zip(crossing.axes) {
            let segment = &segments[ray.segment];
            let normal = if ray.end == 0 { segment.normal } else { -segment.normal };
            let course = course(normal, crossing.place.angle(ray.far(segments)) - 2.0 / px_per_rad);
            rays[axis] = follow(&course, 1.0, share_min);
            if rays[axis].is_none() {
                break;
            }
        }
        if crossing.axes.iter().any(|axis| rays[*axis].is_none()) {
            continue;
        }
        for (course, least_share) in thirds.iter().flatten() {
            rays[third] = follow(course, 1.0, *least_share);
            let [Some(x), Some(y), Some(z)] = rays else { continue };
            let Some(corner) = clockwise(&[x, y, z]) else { continue };
            let good = corner.residual_rad() * px_per_rad <= options.residual_max_px;
            if good && rays_apart(&corner, options.ray_angle_min_rad) {
                out.push(corner);
            }
        }
    }
}

/// The feature of three rays with x and z named so that x, y, z are clockwise in the image.
fn clockwise(traced: &[Traced; 3]) -> Option<CornerFeature> {
    let [x, y, z] = [traced[0].ray, traced[1].ray, traced[2].ray];
    let corner = CornerFeature::from_rays([x, y, z])?;
    let vertex = corner.vertex();
    let along = corner.rays().map(|ray| ray.normal.cross(&vertex));
    let turn = |direction: &Vector3<f64>| {
        let angle = vertex.dot(&along[1].cross(direction)).atan2(along[1].dot(direction));
        if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
    };
    if turn(&along[0]) > turn(&along[2]) { Some(corner) } else { CornerFeature::from_rays([z, y, x]) }
}
