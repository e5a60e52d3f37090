//! Any three rays as those of a corner: no attitude, or attitudes that are rotations with finite covariances and probabilities.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use nalgebra::{Matrix3, Vector3};
use tiltvp_core::corner::{Alignment, CornerFeature, IncludedAngle, View, corner_attitudes, resolve};

#[derive(Debug, Arbitrary)]
struct Input {
    vertex: [f64; 3],
    toward: [[f64; 3]; 3],
    gamma_rad: f64,
    sigma_rad: Option<f64>,
    right_handed: Option<bool>,
}

fuzz_target!(|input: Input| {
    let toward = input.toward.map(Vector3::from);
    let Some(feature) = CornerFeature::from_bearings(&Vector3::from(input.vertex), &toward) else { return };
    let _ = (feature.chi_square(), feature.meets_probability(), feature.vertex_covariance());
    let mut angle = IncludedAngle::exact(input.gamma_rad);
    angle.sigma_rad = input.sigma_rad.unwrap_or(angle.sigma_rad);
    let Ok(attitudes) = corner_attitudes(&feature, &angle) else { return };
    for attitude in attitudes.iter() {
        let r = attitude.camera_from_object;
        assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-9, "no rotation: {r}");
    }
    let view = View { attitudes: &attitudes, common_from_camera: Matrix3::identity() };
    let Ok(resolved) = resolve(&[view], Alignment::default(), input.right_handed, &[]) else { return };
    let total: f64 = resolved.iter().map(|one| one.probability).sum();
    assert!(resolved.is_empty() || (total - 1.0).abs() < 1e-6, "probabilities add up to {total}");
});
