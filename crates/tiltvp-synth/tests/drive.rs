//! Laws of drives: kinematics, encoders, free ways, determinism, and truth that lies on the edges of the pictures.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::Error;
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::geometry::{Tilt, wrap_angle};
use tiltvp_synth::{
    Drive, DriveOptions, Mount, RobotPose, RoomKind, RoomOptions, WallPattern, Way, Wheels, World, on_threads,
};

fn world(kind: RoomKind, seed: u64) -> Arc<World> {
    Arc::new(World::new(&RoomOptions { light_spacing_m: 1.0, ..RoomOptions::new(kind, seed) }).unwrap())
}

/// A 190-degree fisheye that looks up.
fn fisheye(side: u32, focal_px: f64) -> Camera {
    let middle = 0.5 * f64::from(side - 1);
    let lens = Equidistant::new(focal_px, middle, middle).unwrap();
    Camera::new(side, side, Model::Equidistant(lens)).unwrap().with_max_theta_rad(95f64.to_radians()).unwrap()
}

fn drive(world: &Arc<World>, options: DriveOptions) -> Drive {
    Drive::new(Arc::clone(world), fisheye(96, 28.0), options).unwrap()
}

#[test]
fn legs_are_driven_where_there_is_room() {
    let world = world(RoomKind::Office, 5);
    let legs = vec![(1.0, 0.0), (0.0, PI), (0.5, -0.5)];
    let options = DriveOptions { way: Way::Legs(legs), seed: 2, ..DriveOptions::default() };
    let drive = drive(&world, options.clone());
    let poses = &drive.trajectory().poses;
    assert_eq!(poses.len(), 1 + 20 + 40 + 10);
    let (first, turned, last) = (poses[0], poses[60], poses[70]);
    assert!(((first.x_m - turned.x_m).hypot(first.y_m - turned.y_m) - 1.0).abs() < 1e-9);
    assert!((wrap_angle(last.yaw_rad - first.yaw_rad) - wrap_angle(PI - 0.5)).abs() < 1e-9);
    assert!(poses.iter().all(|pose| world.is_free(pose.x_m, pose.y_m)));
    let refused = |legs| {
        Drive::new(Arc::clone(&world), fisheye(96, 28.0), DriveOptions { way: Way::Legs(legs), ..options.clone() })
    };
    assert!(matches!(refused(vec![(90.0, 0.0)]), Err(Error::InvalidArgument { .. })));
    assert!(matches!(refused(vec![]), Err(Error::InvalidOption { .. })));
    assert!(matches!(refused(vec![(f64::NAN, 0.0)]), Err(Error::InvalidOption { .. })));
}

#[test]
fn wheels_add_up_to_the_poses_exactly() {
    let options = DriveOptions { way: Way::Wander { frames: 400 }, seed: 5, ..DriveOptions::default() };
    let drive = drive(&world(RoomKind::Office, 1), options.clone());
    let way = drive.trajectory();
    assert_eq!([way.poses.len(), way.tilts.len(), way.displacements_m.len(), way.odometry_m.len()], [400; 4]);
    assert_eq!((way.displacements_m[0], way.odometry_m[0]), ([0.0; 2], [0.0; 2]));
    let mut pose = way.poses[0];
    for k in 1..400 {
        pose = options.wheels.moved(pose, way.displacements_m[k]);
        assert_eq!(pose, way.poses[k]);
        let (distance, turn) = options.wheels.motion(way.displacements_m[k]);
        assert!((0.0..=options.step_m + 1e-12).contains(&distance) && turn.abs() <= options.turn_max_rad + 1e-12);
    }
    let length: f64 = way.displacements_m.iter().map(|d| options.wheels.motion(*d).0).sum();
    assert!(length > 8.0, "{length} m");
}

/// A quarter of a circle of radius 1 m: the outer wheel rolls on a circle of 1.2 m.
#[test]
fn a_quarter_turn_ends_where_it_should() {
    let wheels = Wheels { base_m: 0.4, ..Wheels::default() };
    let quarter = std::f64::consts::FRAC_PI_2;
    let rolled = wheels.displacements(quarter, quarter);
    approx::assert_relative_eq!(rolled[1], 1.2 * quarter, epsilon = 1e-12);
    let mut pose = RobotPose::default();
    for _ in 0..10 {
        pose = wheels.moved(pose, rolled.map(|d| d / 10.0));
    }
    approx::assert_relative_eq!(pose.x_m, 1.0, epsilon = 1e-12);
    approx::assert_relative_eq!(pose.y_m, 1.0, epsilon = 1e-12);
    approx::assert_relative_eq!(pose.yaw_rad, quarter, epsilon = 1e-12);
}

