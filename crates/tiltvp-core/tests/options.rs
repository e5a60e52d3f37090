//! An option no code reads does not exist: a second value of each changes an answer, and a wrong value is refused by name.

#![allow(clippy::unwrap_used, clippy::panic)]

mod scene;

use nalgebra::{Matrix3, Vector3};
use scene::{Image, fisheye, random, stripes};
use tiltvp_core::Error;
use tiltvp_core::edges::{EdgeOptions, Mask, NormalKind};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::options::{Field, Options, Value};
use tiltvp_core::robust::{LocalOptimization, SampleOrder, Sampling, Score};
use tiltvp_core::tilt::{
    CommonDirectionOptions, Correction, ImageSpaceOptions, ImageSpaceRansacOptions, ImageSpaceRejectRefitOptions,
    METHODS, Method, RefineOptions, TiltEstimate, TiltEstimator, TiltOptions, TrainedCorrection,
    VectorConsensusOptions, common_direction,
};

const SIDE: u32 = 200;

/// Vertical stripes with enough noise that every choice has something to choose from.
fn image() -> Image {
    stripes(&fisheye(SIDE), &Matrix3::identity(), &Tilt::from_alpha_beta(0.07, 0.8), 25, 7.0, 3)
}

fn defaults(name: &str) -> TiltOptions {
    TiltOptions::for_method(name).unwrap()
}

fn estimate(options: TiltOptions) -> TiltEstimate {
    let estimator = TiltEstimator::new(fisheye(SIDE), Matrix3::identity(), options).unwrap();
    estimator.estimate(&image().view(), &mut estimator.scratch()).unwrap()
}

/// The name in the refusal of an option.
fn refused(options: TiltOptions) -> String {
    match TiltEstimator::new(fisheye(SIDE), Matrix3::identity(), options) {
        Err(Error::InvalidOption { name, value, expected }) => {
            assert!(!value.is_empty() && !expected.is_empty());
            name.into_owned()
        }
        other => panic!("not refused as an option: {:?}", other.map(|_| "an estimator")),
    }
}

/// Another value of an option that changes an answer. A new option needs one here.
fn second(method: &str, name: &str, default: &Value) -> Value {
    let number = default.numbers().first().copied().unwrap_or(f64::NAN);
    match name {
        // Far above where a chain may start; of single pixels a little does.
        "gradient_min" => Value::Float(if method == "segments" { 900.0 } else { 1.3 * number }),
        "smoothing_px" => Value::Float(number + 0.7),
        "elevation_min_rad" => Value::Float(0.2),
        "elevation_max_rad" => Value::Float(0.5),
        "margin_px" => Value::Float(6.0),
        "stray_max_px" | "rms_max_px" => Value::Float(0.1),
        "tilt_max_rad" => Value::Float(0.3),
        "row_stride" => Value::Int(2),
        "mask" => {
            let n = SIDE as usize;
            Value::Mask(vec![n, n], (0..n * n).map(|i| i % n > n / 3).collect())
        }
        "seed" => Value::Int(5),
        "threshold_px" => Value::Float(3.0),
        "offset_max_px" => Value::Float(8.0),
        "correction" => Value::Float(if method == "vector-consensus" { 1.8 } else { 100.0 }),
        "keep_fraction" => Value::Float(0.55),
        "max_iterations" => Value::Int(1),
        "threshold_rad" => Value::Float(0.03),
        "normal" => Value::Text("tangent".to_owned()),
        "scale_rad" => Value::Float(0.01),
        "tolerance_rad" | "scatter_rad" => Value::Float(0.05),
        "sampling" => Value::Text("progressive".to_owned()),
        "local_optimization" => Value::Bool(true),
        "score" => Value::Text("msac".to_owned()),
        "gradient_start" => Value::Float(1200.0),
        "support_min_px" => Value::Int(30),
        "gap_max" => Value::Float(0.0),
        "segments_max" => Value::Int(4),
        _ => panic!("{method}: the option {name} has no second value here, which would show that it is read"),
    }
}

/// Options that a method leaves to others: only what samples draws, and only drawn samples have a seed.
const UNREAD: [(&str, &str); 3] = [("refined", "seed"), ("image-space-reject-refit", "seed"), ("segments", "seed")];

/// Straight edges are followed from row to row.
const REFUSED: (&str, &str) = ("segments", "row_stride");

