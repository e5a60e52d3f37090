//! Any bytes as the image of any lens, with any options of any method: a refusal, or an estimate that agrees with itself; and straight
//! edges that do.

#![no_main]

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use nalgebra::{Matrix3, Rotation3, Vector3};
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::image::ImageView;
use tiltvp_core::options::{Kind, Options, Value};
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions, Segments};
use tiltvp_core::tilt::{TiltEstimator, TiltOptions};

/// Columns and rows of the images: enough for edges, few enough for a thousand images a second.
const WIDTH: usize = 48;
const HEIGHT: usize = 36;

static CAMERAS: LazyLock<Vec<Camera>> = LazyLock::new(|| {
    let centre = [(WIDTH as f64 - 1.0) / 2.0, (HEIGHT as f64 - 1.0) / 2.0];
    let models = [8.0, 11.0, 40.0].map(|focal| Equidistant::new(focal, centre[0], centre[1]).map(Model::Equidistant));
    models.into_iter().filter_map(|model| Camera::new(WIDTH as u32, HEIGHT as u32, model.ok()?).ok()).collect()
});

#[derive(Debug, Arbitrary)]
struct Input {
    camera: u8,
    turn: [i8; 3],
    /// Of the estimator and of the detector: which option, and its value as a number.
    tilt: Vec<(u8, f64)>,
    segments: Vec<(u8, f64)>,
    /// Bars of a level from a column on, then what is left of the input as noise.
    bars: Vec<(u8, u8)>,
    stride: u8,
    noise: Vec<u8>,
}

/// Sets an option by its place, with a value of its kind.
fn set(options: &mut dyn Options, place: u8, number: f64) {
    let fields = options.fields();
    let field = &fields[usize::from(place) % fields.len()];
    let mut kind = field.kind;
    while let Kind::Maybe(inner) = kind {
        kind = *inner;
    }
    let value = match kind {
        Kind::Bool => Value::Bool(number > 0.0),
        // Draws without end are asked for by name, not by chance.
        Kind::Int(_) => Value::Int(i128::from((number.abs() % 300.0) as i64)),
        Kind::Word(words) => Value::Text(words[(number.abs() % words.len() as f64) as usize % words.len()].to_owned()),
        _ => Value::Float(number),
    };
    let _ = options.set(&field.name.clone(), &value);
}

fuzz_target!(|input: Input| {
    let camera = CAMERAS[usize::from(input.camera) % CAMERAS.len()].clone();
    let stride = WIDTH + usize::from(input.stride % 4);
    let mut data = vec![90u8; stride * HEIGHT];
    for (column, level) in &input.bars {
        for row in data.chunks_mut(stride) {
            row[usize::from(*column) % WIDTH..].fill(*level);
        }
    }
    for (pixel, byte) in data.iter_mut().rev().zip(&input.noise) {
        *pixel = *byte;
    }
    let Ok(image) = ImageView::new(&data, WIDTH, HEIGHT, stride) else { return };

    let mut options = SegmentDetectorOptions::default();
    for (place, number) in input.segments.iter().take(8) {
        set(&mut options, *place, *number);
    }
    if let Ok(detector) = SegmentDetector::new(camera.clone(), options) {
        let (mut scratch, mut found) = (detector.scratch(), Segments::default());
        assert!(detector.detect(&image, &mut scratch, &mut found).is_ok());
        for segment in &found.list {
            assert!((segment.normal.norm() - 1.0).abs() < 1e-9);
            assert!(segment.variances_rad2.iter().all(|variance| *variance >= 0.0 && variance.is_finite()));
            assert!(!found.points_of(segment).is_empty());
        }
    }

    let mut options = TiltOptions::default();
    for (place, number) in input.tilt.iter().take(8) {
        set(&mut options, *place, *number);
    }
    let turn = Vector3::from(input.turn.map(|x| f64::from(x) / 40.0));
    let mount: Matrix3<f64> = Rotation3::from_scaled_axis(turn).into_inner();
    let Ok(estimator) = TiltEstimator::new(camera, mount, options) else { return };
    let mut scratch = estimator.scratch();
    let Ok(estimate) = estimator.estimate(&image, &mut scratch) else { return };
    assert!((0.0..=1.0).contains(&estimate.confidence));
    if let Some(covariance) = estimate.covariance {
        assert!(covariance.iter().all(|x| x.is_finite()));
    }
    let again = estimator.estimate(&image, &mut scratch);
    assert!(format!("{estimate:?}") == format!("{:?}", again.ok().unwrap_or_else(|| estimate.clone())));
});
