//! Lenses of any parameters, asked anything: refused, or rays of unit length that come back to where they were.

use std::sync::LazyLock;

use nalgebra::{Vector2, Vector3};
use tiltvp_core::Error;
use tiltvp_core::camera::{Camera, Model, Parameter};
use tiltvp_core::testing::zoo;

use crate::bytes::Bytes;

/// A calibration of every lens of the core; a lens that is not there fails a test of the core.
pub(crate) static ZOO: LazyLock<Vec<Camera>> = LazyLock::new(|| zoo().into_iter().map(|(_, camera)| camera).collect());

/// A lens of the zoo of which some parameters are changed, and questions.
pub fn lens(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let camera = match camera(&mut bytes) {
        Ok(camera) => camera,
        Err(error) => {
            assert!(matches!(error, Error::InvalidCamera { .. }) && error.to_string().len() < 10_000, "{error}");
            return;
        }
    };
    assert!(camera.max_theta_rad() > 0.0 && camera.max_theta_rad() <= std::f64::consts::PI, "{camera:?}");
    // As long again as the lens took to be made.
    if bytes.byte().is_multiple_of(8) {
        let parameters = camera.model().parameters().into_iter();
        let named: Vec<_> = parameters.map(|(name, value)| (name.to_owned(), value)).collect();
        let again = Model::from_parameters(camera.model().name(), camera.width(), camera.height(), &named);
        assert_eq!(again.as_ref(), Ok(camera.model()));
    }
    for _ in 0..8 {
        let pixel = Vector2::new(
            bytes.mostly(-0.5, f64::from(camera.width()) - 0.5),
            bytes.mostly(-0.5, f64::from(camera.height()) - 0.5),
        );
        of_pixel(&camera, &pixel);
        of_bearing(&camera, &Vector3::new(bytes.mostly(-1.0, 1.0), bytes.mostly(-1.0, 1.0), bytes.mostly(-1.0, 1.0)));
        if bytes.is_empty() {
            break;
        }
    }
}

/// A camera of the zoo with parameters, size, limit and mirror that may be others.
pub(crate) fn camera(bytes: &mut Bytes<'_>) -> Result<Camera, Error> {
    let known = &ZOO[bytes.below(ZOO.len())];
    let mut parameters: Vec<_> =
        known.model().parameters().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    let (mut width, mut height) = (known.width(), known.height());
    for (name, value) in &mut parameters {
        match (bytes.byte(), &mut *value) {
            (0..=159, _) => {}
            (160..=199, Parameter::Scalar(x)) => *x *= bytes.within(0.5, 1.5),
            (200..=251, Parameter::Scalar(x)) => *x = bytes.number(),
            (160..=199, Parameter::List(list)) => {
                let place = bytes.below(list.len().max(1));
                if let Some(x) = list.get_mut(place) {
                    *x *= bytes.within(-0.5, 2.0);
                }
            }
            (200..=251, Parameter::List(list)) => *list = (0..bytes.byte() % 24).map(|_| bytes.number()).collect(),
            (252, _) => *value = Parameter::List(vec![bytes.number(); bytes.byte().into()]),
            (253, _) => *value = Parameter::Scalar(bytes.number()),
            _ => *name = String::from_utf8_lossy(&bytes.long().to_le_bytes()).into_owned(),
        }
    }
    let how = bytes.byte();
    if how & 7 == 7 {
        (width, height) = (bytes.word().into(), bytes.word().into());
    }
    let model = Model::from_parameters(known.model().name(), width, height, &parameters)?;
    let mut camera = Camera::new(width, height, model)?;
    if how & 8 != 0 {
        camera = camera.with_max_theta_rad(bytes.mostly(0.0, 3.2))?;
    }
    Ok(if how & 16 != 0 { camera.mirrored() } else { camera })
}

/// Rounding in the two ways to an answer, with and without Jacobian: of what the calibration makes of single bits.
const ALIKE: f64 = 1e-9;

/// Pixels from the centre that no image has.
const FAR_PX: f64 = 1e5;

/// How far from a pixel the pixel of its bearing may be: a millionth of its distance from the image's corner or from the lens' centre,
/// and what rounding of bearings makes of steep lenses. Of more than [`FAR_PX`] from the centre a ten-thousandth: unified lenses tell
/// bearings next to their rim by the difference of nearly equal numbers.
fn round_trip(camera: &Camera, pixel: &Vector2<f64>, bearing: &Vector3<f64>) {
    let Some((back, jacobian)) = camera.project_jacobian(bearing) else { return };
    let centres = [1.0, -1.0].map(|z| camera.project(&Vector3::new(0.0, 0.0, z)));
    let away = centres.iter().flatten().map(|centre| (pixel - centre).amax()).fold(pixel.amax(), f64::max);
    let allowed = if away > FAR_PX { 1e-4 } else { 1e-6 } * (1.0 + away) + 1e-12 * jacobian.norm();
    assert!((back - pixel).amax() <= allowed, "{camera:?} {pixel:?} {bearing:?} {back:?} {allowed:e}");
}

fn of_pixel(camera: &Camera, pixel: &Vector2<f64>) {
    let seen = camera.unproject(pixel);
    if let Some((bearing, jacobian)) = camera.unproject_jacobian(pixel) {
        assert!(seen.is_some_and(|seen| (seen - bearing).amax() < ALIKE), "{camera:?} {pixel:?} {seen:?} {bearing:?}");
        assert!(jacobian.iter().all(|x| x.is_finite()), "{camera:?} {pixel:?} {jacobian:?}");
    }
    let Some(bearing) = seen else { return };
    assert!((bearing.norm() - 1.0).abs() < 1e-12, "{camera:?} {pixel:?} {bearing:?}");
    let _ = camera.contains(pixel);
    round_trip(camera, pixel, &bearing);
}

fn of_bearing(camera: &Camera, bearing: &Vector3<f64>) {
    let seen = camera.project(bearing);
    if let Some((pixel, jacobian)) = camera.project_jacobian(bearing) {
        let alike = |seen: Vector2<f64>| (seen - pixel).amax() <= ALIKE * (1.0 + seen.amax());
        assert!(seen.is_some_and(alike), "{camera:?} {bearing:?} {seen:?} {pixel:?}");
        assert!(jacobian.iter().all(|x| x.is_finite()), "{camera:?} {bearing:?} {jacobian:?}");
    }
    let Some(pixel) = seen else { return };
    assert!(pixel.iter().all(|x| x.is_finite()), "{camera:?} {bearing:?} {pixel:?}");
    if let Some(back) = camera.unproject(&pixel) {
        round_trip(camera, &pixel, &back);
    }
}
