//! Corrections learned from draws of known laws: they find the law, are calibrated, never fall, and refuse what makes no sense.

#![allow(clippy::unwrap_used, clippy::panic)]

mod scene;

use nalgebra::Matrix3;
use scene::{fisheye, random, stripes};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt::{
    AffineCorrection, Correction, Method, PosteriorCorrection, PriorOfTilt, ShiftModel, TiltEstimate, TiltEstimator,
    TiltOptions, TrainedCorrection, train_affine, train_factor, train_posterior,
};

const LAW: ShiftModel =
    ShiftModel { factor: 200.0, spread: 3.0, spread_per_rad: 25.0, stray_share: 0.04, stray_max: 100.0 };

/// Two independent standard normal numbers (Box and Muller).
fn gauss(seed: u64, index: u64) -> [f64; 2] {
    let radius = (-2.0 * (1.0 - random(seed, 2 * index)).ln()).sqrt();
    let (sin, cos) = (random(seed, 2 * index + 1) * std::f64::consts::TAU).sin_cos();
    [radius * cos, radius * sin]
}

/// Shifts of a law for leans uniform from zero to `max_rad`.
fn draw(law: &ShiftModel, max_rad: f64, count: u64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    (0..count)
        .map(|i| {
            let alpha = max_rad * random(seed, i);
            let [x, y] = gauss(seed + 1, i).map(|g| g * law.spread_at(alpha));
            let stray = random(seed + 2, i) < law.stray_share;
            let shift =
                if stray { law.stray_max * random(seed + 3, i).sqrt() } else { (law.factor * alpha + x).hypot(y) };
            (shift, alpha)
        })
        .unzip()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / count
}

#[test]
fn the_factor_is_the_mean_ratio() {
    let a = train_factor(&[2.0, 9.0, 8.0], &[0.01, 0.03, 0.04]).unwrap();
    assert!((a - (200.0 + 300.0 + 200.0) / 3.0).abs() < 1e-9);
}

#[test]
fn the_line_is_found_and_right_on_average_at_every_lean() {
    let alpha: Vec<f64> = (0..4000).map(|i| 0.02 + 0.1 * random(1, i)).collect();
    let shift: Vec<f64> =
        alpha.iter().zip(0..).map(|(a, i)| (180.0 * (a + 0.015) + 2.0 * gauss(2, i)[0]).max(0.0)).collect();
    let line = train_affine(&shift, &alpha).unwrap();
    assert!((line.factor - 180.0).abs() < 3.0 && (line.offset_rad + 0.015).abs() < 1.5e-3, "{line:?}");
    let correction = TrainedCorrection::Affine(line);
    for (low, high) in [(0.02, 0.05), (0.05, 0.09), (0.09, 0.12)] {
        let some = alpha.iter().zip(&shift).filter(|(a, _)| (low..high).contains(*a));
        assert!(mean(some.map(|(a, l)| correction.apply(*l) - a)).abs() < 1e-3);
    }
    assert_eq!(correction.apply(0.0), 0.0);
    assert!((correction.apply(36.0) - (36.0 / line.factor + line.offset_rad)).abs() < 1e-15);
}

#[test]
fn the_law_of_the_draws_is_found() {
    let (shift, alpha) = draw(&LAW, 0.15, 3000, 10);
    let found = *train_posterior(&shift, &alpha, PriorOfTilt::Empirical).unwrap().model();
    assert!((found.factor / LAW.factor - 1.0).abs() < 0.01, "{found:?}");
    assert!((found.spread / LAW.spread - 1.0).abs() < 0.08, "{found:?}");
    assert!((found.spread_per_rad / LAW.spread_per_rad - 1.0).abs() < 0.25, "{found:?}");
    assert!((found.stray_share / LAW.stray_share - 1.0).abs() < 0.3, "{found:?}");
}

