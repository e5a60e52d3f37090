//! The vector-consensus method of paper 000, section 2.2: the common direction of great circles, by random sampling.

use nalgebra::{Matrix3, Vector3};

use crate::robust::{Direction, FitReport, RansacOptions, RansacScratch, Rows, ransac};

/// Eqs. 36 to 41: samples pairs of normals, then solves `m . o = 0` over the consensus set with `(1, 1, 1) . o_camera = 1` added.
///
/// The threshold of the options is the sine of an angle; `quality` orders the rows for progressive sampling.
pub(super) fn vector_consensus(
    rows: &Rows<f32>,
    quality: &[f32],
    robot_from_camera: &Matrix3<f64>,
    options: &RansacOptions,
    weights: &mut [f32],
    scratch: &mut RansacScratch,
) -> FitReport<Vector3<f64>> {
    let plane = robot_from_camera * Vector3::new(1.0, 1.0, 1.0);
    let problem = Direction::with_plane(rows, plane).with_quality(quality);
    ransac(&problem, options, &Vector3::z(), weights, scratch)
}