/// Over 20,000 readings the normalised squares average to 1 within 4 standard deviations, sqrt(2 / 20000): false alarm 6e-5.
#[test]
fn encoders_err_by_the_model_of_chong_and_kleeman() {
    let wheels = Wheels { encoder_k_m: 3e-5, radius_errors: [0.02, -0.01], ..Wheels::default() };
    let options = DriveOptions { way: Way::Wander { frames: 10_001 }, wheels, ..DriveOptions::default() };
    let drive = drive(&world(RoomKind::Corridor, 1), options);
    let way = drive.trajectory();
    let (mut sum, mut count) = (0.0, 0.0);
    for (rolled, read) in way.displacements_m.iter().zip(&way.odometry_m) {
        for wheel in 0..2 {
            let nominal = rolled[wheel] / (1.0 + wheels.radius_errors[wheel]);
            if nominal.abs() > 1e-12 {
                sum += (read[wheel] - nominal).powi(2) / (wheels.encoder_k_m * nominal.abs());
                count += 1.0;
            }
        }
    }
    assert!(count > 18_000.0 && (sum / count - 1.0).abs() < 4.0 * (2.0f64 / count).sqrt(), "{}", sum / count);
}

#[test]
fn ways_are_free_smooth_and_lead_far() {
    for (kind, extent) in
        [(RoomKind::Corridor, 2.0), (RoomKind::LShaped, 1.0), (RoomKind::Office, 2.0), (RoomKind::LivingRoom, 1.0)]
    {
        let room = RoomOptions { light_spacing_m: 1.0, extent, ..RoomOptions::new(kind, 3) };
        let world = Arc::new(World::new(&room).unwrap());
        let mount = Mount { x_m: 0.1, y_m: -0.05, yaw_rad: 0.3, height_m: 0.5 };
        let drive = drive(
            &world,
            DriveOptions { way: Way::Wander { frames: 1500 }, mount, lighting: 0.0, ..DriveOptions::default() },
        );
        let way = drive.trajectory();
        let (mut low, mut high) = (way.poses[0], way.poses[0]);
        for (k, pose) in way.poses.iter().enumerate() {
            assert!(world.is_free(pose.x_m, pose.y_m), "{kind} {k}");
            assert!(world.contains(&drive.center(k).unwrap()));
            (low.x_m, high.x_m) = (low.x_m.min(pose.x_m), high.x_m.max(pose.x_m));
        }
        assert!(high.x_m - low.x_m > 1.0, "{kind}: {low:?} {high:?}");
        let length: f64 = way.displacements_m.iter().map(|[left, right]| 0.5 * (left + right)).sum();
        assert!(length > 30.0, "{kind}: {length} m");
    }
}

#[test]
fn bumps_are_as_large_as_asked_and_smooth() {
    let most = 5f64.to_radians();
    let drive = drive(
        &world(RoomKind::Narrow, 0),
        DriveOptions {
            way: Way::Wander { frames: 2000 },
            bumps_max_rad: most,
            lighting: 0.0,
            ..DriveOptions::default()
        },
    );
    let tilts = &drive.trajectory().tilts;
    let leans: Vec<f64> = tilts.iter().map(Tilt::alpha_rad).collect();
    assert!(leans.iter().all(|lean| *lean <= most + 1e-12));
    assert!(leans.iter().filter(|lean| **lean > 0.8 * most).count() > 40);
    assert!(tilts.windows(2).all(|pair| pair[0].angle_to(&pair[1]) < 0.8 * most));
}

#[test]
fn same_seed_same_bytes_for_any_number_of_threads_and_order() {
    let pictures = |threads: usize, order: [usize; 3]| {
        on_threads(threads, || {
            let room =
                RoomOptions { light_spacing_m: 0.6, floor_gloss: 0.5, ..RoomOptions::new(RoomKind::Corridor, 3) };
            let world = Arc::new(World::new(&room).unwrap());
            let options =
                DriveOptions { way: Way::Wander { frames: 12 }, bumps_max_rad: 0.05, ..DriveOptions::default() };
            let drive = drive(&world, options);
            let mut frames: Vec<_> = order.iter().map(|k| (*k, drive.render(*k).unwrap())).collect();
            frames.sort_by_key(|frame| frame.0);
            (frames, drive.sightings(7).unwrap(), drive.trajectory().clone())
        })
        .unwrap()
    };
    let one = pictures(1, [0, 5, 11]);
    assert_eq!(one, pictures(3, [11, 0, 5]));
    assert_ne!(one.0[0].1, one.0[1].1);
}