/// The mean of what is left over, and its square in units of the posterior's own variance, in three parts of the leans'
/// range; with 6000 draws four standard errors of the latter are about 0.15.
#[test]
fn the_posterior_is_calibrated_on_draws_it_has_not_seen() {
    for law in [LAW, ShiftModel { stray_share: 0.0, ..LAW }, ShiftModel { factor: 1.8, spread: 0.02, ..LAW }] {
        let law = if law.factor < 2.0 { ShiftModel { spread_per_rad: 0.2, stray_max: 0.8, ..law } } else { law };
        let (shift, alpha) = draw(&law, 0.15, 3000, 20);
        let posterior = train_posterior(&shift, &alpha, PriorOfTilt::Uniform { max_rad: 0.15 }).unwrap();
        let (unseen, truth) = draw(&law, 0.15, 18_000, 30);
        let (step, std) = (posterior.step(), posterior.std_rad().to_vec());
        let correction = TrainedCorrection::Posterior(posterior);
        let scale = law.factor * 0.15;
        for (low, high) in [(0.0, 0.2 * scale), (0.2 * scale, 0.6 * scale), (0.6 * scale, scale)] {
            let some = || unseen.iter().zip(&truth).filter(move |(l, _)| (low..high).contains(*l));
            let bias = mean(some().map(|(l, a)| correction.apply(*l) - a));
            let squares = mean(some().map(|(l, a)| {
                ((correction.apply(*l) - a) / std[((l / step).round() as usize).min(std.len() - 1)]).powi(2)
            }));
            assert!(bias.abs() < 1.2e-3, "{law:?}, {low:.1}..{high:.1}: bias {bias}");
            assert!((squares - 1.0).abs() < 0.2, "{law:?}, {low:.1}..{high:.1}: squares {squares}");
        }
        // It errs less than dividing by the true factor does.
        let rms = |f: &dyn Fn(f64) -> f64| mean(unseen.iter().zip(&truth).map(|(l, a)| (f(*l) - a).powi(2))).sqrt();
        assert!(rms(&|l| correction.apply(l)) < 0.95 * rms(&|l| l / law.factor));
    }
}

#[test]
fn the_prior_draws() {
    let (shift, alpha) = draw(&LAW, 0.15, 600, 40);
    let with = |prior| train_posterior(&shift, &alpha, prior).unwrap();
    let flat = with(PriorOfTilt::Uniform { max_rad: 0.15 });
    let low = with(PriorOfTilt::Rayleigh { sigma_rad: 0.01 });
    let at = |posterior: &PosteriorCorrection, l| TrainedCorrection::Posterior(posterior.clone()).apply(l);
    assert!(at(&low, 8.0) < at(&flat, 8.0) - 0.01);
    assert!((at(&with(PriorOfTilt::Empirical), 16.0) - at(&flat, 16.0)).abs() < 3e-3);
    assert!(at(&flat, 1e6) < 0.15 && flat.mean_rad()[0] > 0.0);
}

#[test]
fn means_never_fall() {
    for (seed, count) in [(50, 10), (51, 30), (52, 300)] {
        for prior in
            [PriorOfTilt::Empirical, PriorOfTilt::Uniform { max_rad: 0.3 }, PriorOfTilt::Rayleigh { sigma_rad: 0.03 }]
        {
            let (shift, alpha) = draw(&LAW, 0.12, count, seed);
            let posterior = train_posterior(&shift, &alpha, prior).unwrap();
            assert!(posterior.mean_rad().is_sorted());
            let correction = TrainedCorrection::Posterior(posterior.clone());
            let all: Vec<f64> = (0..5000).map(|i| correction.apply(f64::from(i) * 0.05)).collect();
            assert!(all.is_sorted() && all.iter().all(|alpha| alpha.is_finite()), "{prior:?}");
            let same = PosteriorCorrection::new(
                *posterior.model(),
                posterior.step(),
                posterior.mean_rad(),
                posterior.std_rad(),
            );
            assert_eq!(same.unwrap(), posterior);
        }
    }
    // The paper's database: six equal leans and none.
    let alpha: Vec<f64> = (0..301).map(|i| if i % 7 == 0 { 0.0 } else { [0.035, 0.07][i % 2] }).collect();
    let shift: Vec<f64> = alpha.iter().zip(0..).map(|(a, i)| (230.0 * a + 2.0 * gauss(3, i)[0]).abs()).collect();
    for prior in [PriorOfTilt::Empirical, PriorOfTilt::Uniform { max_rad: 0.1 }] {
        let correction = TrainedCorrection::Posterior(train_posterior(&shift, &alpha, prior).unwrap());
        assert!((correction.apply(230.0 * 0.07) - 0.07).abs() < 0.006);
    }
}

