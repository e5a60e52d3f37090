//! The vector-consensus method of paper 000, section 2.2: the common direction of great circles, by random sampling.

use nalgebra::{Matrix3, Vector3};

use crate::robust::{Direction, FitReport, RansacOptions, Rows, ransac};

/// Eqs. 36 to 41: samples pairs of normals, then solves `m . o = 0` over the consensus set with `(1, 1, 1) . o_camera = 1` added.
pub(super) fn vector_consensus(
    rows: &Rows<f32>,
    robot_from_camera: &Matrix3<f64>,
    threshold_rad: f64,
    seed: u64,
    weights: &mut [f32],
) -> FitReport<Vector3<f64>> {
    let problem = Direction::with_plane(rows, robot_from_camera * Vector3::new(1.0, 1.0, 1.0));
    let options = RansacOptions { seed, ..RansacOptions::with_threshold(threshold_rad.sin()) };
    ransac(&problem, &options, &Vector3::z(), weights)
}
