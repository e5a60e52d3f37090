//! Where the edges of a corner end: at lines along the other axes that meet them there, as one image shows it or both.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::general::{ERRING_TOGETHER, GeneralScratch};
use super::options::GeneralOptions;
use super::position::{Sighting, triangulate};
use super::segments::Segment;
use super::trace::{Course, trace};
use super::vertex::CornerFeature;
use crate::camera::Camera;
use crate::geometry::RigidMotion;
use crate::image::{ImageView, LightTable};

/// The far end of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeEnd {
    /// How far it is from the vertex, metres: along the edge where one camera sees it, else the distance of the two points.
    pub length_m: f64,
    /// Where it is in the left camera's frame, metres, from its bearings in both images alone; none where one image shows it.
    pub place_m: Option<Vector3<f64>>,
}

/// The end of an edge in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SeenEnd {
    bearing: Vector3<f64>,
    sigma_rad: f64,
    length_m: f64,
}

/// What one camera sees of a corner.
pub(super) struct Seen<'a> {
    pub(super) camera: &'a Camera,
    pub(super) image: &'a ImageView<'a>,
    pub(super) options: &'a GeneralOptions,
    pub(super) light: &'a LightTable,
    pub(super) corner: &'a CornerFeature,
    /// The axes of the object, camera frame.
    pub(super) camera_from_object: Matrix3<f64>,
    /// The directions of the edges x, y, z, camera frame.
    pub(super) edges: [Vector3<f64>; 3],
    /// The vertex in the camera's frame, metres.
    pub(super) vertex_m: Vector3<f64>,
}

/// How far from the direction of its axis a segment's great circle may pass: 2.5 degrees.
const AXIS_SINE: f64 = 0.0436;

/// Least length of an edge, in pixels.
const EDGE_MIN_PX: f64 = 20.0;

/// How far from the edge a line along another axis may begin, in pixels: vertices are rounded.
const GAP_PX: f64 = 15.0;

/// Ends that are closer than this are one, in pixels.
const SAME_END_PX: f64 = 8.0;

/// The last pixels of an edge, which tell it from what happens to lie beyond its end.
const LAST_PX: f64 = 20.0;

/// Least share of the last pixels that show the edge.
const LAST_SHARE: f64 = 0.8;

/// Least number of places of an edge.
const PLACES_MIN: usize = 10;

/// Pixels about a vertex where the edges' gradients mix.
const CLEAR_OF_VERTEX_PX: f64 = 4.0;

/// How far apart the lengths may be that two images say, as a share of them.
const LENGTHS_APART: f64 = 0.06;

/// Places where lines along another axis meet a ray: the angle from the vertex, and the line.
fn meetings<'a>(seen: &Seen<'_>, segments: &'a [Segment], axis: usize, px_per_rad: f64) -> Vec<(f64, &'a Segment)> {
    let (vertex, normal) = (seen.corner.vertex(), seen.corner.rays()[axis].normal);
    let along = normal.cross(&vertex);
    let mut out = Vec::new();
    for segment in segments {
        let sines = seen.camera_from_object.tr_mul(&segment.normal).abs();
        let nearest = sines.imin();
        // The axis of an edge is the column that is nearest to it.
        let own = seen.camera_from_object.tr_mul(&seen.edges[axis]).abs().imax();
        if nearest == own || sines[nearest] > AXIS_SINE {
            continue;
        }
        let Some(crossing) = normal.cross(&segment.normal).try_normalize(0.05) else { continue };
        let crossing = if crossing.dot(&vertex) < 0.0 { -crossing } else { crossing };
        let angle = crossing.dot(&along).atan2(crossing.dot(&vertex));
        let own_px = segment.px_per_rad;
        let aside = segment.ends.map(|end| end.angle(&crossing) * own_px);
        let inside = aside[0].max(aside[1]) < segment.length_px;
        let off_px = aside[0].min(aside[1]);
        let widest = if inside { seen.options.overshoot_max_px } else { GAP_PX };
        if angle * px_per_rad >= EDGE_MIN_PX && off_px <= widest {
            out.push((angle, segment));
        }
    }
    out.sort_by(|a, b| b.0.total_cmp(&a.0));
    out
}

