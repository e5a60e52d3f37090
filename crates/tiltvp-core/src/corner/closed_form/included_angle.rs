//! The inverse problem (section III-E): the included angle of the horizontal edges, from a known attitude.

use nalgebra::{Matrix3, Vector3};

use super::attitude::IncludedAngle;
use crate::corner::feature::CornerFeature;

/// The angle between the horizontal edges of a corner whose vertical direction is known, with its standard deviation.
///
/// `vertical` is the direction of the vertical edge or its opposite in the camera frame, a unit vector (of an attitude
/// `camera_from_object` the second column); `vertical_covariance` that of the rotation vector of the camera frame that its
/// error is, square radians, independent of the feature's. The edges lie in their half-planes and are perpendicular to the
/// vertical, which is all that is needed: not even the vertical ray.
///
/// `None` where the vertex is seen along a horizontal direction, within 1e-9: the planes of both edges then hold the
/// same horizontal line of sight and do not depend on the angle.
pub fn included_angle(
    feature: &CornerFeature,
    vertical: &Vector3<f64>,
    vertical_covariance: &Matrix3<f64>,
) -> Option<IncludedAngle> {
    let pencil = &feature.pencil;
    let upright = vertical.dot(&pencil.vertex);
    if upright.abs() <= 1e-9 || upright.is_nan() {
        return None;
    }
    // Both edges, how they turn about the vertical with the errors of the pencil's vertex and of the vertical.
    let mut edges = [Vector3::zeros(); 2];
    let (mut by_vertex, mut by_vertical) = ([Vector3::zeros(); 2], [Vector3::zeros(); 2]);
    let mut noise = 0.0;
    for (place, i) in [0, 2].into_iter().enumerate() {
        let (along, normal) = (pencil.along[i], pencil.normal[i]);
        let edge = (along * upright - pencil.vertex * vertical.dot(&along)).normalize() * upright.signum();
        let aside = vertical.cross(&edge);
        let (sine, cosine) = (edge.dot(&along), edge.dot(&pencil.vertex));
        let turning = normal.dot(&aside);
        by_vertex[place] = normal * ((cosine + pencil.lever[i] * sine) / turning);
        // (w x vertical) . edge = w . (vertical x edge).
        by_vertical[place] = aside * (normal.dot(vertical) / turning);
        noise += (sine / turning).powi(2) * pencil.noise[i];
        edges[place] = edge;
    }
    let [x, z] = edges;
    let (apart, tilted) = (by_vertex[1] - by_vertex[0], by_vertical[1] - by_vertical[0]);
    let variance = apart.dot(&(pencil.vertex_covariance * apart)) + tilted.dot(&(vertical_covariance * tilted)) + noise;
    let (gamma_rad, sigma_rad) = (x.cross(&z).norm().atan2(x.dot(&z)), variance.max(0.0).sqrt());
    gamma_rad.is_finite().then_some(IncludedAngle { gamma_rad, sigma_rad })
}
