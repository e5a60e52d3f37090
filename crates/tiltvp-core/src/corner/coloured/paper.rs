//! The front end as the paper has it: lines through midpoints between labels, and the vertex nearest to them (eqs. 25 to 27).

use nalgebra::{Matrix2, Vector2, Vector3};

use super::{CandidateLine, ColouredScratch, NEAR_SHARE_MAX, Window, find_lines};
use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::options::PaperOptions;
use crate::corner::ray::FittedRay;
use crate::filter::symmetric;
use crate::geometry::tangent_basis;
use crate::image::ColorView;

/// How many midpoints err together: those of one row of the gap, which hardly differ, and their neighbours.
const ERRING_TOGETHER: f64 = 20.0;

/// A line of the image plane z = 1, `normal . p = offset`, as its great circle has it.
#[derive(Debug, Clone, Copy)]
struct PlaneLine {
    normal: Vector2<f64>,
    offset: f64,
}

impl PlaneLine {
    /// None for a line at infinity.
    fn of(circle: &Vector3<f64>) -> Option<Self> {
        let length = circle.xy().norm();
        (length > 1e-9).then(|| Self { normal: circle.xy() / length, offset: -circle.z / length })
    }

    /// The great circle of the parallel line through a point of the plane.
    fn moved_to(&self, point: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(self.normal.x, self.normal.y, -self.normal.dot(point)).normalize()
    }
}

/// The cuboid's corner: all pixels labelled, all midpoints rectified, a line for each edge by RANSAC, the vertex with the least sum
/// of squared distances from the lines, and the rays through it, parallel to the lines. None where an edge has too few midpoints,
/// where the lines miss each other, and where the vertex is not in the plane z = 1, in which the paper calculates.
pub(crate) fn find(
    camera: &Camera,
    image: &ColorView<'_>,
    options: &PaperOptions,
    window: &Window,
    scratch: &mut ColouredScratch,
) -> Option<CornerFeature> {
    let lines = find_lines(camera, image, &options.lines, (1, usize::MAX), window, scratch)?;
    let [Some(x), Some(y), Some(z)] = lines.map(|line| PlaneLine::of(&line.normal)) else { return None };
    let in_plane = [x, y, z];
    let point = vertex(&in_plane)?;
    let bearing = Vector3::new(point.x, point.y, 1.0).normalize();
    if lines.iter().any(|line| line.middle.z <= 0.0) {
        return None;
    }
    if missed_px(&in_plane, &point, camera)? > options.residual_max_px {
        return None;
    }
    let mut rays = [None; 3];
    for ((ray, line), parallel) in rays.iter_mut().zip(&lines).zip(&in_plane) {
        *ray = Some(ray_through(&bearing, line, &parallel.moved_to(&point), options.line_sigma_px)?);
    }
    let [Some(x), Some(y), Some(z)] = rays else { return None };
    CornerFeature::from_rays([x, y, z])
}

/// How far lines of the plane z = 1 miss a point, root mean square, in pixels. None where the camera does not see it.
fn missed_px(lines: &[PlaneLine; 3], point: &Vector2<f64>, camera: &Camera) -> Option<f64> {
    let missed = lines.iter().map(|line| (line.normal.dot(point) - line.offset).powi(2)).sum::<f64>();
    let bearing = Vector3::new(point.x, point.y, 1.0);
    Some((missed / 3.0).sqrt() * camera.px_per_rad(&bearing.normalize())? / bearing.norm())
}

/// Eq. 27: the point with the least sum of squared distances from the lines.
fn vertex(lines: &[PlaneLine; 3]) -> Option<Vector2<f64>> {
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for line in lines {
        matrix += line.normal * line.normal.transpose();
        right += line.normal * line.offset;
    }
    Some(matrix.try_inverse()? * right).filter(|point| point.iter().all(|x| x.is_finite()))
}

/// A line as a ray away from the vertex, with the normal of the parallel through it; none if its midpoints lie as far on the one side
/// of the vertex as on the other. The paper has no covariances: this one is that of evenly spread midpoints which scatter as these
/// do, and of `sigma_px` across the line that all of them share.
fn ray_through(
    vertex: &Vector3<f64>,
    line: &CandidateLine,
    parallel: &Vector3<f64>,
    sigma_px: f64,
) -> Option<FittedRay> {
    let at = vertex.dot(&line.along).atan2(vertex.dot(&line.middle));
    let [low, high] = line.reach.map(|angle| angle - at);
    let (far, near) = if high.abs() >= low.abs() { (high, -low) } else { (low, high) };
    if near > NEAR_SHARE_MAX * far.abs() {
        return None;
    }
    let length = line.reach[1] - line.reach[0];
    let scatter = line.rms_rad.powi(2) * ERRING_TOGETHER / line.support as f64;
    let (offset, slope) = (scatter + (sigma_px / line.px_per_rad).powi(2), 12.0 * scatter / (length * length));
    let spread = line.middle * line.middle.transpose() * offset + line.along * line.along.transpose() * slope;
    let basis = tangent_basis(parallel);
    let (sin, cos) = (at + far).sin_cos();
    let toward = line.middle * cos + line.along * sin;
    Some(FittedRay {
        normal: *parallel,
        covariance: symmetric(&(basis.transpose() * spread * basis)),
        toward: (toward - parallel * parallel.dot(&toward)).try_normalize(1e-9)?,
        support: line.support,
        residual_rms_rad: line.rms_rad,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Model, Pinhole};

    #[test]
    fn what_lines_miss_the_vertex_by_is_told_in_pixels() {
        let lens = Pinhole::new([500.0, 500.0], [319.5, 239.5], &[]).unwrap();
        let camera = Camera::new(640, 480, Model::Pinhole(lens)).unwrap();
        // Through points 0.004 to the left and right of the axis, and one across both: they are 2, 2 and 0 pixels beside it.
        let upright = |offset: f64| PlaneLine { normal: Vector2::x(), offset };
        let lines = [upright(0.004), upright(-0.004), PlaneLine { normal: Vector2::y(), offset: 0.0 }];
        let point = vertex(&lines).unwrap();
        assert!(point.norm() < 1e-12);
        let expected = (8.0f64 / 3.0).sqrt();
        assert!((missed_px(&lines, &point, &camera).unwrap() - expected).abs() < 1e-9);
    }
}
