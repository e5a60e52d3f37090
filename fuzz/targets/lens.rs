//! Any numbers for any lens: a refusal, or a camera whose bearings are unit vectors and whose pixels come back.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use nalgebra::{Vector2, Vector3};
use tiltvp_core::camera::{Camera, Model, Parameter};

#[derive(Debug, Arbitrary)]
struct Input {
    lens: u8,
    width: u16,
    height: u16,
    max_theta_rad: Option<f64>,
    mirrored: bool,
    /// By which factors the numbers of a real lens are changed, and what stands in their place.
    factors: Vec<f32>,
    numbers: Vec<(u8, f64)>,
    list: Option<Vec<f64>>,
    at: [f64; 3],
}

fuzz_target!(|input: Input| {
    let zoo = tiltvp_core::testing::zoo();
    let (_, real) = &zoo[usize::from(input.lens) % zoo.len()];
    let mut parameters: Vec<_> =
        real.model().parameters().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    for ((_, value), factor) in parameters.iter_mut().zip(&input.factors) {
        match value {
            Parameter::Scalar(number) => *number *= f64::from(*factor),
            Parameter::List(numbers) => numbers.iter_mut().for_each(|number| *number *= f64::from(*factor)),
        }
    }
    for (place, number) in &input.numbers {
        let count = parameters.len().max(1);
        match parameters.get_mut(usize::from(*place) % count) {
            Some((_, Parameter::Scalar(own))) => *own = *number,
            Some((_, Parameter::List(own))) => own.push(*number),
            None => {}
        }
    }
    if let (Some(list), Some((_, Parameter::List(own)))) =
        (input.list, parameters.iter_mut().find(|(_, value)| matches!(value, Parameter::List(_))))
    {
        *own = list;
    }
    let (width, height) = (u32::from(input.width), u32::from(input.height));
    let made = Model::from_parameters(real.model().name(), width, height, &parameters)
        .and_then(|model| Camera::new(width, height, model));
    let Ok(mut camera) = made else { return };
    if let Some(limit) = input.max_theta_rad {
        let Ok(limited) = camera.clone().with_max_theta_rad(limit) else { return };
        camera = limited;
    }
    if input.mirrored {
        camera = camera.mirrored();
    }
    let theta = camera.max_theta_rad();
    assert!(theta.is_finite() && theta > 0.0, "a largest angle of {theta}");
    let [u, v, w] = input.at;
    for pixel in [Vector2::new(u, v), Vector2::new(f64::from(width) * 0.3, f64::from(height) * 0.6)] {
        if let Some(bearing) = camera.unproject(&pixel) {
            assert!((bearing.norm() - 1.0).abs() < 1e-9, "a bearing {bearing:?} of {pixel:?}");
        }
        let _ = camera.unproject_jacobian(&pixel);
    }
    for bearing in [Vector3::new(u, v, w), Vector3::new(0.1, -0.2, 0.8).normalize()] {
        if let Some(pixel) = camera.project(&bearing) {
            assert!(pixel.iter().all(|x| x.is_finite()), "a pixel {pixel:?} of {bearing:?}");
        }
        let _ = camera.project_jacobian(&bearing);
    }
});
