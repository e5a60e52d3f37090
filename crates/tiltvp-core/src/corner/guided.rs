//! A corner looked for where it is expected: near where it was, or where another camera says it is.

use nalgebra::Vector3;

use super::consensus::rays_apart;
use super::general::ERRING_TOGETHER;
use super::options::GeneralOptions;
use super::trace::{Course, TraceScratch, trace_every};
use super::vertex::CornerFeature;
use crate::camera::Camera;
use crate::geometry::RigidMotion;
use crate::image::{ImageView, LightTable};

/// Pixels about the vertex where the edges' gradients mix.
const CLEAR_OF_VERTEX_PX: f64 = 4.0;

/// How far beyond its end a ray is looked for, in pixels: what follows a ray must not shorten it from frame to frame.
const BEYOND_END_PX: f64 = 1.0;

/// Where a corner is expected: its vertex, and a bearing at the far end of each of the rays x, y, z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub(super) vertex: Vector3<f64>,
    pub(super) far: [Vector3<f64>; 3],
}

impl Expected {
    /// Where a corner was.
    pub(super) fn of(corner: &CornerFeature) -> Self {
        Self { vertex: corner.vertex(), far: corner.rays().map(|ray| ray.toward) }
    }

    /// Where a corner of one camera is seen by another if its vertex is `distance_m` away and its edges have these
    /// directions in the first camera's frame; none behind the other camera.
    pub(super) fn transferred(
        corner: &CornerFeature,
        edges: &[Vector3<f64>; 3],
        distance_m: f64,
        other_from_own: &RigidMotion,
    ) -> Option<Self> {
        let vertex = corner.vertex() * distance_m;
        let mut far = [Vector3::zeros(); 3];
        for ((far, ray), edge) in far.iter_mut().zip(corner.rays()).zip(edges) {
            // The point of the edge that is seen at the far end: vertex + s edge, along `toward`.
            let across = (
                Vector3::from(vertex) - ray.toward * ray.toward.dot(&vertex),
                edge - ray.toward * ray.toward.dot(edge),
            );
            let length_m = -across.0.dot(&across.1) / across.1.norm_squared();
            if !(length_m > 0.0 && length_m.is_finite()) {
                return None;
            }
            let point = vertex + edge * length_m;
            if point.dot(&ray.toward) <= 0.0 {
                return None;
            }
            *far = other_from_own.point(&point).try_normalize(1e-9)?;
        }
        Some(Self { vertex: other_from_own.point(&vertex).try_normalize(1e-9)?, far })
    }
}

/// The corner near where it is expected, at most `search_px` from there; none if its rays are not all seen.
pub(super) fn find_near(
    camera: &Camera,
    image: &ImageView<'_>,
    expected: &Expected,
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
    for (search_px, stride_px, least_share) in
        [(search_px, 3.0, 0.5 * options.guided_min_share), (options.search_px, 1.0, options.guided_min_share)]
    {
        let pixel = camera.project_jacobian(&vertex)?;
        if !camera.contains(&pixel.0) {
            return None;
        }
        let px_per_rad = pixel.1.norm() / 2f64.sqrt();
        let mut rays = [None; 3];
        for ((ray, normal), far) in rays.iter_mut().zip(normals).zip(&expected.far) {
            let normal = normal?;
            let course = Course {
                normal,
                vertex: (vertex - normal * normal.dot(&vertex)).try_normalize(0.5)?,
                from_rad: CLEAR_OF_VERTEX_PX / px_per_rad,
                to_rad: vertex.angle(far) + BEYOND_END_PX / px_per_rad,
                search_px,
                step_min: options.step_min,
                step_share_min: 0.0,
                threshold_px: options.threshold_px,
                erring_together: ERRING_TOGETHER,
                ray_sigma_px: options.ray_sigma_px,
            };
            let signal = |u, v| light.gray(image, u, v);
            let support_min = (f64::from(options.support_min_px) / stride_px) as usize;
            let traced = trace_every(stride_px, camera, &course, support_min, signal, scratch)?;
            if traced.share < least_share {
                return None;
            }
            *ray = Some(traced.ray);
        }
        let [Some(x), Some(y), Some(z)] = rays else { return None };
        let corner = CornerFeature::from_rays([x, y, z])?;
        let good = corner.residual_rad() * px_per_rad <= options.residual_max_px;
        if !good || !rays_apart(&corner, options.ray_angle_min_rad) {
            return None;
        }
        vertex = corner.vertex();
        normals = corner.rays().map(|ray| Some(ray.normal));
        found = Some(corner);
    }
    found
}