#[test]
fn every_drive_option_changes_something() {
    let world = world(RoomKind::Office, 2);
    let base = DriveOptions { way: Way::Wander { frames: 40 }, ..DriveOptions::default() };
    let of = |options: &DriveOptions| {
        let drive = drive(&world, options.clone());
        (drive.trajectory().clone(), drive.render(29).unwrap())
    };
    let first = of(&base);
    assert_eq!(first, of(&base));
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let wheels = Wheels::default();
    for options in [
        DriveOptions { way: Way::Wander { frames: 41 }, ..base.clone() },
        DriveOptions { seed: 1, ..base.clone() },
        DriveOptions { step_m: 0.03, ..base.clone() },
        DriveOptions { turn_max_rad: 0.04, ..base.clone() },
        DriveOptions { mount: Mount { x_m: 0.1, ..base.mount }, ..base.clone() },
        DriveOptions { mount: Mount { y_m: 0.1, ..base.mount }, ..base.clone() },
        DriveOptions { mount: Mount { yaw_rad: 0.1, ..base.mount }, ..base.clone() },
        DriveOptions { mount: Mount { height_m: 0.6, ..base.mount }, ..base.clone() },
        DriveOptions { robot_from_camera: quarter, ..base.clone() },
        DriveOptions { blind_rad: 0.3, ..base.clone() },
        DriveOptions { wheels: Wheels { base_m: 0.3, ..wheels }, ..base.clone() },
        DriveOptions { wheels: Wheels { encoder_k_m: 0.0, ..wheels }, ..base.clone() },
        DriveOptions { wheels: Wheels { radius_errors: [0.01, 0.0], ..wheels }, ..base.clone() },
        DriveOptions { bumps_max_rad: 0.05, ..base.clone() },
        DriveOptions { lighting: 0.0, ..base.clone() },
        DriveOptions { samples: 1, ..base.clone() },
        DriveOptions { noise_sigma: 0.0, ..base.clone() },
        DriveOptions { blur_sigma_px: 0.7, ..base.clone() },
    ] {
        assert_ne!(first, of(&options), "{options:?}");
    }
}

/// Where an edge is said to be in sight, the picture changes across it, and more than beside it.
#[test]
fn the_truth_lies_on_the_edges_of_leaning_pictures() {
    let room = RoomOptions {
        light_spacing_m: 0.4,
        wall_pattern: WallPattern::Stripes,
        ..RoomOptions::new(RoomKind::Corridor, 4)
    };
    let world = Arc::new(World::new(&room).unwrap());
    let camera = fisheye(480, 140.0);
    let mount = Mount { x_m: 0.1, y_m: 0.05, yaw_rad: 0.4, height_m: 0.4 };
    let options = DriveOptions {
        way: Way::Wander { frames: 12 },
        mount,
        bumps_max_rad: 0.09,
        noise_sigma: 0.0,
        ..DriveOptions::default()
    };
    let drive = Drive::new(Arc::clone(&world), camera.clone(), options.clone()).unwrap();
    let (mut on, mut beside, mut count) = (0.0, 0.0, 0);
    for frame in [1, 3, 5, 7, 9, 11] {
        let image = drive.render(frame).unwrap();
        let leaning_from_upright = drive.trajectory().tilts[frame].leaning_from_upright();
        let seen = drive.sightings(frame).unwrap();
        let level = |bearing_rad: f64, elevation_rad: f64| {
            let (s, c) = elevation_rad.sin_cos();
            let upright = Vector3::new(c * bearing_rad.cos(), c * bearing_rad.sin(), s);
            let bearing = options.robot_from_mounted_camera().transpose() * leaning_from_upright * upright;
            let pixel = camera.project(&bearing)?;
            let (x, y) = (pixel.x.floor(), pixel.y.floor());
            let (fx, fy) = (pixel.x - x, pixel.y - y);
            let at =
                |dx: usize, dy: usize| image.gray.get((y as usize + dy) * 480 + x as usize + dx).map(|g| f64::from(*g));
            let row = |dy| Some(at(0, dy)? * (1.0 - fx) + at(1, dy)? * fx);
            Some(row(0)? * (1.0 - fy) + row(1)? * fy)
        };
        for edge in &seen {
            let lonely = seen.iter().all(|o| o.edge == edge.edge || (o.bearing_rad - edge.bearing_rad).abs() > 0.045);
            if !lonely || edge.contrast < 0.08 || edge.visible_share < 0.5 {
                continue;
            }
            let step = |aside: f64| {
                let [low, high] = edge.elevation_rad;
                let steps: Vec<f64> = (0..9)
                    .filter_map(|k| {
                        let elevation = low + (high - low) * (f64::from(k) + 0.5) / 9.0;
                        let bearing = edge.bearing_rad + aside;
                        let half = 0.0075 / elevation.cos();
                        Some((level(bearing + half, elevation)? - level(bearing - half, elevation)?).abs())
                    })
                    .collect();
                steps.iter().sum::<f64>() / steps.len().max(1) as f64
            };
            on += step(0.0);
            beside += 0.5 * (step(0.02) + step(-0.02));
            count += 1;
        }
    }
    assert!(count >= 6 && on > 4.0 * beside && on > 10.0 * f64::from(count), "{count} edges: {on} on, {beside} beside");
}

