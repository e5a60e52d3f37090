//! One battery over a zoo of calibrations, from the axis to the rim, and no input that panics.

#![allow(clippy::unwrap_used)]

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

#[test]
fn a_resized_image_sees_the_same() {
    for (name, camera) in ZOO.iter() {
        for factor in [0.5, 2.0] {
            let resized = camera.scaled(factor).unwrap();
            assert_eq!(resized.is_mirrored(), camera.is_mirrored(), "{name}");
            let mut seen = 0;
            for k in 0..400 {
                let (u, v) = (f64::from(k % 20) / 20.0, f64::from(k / 20) / 20.0);
                let pixel = Vector2::new(u * f64::from(camera.width()), v * f64::from(camera.height()));
                let place = (pixel + Vector2::repeat(0.5)) * factor - Vector2::repeat(0.5);
                if let (Some(a), Some(b)) = (camera.unproject(&pixel), resized.unproject(&place)) {
                    // An image of odd sides is not of half the size to the last pixel, and a panorama is stretched over it.
                    let slack = if matches!(camera.model(), Model::Equirectangular(_)) { 0.01 } else { 1e-7 };
                    assert!(angle_between(&a, &b) < slack, "{name} times {factor} at {pixel:?}: {a:?} {b:?}");
                    seen += 1;
                }
            }
            assert!(seen > 20, "{name} times {factor}: {seen}");
        }
        assert!(camera.scaled(0.0).is_err() && camera.scaled(f64::NAN).is_err() && camera.scaled(1e9).is_err());
    }
}

#[test]
fn parameters_make_the_same_model_again() {
    for (name, camera) in ZOO.iter() {
        let model = camera.model();
        let parameters: Vec<_> = model.parameters().into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let again = Model::from_parameters(model.name(), camera.width(), camera.height(), &parameters);
        assert_eq!(again.as_ref(), Ok(model), "{name}");
    }
}

#[test]
fn scaramuzza_sees_right_to_the_right_and_down_below() {
    let scalars = [("cx", 400.0), ("cy", 300.0)];
    for (a0, front) in [(-200.0, 1.0), (200.0, -1.0)] {
        let ocam = camera("ocam", [800, 600], &scalars, &[("polynomial", &[a0, 0.0, -a0 * 1e-5])]);
        let see = |u, v| ocam.unproject(&Vector2::new(u, v)).unwrap_or_else(Vector3::zeros);
        assert_eq!(see(400.0, 300.0), Vector3::new(0.0, 0.0, front));
        assert!(see(500.0, 300.0).x > 0.1 && see(500.0, 300.0).y == 0.0);
        assert!(see(400.0, 400.0).y > 0.1 && see(400.0, 400.0).x == 0.0);
        // (x, y, f) = (100, 0, a0 (1 - 0.1)): the ray of the file, seen from the back.
        let expected = Vector3::new(0.0, 100.0, -a0 * 0.9).normalize();
        assert!((see(400.0, 400.0) - expected).norm() < 1e-15);
        let narrow = ocam.with_max_theta_rad(0.3).unwrap();
        assert!(narrow.project(&Vector3::new(0.1, 0.0, front)).is_some());
        assert!(narrow.project(&Vector3::new(0.1, 0.0, -front)).is_none());
        assert!(narrow.mirrored().project(&Vector3::new(0.1, 0.0, -front)).is_some());
    }
}

#[test]
fn scaramuzza_inverse_polynomial_is_judged_not_used() {
    let of = |name: &str| ZOO.iter().find(|entry| entry.0 == name).map(|entry| entry.1.clone()).unwrap();
    let (with, without) = (of("ocam affine, 33 inverse terms"), of("ocam affine"));
    let ray = Vector3::new(0.6, -0.5, -0.2);
    assert_eq!(with.project(&ray), without.project(&ray));
    let judged = |camera: &Camera| match camera.model() {
        Model::Ocam(ocam) => ocam.inverse_polynomial_error_px(2.0),
        _ => None,
    };
    assert!(judged(&with).is_some_and(|error| error > 0.01));
    assert_eq!(judged(&without), None);
}

