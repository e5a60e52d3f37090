//! One battery over a zoo of calibrations, from the axis to the rim, and no input that panics.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2, Vector3};
use proptest::prelude::*;
use std::sync::LazyLock;
use tiltvp_core::Error;
use tiltvp_core::camera::{Camera, Equidistant, KannalaBrandt, Model, Parameter, Unified, conformance};
use tiltvp_core::geometry::angle_between;
use tiltvp_core::testing::{JACOBIAN_RELATIVE, ROUND_TRIP_PX, camera, with_margin, zoo};

static ZOO: LazyLock<Vec<(&'static str, Camera)>> = LazyLock::new(zoo);

#[test]
fn every_camera_of_the_zoo_keeps_its_promises() {
    let mut wrong = Vec::new();
    for (name, camera) in ZOO.iter() {
        for (size, camera) in [("", camera.clone()), (" (to the rim)", with_margin(camera, 3000))] {
            let found = conformance(&camera);
            println!(
                "{name}{size}: {} pixels, round trip {:.1e} px {:.1e} rad, length {:.1e}, Jacobian {:.1e} (differences {:.1e}, \
                 inverse {:.1e}), rim {:.3} of {:.3} deg, worst at {:?}",
                found.pixels_tested,
                found.max_round_trip_px,
                found.max_round_trip_rad,
                found.max_length_error,
                found.max_jacobian_error_relative,
                found.max_difference_error_relative,
                found.max_inverse_error,
                found.rim_theta_rad.to_degrees(),
                camera.max_theta_rad().to_degrees(),
                found.worst_jacobian_px,
            );
            let right = found.pixels_tested > 500
                && found.pixels_lost == 0
                && found.pixels_without_jacobian <= 200
                && found.max_round_trip_px <= ROUND_TRIP_PX
                && found.max_length_error <= 1e-14
                && found.max_jacobian_error_relative <= JACOBIAN_RELATIVE
                && found.max_inverse_error <= JACOBIAN_RELATIVE;
            if !right {
                wrong.push(format!("{name}{size}: {found:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
