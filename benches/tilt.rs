//! The tilt of one image: each method whole, and the stages that it is made of.

#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use divan::{Bencher, black_box, counter::ItemsCount};
use nalgebra::{Matrix3, Vector3};
use tiltvp_benches::{estimator, fisheye, picture, view};
use tiltvp_core::edges::{Detector, EdgeOptions, EdgePixels, LiftTable, NormalKind, Region};
use tiltvp_core::robust::{Gate, Rows};
use tiltvp_core::tilt::{CommonDirectionOptions, METHODS, TiltEstimator, TiltOptions, common_direction};

static PICTURE: LazyLock<Vec<u8>> = LazyLock::new(|| picture().unwrap());

fn main() {
    let picture = view(&PICTURE).unwrap();
    for method in METHODS {
        let estimator = estimator(method).unwrap();
        let found = estimator.estimate(&picture, &mut estimator.scratch()).unwrap();
        println!(
            "{method}: {} of {} pixels are edges, {} pass the prefilter, {} iterations",
            found.edge_pixels,
            estimator.region_pixels(),
            found.prefiltered_pixels,
            found.iterations
        );
    }
    divan::main();
}

/// From the image to the estimate.
#[divan::bench(args = METHODS)]
fn whole(bencher: Bencher, method: &str) {
    let estimator = estimator(method).unwrap();
    let (mut scratch, picture) = (estimator.scratch(), view(&PICTURE).unwrap());
    bencher.bench_local(|| estimator.estimate(black_box(&picture), &mut scratch));
}

/// Sixteen images, by threads.
#[divan::bench(args = [1, 2, 4])]
fn many(bencher: Bencher, threads: usize) {
    let estimator = estimator("refined").unwrap();
    let views = vec![view(&PICTURE).unwrap(); 16];
    bencher.counter(ItemsCount::new(views.len())).bench_local(|| estimator.estimate_many(black_box(&views), threads));
}

/// What is done once per camera.
#[divan::bench(args = METHODS)]
fn tables(bencher: Bencher, method: &str) {
    let options = TiltOptions::for_method(method).unwrap();
    bencher.bench_local(|| TiltEstimator::new(fisheye().unwrap(), Matrix3::identity(), black_box(options.clone())));
}

mod stages {
    use super::{
        Bencher, CommonDirectionOptions, Detector, EdgeOptions, EdgePixels, Gate, ItemsCount, LiftTable, Matrix3,
        NormalKind, PICTURE, Region, Rows, Vector3, black_box, common_direction, fisheye, view,
    };

    fn edges_of(smoothing_px: f64) -> (Region, Detector, EdgePixels) {
        let options = EdgeOptions { smoothing_px, ..EdgeOptions::default() };
        let region = Region::new(&fisheye().unwrap(), &Matrix3::identity(), &options, None).unwrap();
        let mut detector = Detector::new(&region, &options);
        let mut edges = EdgePixels::with_capacity(region.len());
        detector.detect(&view(&PICTURE).unwrap(), &region, options.gradient_min, None, &mut edges);
        (region, detector, edges)
    }

    fn lifted() -> (Rows<f32>, Vec<f32>) {
        let (region, _, edges) = edges_of(0.6);
        let table = LiftTable::new(&fisheye().unwrap(), &Matrix3::identity(), &region, NormalKind::Tangent);
        let (mut rows, mut weights, mut places) = (Rows::default(), Vec::new(), Vec::new());
        table.lift(&edges, 12f64.to_radians().sin(), &mut rows, &mut weights, &mut Vec::new(), &mut places);
        (rows, weights)
    }

    /// Rows of gradients and the strong pixels among them, by the smoothing before.
    #[divan::bench(args = [0.0, 0.6, 1.5])]
    fn detect(bencher: Bencher, smoothing_px: f64) {
        let (region, mut detector, mut edges) = edges_of(smoothing_px);
        let picture = view(&PICTURE).unwrap();
        bencher.counter(ItemsCount::new(region.len())).bench_local(|| {
            detector.detect(black_box(&picture), &region, EdgeOptions::default().gradient_min, None, &mut edges);
        });
    }

    /// From gradients to unit normals that pass the prefilter.
    #[divan::bench]
    fn lift(bencher: Bencher) {
        let (region, _, edges) = edges_of(0.6);
        let table = LiftTable::new(&fisheye().unwrap(), &Matrix3::identity(), &region, NormalKind::Tangent);
        let (mut rows, mut weights) = (Rows::default(), Vec::new());
        let (mut slots, mut places) = (Vec::new(), Vec::new());
        let sin_max = 12f64.to_radians().sin();
        bencher
            .counter(ItemsCount::new(edges.len()))
            .bench_local(|| table.lift(black_box(&edges), sin_max, &mut rows, &mut weights, &mut slots, &mut places));
    }

    /// One pass of a refit, by its gate.
    #[divan::bench(args = [Gate::Open, Gate::Hard { threshold: 0.1 }, Gate::Soft { scale: 0.035 }])]
    fn moments(bencher: Bencher, gate: Gate) {
        let (rows, mut weights) = lifted();
        bencher
            .counter(ItemsCount::new(rows.len()))
            .bench_local(|| rows.moments(black_box([0.01, 0.02, 1.0]), gate, &mut weights));
    }

    /// One trial of random sampling.
    #[divan::bench]
    fn count_within(bencher: Bencher) {
        let (rows, _) = lifted();
        bencher
            .counter(ItemsCount::new(rows.len()))
            .bench_local(|| rows.count_within(black_box([0.01, 0.02, 1.0]), 0.05));
    }

    /// A user's normals, by their number.
    #[divan::bench(args = [100, 1000, 10_000])]
    fn common(bencher: Bencher, count: usize) {
        let (rows, _) = lifted();
        let normals: Vec<Vector3<f64>> = {
            let all: Vec<_> = rows.iter().collect();
            all.iter().copied().cycle().take(count).collect()
        };
        bencher
            .counter(ItemsCount::new(count))
            .bench_local(|| common_direction(black_box(&normals), None, &CommonDirectionOptions::default()));
    }
}
