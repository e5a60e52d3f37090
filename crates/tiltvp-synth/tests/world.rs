//! Laws of the synthetic worlds: determinism, true verticals, finite pictures, checked options.

#![allow(clippy::unwrap_used, clippy::panic)]

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::Error;
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{
    Exposure, RenderOptions, RobotPose, RoomKind, RoomOptions, View, WallPattern, World, render, render_panorama,
};

const WIDTH: usize = 96;
const HEIGHT: usize = 72;

fn coarse(kind: RoomKind, seed: u64) -> World {
    World::new(&RoomOptions { light_spacing_m: 0.6, ..RoomOptions::new(kind, seed) }).unwrap()
}

/// A 185-degree equidistant fisheye.
fn fisheye(x: f64, y: f64) -> Option<Vector3<f64>> {
    let (dx, dy) = (x - 47.5, y - 35.5);
    let theta = dx.hypot(dy) / 21.0;
    let (s, c) = theta.sin_cos();
    let phi = dy.atan2(dx);
    (theta <= 92.5f64.to_radians()).then(|| Vector3::new(s * phi.cos(), s * phi.sin(), c))
}

fn with_threads<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(f)
}

#[test]
fn same_seed_same_bytes_for_any_number_of_threads() {
    let picture = |threads| {
        with_threads(threads, || {
            let world = coarse(RoomKind::Office, 3);
            let pose = world.free_poses(1, 9).unwrap()[0];
            let options = RenderOptions { noise_sigma: 2.0, blur_sigma_px: 0.6, seed: 5, ..RenderOptions::default() };
            let view = View { tilt: Tilt::from_alpha_beta(0.05, 1.0), ..View::new(&fisheye, WIDTH, HEIGHT, pose) };
            render(&world, &view, &options).unwrap()
        })
    };
    let one = picture(1);
    assert_eq!(one, picture(2));
    assert_eq!(one, picture(4));
}

#[test]
fn seeds_and_kinds_differ() {
    let outline = |kind, seed| coarse(kind, seed).floor_outline().to_vec();
    assert_ne!(outline(RoomKind::Office, 1), outline(RoomKind::Office, 2));
    assert_ne!(outline(RoomKind::Office, 1), outline(RoomKind::LivingRoom, 1));
}

#[test]
fn every_kind_is_furnished_and_its_pictures_have_contrast() {
    for kind in RoomKind::ALL {
        for seed in 0..4 {
            let world = coarse(kind, seed);
            assert!(world.vertical_edges().len() > 50, "{kind} {seed}");
            let poses = world.free_poses(3, seed).unwrap();
            for pose in &poses {
                assert!(world.is_free(pose.x_m, pose.y_m), "{kind} {seed}");
            }
            let options = RenderOptions { samples: 1, ..RenderOptions::default() };
            let image = render(&world, &View::new(&fisheye, WIDTH, HEIGHT, poses[0]), &options).unwrap().image;
            assert_eq!((image.gray.len(), image.rgb.len()), (WIDTH * HEIGHT, 3 * WIDTH * HEIGHT));
            let lit: Vec<f64> = image.gray.iter().filter(|g| **g > 0).map(|g| f64::from(*g)).collect();
            let mean = lit.iter().sum::<f64>() / lit.len() as f64;
            let deviation = (lit.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / lit.len() as f64).sqrt();
            assert!((60.0..160.0).contains(&mean) && deviation > 20.0, "{kind} {seed}: {mean} +- {deviation}");
        }
    }
}

#[test]
fn under_table_places_are_under_the_table() {
    for seed in 0..12 {
        let world = coarse(RoomKind::UnderTable, seed);
        for pose in world.free_poses(5, seed).unwrap() {
            let up = world.cast(&Vector3::new(pose.x_m, pose.y_m, 0.3), &Vector3::z()).unwrap();
            assert!(up.distance_m < 0.5, "seed {seed}: {} m of room above", up.distance_m);
        }
    }
}

