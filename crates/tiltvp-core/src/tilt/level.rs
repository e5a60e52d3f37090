//! The image as the upright robot's camera would have seen it: where each of its pixels is found in the leaning one.

use nalgebra::{Matrix3, Vector2};

use crate::camera::Camera;
use crate::error::Result;
use crate::geometry::Tilt;
use crate::interrupt::check;

/// For each pixel of the upright image, in row order, the pixel `(u, v)` of the leaning image that shows the same direction.
///
/// `v_leaning = R^T R_ab R v_upright` with `R = robot_from_camera` and `R_ab` of [`Tilt::leaning_from_upright`]; NaN where the
/// lens has no answer.
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) if `robot_from_camera` is no rotation.
pub fn level_map(camera: &Camera, robot_from_camera: &Matrix3<f64>, tilt: &Tilt) -> Result<Vec<[f32; 2]>> {
    crate::geometry::validate_rotation(robot_from_camera)?;
    let rotation = robot_from_camera.transpose() * tilt.leaning_from_upright() * robot_from_camera;
    camera.check_memory(size_of::<[f32; 2]>())?;
    let place = |u: u32, v: u32| -> Option<[f32; 2]> {
        if u == 0 {
            check();
        }
        let bearing = camera.unproject(&Vector2::new(f64::from(u), f64::from(v)))?;
        let pixel = camera.project(&(rotation * bearing))?;
        Some([pixel.x as f32, pixel.y as f32])
    };
    Ok((0..camera.height())
        .flat_map(|v| (0..camera.width()).map(move |u| (u, v)))
        .map(|(u, v)| place(u, v).unwrap_or([f32::NAN; 2]))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Equidistant;

    #[test]
    fn the_zenith_of_the_leaning_image_comes_to_the_centre() {
        let lens = Equidistant::new(40.0, 60.0, 50.0).expect("a lens");
        let camera = Camera::new(121, 101, lens.into()).expect("a camera");
        let tilt = Tilt::from_alpha_beta(0.1, 0.7);
        let map = level_map(&camera, &Matrix3::identity(), &tilt).expect("a rotation");
        let zenith = camera.project(&tilt.normal()).expect("in view");
        let found = map[50 * 121 + 60];
        assert!((f64::from(found[0]) - zenith.x).abs() < 1e-4 && (f64::from(found[1]) - zenith.y).abs() < 1e-4);
    }
}