/// Answers with an option set, for several seeds and a wide and a narrow threshold where there are such.
fn answers(method: &str, name: &str, value: &Value) -> Vec<(Option<Tilt>, u32)> {
    let mut answers = Vec::new();
    for seed in 0..3 {
        for narrow in [false, true] {
            let mut options = defaults(method);
            options.seed = seed;
            for (threshold, value) in [("threshold_px", 2.0), ("threshold_rad", 0.02)] {
                if narrow {
                    options.try_set(threshold, &Value::Float(value)).unwrap();
                }
            }
            if name == "max_iterations" {
                // Only what has not converged before reaches the limit.
                options.try_set("tolerance_rad", &Value::Float(0.0)).unwrap();
            }
            options.set(name, value).unwrap();
            assert_eq!(options.get(name).as_ref(), Some(value), "{method}, {name}");
            let answer = estimate(options);
            answers.push((answer.tilt, answer.iterations));
        }
    }
    answers
}

#[test]
fn every_option_is_read() {
    for method in METHODS {
        for Field { name, value, .. } in defaults(method).fields() {
            let other = second(method, &name, &value);
            if (method, &*name) == REFUSED {
                assert_eq!(refused(TiltOptions { row_stride: 2, ..defaults(method) }), "row_stride");
                continue;
            }
            assert_ne!(other, value, "{method}: the second value of {name} is its default");
            let (before, after) = (answers(method, &name, &value), answers(method, &name, &other));
            assert!(before.iter().chain(&after).any(|(tilt, _)| tilt.is_some()), "{method}, {name}: no answer");
            let unread = UNREAD.contains(&(method, &name));
            assert_eq!(before == after, unread, "{method} does {}read {name}", if unread { "" } else { "not " });
        }
    }
}

/// No correction is a correction too.
#[test]
fn corrections_are_told_apart() {
    for method in ["image-space-ransac", "image-space-reject-refit"] {
        let [none, closed] = [Value::None, Value::Text("closed-form".to_owned())];
        assert_ne!(answers(method, "correction", &none), answers(method, "correction", &closed));
    }
}

/// The sampling of a sampling method.
fn sampling(options: &mut TiltOptions) -> &mut Sampling {
    match &mut options.method {
        Method::ImageSpaceRansac(own) => &mut own.sampling,
        Method::VectorConsensus(own) => &mut own.sampling,
        other => panic!("{other:?} does not sample"),
    }
}

/// Each number of an option changes an answer or the number of trials.
#[test]
fn every_number_of_the_sampling_is_read() {
    let with = |change: &dyn Fn(&mut Sampling)| {
        let mut answers = Vec::new();
        for method in ["image-space-ransac", "vector-consensus"] {
            for seed in 0..4 {
                let mut options = TiltOptions { seed, ..defaults(method) };
                match &mut options.method {
                    Method::ImageSpaceRansac(own) => own.threshold_px = 2.0,
                    Method::VectorConsensus(own) => own.threshold_rad = 0.02,
                    other => panic!("{other:?} does not sample"),
                }
                change(sampling(&mut options));
                let answer = estimate(options);
                answers.push((answer.tilt, answer.iterations));
            }
        }
        answers
    };
    let order = |uniform_after| with(&|s| s.order = SampleOrder::Progressive { uniform_after });
    assert_ne!(order(200_000), order(50));
    let local =
        |iterations, widening| with(&|s| s.local_optimization = Some(LocalOptimization { iterations, widening }));
    assert_ne!(local(4, 2.0), local(2, 2.0));
    assert_ne!(local(4, 2.0), local(4, 1.0));
    assert_ne!(with(&|s| s.score = Score::Msac), with(&|_| {}));
}

fn space(offset_max_px: f64, factor: f64) -> ImageSpaceOptions {
    ImageSpaceOptions { offset_max_px: Some(offset_max_px), correction: Correction::factor(factor) }
}

/// A factor divides the lean and nothing else.
#[test]
fn factors_divide_the_lean() {
    let with = |factor| {
        let method = Method::ImageSpaceRejectRefit(ImageSpaceRejectRefitOptions {
            space: space(40.0, factor),
            ..ImageSpaceRejectRefitOptions::default()
        });
        estimate(TiltOptions { method, ..defaults("image-space-reject-refit") })
    };
    let (one, two) = (with(80.0), with(160.0));
    assert!((one.tilt.unwrap().alpha_rad() / two.tilt.unwrap().alpha_rad() - 2.0).abs() < 1e-9);
    assert!((one.tilt.unwrap().beta_rad() - two.tilt.unwrap().beta_rad()).abs() < 1e-12);
    assert_eq!((one.shift_px, one.inlier_pixels), (two.shift_px, two.inlier_pixels));
}