#[test]
fn kannala_brandt_is_right_at_95_degrees_and_stops_at_its_fold() {
    let theta = 95f64.to_radians();
    // r' = 1 - 0.21 theta^2 - 0.01 theta^4 has its root at theta = 2.
    let k = [-0.07, -0.002, 0.0, 0.0];
    let folding = KannalaBrandt::new([277.0, 277.0], [320.0, 240.0], k).unwrap();
    let camera = Camera::new(640, 480, folding.into()).unwrap();
    let rim = camera.max_theta_rad();
    assert!(theta < rim && rim < 2.0 && rim > 2.0 - 1e-3, "{}", rim.to_degrees());
    let radius: f64 = theta * (1.0 + (1..=4).zip(k).map(|(i, k)| k * theta.powi(2 * i)).sum::<f64>());
    let pixel = camera.project(&Vector3::new(theta.sin(), 0.0, theta.cos())).unwrap();
    assert!((pixel - Vector2::new(320.0 + 277.0 * radius, 240.0)).norm() < 1e-10);
    assert!(camera.project(&Vector3::new((rim + 1e-6).sin(), 0.0, (rim + 1e-6).cos())).is_none());
}

#[test]
fn sphere_models_end_where_their_papers_say() {
    let rim = |xi: f64| {
        Unified::new(xi, [500.0, 500.0], [320.0, 240.0], [0.0; 5], 0.0)
            .map_or(0.0, |m| Model::from(m).as_dyn().max_theta_rad())
    };
    assert!((rim(0.5) - (-0.5f64).acos()).abs() < 1e-5);
    // At a fold the last part of the way is left out, where neighbouring rays cannot be told apart.
    let fold = (-0.5f64).acos();
    assert!(rim(2.0) < fold && rim(2.0) > fold - 3e-3, "{} {fold}", rim(2.0));
}

#[test]
fn batches_are_the_single_answers() {
    for (name, camera) in ZOO.iter() {
        let bearings: Vec<[f64; 3]> =
            (1..201).map(f64::from).map(|i| [(i * 0.7).sin(), (i * 1.3).cos(), (i * 0.31).sin()]).collect();
        let mut pixels = vec![[0.0; 2]; bearings.len()];
        let mut jacobians = vec![Matrix2x3::zeros(); bearings.len()];
        let mut back = vec![Vector3::zeros(); bearings.len()];
        let mut back_jacobians = vec![Matrix3x2::zeros(); bearings.len()];
        camera.project_all(&bearings, &mut pixels).unwrap();
        camera.project_jacobian_all(&bearings, &mut vec![Vector2::zeros(); 200], &mut jacobians).unwrap();
        camera.unproject_jacobian_all(&pixels, &mut vec![[0.0; 3]; 200], &mut back_jacobians).unwrap();
        camera.unproject_all(&pixels, &mut back).unwrap();
        for i in 0..bearings.len() {
            let bearing = Vector3::from(bearings[i]);
            match camera.project(&bearing) {
                Some(pixel) => {
                    assert_eq!(pixel, Vector2::from(pixels[i]), "{name}");
                    assert!(angle_between(&back[i], &bearing) < 1e-9, "{name} {bearing:?} {:?}", back[i]);
                    assert_eq!(
                        camera.project_jacobian(&bearing).map(|j| j.1),
                        Some(jacobians[i]),
                        "{name} {bearing:?} {pixel:?}"
                    );
                    assert_eq!(
                        camera.unproject_jacobian(&pixel).map(|j| j.1),
                        Some(back_jacobians[i]),
                        "{name} {bearing:?} {pixel:?}"
                    );
                }
                None => assert!(pixels[i][0].is_nan() && jacobians[i][(0, 0)].is_nan() && back[i].x.is_nan(), "{name}"),
            }
        }
        assert!(camera.project_all(&bearings, &mut [[0.0; 2]; 3]).is_err());
    }
}