#[test]
fn identities_last() {
    let drive =
        drive(&world(RoomKind::Office, 5), DriveOptions { way: Way::Wander { frames: 60 }, ..DriveOptions::default() });
    for frame in [0, 30, 59] {
        let pose = drive.trajectory().poses[frame];
        let center = drive.center(frame).unwrap();
        for seen in drive.sightings(frame).unwrap() {
            let to = drive.edges()[seen.edge].position - center.xy();
            let turned = to.y.atan2(to.x) - pose.yaw_rad - seen.bearing_rad;
            assert!(turned.sin().abs() < 1e-12 && turned.cos() > 0.0);
            assert!(seen.visible_share > 0.0 && seen.visible_share <= 1.0 && (0.0..=1.0).contains(&seen.contrast));
            assert!(seen.elevation_rad[0] < seen.elevation_rad[1]);
        }
    }
}

#[test]
fn wrong_options_are_refused_by_name() {
    let refused = |options: DriveOptions, expected: &str| match options.validate() {
        Err(Error::InvalidOption { name, .. }) => assert_eq!(name, expected),
        other => panic!("{expected}: {other:?}"),
    };
    let base = DriveOptions::default();
    refused(DriveOptions { way: Way::Wander { frames: 0 }, ..base.clone() }, "frames");
    refused(DriveOptions { step_m: f64::NAN, ..base.clone() }, "step_m");
    refused(DriveOptions { turn_max_rad: 0.0, ..base.clone() }, "turn_max_rad");
    refused(DriveOptions { mount: Mount { x_m: 2.0, ..base.mount }, ..base.clone() }, "mount");
    refused(DriveOptions { mount: Mount { height_m: 0.0, ..base.mount }, ..base.clone() }, "mount");
    refused(DriveOptions { bumps_max_rad: -0.1, ..base.clone() }, "bumps_max_rad");
    refused(DriveOptions { blind_rad: 2.0, ..base.clone() }, "blind_rad");
    refused(DriveOptions { lighting: 1.5, ..base.clone() }, "lighting");
    refused(DriveOptions { samples: 0, ..base.clone() }, "samples");
    let wheels = Wheels { base_m: 0.0, ..Wheels::default() };
    refused(DriveOptions { wheels, ..base.clone() }, "wheel_base_m");
    let wheels = Wheels { encoder_k_m: -1.0, ..Wheels::default() };
    refused(DriveOptions { wheels, ..base.clone() }, "encoder_k_m");
    let wheels = Wheels { radius_errors: [0.0, f64::NAN], ..Wheels::default() };
    refused(DriveOptions { wheels, ..base.clone() }, "wheel_radius_errors");
    assert!(DriveOptions { robot_from_camera: Matrix3::zeros(), ..base.clone() }.validate().is_err());
    let drive =
        drive(&world(RoomKind::Narrow, 0), DriveOptions { way: Way::Wander { frames: 3 }, lighting: 0.0, ..base });
    assert!(drive.render(3).is_err() && drive.sightings(3).is_err() && drive.center(3).is_err());
}