#[test]
fn wrong_values_are_refused_by_name() {
    for method in METHODS {
        for (name, field) in [
            ("gradient_min", (|o| &mut o.gradient_min) as fn(&mut EdgeOptions) -> &mut f64),
            ("smoothing_px", |o| &mut o.smoothing_px),
            ("elevation_min_rad", |o| &mut o.elevation_min_rad),
            ("elevation_max_rad", |o| &mut o.elevation_max_rad),
            ("margin_px", |o| &mut o.margin_px),
        ] {
            for wrong in [-2.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e9] {
                if name == "gradient_min" && wrong == 1e9 {
                    continue;
                }
                let mut options = defaults(method);
                *field(&mut options.edges) = wrong;
                assert_eq!(refused(options), name, "{method}, {name} = {wrong}");
            }
        }
        for wrong in [0, 1000] {
            assert_eq!(refused(TiltOptions { row_stride: wrong, ..defaults(method) }), "row_stride");
        }
        let beyond = if method == "segments" { 3.2 } else { 1.6 };
        for wrong in [0.0, -0.1, beyond, f64::NAN] {
            assert_eq!(refused(TiltOptions { tilt_max_rad: Some(wrong), ..defaults(method) }), "tilt_max_rad");
        }
        let mask = Some(Mask::new(3, 5, vec![true; 15]).unwrap());
        let error = TiltEstimator::new(fisheye(SIDE), Matrix3::identity(), TiltOptions { mask, ..defaults(method) })
            .unwrap_err();
        assert!(error.to_string().starts_with("mask: got 5 x 3, expected 200 x 200"), "{error}");
    }
    assert!(Mask::new(3, 5, vec![true; 14]).unwrap_err().to_string().starts_with("mask"));
}

#[test]
fn wrong_values_of_a_method_are_refused_by_name() {
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let ransac = |threshold_px, offset_max_px, factor| {
            Method::ImageSpaceRansac(ImageSpaceRansacOptions {
                threshold_px,
                space: space(offset_max_px, factor),
                ..ImageSpaceRansacOptions::default()
            })
        };
        let trimming = |keep_fraction, offset_max_px, factor| {
            Method::ImageSpaceRejectRefit(ImageSpaceRejectRefitOptions {
                keep_fraction,
                space: space(offset_max_px, factor),
                ..ImageSpaceRejectRefitOptions::default()
            })
        };
        let vectors = |threshold_rad, factor| {
            Method::VectorConsensus(VectorConsensusOptions {
                threshold_rad,
                normal: NormalKind::Tangent,
                correction: TrainedCorrection::Factor(factor),
                ..VectorConsensusOptions::default()
            })
        };
        let refined = |keep_fraction, scale_rad| {
            Method::Refined(RefineOptions { keep_fraction, scale_rad, ..RefineOptions::default() })
        };
        for (name, method) in [
            ("threshold_px", ransac(wrong, 40.0, 200.0)),
            ("offset_max_px", ransac(10.0, wrong, 200.0)),
            ("correction", ransac(10.0, 40.0, wrong)),
            ("keep_fraction", trimming(wrong, 40.0, 200.0)),
            ("offset_max_px", trimming(0.8, wrong, 200.0)),
            ("correction", trimming(0.8, 40.0, wrong)),
            ("threshold_rad", vectors(wrong, 1.0)),
            ("correction", vectors(0.1, wrong)),
            ("keep_fraction", refined(wrong, 0.03)),
            ("scale_rad", refined(0.8, wrong)),
        ] {
            assert_eq!(refused(TiltOptions { method, ..defaults("refined") }), name, "{wrong}");
        }
    }
    for method in ["image-space-ransac", "vector-consensus"] {
        let mut options = defaults(method);
        sampling(&mut options).local_optimization = Some(LocalOptimization { iterations: 4, widening: 0.5 });
        assert_eq!(refused(options), "widening");
    }
    let error = TiltOptions::for_method("refine").unwrap_err().to_string();
    for name in METHODS {
        assert!(error.contains(name), "{error}");
        assert_eq!(defaults(name).method.name(), name);
    }
}

/// Normals about a direction that leans by 0.1 rad, a third of them wrong.
fn normals() -> Vec<Vector3<f64>> {
    let truth = Tilt::from_alpha_beta(0.1, 1.0).leaning_from_upright();
    (0..90)
        .map(|i| {
            let (s, c) = (0.7 * f64::from(i)).sin_cos();
            let stray = if i % 3 == 0 { 0.5 } else { 0.02 };
            truth * Vector3::new(c, s, stray * (random(1, i as u64) - 0.5))
        })
        .collect()
}