/// The ends of the edges x, y, z in one image, among the segments that were found in it last; the farthest up to which the
/// image shows the edge.
pub(super) fn seen_ends(seen: &Seen<'_>, scratch: &mut GeneralScratch) -> [Option<SeenEnd>; 3] {
    let mut out = [None; 3];
    let Some((_, jacobian)) = seen.camera.project_jacobian(&seen.corner.vertex()) else { return out };
    let px_per_rad = jacobian.norm() / 2f64.sqrt();
    let GeneralScratch { segments, trace: memory, .. } = scratch;
    for (axis, out) in out.iter_mut().enumerate() {
        let found = meetings(seen, &segments.segments, axis, px_per_rad);
        let normal = seen.corner.rays()[axis].normal;
        let mut follow = |from_rad: f64, to_rad: f64, least_share: f64| {
            let course = Course {
                normal,
                vertex: seen.corner.vertex(),
                from_rad,
                to_rad,
                search_px: seen.options.search_px,
                step_min: seen.options.step_min,
                step_share_min: 0.0,
                threshold_px: seen.options.threshold_px,
                erring_together: ERRING_TOGETHER,
                ray_sigma_px: seen.options.ray_sigma_px,
            };
            trace(seen.camera, &course, PLACES_MIN, |u, v| seen.light.gray(seen.image, u, v), memory)
                .filter(|traced| traced.share >= least_share)
        };
        let clear_rad = CLEAR_OF_VERTEX_PX / px_per_rad;
        for (place, (angle, _)) in found.iter().enumerate() {
            let last_rad = (angle - LAST_PX / px_per_rad).max(clear_rad);
            let whole = follow(clear_rad, angle - clear_rad, seen.options.guided_min_share);
            let (Some(whole), Some(_)) = (whole, follow(last_rad, angle - clear_rad, LAST_SHARE)) else { continue };
            // Of lines that meet the edge next to each other the longest.
            let together = found[place..].iter().take_while(|(other, _)| (angle - other) * px_per_rad < SAME_END_PX);
            let Some((_, line)) = together.max_by(|a, b| a.1.length_px.total_cmp(&b.1.length_px)) else { continue };
            let Some(crossing) = whole.ray.normal.cross(&line.normal).try_normalize(0.05) else { continue };
            let bearing = if crossing.dot(&seen.corner.vertex()) < 0.0 { -crossing } else { crossing };
            if let Some(length_m) = along(&seen.vertex_m, &seen.edges[axis], &bearing) {
                *out = Some(SeenEnd { bearing, sigma_rad: seen.options.ray_sigma_px / px_per_rad, length_m });
                break;
            }
        }
    }
    out
}

/// How far from a point along an edge the place is that is nearest to a line of sight; none where that is behind the camera or
/// on the other side of the point.
fn along(point: &Vector3<f64>, edge: &Vector3<f64>, bearing: &Vector3<f64>) -> Option<f64> {
    let across = |vector: &Vector3<f64>| vector - bearing * bearing.dot(vector);
    let length_m = -across(point).dot(&across(edge)) / across(edge).norm_squared();
    let ahead = (point + edge * length_m).dot(bearing) > 0.0;
    (ahead && length_m > 0.0 && length_m.is_finite()).then_some(length_m)
}

/// The ends of the edges of a corner with the vertex `vertex_m`, from what both cameras see of them.
pub(super) fn edge_ends(
    [left, right]: [[Option<SeenEnd>; 3]; 2],
    left_from_right: &RigidMotion,
    vertex_m: &Vector3<f64>,
) -> [Option<EdgeEnd>; 3] {
    let sighting = |end: &SeenEnd, rig_from_camera| Sighting {
        bearing: end.bearing,
        covariance: Matrix2::from_diagonal_element(end.sigma_rad * end.sigma_rad),
        rig_from_camera,
    };
    let mut out = [None; 3];
    for (out, ends) in out.iter_mut().zip(left.iter().zip(&right)) {
        *out = match ends {
            (Some(left), Some(right)) => {
                let apart = (left.length_m - right.length_m).abs();
                let both = [sighting(left, RigidMotion::identity()), sighting(right, *left_from_right)];
                triangulate(&both)
                    .filter(|_| apart <= LENGTHS_APART * left.length_m.max(right.length_m))
                    .map(|point| EdgeEnd { length_m: (point.point_m - vertex_m).norm(), place_m: Some(point.point_m) })
            }
            (Some(one), None) | (None, Some(one)) => Some(EdgeEnd { length_m: one.length_m, place_m: None }),
            (None, None) => None,
        };
    }
    out
}
