//! Views of any bytes, and their tilt and lines with any options of any method: a refusal, or an answer that agrees with itself.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use nalgebra::{Matrix3, Rotation3, Vector3};
use tiltvp_core::camera::Camera;
use tiltvp_core::image::ImageView;
use tiltvp_core::lines::{LineExtractor, LineMethod, LineOptions, Lines};
use tiltvp_core::tilt::{METHODS, TiltEstimator, TiltOptions};
use tiltvp_fuzz::{Choice, Picture, set_cheap};

#[derive(Debug, Arbitrary)]
struct Input {
    /// Sizes that the bytes may not have.
    view: [usize; 3],
    method: u8,
    lines: bool,
    turn: [i8; 3],
    choices: Vec<Choice>,
    picture: Picture,
}

fuzz_target!(|input: Input| {
    let ([width, height], levels) = (input.picture.size(), input.picture.levels());
    let [columns, rows, stride] = input.view;
    if let Ok(view) = ImageView::new(&levels, columns, rows, stride) {
        assert!((0..rows).all(|v| view.row(v).len() == columns) && view.row(rows).is_empty());
    }
    let Ok(image) = ImageView::new(&levels, width, height, input.picture.stride()) else { return };
    let Some(camera) = input.picture.camera() else { return };
    let turn = Vector3::from(input.turn.map(|x| f64::from(x) / 40.0));
    let mount: Matrix3<f64> = Rotation3::from_scaled_axis(turn).into_inner();
    if input.lines {
        lines(&input, camera, mount, &image);
    } else {
        tilt(&input, camera, mount, &image);
    }
});

fn tilt(input: &Input, camera: Camera, mount: Matrix3<f64>, image: &ImageView<'_>) {
    let mut options = TiltOptions::for_method(METHODS[usize::from(input.method) % METHODS.len()]).unwrap_or_default();
    set_cheap(&mut options, &input.choices);
    let Ok(estimator) = TiltEstimator::new(camera, mount, options) else { return };
    let mut scratch = estimator.scratch();
    let estimate = estimator.estimate(image, &mut scratch);
    let Ok(estimate) = estimate else { panic!("an image of the camera's size is refused: {estimate:?}") };
    assert!((0.0..=1.0).contains(&estimate.confidence), "confidence {}", estimate.confidence);
    if let Some(tilt) = estimate.tilt {
        assert!((tilt.normal().norm() - 1.0).abs() < 1e-9, "a normal {:?}", tilt.normal());
        assert!(estimate.covariance_rad2.iter().all(|x| x.is_finite()), "covariance {}", estimate.covariance_rad2);
    } else {
        assert_eq!(estimate.confidence, 0.0);
    }
    let again = estimator.estimate(image, &mut scratch);
    assert_eq!(format!("{:?}", Ok::<_, tiltvp_core::Error>(estimate)), format!("{again:?}"));
}

fn lines(input: &Input, camera: Camera, mount: Matrix3<f64>, image: &ImageView<'_>) {
    let name = LineMethod::NAMES[usize::from(input.method) % LineMethod::NAMES.len()];
    let mut options = LineOptions::for_method(name).unwrap_or_default();
    set_cheap(&mut options, &input.choices);
    let Ok(extractor) = LineExtractor::new(camera, mount, options) else { return };
    let (mut scratch, mut found, mut described) = (extractor.scratch(), Lines::default(), Vec::new());
    assert!(extractor.extract(image, None, &mut scratch, &mut found).is_ok());
    for line in &found.lines {
        assert!(line.bearing_rad.is_finite() && line.sigma_rad >= 0.0, "{line:?}");
        assert!(line.elevation_min_rad <= line.elevation_max_rad && line.polarity.abs() <= 1.0, "{line:?}");
    }
    assert!(extractor.describe(image, &found, &mut scratch, &mut described).is_ok());
    assert_eq!(described.len(), found.lines.len() * extractor.options().descriptor.values());
}
