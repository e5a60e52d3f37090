//! Corners of any rays: no pose, or poses that are rotations, look like their rays and have covariances.

use nalgebra::{Matrix2, Matrix3, Rotation3, SMatrix, Vector3};
use tiltvp_core::corner::{
    Alignment, AttitudePrior, BearingObservation, CornerFeature, CornerOptions, FittedRay, IncludedAngle, Screening,
    VerticalSense, View, corner_attitudes, corner_poses, included_angle, resolve, triangulate,
};
use tiltvp_core::filter::positive_semidefinite;
use tiltvp_core::geometry::{RigidMotion, validate_rotation};

use crate::bytes::Bytes;
use crate::image::feature;

/// One corner or the same seen twice, by exact bearings or by fitted rays.
pub fn corner(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let angle = IncludedAngle {
        gamma_rad: if bytes.flag() { std::f64::consts::FRAC_PI_2 } else { bytes.mostly(0.0, 3.2) },
        sigma_rad: if bytes.flag() { 0.0 } else { bytes.mostly(0.0, 0.3) },
    };
    let Some(left) = seen(&mut bytes) else { return };
    feature(&left);
    let Ok(attitudes) = corner_attitudes(&left, &angle) else { return };
    for attitude in attitudes.iter() {
        let what = || format!("{left:?} {angle:?} {attitude:?}");
        assert!(validate_rotation(&attitude.camera_from_object).is_ok(), "{}", what());
        assert!(attitude.edges.iter().all(|edge| (edge.norm() - 1.0).abs() < 1e-9), "{}", what());
        assert!((0.0..=std::f64::consts::PI).contains(&attitude.alpha_rad), "{}", what());
        assert!(attitude.sensitivity >= 0.0 && !attitude.ln_volume.is_nan(), "{}", what());
        let covariance = attitude.covariance;
        assert!(is_covariance(&covariance) || covariance[(0, 0)].is_infinite(), "{}", what());
    }
    let _ = Screening::of(&left, &angle);
    if let Some(found) = included_angle(&left, &direction(&mut bytes), &(Matrix3::identity() * bytes.mostly(0.0, 0.1)))
    {
        assert!((0.0..=std::f64::consts::PI).contains(&found.gamma_rad), "{left:?} {found:?}");
    }
    let priors = priors(&mut bytes);
    let right_handed = bytes.flag().then(|| bytes.flag());
    let views = [View { attitudes: &attitudes, common_from_camera: Matrix3::identity() }];
    if let Ok(found) = resolve(&views, Alignment::Same, right_handed, &priors) {
        probabilities(found.iter().map(|one| one.probability));
        for one in &found {
            assert!(validate_rotation(&one.common_from_object).is_ok(), "{one:?}");
        }
    }
    let Some(right) = seen(&mut bytes) else { return };
    let (turn, place) = (rotation(&mut bytes), vector(&mut bytes));
    let Ok(left_from_right) = RigidMotion::new("left_from_right", turn, place) else { return };
    let options = CornerOptions { angle, right_handed, priors, fuse: bytes.flag() };
    if let Ok(found) = corner_poses(&left, &right, &left_from_right, &options) {
        probabilities(found.iter().map(|one| one.probability));
        for one in &found {
            assert!(validate_rotation(&one.camera_from_object).is_ok(), "{one:?}");
            assert!(one.vertex_m.iter().all(|x| x.is_finite()), "{one:?}");
            assert!(is_covariance(&one.covariance) || !one.covariance.iter().all(|x| x.is_finite()), "{one:?}");
            assert!(one.covariance.iter().all(|x| !x.is_nan()), "{one:?}");
        }
    }
}

