//! Poses of the corner of a drawn cube, from images of one camera and of two, frame after frame.

#![allow(clippy::unwrap_used)]

mod scene;

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Rotation3, Vector3};
use scene::cube;
use tiltvp_core::corner::{
    BelievedCorner, CornerDetector, CornerEstimate, CornerMethod, CornerPoseEstimator, CornerVerdict, DetectorOptions,
    EstimatorOptions, Frame, FrameKnowledge, GeneralOptions, Hypothesis, IncludedAngle, PlaceVerdict,
};
use tiltvp_core::geometry::RigidMotion;
use tiltvp_core::image::{ColorView, ImageView};

/// Metres between the cameras, and to a side of the cube.
const BASELINE_M: f64 = 0.12;
const SIDE_M: f64 = 0.3;

fn truth() -> Matrix3<f64> {
    (Rotation3::from_axis_angle(&Vector3::x_axis(), 0.5) * Rotation3::from_axis_angle(&Vector3::y_axis(), -0.7))
        .into_inner()
}

fn vertex_m(right_m: f64) -> Vector3<f64> {
    Vector3::new(-right_m, -0.05, 0.8)
}

fn grey(colour: &[u8]) -> Vec<u8> {
    colour.chunks(3).map(|bgr| bgr[1] / 2 + bgr[2] / 2).collect()
}

fn estimator(method: &str, is_pair: bool, options: EstimatorOptions) -> CornerPoseEstimator {
    let side = || CornerDetector::new(cube::pinhole(), DetectorOptions::for_method(method).unwrap(), None).unwrap();
    let left_from_right =
        RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::new(BASELINE_M, 0.0, 0.0) };
    CornerPoseEstimator::new(side(), is_pair.then(|| (side(), left_from_right)), options).unwrap()
}

fn look(estimator: &mut CornerPoseEstimator, colours: &[Vec<u8>], is_grey: bool) -> CornerEstimate {
    let greys: Vec<Vec<u8>> = colours.iter().map(|image| grey(image)).collect();
    let frames: Vec<Frame<'_>> = if is_grey {
        greys.iter().map(|bytes| Frame::Gray(ImageView::new(bytes, 320, 180, 320).unwrap())).collect()
    } else {
        colours.iter().map(|bytes| Frame::Color(ColorView::new(bytes, 320, 180, 3 * 320).unwrap())).collect()
    };
    estimator.observe(&frames[0], frames.get(1), &FrameKnowledge::default()).unwrap()
}

/// How far off the attitude is, degrees, with its axes in whatever order.
fn attitude_deg(pose: &Hypothesis) -> f64 {
    let turned = truth().transpose() * pose.camera_from_object;
    let named = turned.map(f64::round);
    Rotation3::from_matrix_unchecked(named.transpose() * turned).angle().to_degrees()
}

/// How far a corner is from the nearest one of the cube, metres.
fn place_off_m(pose: &Hypothesis, right_m: f64) -> f64 {
    let in_cube = truth().transpose() * (pose.vertex_m.unwrap() - vertex_m(right_m)) / SIDE_M;
    (in_cube - in_cube.map(|share| share.round().clamp(0.0, 1.0))).norm() * SIDE_M
}

/// The names of the corners of a frame.
fn names(estimate: &CornerEstimate) -> Vec<Option<u32>> {
    let mut ids: Vec<Option<u32>> = estimate.corners.iter().map(|corner| corner.id).collect();
    ids.sort_unstable();
    ids
}

/// What is told of the lengths of a corner's edges and of the angles between them is within four standard deviations.
fn tells_the_cube(corner: &BelievedCorner) {
    for end in corner.ends.iter().flatten() {
        assert!((end.length_m - SIDE_M).abs() < 4.0 * end.sigma_m && end.sigma_m < 0.02, "{end:?}");
    }
    for angle in corner.angles.iter().flatten() {
        assert!((angle.angle_rad.to_degrees() - 90.0).abs() < 4.0 * angle.sigma_rad.to_degrees(), "{angle:?}");
        assert!((0.5..10.0).contains(&angle.sigma_rad.to_degrees()), "{angle:?}");
    }
}

