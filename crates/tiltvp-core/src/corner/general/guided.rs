//! A corner looked for where it is expected: where it was in the frame before, or where another camera places it.

use nalgebra::Vector3;

use super::edge_ends::along;
use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::general::{CLEAR_OF_VERTEX_PX, gray_search};
use crate::corner::options::GeneralOptions;
use crate::corner::trace::{RaySearch, TraceScratch, trace_every};
use crate::geometry::RigidMotion;
use crate::image::{ImageView, LightTable};
use crate::segments::Segment;

/// How far beyond its end a ray is looked for, in pixels: what follows a ray must not shorten it from frame to frame,
/// and each fit loses up to a pixel.
const BEYOND_END_PX: f64 = 1.0;

/// Least number of a corner's rays for which segments of the image speak: two, as for a corner of which the third edge is known
/// from an attitude. With one, 4 times as many places are followed up.
const SPEAKING_MIN: usize = 2;

/// Where a corner is expected: its vertex, and a bearing at the far end of each of the rays x, y, z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExpectedCorner {
    pub(crate) vertex: Vector3<f64>,
    pub(crate) far: [Vector3<f64>; 3],
}

impl ExpectedCorner {
    /// Where a corner was.
    pub(crate) fn of(corner: &CornerFeature) -> Self {
        Self { vertex: corner.vertex(), far: corner.rays().map(|ray| ray.toward) }
    }

    /// Where a corner of one camera is seen by another if its vertex is `distance_m` away and its edges have these
    /// directions in the first camera's frame; none behind the other camera.
    pub(crate) fn transferred(
        corner: &CornerFeature,
        edges: &[Vector3<f64>; 3],
        distance_m: f64,
        other_from_own: &RigidMotion,
    ) -> Option<Self> {
        let vertex = corner.vertex() * distance_m;
        let mut far = [Vector3::zeros(); 3];
        for ((far, ray), edge) in far.iter_mut().zip(corner.rays()).zip(edges) {
            // The point of the edge that is seen at the far end.
            let point = vertex + edge * along(&vertex, edge, &ray.toward)?;
            *far = other_from_own.point(&point).try_normalize(1e-9)?;
        }
        Some(Self { vertex: other_from_own.point(&vertex).try_normalize(1e-9)?, far })
    }
}

/// The segments of an image along each edge of a corner of another image.
pub(crate) struct EdgeSegments<'a> {
    along: [Vec<&'a Segment>; 3],
}

impl<'a> EdgeSegments<'a> {
    /// Those of the segments that are along edges with these directions, within `most_rad`.
    pub(crate) fn new(segments: &'a [Segment], edges: &[Vector3<f64>; 3], most_rad: f64) -> Self {
        let along = |edge: &Vector3<f64>| {
            let is_along = |segment: &&Segment| segment.normal.dot(edge).abs() <= most_rad.sin();
            segments.iter().filter(is_along).collect()
        };
        Self { along: edges.each_ref().map(along) }
    }

    /// How well segments agree with where a corner is expected: 1 for each ray that one lies in, 0 for one that is `reach_px` off,
    /// summed; none where too few rays have segments.
    pub(crate) fn speak_for(&self, expected: &ExpectedCorner, reach_px: f64) -> Option<f64> {
        let ExpectedCorner { vertex, far } = expected;
        let nearness = |axis: usize| {
            let (segments, far) = (&self.along[axis], &far[axis]);
            let normal = vertex.cross(far).try_normalize(1e-6)?;
            // Segments end beyond the vertex, and begin before the far end.
            let (onwards, back) = (normal.cross(vertex), far.cross(&normal));
            let near = segments.iter().filter_map(|segment| {
                let off_px = segment.ends.map(|end| normal.dot(&end).abs() * segment.px_per_rad);
                let farthest_px = off_px[0].max(off_px[1]);
                (farthest_px <= reach_px
                    && segment.ends.iter().any(|end| onwards.dot(end) > 0.0)
                    && segment.ends.iter().any(|end| back.dot(end) > 0.0))
                .then(|| 1.0 - farthest_px / reach_px)
            });
            near.max_by(f64::total_cmp)
        };
        let near = [0, 1, 2].map(nearness);
        (near.iter().flatten().count() >= SPEAKING_MIN).then(|| near.iter().flatten().sum())
    }
}