#[test]
fn every_option_of_the_common_direction_is_read() {
    let normals = normals();
    let with = |options: &CommonDirectionOptions| common_direction(&normals, None, options).unwrap();
    let own = CommonDirectionOptions::default();
    let before = with(&own);
    assert!(before.direction.is_some());
    for Field { name, .. } in own.fields() {
        let mut options = own;
        let value = match &*name {
            "sigma_rad" => Value::Float(0.05),
            "prior" => Value::Array(vec![3], vec![0.15, 0.0, 1.0]),
            "max_angle_rad" => Value::Float(0.12),
            _ => panic!("the option {name} has no second value here, which would show that it is read"),
        };
        options.set(&name, &value).unwrap();
        let after = with(&options);
        assert!(after.direction.is_some(), "{name}: {}", after.stop);
        assert_ne!(after.direction, before.direction, "{name}");
    }
    let weights: Vec<f64> = (0..normals.len()).map(|i| 1.0 + i as f64).collect();
    assert_ne!(common_direction(&normals, Some(&weights), &own).unwrap().direction, before.direction);
    let sideways = with(&CommonDirectionOptions { prior: Vector3::x(), ..own });
    assert!(sideways.direction.is_none_or(|d| d.x > 0.9), "{sideways:?}");
}

#[test]
fn wrong_values_of_the_common_direction_are_refused_by_name() {
    let own = CommonDirectionOptions::default();
    let named = |options: &CommonDirectionOptions, name: &str| {
        let error = common_direction(&normals(), None, options).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    };
    for wrong in [0.0, -1.0, 1.6, f64::NAN, f64::INFINITY] {
        named(&CommonDirectionOptions { sigma_rad: wrong, ..own }, "sigma_rad");
        named(&CommonDirectionOptions { max_angle_rad: wrong, ..own }, "max_angle_rad");
    }
    for wrong in [Vector3::zeros(), Vector3::repeat(f64::NAN), Vector3::new(0.0, f64::INFINITY, 1.0)] {
        named(&CommonDirectionOptions { prior: wrong, ..own }, "prior");
        let mut normals = normals();
        normals[7] = wrong;
        let error = common_direction(&normals, None, &own).unwrap_err().to_string();
        assert!(error.contains("normals") && error.contains("row 7"), "{error}");
    }
}

/// A lean is a shift of the image only for a lens about the vertical.
#[test]
fn cameras_far_from_the_vertical_are_refused_by_the_image_space_methods() {
    let about_x =
        |degrees: f64| nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), degrees.to_radians()).into_inner();
    for method in METHODS {
        for (degrees, served) in
            [(0.0, true), (40.0, true), (50.0, false), (90.0, false), (130.0, false), (140.0, true)]
        {
            let mut options = defaults(method);
            (options.edges.elevation_min_rad, options.edges.elevation_max_rad) = (-0.7, 0.7);
            match TiltEstimator::new(fisheye(SIDE), about_x(degrees), options) {
                Ok(_) => assert!(served || !method.starts_with("image"), "{method}, {degrees}"),
                Err(error) => {
                    assert!(!served && method.starts_with("image"), "{method}, {degrees}: {error}");
                    assert!(error.to_string().contains("optical axis"), "{error}");
                }
            }
        }
    }
}

/// The paper's 40 pixels for its lens, and in proportion for others; a number that is too large is named.
#[test]
fn the_largest_offset_follows_the_lens() {
    for method in ["image-space-ransac", "image-space-reject-refit"] {
        let with = |offset: Option<f64>| {
            let mut options = defaults(method);
            match &mut options.method {
                Method::ImageSpaceRansac(own) => own.space.offset_max_px = offset,
                Method::ImageSpaceRejectRefit(own) => own.space.offset_max_px = offset,
                other => panic!("{other:?} has no offsets"),
            }
            options
        };
        let scale = 0.46 * f64::from(SIDE) / 92.5f64.to_radians();
        let (own, same) = (estimate(with(None)), estimate(with(Some(40.0 * scale / 139.7))));
        assert_eq!((own.tilt, own.prefiltered_pixels), (same.tilt, same.prefiltered_pixels), "{method}");
        assert_eq!(refused(with(Some(900.0))), "offset_max_px");
    }
}