#[test]
fn a_limit_is_an_angle_from_the_axis_however_long_the_bearing() {
    let lens = || Model::from(Equidistant::new(190.0, 319.5, 319.5).unwrap());
    for limit in [1e-3, 0.3, 1.5, std::f64::consts::FRAC_PI_2, 2.0, 3.0, 3.13] {
        let camera = Camera::new(640, 640, lens()).unwrap().with_max_theta_rad(limit).unwrap();
        for (theta, inside) in
            [(limit * (1.0 - 1e-9), true), (limit * (1.0 + 1e-9), false), (0.0, true), (3.141_592_5, false)]
        {
            let bearing = Vector3::new(theta.sin(), 0.0, theta.cos());
            for length in [1e-6, 1.0, 1e6] {
                assert_eq!(camera.project(&(bearing * length)).is_some(), inside, "{limit} {theta} {length}");
                assert_eq!(
                    camera.clone().mirrored().project(&Vector3::new(bearing.x, 0.0, -bearing.z)).is_some(),
                    inside
                );
            }
        }
    }
}

#[test]
fn a_bearing_too_short_to_square_is_seen_with_and_without_jacobian_or_not_at_all() {
    for (name, camera) in ZOO.iter() {
        for length in [1e-100, 1e-153, 1e-160, 1e-300, 1e-320] {
            for direction in [Vector3::z(), Vector3::new(0.1, 0.2, 0.8), Vector3::new(0.5, 0.0, -0.1)] {
                let bearing = direction * length;
                let seen = camera.project(&bearing);
                assert_eq!(seen.is_some(), camera.project_jacobian(&bearing).is_some(), "{name} {bearing:?}");
            }
        }
    }
}

/// Pixels far from the centre see rays that graze the rim, where a difference of nearly equal numbers tells the bearing least.
#[test]
fn grazing_rays_of_a_sphere_come_back() {
    for away_px in [1e3, 1e5, 1e7] {
        let parameters = [("xi", 0.501_861), ("fx", 500.0), ("fy", 500.0), ("cx", -away_px), ("cy", 480.0)];
        let given = parameters.map(|(name, x)| (name.to_owned(), Parameter::Scalar(x)));
        let camera = Camera::new(1280, 960, Model::from_parameters("unified", 1280, 960, &given).unwrap()).unwrap();
        let pixel = Vector2::new(3.0, 700.0);
        let back = camera.project(&camera.unproject(&pixel).unwrap()).unwrap();
        // The bearing's rounding is seen enlarged by the square of the distance in focal lengths.
        let allowed = 1e-13 * away_px * (1.0 + away_px / 500.0);
        assert!((back - pixel).amax() < allowed, "{away_px} {back:?} {allowed:e}");
    }
}

#[test]
fn a_panorama_must_fill_its_image() {
    let panorama = Model::from_parameters("equirectangular", 1024, 512, &[]).unwrap();
    assert!(matches!(Camera::new(1024, 513, panorama), Err(Error::InvalidCamera { .. })));
}

/// Numbers of every kind: tame, huge, tiny, zero, infinite, not a number.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0f64,
        2 => -2000.0..2000.0f64,
        1 => prop::num::f64::ANY,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e-300]),
    ]
}

