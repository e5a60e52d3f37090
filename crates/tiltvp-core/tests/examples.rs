//! The programs in `examples`, run on data with known answers.

#![allow(clippy::unwrap_used, clippy::expect_used)]

mod scene;

use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nalgebra::{Matrix3, Rotation2, Rotation3, Vector2, Vector3};
use scene::{fisheye, stripes};
use tiltvp_core::geometry::Tilt;

/// Runs an example; Cargo builds them beside the tests.
fn run(name: &str, arguments: &[&str]) -> Output {
    let program = std::env::current_exe().unwrap();
    let built = program.parent().and_then(Path::parent).unwrap().join("examples");
    Command::new(built.join(name))
        .args(arguments)
        .output()
        .expect("a whole `cargo test` builds them first, or `cargo build --examples`")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The numbers of a text, in order.
fn numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
    words.filter_map(|word| word.parse().ok()).collect()
}

/// A file of the tests of this file.
fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn tilt_of_a_picture() {
    let camera = fisheye(480);
    let tilt = Tilt::from_alpha_beta(3f64.to_radians(), 40f64.to_radians());
    let image = stripes(&camera, &Matrix3::identity(), &tilt, 37, 2.0, 5);
    let path = file("stripes.png");
    let mut encoder = png::Encoder::new(File::create(&path).unwrap(), 480, 480);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&image.data).unwrap();

    let focal_px = (0.46 * 480.0 / 92.5f64.to_radians()).to_string();
    let done = run("tilt", &[path.to_str().unwrap(), &focal_px]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let found = numbers(&text(&done.stdout));
    let estimate = Tilt::from_alpha_beta(found[0].to_radians(), found[1].to_radians());
    assert!(estimate.angle_to(&tilt).to_degrees() < 0.3, "{found:?}");
}

/// The mounting of `log`, x and y in metres and the yaw in radians, and the distance between the wheels.
const MOUNTING: (f64, f64, f64) = (0.25, -0.1, 0.6);
const WHEEL_BASE_M: f64 = 0.4;

/// Tables of a drive without noise that goes straight on and turns in place in turn, past twelve posts.
fn log() -> (String, String) {
    let posts: Vec<_> =
        (0..12u8).map(|k| Rotation2::new(0.55 * f64::from(k)) * Vector2::new(1.5 + 0.2 * f64::from(k), 0.0)).collect();
    let mut odometry = String::from("step,delta_left_m,delta_right_m\n");
    let mut bearings = String::from("step,landmark,bearing_rad\n");
    let (mut place, mut heading) = (Vector2::zeros(), 0.0);
    for step in 0..240 {
        let (distance_m, turn_rad) = if step % 40 < 20 { (0.03, 0.0) } else { (0.0, 0.11) };
        place += Rotation2::new(heading) * Vector2::new(distance_m, 0.0);
        heading += turn_rad;
        let half = 0.5 * turn_rad * WHEEL_BASE_M;
        writeln!(odometry, "{step},{},{}", distance_m - half, distance_m + half).unwrap();
        let camera = place + Rotation2::new(heading) * Vector2::new(MOUNTING.0, MOUNTING.1);
        for (name, post) in posts.iter().enumerate() {
            let seen = Rotation2::new(-heading - MOUNTING.2) * (post - camera);
            writeln!(bearings, "{step},{name},{}", seen.y.atan2(seen.x)).unwrap();
        }
    }
    (odometry, bearings)
}

#[test]
fn calibration_of_a_log() {
    let (odometry, bearings) = log();
    let paths = [file("odometry.csv"), file("bearings.csv")];
    std::fs::write(&paths[0], odometry).unwrap();
    std::fs::write(&paths[1], bearings).unwrap();
    let [odometry, bearings] = paths.each_ref().map(|path| path.to_str().unwrap());

    let done = run("calibrate", &[odometry, bearings, &WHEEL_BASE_M.to_string()]);
    assert!(done.status.success(), "{}{}", text(&done.stdout), text(&done.stderr));
    let found = numbers(&text(&done.stdout));
    let truth = [MOUNTING.0, MOUNTING.1, MOUNTING.2.to_degrees()];
    for (got, (want, bound)) in found.iter().zip(truth.into_iter().zip([0.003, 0.003, 0.3])) {
        assert!((got - want).abs() < bound, "{found:?}");
    }

    let wrong = run("calibrate", &[odometry, bearings, "0.6"]);
    assert!(!wrong.status.success(), "{}", text(&wrong.stdout));
}

#[test]
fn attitudes_of_a_corner() {
    let (focal_px, cx, cy) = (700.0, 639.5, 359.5);
    let rotation = Rotation3::from_euler_angles(0.6, 0.5, 0.4);
    let vertex = Vector3::new(0.1, -0.05, 1.5);
    let pixel = |point: Vector3<f64>| [focal_px * point.x / point.z + cx, focal_px * point.y / point.z + cy];
    let ends = [Vector3::x(), Vector3::y(), Vector3::z()].map(|edge| pixel(vertex + rotation * edge * 0.3));
    let given: Vec<String> =
        [focal_px, cx, cy].iter().chain(&pixel(vertex)).chain(ends.as_flattened()).map(f64::to_string).collect();

    let done = run("corner", &given.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(done.status.success(), "{}", text(&done.stderr));
    let printed = text(&done.stdout);
    let matrices = printed.split("known to").skip(1).map(|part| numbers(part).split_off(1));
    let right = matrices.map(|entries| Matrix3::from_row_slice(&entries[..9]));
    let nearest = right.map(|found| (found - rotation.matrix()).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-3, "{printed}");

    let flat = run("corner", &["700", "639.5", "359.5", "600", "300", "600", "300", "600", "400", "700", "300"]);
    assert!(text(&flat.stderr).contains("a point on the vertex"));
}
