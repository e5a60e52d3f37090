//! Where the edges of a corner end: at lines along the other axes that meet them there, as one image shows it or both.

use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::camera::Camera;
use crate::corner::estimate::{EdgeEnd, Hypothesis};
use crate::corner::feature::CornerFeature;
use crate::corner::general::{AXIS_SINE, CLEAR_OF_VERTEX_PX, GeneralScratch, gray_search};
use crate::corner::options::GeneralOptions;
use crate::corner::ray::FittedRay;
use crate::corner::trace::{RaySearch, TraceScratch, TracedRay, trace};
use crate::corner::triangulation::{BearingObservation, triangulate};
use crate::geometry::{RigidMotion, meeting, tangent_basis};
use crate::image::{ImageView, LightTable};
use crate::segments::Segment;

/// The end of an edge in one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ObservedEnd {
    bearing: Vector3<f64>,
    sigma_rad: f64,
    /// From the vertex, along the edge.
    length_m: f64,
    /// From the camera.
    distance_m: f64,
}

impl ObservedEnd {
    /// The end as this image alone has it, with the vertex in the frame of its camera. Of a triangle with the sides d (to the
    /// vertex), e (to the end) and L, L err by what the bearing does, times e over the sine of the angle at the end, and as d by
    /// what the vertex does along the line of sight; the pose's directions err far less.
    fn alone(&self, vertex_m: &Vector3<f64>, covariance_m2: &Matrix3<f64>) -> EdgeEnd {
        let away = vertex_m / vertex_m.norm();
        let at_camera = away.angle(&self.bearing);
        // The sine rule: L / sin(angle at the camera) = d / sin(angle at the end).
        let sine = (vertex_m.norm() * at_camera.sin() / self.length_m).clamp(SINE_MIN, 1.0);
        let by_bearing = self.sigma_rad * self.distance_m / sine;
        let by_distance = away.dot(&(covariance_m2 * away)).sqrt() * self.length_m / vertex_m.norm();
        EdgeEnd { length_m: self.length_m, sigma_m: by_bearing.hypot(by_distance), place_m: None }
    }
}

/// The least sine of the angle between an edge and the line of sight to its end: below it (3 degrees) its length in one image
/// is told to nothing better than a share of a tenth.
const SINE_MIN: f64 = 0.05;

/// What one camera sees of a corner.
pub(crate) struct ObservedCorner<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) image: &'a ImageView<'a>,
    pub(crate) options: &'a GeneralOptions,
    pub(crate) light: &'a LightTable,
    pub(crate) corner: &'a CornerFeature,
    /// The axes of the object, camera frame.
    pub(crate) camera_from_object: Matrix3<f64>,
    /// The directions of the edges x, y, z, camera frame.
    pub(crate) edges: [Vector3<f64>; 3],
    /// The vertex in the camera's frame, metres.
    pub(crate) vertex_m: Vector3<f64>,
}

impl ObservedCorner<'_> {
    /// The edge on a great circle through the vertex, between two angles from there.
    fn follow(
        &self,
        normal: &Vector3<f64>,
        reach_rad: [f64; 2],
        share_min: f64,
        memory: &mut TraceScratch,
    ) -> Option<TracedRay> {
        let along = gray_search(self.options, *normal, self.corner.vertex(), reach_rad);
        let search = RaySearch { share_min, ..along };
        let signal = |at: &_, step: &_, out: &mut [f64]| self.light.gray_profile(self.image, at, step, out);
        trace(self.camera, &search, SUPPORT_MIN_PX, signal, memory)
    }

    /// Whether the image shows an edge up to where another one has its end, as far as that is in view.
    pub(crate) fn shows(&self, axis: usize, end: &ObservedEnd, scratch: &mut GeneralScratch) -> bool {
        let (vertex, end) = (self.corner.vertex(), self.vertex_m + self.edges[axis] * end.length_m);
        let is_in_view = self.camera.project(&end).is_some_and(|pixel| self.camera.contains(&pixel));
        let normal = vertex.cross(&end).try_normalize(1e-6).filter(|_| is_in_view);
        let (Some(normal), Some(px_per_rad)) = (normal, self.camera.px_per_rad(&vertex)) else { return true };
        let clear_rad = CLEAR_OF_VERTEX_PX / px_per_rad;
        let to_rad = vertex.angle(&end) - clear_rad;
        let last_rad = (to_rad - LAST_PX / px_per_rad).max(clear_rad);
        self.follow(&normal, [last_rad, to_rad], LAST_SHARE, &mut scratch.trace).is_some()
    }
}