/// Everything a camera can be asked; answers must be finite, unit, and inverses near enough to say where they came from.
fn ask(camera: &Camera, a: f64, b: f64, c: f64) {
    let (bearing, pixel) = (Vector3::new(a, b, c), Vector2::new(a, b));
    if let Some(pixel) = camera.project(&bearing) {
        assert!(pixel.iter().all(|x| x.is_finite()), "{camera:?} {bearing:?} {pixel:?}");
    }
    if let Some(bearing) = camera.unproject(&pixel) {
        assert!((bearing.norm() - 1.0).abs() < 1e-12, "{camera:?} {pixel:?} {bearing:?}");
    }
    let _ = (camera.project_jacobian(&bearing), camera.unproject_jacobian(&pixel), camera.contains(&pixel));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn no_question_panics(i in 0..1000usize, a in any_number(), b in any_number(), c in any_number()) {
        ask(&ZOO[i % ZOO.len()].1, a, b, c);
    }

    #[test]
    fn no_parameters_panic(
        i in 0..1000usize, numbers in prop::collection::vec(any_number(), 12), n in 0..12usize, positive in any::<bool>(),
        a in any_number(), b in any_number(), c in any_number(),
    ) {
        let model = ZOO[i % ZOO.len()].1.model();
        let mut next = numbers.iter().cycle().copied();
        let parameters: Vec<_> = model.parameters().into_iter().map(|(key, value)| {
            let x = next.next().unwrap_or(0.0);
            let tame = positive && ["fx", "fy", "focal_px", "alpha", "beta", "xi", "c", "aspect_ratio"].contains(&key);
            (key.to_owned(), match value {
                Parameter::Scalar(_) => Parameter::Scalar(if tame { (x.abs() * 0.3).min(1e3) } else { x }),
                Parameter::List(_) => Parameter::List(numbers.iter().copied().skip(1).take(n).collect()),
            })
        }).collect();
        match Model::from_parameters(model.name(), 64, 48, &parameters).and_then(|m| Camera::new(64, 48, m)) {
            Ok(camera) => {
                ask(&camera, a, b, c);
                ask(&camera, a * 1e-3, b * 1e-3, 1.0);
                prop_assert!(camera.max_theta_rad() > 0.0 && camera.max_theta_rad() <= std::f64::consts::PI);
            }
            Err(error) => prop_assert!(matches!(error, Error::InvalidCamera { .. }), "{error}"),
        }
    }

    #[test]
    fn scaramuzza_of_any_sane_shape_inverts(
        a0 in 50.0..600.0f64, back in any::<bool>(), shape in prop::collection::vec(-0.6..0.6f64, 0..7),
        part in 0.0..0.999_999f64, phi in 0.0..6.3f64,
    ) {
        let sign = if back { 1.0 } else { -1.0 };
        let mut polynomial = vec![sign * a0, 0.0];
        polynomial.extend(shape.iter().zip(2..).map(|(b, i)| -sign * b * a0 * a0.powi(-i)));
        let ocam = camera("ocam", [800, 600], &[("cx", 400.0), ("cy", 300.0)], &[("polynomial", &polynomial)]);
        let Model::Ocam(model) = ocam.model() else { return Ok(()) };
        let rho = part * model.max_rho_px();
        let pixel = Vector2::new(400.0 + rho * phi.cos(), 300.0 + rho * phi.sin());
        let back = ocam.unproject(&pixel).and_then(|bearing| ocam.project(&bearing));
        prop_assert!(back.is_some_and(|p| (p - pixel).norm() <= 1e-12 * (1e6 + rho)), "{:?} {:?} {}", back, pixel, model.max_rho_px());
    }

    #[test]
    fn no_two_rays_of_a_unified_sphere_that_folds_share_a_pixel(
        xi in 0.0..1.0f64, k1 in -0.2..-0.001f64, k2 in -0.2..0.0f64, phi in 0.0..6.3f64, beyond in 1e-6..1.0f64,
    ) {
        let numbers = [("xi", xi), ("fx", 300.0), ("fy", 300.0), ("cx", 320.0), ("cy", 240.0), ("k1", k1), ("k2", k2)];
        let unified = camera("unified", [640, 480], &numbers, &[]);
        let ray = |theta: f64| Vector3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let rim = unified.max_theta_rad();
        let mut last = -1.0;
        for i in 0..100 {
            let theta = rim * f64::from(i) / 100.0;
            let pixel = unified.project(&ray(theta));
            let away = pixel.map_or(f64::NAN, |pixel| (pixel - Vector2::new(320.0, 240.0)).norm());
            prop_assert!(away > last, "{theta} of {rim}: {away} after {last}");
            last = away;
            let back = pixel.and_then(|pixel| unified.unproject(&pixel));
            prop_assert!(back.is_some_and(|back| angle_between(&back, &ray(theta)) < 1e-9), "{theta} of {rim}: {back:?}");
        }
        let theta = rim + beyond * (std::f64::consts::PI - rim);
        prop_assert!(unified.project(&ray(theta)).is_none(), "{theta} of {rim}");
    }
}
