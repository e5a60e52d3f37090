//! Stereo sequences: what is rendered is where the truth says, smooth, and the same for any number of threads.

#![allow(clippy::unwrap_used)]

use std::sync::{Arc, OnceLock};

use nalgebra::Vector3;
use tiltvp_core::camera::{Camera, Model, Pinhole};
use tiltvp_synth::{
    CornerKind, GRAVITY_M_S2, ImuChannel, ImuOptions, LaboratoryOptions, RoomKind, RoomOptions, StereoOptions,
    StereoSequence, World, imu_readings, on_threads,
};

fn laboratory() -> Arc<World> {
    static WORLD: OnceLock<Arc<World>> = OnceLock::new();
    let options = LaboratoryOptions { seed: 4, light_spacing_m: 1.0, ..LaboratoryOptions::default() };
    WORLD.get_or_init(|| Arc::new(World::laboratory(&options).unwrap())).clone()
}

fn small() -> Camera {
    let lens = Pinhole::new([130.0, 130.0], [120.0, 67.0], &[-0.1]).unwrap();
    Camera::new(240, 136, Model::Pinhole(lens)).unwrap()
}

fn sequence(options: StereoOptions) -> StereoSequence {
    StereoSequence::new(laboratory(), [small(), small()], options).unwrap()
}

#[test]
fn the_cuboids_corner_is_upright_and_right_handed() {
    for corner in laboratory().corners() {
        let [x, y, z] = corner.edges;
        assert!(y.xy().norm() < 1e-12 && x.z.abs() < 1e-12 && z.z.abs() < 1e-12);
        assert!(x.cross(&y).dot(&z) > 0.0);
    }
    let gamma_rad = 1.1;
    let options = LaboratoryOptions { gamma_rad, light_spacing_m: 1.0, ..LaboratoryOptions::default() };
    let corner = World::laboratory(&options).unwrap().corners()[0];
    assert!((corner.gamma_rad() - gamma_rad).abs() < 1e-12);
    assert_eq!(corner.kind, CornerKind::Solid);
    assert!((Vector3::from(corner.lengths_m) - Vector3::from(options.size_m)).norm() < 1e-12);
}

/// Along either upper edge of the cuboid, red is above, and green to the left, blue to the right below.
#[test]
fn faces_have_their_colours_and_edges_are_where_the_truth_is() {
    let sequence =
        sequence(StereoOptions { frames: 60, noise_sigma: 0.0, distance_m: [1.0, 1.6], ..Default::default() });
    let corner = laboratory().corners()[0];
    for frame in [0, 20, 59] {
        let pose = sequence.pose(frame).unwrap();
        let poses = [pose, pose * sequence.options().left_from_right];
        for (image, pose) in sequence.render(frame).unwrap().iter().zip(poses) {
            let color = |point: Vector3<f64>| {
                let pixel = small().project(&pose.inverse_transform_point(&point.into()).coords).unwrap();
                let at = 3 * (pixel.y.round() as usize * image.width_px + pixel.x.round() as usize);
                [0, 1, 2].map(|c| image.bgr[at + c])
            };
            let [x, y, z] = corner.edges;
            let place = |a: Vector3<f64>, b: Vector3<f64>| color(corner.position + a * 0.1 + b * 0.1);
            for (channel, [blue, green, red]) in [(0, place(x, y)), (1, place(z, y)), (2, place(x, z))] {
                let levels = [blue, green, red];
                let others = levels.iter().enumerate().filter(|(c, _)| *c != channel).map(|(_, level)| *level);
                assert!(levels[channel] > 60 && others.max().unwrap() + 40 < levels[channel], "{levels:?}");
            }
        }
        let sighting = sequence.sightings(frame).unwrap()[0];
        assert_eq!(sighting.corner, 0);
        assert!(sighting.edges_px.as_flattened().iter().all(|length| *length > 5.0));
    }
}

#[test]
fn frames_do_not_depend_on_threads_or_order() {
    let options = StereoOptions { frames: 10, exposure_s: 0.03, ..Default::default() };
    let one = on_threads(1, || sequence(options.clone()).render(7).unwrap()).unwrap();
    let other = on_threads(3, || {
        let sequence = sequence(options);
        sequence.render(2).unwrap();
        sequence.render(7).unwrap()
    });
    assert!(one == other.unwrap());
}