/// The corner near where it is expected, at most `search_px` from there; none if its rays are not all seen.
pub(crate) fn find_near(
    camera: &Camera,
    image: &ImageView<'_>,
    expected: &ExpectedCorner,
    search_px: f64,
    options: &GeneralOptions,
    light: &LightTable,
    scratch: &mut TraceScratch,
) -> Option<CornerFeature> {
    let mut vertex = expected.vertex;
    let mut normals = expected.far.map(|far| vertex.cross(&far).try_normalize(1e-6));
    let mut found = None;
    // So far about a long ray there are other edges too: the first pass, along every third pixel, only has to lead to the
    // second.
    for (search_px, stride_px, share_min) in
        [(search_px, 3.0, 0.5 * options.guided_min_share), (options.search_px, 1.0, options.guided_min_share)]
    {
        if !camera.contains(&camera.project(&vertex)?) {
            return None;
        }
        let px_per_rad = camera.px_per_rad(&vertex)?;
        let mut rays = [None; 3];
        let lengths = expected.far.map(|far| vertex.angle(&far));
        // Where one ray is missing none of the others is needed, and the shortest is the soonest looked at.
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| lengths[*a].total_cmp(&lengths[*b]));
        for axis in order {
            let normal = normals[axis]?;
            let on_circle = (vertex - normal * normal.dot(&vertex)).try_normalize(0.5)?;
            let angles = [CLEAR_OF_VERTEX_PX / px_per_rad, lengths[axis] + BEYOND_END_PX / px_per_rad];
            let search = RaySearch { search_px, share_min, ..gray_search(options, normal, on_circle, angles) };
            let signal = |at: &_, step: &_, out: &mut [f64]| light.gray_profile(image, at, step, out);
            let support_min_px = f64::from(options.support_min_px);
            rays[axis] = Some(trace_every(stride_px, camera, &search, support_min_px, signal, scratch)?.ray);
        }
        let [Some(x), Some(y), Some(z)] = rays else { return None };
        let corner = CornerFeature::from_rays([x, y, z])?;
        let good = corner.residual_rad() * px_per_rad <= options.residual_max_px;
        if !good || !corner.rays_apart(options.ray_angle_min_rad) {
            return None;
        }
        vertex = corner.vertex();
        normals = corner.rays().map(|ray| Some(ray.normal));
        found = Some(corner);
    }
    found
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use nalgebra::{Matrix2, Matrix3, Rotation3};

    use super::*;
    use crate::corner::ray::FittedRay;

    #[test]
    fn another_camera_sees_vertex_and_ends_where_they_are() {
        let turn = Rotation3::from_euler_angles(0.5, -0.7, 0.1);
        let edges = [0, 1, 2].map(|axis| turn * Vector3::ith(axis, 1.0));
        let vertex = Vector3::new(0.1, -0.05, 0.8);
        let ends = edges.map(|edge| vertex + edge * 0.3);
        let ray = |end: Vector3<f64>| FittedRay {
            normal: vertex.cross(&end).normalize(),
            covariance: Matrix2::identity() * 1e-8,
            toward: end.normalize(),
            support: 50,
            residual_rms_rad: 1e-4,
        };
        let corner = CornerFeature::from_rays(ends.map(ray)).unwrap();
        let other_from_own = RigidMotion {
            rotation: *Rotation3::from_euler_angles(0.0, 0.2, 0.0).matrix(),
            translation_m: Vector3::new(-0.3, 0.02, 0.1),
        };
        let found = ExpectedCorner::transferred(&corner, &edges, vertex.norm(), &other_from_own).unwrap();
        assert!(found.vertex.angle(&other_from_own.point(&vertex)) < 1e-7, "{found:?}");
        for (far, end) in found.far.iter().zip(&ends) {
            assert!(far.angle(&other_from_own.point(end)) < 1e-7, "{found:?}");
        }
        // No point of an edge that goes the other way is seen where the ray is.
        let away = edges.map(|edge| -edge);
        assert!(ExpectedCorner::transferred(&corner, &away, vertex.norm(), &other_from_own).is_none());
        // The other camera is where the vertex is.
        let there = RigidMotion { rotation: Matrix3::identity(), translation_m: -vertex };
        assert!(ExpectedCorner::transferred(&corner, &edges, vertex.norm(), &there).is_none());
    }
}