/// From where an edge is in sight, rays that pass it on its two sides end on different surfaces, all along the edge: it is seen
/// on the great circle through the true vertical.
#[test]
fn vertical_edges_are_seen_on_great_circles_through_the_true_vertical() {
    let world = coarse(RoomKind::Office, 11);
    let tilt = Tilt::from_alpha_beta(0.08, 2.0);
    let mut seen = 0;
    for pose in world.free_poses(4, 1).unwrap() {
        let view = View { tilt, ..View::new(&fisheye, WIDTH, HEIGHT, pose) };
        let (center, robot_from_world) = (view.center(), view.world_from_robot().transpose());
        for edge in world.vertical_edges() {
            let bearing = |point: &Vector3<f64>| robot_from_world * (point - center);
            let normal = bearing(&edge.bottom).cross(&bearing(&edge.top)).normalize();
            assert!(normal.dot(&tilt.normal()).abs() < 1e-9);

            let points = [0.2, 0.35, 0.5, 0.65, 0.8].map(|t| edge.bottom + (edge.top - edge.bottom) * t);
            let sides = points.map(|point| {
                let ray = point - center;
                let across = ray.cross(&Vector3::z()).normalize() * 0.004;
                [-1.0, 1.0].map(|side| world.cast(&center, &(ray + across * side)).unwrap())
            });
            let in_sight = points.iter().all(|point| {
                let ray = point - center;
                world.cast(&center, &ray).unwrap().distance_m > ray.norm() - 1e-6
            });
            if in_sight {
                seen += 1;
                let [left, right] = &sides[2];
                assert_ne!(left.surface, right.surface, "{edge:?}");
            }
        }
    }
    assert!(seen > 40, "only {seen} edges in sight");
}

#[test]
fn the_true_vertical_of_a_leaning_robot_is_its_zenith() {
    let world = coarse(RoomKind::Corridor, 2);
    let pose = world.free_poses(1, 0).unwrap()[0];
    let turned = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let tilt = Tilt::from_alpha_beta(0.1, -0.7);
    let view = View { tilt, robot_from_camera: turned, ..View::new(&fisheye, WIDTH, HEIGHT, pose) };
    let options = RenderOptions { samples: 1, ..RenderOptions::default() };
    let truth = render(&world, &view, &options).unwrap().truth;
    let zenith_in_camera = turned.transpose() * tilt.normal();
    approx::assert_relative_eq!(truth.world_from_camera * zenith_in_camera, Vector3::z(), epsilon = 1e-12);
    // A forward lean takes the robot's x axis below the world's horizon.
    let forward = View { tilt: Tilt::from_alpha_beta(0.1, 0.0), ..view };
    approx::assert_relative_eq!((forward.world_from_robot() * Vector3::x()).z, -0.1f64.sin(), epsilon = 1e-12);
    assert_eq!((truth.tilt, truth.pose), (tilt, pose));
}

#[test]
fn panorama_has_its_front_in_the_middle() {
    let world = coarse(RoomKind::LivingRoom, 0);
    let pose = world.free_poses(1, 0).unwrap()[0];
    let options = RenderOptions { samples: 1, ..RenderOptions::default() };
    let panorama = render_panorama(&world, pose, 1.2, 32, &options).unwrap().image;
    assert_eq!((panorama.width_px, panorama.height_px), (64, 32));
    assert!(panorama.gray.iter().all(|g| *g > 0));
}

#[test]
fn pixels_outside_the_lens_are_black() {
    let world = coarse(RoomKind::Narrow, 0);
    let pose = world.free_poses(1, 0).unwrap()[0];
    let options = RenderOptions { noise_sigma: 20.0, ..RenderOptions::default() };
    let image = render(&world, &View::new(&fisheye, WIDTH, HEIGHT, pose), &options).unwrap().image;
    assert_eq!([image.gray[0], image.gray[WIDTH - 1], image.gray[WIDTH * HEIGHT - 1]], [0; 3]);
}

#[test]
fn every_render_option_changes_the_picture() {
    let world = coarse(RoomKind::Office, 1);
    let pose = world.free_poses(1, 0).unwrap()[0];
    let base = RenderOptions { samples: 1, ..RenderOptions::default() };
    let picture =
        |options: &RenderOptions| render(&world, &View::new(&fisheye, WIDTH, HEIGHT, pose), options).unwrap().image;
    let changed = [
        RenderOptions { samples: 2, ..base.clone() },
        RenderOptions { blur_sigma_px: 1.0, ..base.clone() },
        RenderOptions { noise_sigma: 2.0, ..base.clone() },
        RenderOptions { exposure: Exposure::fixed(0.2), ..base.clone() },
        RenderOptions { exposure: Exposure::auto(0.2), ..base.clone() },
        RenderOptions { gamma: 1.0, ..base.clone() },
        RenderOptions { vignetting: 0.8, ..base.clone() },
        RenderOptions { seed: 1, ..base.clone() },
    ];
    let first = picture(&base);
    for options in changed {
        assert_ne!(first, picture(&options), "{options:?}");
    }
}