#[test]
fn a_pair_that_passes_the_coloured_cube_has_its_pose() {
    for (method, most_deg, most_m) in [("coloured", 0.7, 0.003), ("paper", 1.2, 0.01)] {
        let options = EstimatorOptions { right_handed: Some(true), ..EstimatorOptions::default() };
        let mut estimator = estimator(method, true, options);
        for k in 0..6u8 {
            let right_m = 0.01 * f64::from(k);
            let found = look(&mut estimator, &[right_m, right_m + BASELINE_M].map(cube::cube), false);
            let pose = found.pose().unwrap();
            // Colours name the edges: the axes are in their order.
            let off = Rotation3::from_matrix_unchecked(truth().transpose() * pose.camera_from_object);
            let off_m = (pose.vertex_m.unwrap() - vertex_m(right_m)).norm();
            assert!(off.angle().to_degrees() < most_deg && off_m < most_m, "{method} {k}: {} {off_m}", off.angle());
            for (axis, edge) in pose.edges.iter().enumerate() {
                assert!(edge.angle(&truth().column(axis)).to_degrees() < most_deg);
            }
            assert!(pose.right_handed && pose.probability > 0.9);
            assert_eq!((found.object, found.followed, names(&found)), (1, k > 0, vec![Some(1)]));
            tells_the_cube(&found.corners[0]);
        }
    }
}

#[test]
fn a_pair_that_passes_a_grey_cube_names_its_corners() {
    let mut estimator = estimator("general", true, EstimatorOptions::default());
    let mut before: Option<CornerEstimate> = None;
    for k in 0..6u8 {
        let right_m = 0.01 * f64::from(k);
        let found = look(&mut estimator, &[right_m, right_m + BASELINE_M].map(cube::cube), true);
        let pose = found.pose().unwrap();
        assert!(attitude_deg(pose) < 0.6 && place_off_m(pose, right_m) < 0.004, "{k}: {pose:?}");
        assert_eq!((found.object, found.followed), (1, k > 0));
        assert!(found.corners.len() >= 3, "{k}: {}", found.corners.len());
        for corner in &found.corners {
            let own = &corner.hypotheses[0];
            assert!(attitude_deg(own) < 1.5 && place_off_m(own, right_m) < 0.01, "{k}: {own:?}");
            tells_the_cube(corner);
        }
        assert!(found.ends.iter().flatten().count() >= 2);
        if let Some(before) = &before {
            assert_eq!(names(&found), names(before));
        }
        before = Some(found);
    }
    // Nothing is there for a while, and then the same.
    let wall = [cube::wall(), cube::wall()];
    for _ in 0..3 {
        let found = look(&mut estimator, &wall, true);
        assert_eq!((found.verdict, found.corners.len()), (CornerVerdict::NoneLeft, 0));
    }
    let found = look(&mut estimator, &[0.06, 0.06 + BASELINE_M].map(cube::cube), true);
    assert_eq!(names(&found), names(&before.unwrap()));
    assert_eq!(found.object, 1);
}

#[test]
fn an_image_of_the_other_kind_is_refused_and_nothing_has_happened() {
    let colours = [0.0, BASELINE_M].map(cube::cube);
    let greys = colours.each_ref().map(|image| grey(image));
    let grey = |k: usize| Frame::Gray(ImageView::new(&greys[k], 320, 180, 320).unwrap());
    let colour = |k: usize| Frame::Color(ColorView::new(&colours[k], 320, 180, 3 * 320).unwrap());
    for (method, is_grey) in [("general", true), ("coloured", false)] {
        let mut estimator = estimator(method, true, EstimatorOptions::default());
        assert!(look(&mut estimator, &colours, is_grey).pose().is_some());
        let before = estimator.clone();
        let (own, other) = if is_grey { ([grey(0), grey(1)], colour(1)) } else { ([colour(0), colour(1)], grey(1)) };
        for [left, right] in [[&other, &own[1]], [&own[0], &other]] {
            assert!(estimator.observe(left, Some(right), &FrameKnowledge::default()).is_err());
            assert_eq!(estimator.state(), before.state(), "{method}");
        }
    }
}