/// Least length of an edge, in pixels: that of a segment.
pub(super) const EDGE_MIN_PX: f64 = 20.0;

/// How far from the edge a line along another axis may begin, in pixels: vertices of real things are rounded and worn.
pub(super) const GAP_PX: f64 = 15.0;

/// Ends that are closer than this are one, in pixels: both sides of a bevelled edge.
const SAME_END_PX: f64 = 8.0;

/// The last pixels of an edge. They separate its end from what happens to lie beyond it.
const LAST_PX: f64 = 20.0;

/// Least share of the last pixels that show the edge. An edge that has ended shows background instead.
const LAST_SHARE: f64 = 0.8;

/// Least length of an edge that agrees with it, in pixels: half of the last pixels.
const SUPPORT_MIN_PX: f64 = 10.0;

/// The 99.9 % quantile of chi-square of 2: an end that is farther from its edge is none of it.
const ON_EDGE_CHI_SQUARE: f64 = 13.8;

/// How far apart the lengths from the two images may be, as a share of them: larger ones are ends of different edges.
const LENGTHS_APART: f64 = 0.06;

/// Places where lines along another axis meet a ray: the angle from the vertex, and the line.
fn meetings<'a>(
    seen: &ObservedCorner<'_>,
    segments: &'a [Segment],
    axis: usize,
    px_per_rad: f64,
) -> Vec<(f64, &'a Segment)> {
    let (vertex, normal) = (seen.corner.vertex(), seen.corner.rays()[axis].normal);
    let along = normal.cross(&vertex);
    // The axis of an edge is the column that is nearest to it.
    let own = seen.camera_from_object.tr_mul(&seen.edges[axis]).abs().imax();
    let mut out = Vec::new();
    for segment in segments {
        let sines = seen.camera_from_object.tr_mul(&segment.normal).abs();
        let nearest = sines.imin();
        if nearest == own || sines[nearest] > AXIS_SINE {
            continue;
        }
        let Some(crossing) = meeting(&normal, &segment.normal, &vertex) else { continue };
        let angle = crossing.dot(&along).atan2(crossing.dot(&vertex));
        let own_px = segment.px_per_rad;
        let aside = segment.ends.map(|end| end.angle(&crossing) * own_px);
        let inside = aside[0].max(aside[1]) < segment.length_px();
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
pub(crate) fn seen_ends(seen: &ObservedCorner<'_>, scratch: &mut GeneralScratch) -> [Option<ObservedEnd>; 3] {
    let mut out = [None; 3];
    let Some(px_per_rad) = seen.camera.px_per_rad(&seen.corner.vertex()) else { return out };
    let GeneralScratch { segments, trace: memory, .. } = scratch;
    for (axis, out) in out.iter_mut().enumerate() {
        let found = meetings(seen, &segments.list, axis, px_per_rad);
        let FittedRay { normal, support, .. } = seen.corner.rays()[axis];
        if support == 0 {
            continue;
        }
        let clear_rad = CLEAR_OF_VERTEX_PX / px_per_rad;
        for (place, (angle, _)) in found.iter().enumerate() {
            let last_rad = (angle - LAST_PX / px_per_rad).max(clear_rad);
            // The last pixels are sooner looked at than all.
            if seen.follow(&normal, [last_rad, angle - clear_rad], LAST_SHARE, memory).is_none() {
                continue;
            }
            let reach = [clear_rad, angle - clear_rad];
            let Some(whole) = seen.follow(&normal, reach, seen.options.guided_min_share, memory) else { continue };
            // Of lines that meet the edge next to each other the longest.
            let together = found[place..].iter().take_while(|(other, _)| (angle - other) * px_per_rad < SAME_END_PX);
            let Some((_, line)) = together.max_by(|a, b| a.1.length_px().total_cmp(&b.1.length_px())) else { continue };
            let Some(bearing) = meeting(&whole.ray.normal, &line.normal, &seen.corner.vertex()) else { continue };
            if let Some(length_m) = along(&seen.vertex_m, &seen.edges[axis], &bearing) {
                let sigma_rad = seen.options.ray_sigma_px / px_per_rad;
                let distance_m = (seen.vertex_m + seen.edges[axis] * length_m).norm();
                *out = Some(ObservedEnd { bearing, sigma_rad, length_m, distance_m });
                break;
            }
        }
    }
    out
}

/// How far from a point along an edge the place is that is nearest to a line of sight; none where that is behind the camera or
/// on the other side of the point.
pub(crate) fn along(point: &Vector3<f64>, edge: &Vector3<f64>, bearing: &Vector3<f64>) -> Option<f64> {
    let across = |vector: &Vector3<f64>| vector - bearing * bearing.dot(vector);
    let length_m = -across(point).dot(&across(edge)) / across(edge).norm_squared();
    let ahead = (point + edge * length_m).dot(bearing) > 0.0;
    (ahead && length_m > 0.0 && length_m.is_finite()).then_some(length_m)
}

/// The ends of the edges of a corner from what both cameras see of them. An end that both see lies on its edge: where a line
/// before it hides the rest, the places at which the images show that are not one on the edge.
pub(crate) fn edge_ends(
    [left, right]: [[Option<ObservedEnd>; 3]; 2],
    left_from_right: &RigidMotion,
    pose: &Hypothesis,
) -> [Option<EdgeEnd>; 3] {
    let Some(vertex_m) = pose.vertex_m else { return [None; 3] };
    let covariance_m2 = pose.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    let observation = |end: &ObservedEnd, rig_from_camera| BearingObservation {
        bearing: end.bearing,
        covariance: Matrix2::from_diagonal_element(end.sigma_rad * end.sigma_rad),
        rig_from_camera,
    };
    std::array::from_fn(|axis| match (&left[axis], &right[axis]) {
        (Some(left), Some(right)) => {
            let apart = (left.length_m - right.length_m).abs();
            if apart > LENGTHS_APART * left.length_m.max(right.length_m) {
                return None;
            }
            let both = [observation(left, RigidMotion::identity()), observation(right, *left_from_right)];
            let point = triangulate(&both)?;
            let (reach_m, spread_m2) = (point.point_m - vertex_m, point.covariance_m2 + covariance_m2);
            if !lies_on(&pose.edges[axis], &pose.attitude_covariance(), &reach_m, &spread_m2) {
                return None;
            }
            let along = reach_m / reach_m.norm();
            let sigma_m = along.dot(&(spread_m2 * along)).sqrt();
            Some(EdgeEnd { length_m: reach_m.norm(), sigma_m, place_m: Some(point.point_m) })
        }
        (Some(one), None) => Some(one.alone(&vertex_m, &covariance_m2)),
        (None, Some(one)) => {
            // The vertex as the right camera has it.
            let turned = left_from_right.rotation.transpose();
            let covariance_m2 = turned * covariance_m2 * turned.transpose();
            Some(one.alone(&left_from_right.inverse().point(&vertex_m), &covariance_m2))
        }
        (None, None) => None,
    })
}

/// Whether a point is on a line through the vertex, by the covariances of the line's direction (a rotation vector) and of how far it is
/// from there.
fn lies_on(edge: &Vector3<f64>, turn_rad2: &Matrix3<f64>, reach_m: &Vector3<f64>, spread_m2: &Matrix3<f64>) -> bool {
    let lever = edge.cross_matrix() * reach_m.dot(edge);
    let basis = tangent_basis(edge);
    let spread = basis.transpose() * (spread_m2 + lever * turn_rad2 * lever.transpose()) * basis;
    let off_m = basis.transpose() * reach_m;
    spread.try_inverse().is_some_and(|information| off_m.dot(&(information * off_m)) <= ON_EDGE_CHI_SQUARE)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use nalgebra::{Matrix6, Vector2, Vector6};

    use super::*;
    use crate::camera::{Model, Pinhole};
    use crate::segments::SegmentDetector;

    /// An edge across the line of sight, and edges that run towards the camera and away from it.
    #[test]
    fn a_length_from_one_image_errs_by_its_end_and_by_the_distance() {
        let (vertex_m, length_m, sigma_rad, sigma_m) = (Vector3::new(0.0, 0.0, 2.0), 0.6, 1e-3, 4e-3);
        let covariance_m2 = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sigma_m * sigma_m));
        for lean_rad in [0.0f64, -0.9, 0.9] {
            let edge = Vector3::new(lean_rad.cos(), 0.0, lean_rad.sin());
            let end_m = vertex_m + edge * length_m;
            let told_m = |distance_m: f64, off_rad: f64| {
                let angle_rad = end_m.x.atan2(end_m.z) + off_rad;
                along(&(vertex_m * distance_m / 2.0), &edge, &Vector3::new(angle_rad.sin(), 0.0, angle_rad.cos()))
                    .unwrap()
            };
            let by_bearing = (told_m(2.0, 1e-6) - told_m(2.0, -1e-6)) / 2e-6 * sigma_rad;
            let by_distance = (told_m(2.0 + 1e-6, 0.0) - told_m(2.0 - 1e-6, 0.0)) / 2e-6 * sigma_m;
            let end = ObservedEnd { bearing: end_m.normalize(), sigma_rad, length_m, distance_m: end_m.norm() };
            let found = end.alone(&vertex_m, &covariance_m2);
            assert!((found.sigma_m / by_bearing.hypot(by_distance) - 1.0).abs() < 1e-6, "{lean_rad}: {found:?}");
            assert_eq!((found.length_m, found.place_m), (length_m, None));
        }
    }

    /// A pose before both cameras with edges along x, y and away from them.
    fn pose(vertex_m: Vector3<f64>) -> Hypothesis {
        let sigmas = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 3e-3];
        Hypothesis {
            camera_from_object: Matrix3::identity(),
            edges: [Vector3::x(), Vector3::y(), Vector3::z()],
            vertex_m: Some(vertex_m),
            covariance: Matrix6::from_diagonal(&Vector6::from(sigmas.map(|sigma| sigma * sigma))),
            probability: 1.0,
            right_handed: true,
            misfit: 0.0,
        }
    }

    #[test]
    fn where_a_line_in_front_hides_an_edge_it_does_not_end() {
        let pose = pose(Vector3::new(-0.2, 0.1, 3.0));
        let left_from_right =
            RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::new(0.12, 0.0, 0.0) };
        // Where each camera sees the edge x pass an upright line at x = 0.8, so far away.
        let at = |distance_m: f64| {
            let seen = |camera_x: f64| {
                let x = camera_x + (0.8 - camera_x) * 3.0 / distance_m;
                let reach = Vector3::new(x - camera_x, 0.1, 3.0);
                let bearing = reach.normalize();
                Some(ObservedEnd { bearing, sigma_rad: 3e-4, length_m: x + 0.2, distance_m: reach.norm() })
            };
            edge_ends([[seen(0.0), None, None], [seen(0.12), None, None]], &left_from_right, &pose)[0]
        };
        let end = at(3.0).unwrap();
        assert!((end.length_m - 1.0).abs() < 1e-9 && end.sigma_m < 0.02, "{end:?}");
        assert!(end.place_m.is_some());
        // Within what covariances say of the place along the line of sight, 4 cm, and beyond it.
        assert!(at(2.95).is_some());
        assert_eq!(at(2.7), None);
    }

    #[test]
    fn an_end_is_shown_where_the_edge_goes_on_to_it_or_it_is_out_of_view() {
        let lens = Pinhole::new([200.0; 2], [79.5, 59.5], &[]).unwrap();
        let camera = Camera::new(160, 120, Model::Pinhole(lens)).unwrap();
        // Dark below the edge x, which begins at column 40 and goes on to column 100.
        let level = |u: usize, v: usize| if (40..100).contains(&u) && v > 59 { 60 } else { 180 };
        let data: Vec<u8> = (0..160 * 120).map(|i| level(i % 160, i / 160)).collect();
        let image = ImageView::new(&data, 160, 120, 160).unwrap();
        let bearing = |u: f64, v: f64| camera.unproject(&Vector2::new(u, v)).unwrap();
        let on = [bearing(95.0, 59.5), bearing(39.5, 100.0), bearing(30.0, 50.0)];
        let corner = CornerFeature::from_bearings(&bearing(39.5, 59.5), &on).unwrap();
        let light = LightTable::new(2.2).unwrap();
        let seen = ObservedCorner {
            camera: &camera,
            image: &image,
            options: &GeneralOptions::default(),
            light: &light,
            corner: &corner,
            camera_from_object: Matrix3::identity(),
            edges: [Vector3::x(), Vector3::y(), Vector3::z()],
            vertex_m: corner.vertex() * 2.0,
        };
        let detector = SegmentDetector::new(camera.clone(), GeneralOptions::default().segments(None)).unwrap();
        let mut scratch = GeneralScratch::new(detector.scratch());
        let mut shows = |column: f64| {
            let length_m = (column - 39.5) / 200.0 * seen.vertex_m.z;
            let (bearing, sigma_rad, distance_m) = (Vector3::z(), 1e-3, 2.0);
            seen.shows(0, &ObservedEnd { bearing, sigma_rad, length_m, distance_m }, &mut scratch)
        };
        assert!(shows(99.5) && shows(80.0) && shows(170.0));
        assert!(!shows(125.0) && !shows(150.0));
    }
}