#[test]
fn every_room_option_changes_the_world() {
    let base = RoomOptions { light_spacing_m: 0.6, ..RoomOptions::new(RoomKind::LivingRoom, 4) };
    let options = RenderOptions { samples: 1, exposure: Exposure::fixed(0.7), ..RenderOptions::default() };
    let picture = |room: &RoomOptions| {
        let world = World::new(room).unwrap();
        let (x_m, y_m) = (1.6, 1.2);
        render(&world, &View::new(&fisheye, WIDTH, HEIGHT, RobotPose { x_m, y_m, yaw_rad: 0.3 }), &options)
            .unwrap()
            .image
    };
    let first = picture(&base);
    for room in [
        RoomOptions { kind: RoomKind::LShaped, ..base.clone() },
        RoomOptions { seed: 5, ..base.clone() },
        RoomOptions { clutter: 0.1, ..base.clone() },
        RoomOptions { daylight: 0.0, ..base.clone() },
        RoomOptions { light_spacing_m: 0.3, ..base.clone() },
        RoomOptions { extent: 1.5, ..base.clone() },
        RoomOptions { wall_pattern: WallPattern::Stripes, ..base.clone() },
        RoomOptions { wall_pattern: WallPattern::Panels, ..base.clone() },
        RoomOptions { wall_pattern: WallPattern::Tiles, ..base.clone() },
    ] {
        assert_ne!(first, picture(&room), "{room:?}");
    }
}

#[test]
fn wrong_options_are_refused_by_name() {
    let refused = |result: Result<(), Error>, expected: &str| match result {
        Err(Error::InvalidOption { name, .. }) => assert_eq!(name, expected),
        other => panic!("{expected}: {other:?}"),
    };
    let room = RoomOptions::default();
    refused(RoomOptions { clutter: 1.5, ..room.clone() }.validate(), "clutter");
    refused(RoomOptions { daylight: f64::NAN, ..room.clone() }.validate(), "daylight");
    refused(RoomOptions { extent: 0.5, ..room.clone() }.validate(), "extent");
    refused(RoomOptions { floor_gloss: -0.5, ..room.clone() }.validate(), "floor_gloss");
    refused("plaid".parse::<WallPattern>().map(|_| ()), "wall_pattern");
    let yard = RoomOptions { wall_pattern: WallPattern::Stripes, ..RoomOptions::new(RoomKind::Yard, 1) };
    refused(World::new(&yard).map(|_| ()), "wall_pattern");
    refused(RoomOptions { light_spacing_m: 0.0, ..room }.validate(), "light_spacing_m");
    let base = RenderOptions::default();
    refused(RenderOptions { samples: 0, ..base.clone() }.validate(), "samples");
    refused(RenderOptions { blur_sigma_px: -1.0, ..base.clone() }.validate(), "blur_sigma_px");
    refused(RenderOptions { noise_sigma: f64::INFINITY, ..base.clone() }.validate(), "noise_sigma");
    refused(RenderOptions { gamma: 0.0, ..base.clone() }.validate(), "gamma");
    refused(RenderOptions { vignetting: 2.0, ..base.clone() }.validate(), "vignetting");
    let exposure = Exposure::fixed(0.0);
    refused(RenderOptions { exposure, ..base }.validate(), "gain");
    refused("kitchen".parse::<RoomKind>().map(|_| ()), "kind");
    for kind in RoomKind::ALL {
        assert_eq!(kind.name().parse::<RoomKind>(), Ok(kind));
    }

    let world = coarse(RoomKind::Office, 0);
    let pose = world.free_poses(1, 0).unwrap()[0];
    let view = View::new(&fisheye, WIDTH, HEIGHT, pose);
    refused(View { width_px: 0, ..view }.validate(), "view.width_px");
    refused(View { camera_height_m: -1.0, ..view }.validate(), "view.camera_height_m");
    assert!(View { robot_from_camera: Matrix3::identity() * 2.0, ..view }.validate().is_err());
    let outside = View { pose: RobotPose { x_m: -5.0, ..pose }, ..view };
    assert!(render(&world, &outside, &RenderOptions::default()).is_err());
}

#[test]
fn worlds_can_be_shared_between_threads() {
    fn shareable<T: Send + Sync>() {}
    shareable::<World>();
}

/// Seen in a floor that shines, the lamps are brighter than the floor itself.
#[test]
fn floors_shine_as_asked() {
    let room = |floor_gloss| {
        let base = RoomOptions { light_spacing_m: 0.6, daylight: 0.0, ..RoomOptions::new(RoomKind::Office, 4) };
        World::new(&RoomOptions { floor_gloss, ..base }).unwrap()
    };
    let options = RenderOptions { samples: 1, exposure: Exposure::fixed(0.3), ..RenderOptions::default() };
    let (matt, glossy) = (room(0.0), room(1.0));
    let pose = matt.free_poses(1, 0).unwrap()[0];
    let floor =
        |world: &World| render_panorama(world, pose, 1.2, 64, &options).unwrap().image.gray[128 * 40..].to_vec();
    let brightest = |levels: &[u8]| levels.iter().copied().max().unwrap();
    assert_ne!(floor(&matt), floor(&glossy));
    assert!(brightest(&floor(&glossy)) > brightest(&floor(&matt)) + 10);
}