type Trainer = fn(&[f64], &[f64]) -> Result<String, tiltvp_core::Error>;

#[test]
fn training_sets_that_make_no_sense_are_refused() {
    let message = |result: Result<String, tiltvp_core::Error>| result.unwrap_err().to_string();
    let ten = |value: f64| vec![value; 12];
    let rising: Vec<f64> = (1..13).map(f64::from).collect();
    let trainers: [Trainer; 3] = [
        |l, a| train_factor(l, a).map(|x| format!("{x:?}")),
        |l, a| train_affine(l, a).map(|x| format!("{x:?}")),
        |l, a| train_posterior(l, a, PriorOfTilt::Empirical).map(|x| format!("{x:?}")),
    ];
    for train in trainers {
        assert!(message(train(&[], &[])).contains("0 for 0 shifts"));
        assert!(message(train(&rising, &ten(0.1)[1..])).contains("11 for 12 shifts"));
        for wrong in [f64::NAN, -1.0, f64::INFINITY] {
            let mut shift = rising.clone();
            shift[3] = wrong;
            assert!(message(train(&shift, &ten(0.1))).contains("in place 3"));
            let mut alpha = ten(0.1);
            alpha[5] = wrong;
            assert!(message(train(&rising, &alpha)).contains("alpha_rad"));
        }
        assert!(message(train(&ten(0.0), &rising.iter().map(|x| 0.01 * x).collect::<Vec<_>>())).contains("shift"));
    }
    assert!(message(trainers[0](&rising, &ten(0.0))).contains("above zero"));
    assert!(message(trainers[1](&rising, &ten(0.1))).contains("leans that differ"));
    let falling: Vec<f64> = rising.iter().map(|x| 0.2 - 0.01 * x).collect();
    assert!(message(trainers[1](&rising, &falling)).contains("grow"));
    assert!(message(trainers[2](&rising, &ten(0.0))).contains("grow"));
    assert!(message(trainers[2](&rising[..9], &ten(0.1)[..9])).contains("at least 10"));
    for (prior, name) in [
        (PriorOfTilt::Uniform { max_rad: 0.0 }, "max_rad"),
        (PriorOfTilt::Uniform { max_rad: 2.0 }, "max_rad"),
        (PriorOfTilt::Rayleigh { sigma_rad: f64::NAN }, "sigma_rad"),
    ] {
        assert!(train_posterior(&rising, &ten(0.1), prior).unwrap_err().to_string().contains(name));
    }
    let table = |step, mean: &[f64], std: &[f64]| PosteriorCorrection::new(LAW, step, mean, std);
    assert!(table(1.0, &[0.1, 0.2], &[0.1, 0.1]).is_ok());
    assert!(table(0.0, &[0.1, 0.2], &[0.1, 0.1]).is_err());
    assert!(table(1.0, &[0.2, 0.1], &[0.1, 0.1]).is_err());
    assert!(table(1.0, &[0.1, 0.2], &[0.1]).is_err());
    assert!(table(1.0, &[0.1], &[0.1]).is_err());
    assert!(table(1.0, &[0.1, f64::NAN], &[0.1, 0.1]).is_err());
    assert!(table(1.0, &[0.1, 0.2], &[0.1, -0.1]).is_err());
}

fn estimate(method: &str, correction: TrainedCorrection, alpha_rad: f64) -> TiltEstimate {
    let mut options = TiltOptions::for_method(method).unwrap();
    match &mut options.method {
        Method::ImageSpaceRansac(own) => {
            // Ten pixels are for larger images: of this lens they would be more than the lean.
            own.threshold_px = 2.0;
            own.space.correction = Correction::Trained(correction);
        }
        Method::ImageSpaceRejectRefit(own) => own.space.correction = Correction::Trained(correction),
        Method::VectorConsensus(own) => own.correction = correction,
        Method::Refined(_) | Method::Segments(_) => panic!("{method} takes no correction"),
    }
    let estimator = TiltEstimator::new(fisheye(200), Matrix3::identity(), options).unwrap();
    let image = stripes(&fisheye(200), &Matrix3::identity(), &Tilt::from_alpha_beta(alpha_rad, 0.8), 25, 3.0, 3);
    estimator.estimate(&image.view(), &mut estimator.scratch()).unwrap()
}

