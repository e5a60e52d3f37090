//! The vertical lines of one image: found, described, matched.

#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use divan::{Bencher, black_box};
use nalgebra::Matrix3;
use tiltvp_benches::{fisheye, picture, view};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{
    GreatCircleOptions, LineExtractor, LineMethod, LineOptions, Lines, MatchOptions, MatchScratch, match_descriptors,
};

static PICTURE: LazyLock<Vec<u8>> = LazyLock::new(|| picture().unwrap());

fn main() {
    let (extractor, lines, _) = found("great-circle", Some(10));
    println!("{} lines of {} x {} pixels", lines.lines.len(), extractor.camera().width(), extractor.camera().height());
    divan::main();
}

fn tilt() -> Tilt {
    Tilt::from_alpha_beta(4.15f64.to_radians(), 0.5)
}

fn extractor(method: &str, lines_max: Option<usize>) -> LineExtractor {
    let mut options = LineOptions::for_method(method).unwrap();
    if let LineMethod::GreatCircle(GreatCircleOptions { lines_max: most, .. }) = &mut options.method {
        *most = lines_max;
    }
    LineExtractor::new(fisheye().unwrap(), Matrix3::identity(), options).unwrap()
}

fn found(method: &str, lines_max: Option<usize>) -> (LineExtractor, Lines, Vec<f32>) {
    let extractor = extractor(method, lines_max);
    let (mut scratch, mut lines, mut values) = (extractor.scratch(), Lines::default(), Vec::new());
    let picture = view(&PICTURE).unwrap();
    extractor.extract(&picture, Some(&tilt()), None, &mut scratch, &mut lines).unwrap();
    extractor.describe(&picture, &lines, &mut scratch, &mut values).unwrap();
    (extractor, lines, values)
}

/// From the image to the matches with ten lines of the frame before.
#[divan::bench]
fn whole(bencher: Bencher) {
    let (extractor, mut lines, before) = found("great-circle", Some(10));
    let (mut scratch, mut matching) = (extractor.scratch(), MatchScratch::default());
    let (mut values, mut matches, picture, tilt) = (Vec::new(), Vec::new(), view(&PICTURE).unwrap(), tilt());
    bencher.bench_local(|| {
        extractor.extract(black_box(&picture), Some(&tilt), None, &mut scratch, &mut lines).unwrap();
        extractor.describe(&picture, &lines, &mut scratch, &mut values).unwrap();
        match_descriptors(&before, &values, 192, &MatchOptions::default(), None, &mut matching, &mut matches).unwrap();
    });
}

/// From the image to its lines.
#[divan::bench(args = LineMethod::NAMES)]
fn extract(bencher: Bencher, method: &str) {
    let (extractor, mut lines, _) = found(method, Some(10));
    let (mut scratch, picture, tilt) = (extractor.scratch(), view(&PICTURE).unwrap(), tilt());
    bencher.bench_local(|| extractor.extract(black_box(&picture), Some(&tilt), None, &mut scratch, &mut lines));
}

/// The descriptors of ten lines.
#[divan::bench]
fn describe(bencher: Bencher) {
    let (extractor, lines, mut values) = found("great-circle", Some(10));
    let (mut scratch, picture) = (extractor.scratch(), view(&PICTURE).unwrap());
    bencher.bench_local(|| extractor.describe(black_box(&picture), &lines, &mut scratch, &mut values));
}

/// The matches of ten lines with ten.
#[divan::bench]
fn matching(bencher: Bencher) {
    let (_, _, values) = found("great-circle", Some(10));
    let (mut scratch, mut matches, options) = (MatchScratch::default(), Vec::new(), MatchOptions::default());
    bencher.bench_local(|| {
        match_descriptors(black_box(&values), &values, 192, &options, None, &mut scratch, &mut matches)
    });
}