#[test]
fn distances_and_rooms_are_kept_to() {
    let sequence = sequence(StereoOptions { frames: 300, ..Default::default() });
    let vertex = laboratory().corners()[sequence.corner()].position;
    for frame in 0..300 {
        let center = sequence.pose(frame).unwrap().translation.vector;
        let distance = (center - vertex).norm();
        assert!(laboratory().contains(&center) && (0.9..3.1).contains(&distance), "{distance}");
    }
    assert!(sequence.pose(300).is_err() && sequence.render(300).is_err());
    let room = RoomOptions { light_spacing_m: 1.0, ..RoomOptions::new(RoomKind::Office, 3) };
    let room = Arc::new(World::new(&room).unwrap());
    assert!(room.corners().iter().filter(|corner| corner.kind == CornerKind::Hollow).count() == 8);
    let sequence =
        StereoSequence::new(room.clone(), [small(), small()], StereoOptions { frames: 30, ..Default::default() });
    assert!(sequence.unwrap().corner() < room.corners().len());
}

/// Integrated rates turn from the first pose to the last; forces at rest point upwards.
#[test]
fn inertial_readings_follow_the_motion() {
    let sequence = sequence(StereoOptions { frames: 61, ..Default::default() });
    let perfect = |range| ImuChannel { noise_density: 0.0, bias_sigma: 0.0, bias_walk: 0.0, scale_sigma: 0.0, range };
    let options =
        ImuOptions { rate_hz: 1000.0, gyroscope: perfect(8.0), accelerometer: perfect(40.0), ..ImuOptions::default() };
    let readings = imu_readings(sequence.motion(), sequence.time_s(60), &options).unwrap();
    assert_eq!(readings.len(), 2001);
    let mut turned = sequence.pose(0).unwrap().rotation;
    let (mut velocity, mut steps) = (Vector3::zeros(), Vector3::zeros());
    for pair in readings.windows(2) {
        let middle = 0.5 * (pair[0].rate_rad_s + pair[1].rate_rad_s) * 1e-3;
        velocity += (turned * pair[0].force_m_s2 - Vector3::z() * GRAVITY_M_S2) * 1e-3;
        steps += velocity * 1e-3;
        turned *= nalgebra::UnitQuaternion::from_scaled_axis(middle);
    }
    assert!(turned.angle_to(&sequence.pose(60).unwrap().rotation) < 2e-3);
    let start = sequence.motion();
    let first = (start.pose(1e-3).translation.vector - start.pose(-1e-3).translation.vector) / 2e-3;
    let moved = sequence.pose(60).unwrap().translation.vector - sequence.pose(0).unwrap().translation.vector;
    assert!((steps + first * 2.0 - moved).norm() < 0.02, "{steps} {moved}");

    let real = imu_readings(sequence.motion(), 2.0, &ImuOptions::default()).unwrap();
    let again = imu_readings(sequence.motion(), 2.0, &ImuOptions::default()).unwrap();
    assert!(real == again);
    let step = 2.0 * GRAVITY_M_S2 / 32_768.0;
    let whole = real.iter().flat_map(|reading| reading.force_m_s2.iter().map(|f| f / step).collect::<Vec<_>>());
    assert!(whole.clone().all(|level| (level - level.round()).abs() < 1e-6));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let wrong = [
        StereoOptions { frames: 0, ..Default::default() },
        StereoOptions { distance_m: [3.0, 1.0], ..Default::default() },
        StereoOptions { exposure_s: -1.0, ..Default::default() },
        StereoOptions { corner: Some(100_000), ..Default::default() },
        StereoOptions { distance_m: [8.0, 9.0], ..Default::default() },
    ];
    for options in wrong {
        assert!(StereoSequence::new(laboratory(), [small(), small()], options).is_err());
    }
    for options in [
        LaboratoryOptions { gamma_rad: 0.1, ..Default::default() },
        LaboratoryOptions { size_m: [0.4, 0.4, f64::NAN], ..Default::default() },
        LaboratoryOptions { light_spacing_m: 0.0, ..Default::default() },
        LaboratoryOptions { marker_m: 0.3, ..Default::default() },
        LaboratoryOptions { marker_m: 0.2, gamma_rad: 1.2, ..Default::default() },
    ] {
        assert!(World::laboratory(&options).is_err());
    }
    assert!(ImuOptions { rate_hz: 0.0, ..ImuOptions::default() }.validate().is_err());
}
