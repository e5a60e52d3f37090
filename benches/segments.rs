//! The straight edges of one image: of a fisheye of 640 x 480 that looks up, and of a pinhole of 1280 x 720 that looks ahead.

#![allow(clippy::unwrap_used)]

use divan::{Bencher, black_box};
use nalgebra::Matrix3;
use tiltvp_benches::{fisheye, picture, seen_by};
use tiltvp_core::camera::{Camera, Model, Pinhole};
use tiltvp_core::image::ImageView;
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions, Segments};

fn main() {
    for (width, height) in SIZES {
        let (camera, grey) = view(width);
        let detector = SegmentDetector::new(camera, SegmentDetectorOptions::default()).unwrap();
        let mut found = Segments::default();
        let image = ImageView::new(&grey, width, height, width).unwrap();
        detector.detect(&image, &mut detector.scratch(), &mut found).unwrap();
        println!("{width} x {height}: {} edges of {} pixels", found.list.len(), found.points.len());
    }
    divan::main();
}

const SIZES: [(usize, usize); 2] = [(640, 480), (1280, 720)];

/// The camera of images of so many columns, and what it sees.
fn view(width: usize) -> (Camera, Vec<u8>) {
    if width == 640 {
        return (fisheye().unwrap(), picture().unwrap());
    }
    let lens = Pinhole::new([700.0, 700.0], [639.5, 359.5], &[]).unwrap();
    let camera = Camera::new(1280, 720, Model::Pinhole(lens)).unwrap();
    // Forwards: the camera's axis is the robot's x, its columns grow to the right and its rows downwards.
    let ahead = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let grey = seen_by(&camera, ahead).unwrap();
    (camera, grey)
}

/// From the image to its straight edges.
#[divan::bench(args = SIZES)]
fn whole(bencher: Bencher, (width, height): (usize, usize)) {
    let (camera, grey) = view(width);
    let detector = SegmentDetector::new(camera, SegmentDetectorOptions::default()).unwrap();
    let (mut scratch, mut found) = (detector.scratch(), Segments::default());
    let image = ImageView::new(&grey, width, height, width).unwrap();
    bencher.bench_local(|| detector.detect(black_box(&image), &mut scratch, &mut found));
}

/// What is done once per camera.
#[divan::bench]
fn tables(bencher: Bencher) {
    bencher.bench_local(|| SegmentDetector::new(fisheye().unwrap(), SegmentDetectorOptions::default()));
}
