//! Every way of sampling finds the truth among outliers, repeats itself, and does what it is for.

#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::robust::{
    Direction, FitReport, LocalOptimization, RansacOptions, RansacScratch, Rows, SampleOrder, Sampling, Score, Stop,
    ransac,
};

const NOISE: f64 = 0.004;
const THRESHOLD: f64 = 0.01;

/// A number in (0, 1) for each argument, alike on every machine.
fn random(seed: u64, i: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ i.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for _ in 0..3 {
        x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    ((x >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// Normals of great circles through `truth` with Gaussian noise, a share of them replaced by any; and how good they look.
struct Scene {
    truth: Vector3<f64>,
    rows: Rows<f32>,
    quality: Vec<f32>,
}

fn scene(seed: u64, len: u64, outliers: f64) -> Scene {
    let truth = Vector3::new(0.1 * random(seed, 1) - 0.05, 0.1 * random(seed, 2) - 0.05, 1.0).normalize();
    let basis = Matrix3::from_columns(&[truth.cross(&Vector3::y()).normalize(), Vector3::zeros(), truth]);
    let across = truth.cross(&basis.column(0).into_owned());
    let (mut rows, mut quality) = (Rows::with_capacity(len as usize), Vec::new());
    for i in 0..len {
        let at = |k| random(seed, 16 * i + k);
        let outlier = at(3) < outliers;
        let gauss = (-2.0 * at(4).ln()).sqrt() * (std::f64::consts::TAU * at(5)).cos();
        let lean = if outlier { 0.6 * (at(6) - 0.5) } else { NOISE * gauss };
        let turn = std::f64::consts::TAU * at(7);
        let m = (basis.column(0) * turn.cos() + across * turn.sin() + truth * lean).normalize();
        rows.push(m.x as f32, m.y as f32, m.z as f32);
        // Inliers tend to look better.
        quality.push((at(8) + if outlier { 0.0 } else { 0.5 }) as f32);
    }
    Scene { truth, rows, quality }
}

impl Scene {
    fn problem(&self) -> Direction<'_, f32> {
        Direction::new(&self.rows).with_quality(&self.quality)
    }

    fn fit(&self, sampling: Sampling, seed: u64) -> FitReport<Vector3<f64>> {
        let options = RansacOptions { seed, sampling, ..RansacOptions::with_threshold(THRESHOLD) };
        options.validate().unwrap();
        let mut weights = vec![1.0; self.rows.len()];
        ransac(&self.problem(), &options, &mut weights, &mut RansacScratch::default())
    }

    fn error(&self, report: &FitReport<Vector3<f64>>) -> f64 {
        report.model.unwrap().cross(&self.truth).norm()
    }
}

/// Each way alone and all together.
fn ways() -> Vec<(&'static str, Sampling)> {
    let plain = Sampling::default();
    let order = SampleOrder::progressive();
    let local_optimization = Some(LocalOptimization::default());
    vec![
        ("plain", plain),
        ("progressive", Sampling { order, ..plain }),
        ("local", Sampling { local_optimization, ..plain }),
        ("msac", Sampling { score: Score::Msac, ..plain }),
        ("all", Sampling { order, local_optimization, score: Score::Msac }),
    ]
}

#[test]
fn every_way_finds_the_truth_among_outliers() {
    for (seed, outliers) in [(1, 0.3), (2, 0.5), (3, 0.7), (4, 0.8)] {
        let scene = scene(seed, 3000, outliers);
        for (name, sampling) in ways() {
            for draw in 0..3 {
                let report = scene.fit(sampling, draw);
                // Least squares over the inliers would be off by about NOISE / sqrt(inliers / 2), below 3e-4.
                let error = scene.error(&report);
                assert!(error < 2e-3, "{name}, {outliers}: {error:.1e}, {}", report.stop);
                assert!(report.inliers as f64 > 0.9 * (1.0 - outliers) * 3000.0, "{name}: {}", report.inliers);
                assert!(matches!(report.stop, Stop::Confident { .. }), "{name}: {}", report.stop);
            }
        }
    }
}

#[test]
fn same_seed_same_answer_whatever_the_scratch_has_seen() {
    let (first, other) = (scene(5, 2000, 0.6), scene(6, 900, 0.3));
    let mut scratch = RansacScratch::default();
    for (name, sampling) in ways() {
        let options = RansacOptions { seed: 9, sampling, ..RansacOptions::with_threshold(THRESHOLD) };
        let mut fit = |scene: &Scene| {
            let mut weights = vec![1.0; scene.rows.len()];
            (ransac(&scene.problem(), &options, &mut weights, &mut scratch), weights)
        };
        let before = fit(&first);
        fit(&other);
        assert_eq!(fit(&first), before, "{name}");
        assert_eq!(first.fit(sampling, 9), before.0, "{name}");
    }
}

/// Sums over the seeds of scenes with 70 % outliers: errors, trials.
fn totals(sampling: Sampling) -> (f64, f64) {
    (0..40).fold((0.0, 0.0), |(errors, trials), seed| {
        let scene = scene(100 + seed, 2000, 0.7);
        let report = scene.fit(sampling, seed);
        (errors + scene.error(&report), trials + f64::from(report.iterations))
    })
}

#[test]
fn every_way_does_what_it_is_for() {
    let total: Vec<(f64, f64)> = ways().iter().map(|(_, sampling)| totals(*sampling)).collect();
    let [plain, progressive, local, msac, all] = total[..] else { unreachable!() };
    // The best-looking observations are mostly inliers: a good model early.
    assert!(progressive != plain && progressive.1 <= 1.02 * plain.1, "{progressive:?} {plain:?}");
    // A larger consensus set earlier: fewer trials, and a better model.
    assert!(local.1 < plain.1 && local.0 < plain.0, "{local:?} {plain:?}");
    // A better choice among models of like counts.
    assert!(msac.0 < plain.0, "{msac:?} {plain:?}");
    assert!(all.0 < plain.0 && all.1 < plain.1, "{all:?} {plain:?}");
}

/// Scores that stop early never hide a better model, and agree with the sum of gains.
#[test]
fn support_is_the_sum_of_gains() {
    let scene = scene(7, 1500, 0.5);
    for score in [Score::Count, Score::Msac] {
        for model in [scene.truth, Vector3::z()] {
            let whole = scene.rows.support(model.into(), THRESHOLD, score, 0.0);
            let sum: f64 = scene.rows.iter().map(|row| score.gain(row.dot(&model), THRESHOLD)).sum();
            assert!((whole - sum).abs() < 1e-3 * sum + 1.0, "{score:?}: {whole} {sum}");
            for share in [0.3, 0.9, 0.999, 1.001, 2.0] {
                let found = scene.rows.support(model.into(), THRESHOLD, score, share * whole);
                if share < 1.0 {
                    assert_eq!(found, whole);
                } else {
                    assert!(found <= share * whole);
                }
            }
        }
    }
}

/// Few and degenerate observations end as they do without options.
#[test]
fn every_way_says_why_it_has_no_model() {
    for (name, sampling) in ways() {
        let mut rows = Rows::<f32>::default();
        let options = RansacOptions { sampling, ..RansacOptions::with_threshold(THRESHOLD) };
        for n in 0..4 {
            let quality = vec![1.0; n];
            let problem = Direction::new(&rows).with_quality(&quality);
            let mut weights = vec![1.0; n];
            let report = ransac(&problem, &options, &mut weights, &mut RansacScratch::default());
            match n {
                0 | 1 => assert_eq!(report.stop, Stop::TooFew { have: n, need: 2 }, "{name}"),
                _ => assert!(matches!(report.stop, Stop::NoModel { .. }), "{name}: {}", report.stop),
            }
            rows.push(1.0, 0.0, 0.0);
        }
    }
}