#[test]
fn one_camera_has_the_place_by_what_it_knows() {
    let right_m = 0.03;
    let height_m = truth().column(1).dot(&vertex_m(right_m));
    let known = [
        EstimatorOptions { edge_length_m: Some(SIDE_M), ..EstimatorOptions::default() },
        EstimatorOptions { box_size_m: Some(Vector3::repeat(SIDE_M)), ..EstimatorOptions::default() },
        EstimatorOptions { camera_height_m: Some(height_m), ..EstimatorOptions::default() },
    ];
    for (case, known) in known.into_iter().enumerate() {
        for (method, is_grey) in [("coloured", false), ("general", true)] {
            let down = Some(truth().column(1).into_owned());
            let options = EstimatorOptions { down, right_handed: Some(true), ..known.clone() };
            let found = look(&mut estimator(method, false, options), &[cube::cube(right_m)], is_grey);
            assert_eq!((found.verdict, found.place), (CornerVerdict::Found, PlaceVerdict::Told), "{method} {case}");
            let pose = found.pose().unwrap();
            assert!(attitude_deg(pose) < 0.4, "{method} {case}: {}", attitude_deg(pose));
            // By its height a grey corner below the upper face is as good as this one.
            if is_grey && known.camera_height_m.is_some() {
                continue;
            }
            assert!(place_off_m(pose, right_m) < 0.006, "{method} {case}: {}", place_off_m(pose, right_m));
        }
    }
}

#[test]
fn a_corner_whose_third_edge_is_short_is_completed() {
    let mut images = [0.0, BASELINE_M].map(cube::cube);
    // What is beyond two fifths of the upright edge is behind something plain.
    for (bytes, right_m) in images.iter_mut().zip([0.0, BASELINE_M]) {
        for share in 0..60u8 {
            let along_m = (0.4 + 0.65 * f64::from(share) / 59.0) * SIDE_M;
            let hidden = cube::project(vertex_m(right_m) + truth() * Vector3::new(0.0, along_m, 0.0));
            for (k, pixel) in bytes.chunks_mut(3).enumerate() {
                if ((k % 320) as f64 - hidden.x).hypot((k / 320) as f64 - hidden.y) < 7.0 {
                    pixel.fill(90);
                }
            }
        }
    }
    let found = look(&mut estimator("general", true, EstimatorOptions::default()), &images, true);
    let is_here = |corner: &&BelievedCorner| (corner.hypotheses[0].vertex_m.unwrap() - vertex_m(0.0)).norm() < 0.02;
    let completed = found.corners.iter().find(is_here).unwrap();
    assert!(attitude_deg(&completed.hypotheses[0]) < 0.5 && place_off_m(&completed.hypotheses[0], 0.0) < 0.006);
}

#[test]
fn a_detector_of_another_included_angle_is_refused() {
    let with = |left_rad: f64, right_rad: f64, gamma_rad: f64| {
        let side = |gamma_rad: f64| {
            let method = CornerMethod::General(GeneralOptions { gamma_rad, ..GeneralOptions::default() });
            CornerDetector::new(cube::pinhole(), DetectorOptions { method, ..DetectorOptions::default() }, None)
                .unwrap()
        };
        let left_from_right = RigidMotion { rotation: Matrix3::identity(), translation_m: Vector3::x() };
        let options = EstimatorOptions { angle: IncludedAngle::exact(gamma_rad), ..EstimatorOptions::default() };
        CornerPoseEstimator::new(side(left_rad), Some((side(right_rad), left_from_right)), options)
    };
    assert!(with(1.2, 1.2, 1.2).is_ok() && with(1.57, FRAC_PI_2, FRAC_PI_2).is_ok());
    for (left_rad, right_rad, gamma_rad) in [(1.2, 1.2, FRAC_PI_2), (FRAC_PI_2, FRAC_PI_2, 1.2), (1.2, 1.3, 1.2)] {
        let told = with(left_rad, right_rad, gamma_rad).unwrap_err().to_string();
        assert!(told.contains("gamma_rad") && told.contains("as the detector has it"), "{told}");
    }
}

#[test]
fn knowledge_that_is_none_is_refused_by_name() {
    let usual = EstimatorOptions::default();
    for (options, expected) in [
        (EstimatorOptions { camera_height_m: Some(0.0), ..usual.clone() }, "camera_height_m"),
        (EstimatorOptions { edge_length_m: Some(f64::INFINITY), ..usual.clone() }, "edge_length_m"),
        (EstimatorOptions { box_size_m: Some(Vector3::new(0.3, -0.3, 0.3)), ..usual.clone() }, "box_size_m"),
        (EstimatorOptions { camera_height_m: Some(1.0), edge_length_m: Some(0.3), ..usual.clone() }, "one of them"),
        (EstimatorOptions { down: Some(Vector3::new(0.0, 1.1, 0.0)), ..usual.clone() }, "a unit vector"),
    ] {
        let detector =
            CornerDetector::new(cube::pinhole(), DetectorOptions::for_method("general").unwrap(), None).unwrap();
        let told = CornerPoseEstimator::new(detector, None, options).unwrap_err().to_string();
        assert!(told.contains(expected), "{told}");
    }
}