/// The methods that take a correction.
const CORRECTED: [&str; 3] = ["image-space-ransac", "image-space-reject-refit", "vector-consensus"];

/// What each method measures before any correction, and its own unit per radian.
fn measured(method: &str, alpha_rad: f64) -> (TiltEstimate, f64, f64) {
    let factor = if method == "vector-consensus" { 1.0 } else { 100.0 };
    let plain = estimate(method, TrainedCorrection::Factor(factor), alpha_rad);
    let raw = plain.shift_px.unwrap_or_else(|| plain.tilt.unwrap().alpha_rad());
    (plain, raw, factor)
}

#[test]
fn estimates_are_what_corrections_of_their_shifts_are() {
    for method in CORRECTED {
        let (plain, raw, factor) = measured(method, 0.07);
        let line = TrainedCorrection::Affine(AffineCorrection { factor, offset_rad: -0.02 });
        let found = estimate(method, line.clone(), 0.07);
        assert!((found.tilt.unwrap().alpha_rad() - line.apply(raw)).abs() < 1e-9, "{method}");
        assert!((found.tilt.unwrap().beta_rad() - plain.tilt.unwrap().beta_rad()).abs() < 1e-9, "{method}");
        let difference = found.covariance_rad2 - plain.covariance_rad2;
        // Along the lean the methods' own share of a smaller angle is smaller; across it nothing changes.
        let along = plain.tilt.unwrap().normal().xy().normalize();
        let across = nalgebra::Vector2::new(-along.y, along.x);
        let sideways = across.dot(&(difference * across)).abs();
        assert!(sideways < 0.05 * plain.covariance_rad2.norm(), "{method}: {difference}");
        assert_eq!(found.shift_px, plain.shift_px);

        let clamped = TrainedCorrection::Affine(AffineCorrection { factor, offset_rad: -1.0 });
        let none = estimate(method, clamped, 0.07);
        assert_eq!(none.tilt.unwrap().alpha_rad(), 0.0, "{method}");
        assert!(none.covariance_rad2.determinant() > 0.0);

        let same = TrainedCorrection::Affine(AffineCorrection { factor, offset_rad: 0.0 });
        let same = estimate(method, same, 0.07);
        assert!((same.tilt.unwrap().alpha_rad() - plain.tilt.unwrap().alpha_rad()).abs() < 1e-12);
        assert!((same.covariance_rad2 - plain.covariance_rad2).norm() < 1e-9, "{method}");
    }
}

#[test]
fn the_posterior_deviation_is_in_the_covariance_along_the_lean() {
    for method in CORRECTED {
        let (plain, raw, factor) = measured(method, 0.07);
        let model =
            ShiftModel { factor, spread: 0.02 * factor, spread_per_rad: 0.0, stray_share: 0.0, stray_max: factor };
        let table = |std: f64| {
            let mean: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.002 + 0.01).collect();
            PosteriorCorrection::new(model, 0.002 * factor, &mean, &vec![std; 200]).unwrap()
        };
        let correction = TrainedCorrection::Posterior(table(0.05));
        let found = estimate(method, correction.clone(), 0.07);
        let tilt = found.tilt.unwrap();
        assert!((tilt.alpha_rad() - correction.apply(raw)).abs() < 1e-9, "{method}");
        assert!((tilt.beta_rad() - plain.tilt.unwrap().beta_rad()).abs() < 1e-9, "{method}");
        let along = tilt.normal().xy().normalize();
        let deviation = along.dot(&(found.covariance_rad2 * along)).sqrt();
        assert!((deviation - 0.05).abs() < 1e-3, "{method}: {deviation}");
        let across = nalgebra::Vector2::new(-along.y, along.x);
        assert!(across.dot(&(found.covariance_rad2 * across)).sqrt() < 0.03, "{method}");
        // A training set without scatter takes nothing off what the image itself does not know; along the lean it replaces
        // the share of the lean that a method may be wrong by.
        let sure = estimate(method, TrainedCorrection::Posterior(table(0.0)), 0.07);
        let sideways = |estimate: &TiltEstimate| across.dot(&(estimate.covariance_rad2 * across));
        assert!(sideways(&sure) > 0.8 * sideways(&plain), "{method}");
        assert!(sure.confidence > found.confidence, "{method}");
    }
}