/// The point of bearings of any kind, of which a camera may be anywhere.
pub fn point(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let observations: Vec<_> = (0..bytes.below(5))
        .map(|_| BearingObservation {
            bearing: direction(&mut bytes),
            covariance: spread(&mut bytes),
            rig_from_camera: RigidMotion { rotation: rotation(&mut bytes), translation_m: vector(&mut bytes) },
        })
        .collect();
    let Some(found) = triangulate(&observations) else { return };
    assert!(found.point_m.iter().all(|x| x.is_finite()) && found.chi_square >= 0.0, "{observations:?} {found:?}");
    assert!(is_covariance(&found.covariance_m2), "{observations:?} {found:?}");
}

/// A covariance, of which what is below the floats' own precision says nothing.
fn is_covariance<const N: usize>(matrix: &SMatrix<f64, N, N>) -> bool {
    matrix.amax() < 1e-290 || positive_semidefinite(matrix)
}

/// Probabilities of all there is add up to one, but for those below 1e-9 of which there are at most four times four.
fn probabilities(all: impl ExactSizeIterator<Item = f64> + Clone) {
    let sum: f64 = all.clone().sum();
    assert!(all.len() == 0 || (1.0 - 17e-9..=1.0 + 1e-9).contains(&sum), "{:?}", all.collect::<Vec<_>>());
    assert!(all.clone().all(|p| (0.0..=1.0 + 1e-12).contains(&p)), "{:?}", all.collect::<Vec<_>>());
}

fn vector(bytes: &mut Bytes<'_>) -> Vector3<f64> {
    Vector3::from_fn(|_, _| bytes.mostly(-1.0, 1.0))
}

/// Mostly of length one.
fn direction(bytes: &mut Bytes<'_>) -> Vector3<f64> {
    let any = vector(bytes);
    if bytes.byte() < 250 { any.try_normalize(1e-9).unwrap_or(any) } else { any }
}

fn rotation(bytes: &mut Bytes<'_>) -> Matrix3<f64> {
    let axis = vector(bytes);
    if bytes.byte() < 250 {
        Rotation3::from_scaled_axis(axis * 3.0).into_inner()
    } else {
        Matrix3::from_diagonal(&axis)
    }
}

/// Mostly a covariance, of any size.
fn spread(bytes: &mut Bytes<'_>) -> Matrix2<f64> {
    let size = 10f64.powi(-i32::from(bytes.byte() % 16));
    let (a, b, c) = (bytes.mostly(0.0, 1.0), bytes.mostly(-1.0, 1.0), bytes.mostly(0.0, 1.0));
    if bytes.byte() < 240 {
        Matrix2::new(a, b * (a * c).abs().sqrt(), b * (a * c).abs().sqrt(), c) * size
    } else {
        Matrix2::new(a, b, c, a)
    }
}

fn seen(bytes: &mut Bytes<'_>) -> Option<CornerFeature> {
    if bytes.flag() {
        return CornerFeature::from_bearings(&vector(bytes), &std::array::from_fn(|_| vector(bytes)));
    }
    CornerFeature::from_rays(std::array::from_fn(|_| FittedRay {
        normal: direction(bytes),
        covariance: spread(bytes),
        toward: direction(bytes),
        support: bytes.byte().into(),
        residual_rms_rad: bytes.mostly(0.0, 0.1),
    }))
}

fn priors(bytes: &mut Bytes<'_>) -> Vec<AttitudePrior> {
    (0..bytes.below(3))
        .map(|_| {
            let (sigma_rad, sense) = (bytes.mostly(0.0, 1.0), VerticalSense::ALL[bytes.below(3)]);
            match bytes.below(3) {
                0 => AttitudePrior::Gravity { down: direction(bytes), sigma_rad, sense },
                1 => AttitudePrior::Elevation { elevation_rad: bytes.mostly(-1.6, 1.6), sigma_rad, sense },
                _ => AttitudePrior::Attitude {
                    camera_from_object: rotation(bytes),
                    covariance: Matrix3::from_diagonal(&vector(bytes).map(|x| x * x)),
                },
            }
        })
        .collect()
}
