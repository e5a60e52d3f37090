//! The picture that the benches look at: a room through the fisheye of the evaluation.

use nalgebra::{Matrix3, Vector2};
use tiltvp_core::Result;
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::ImageView;
use tiltvp_core::tilt::{TiltEstimator, TiltOptions};
use tiltvp_synth::{RenderOptions, RoomKind, RoomOptions, View, World, render};

/// Columns and rows of the picture.
pub const SIZE: (usize, usize) = (640, 480);

/// A 185-degree equidistant fisheye of 139.7 px/rad.
///
/// # Errors
/// None, for these numbers.
pub fn fisheye() -> Result<Camera> {
    let lens = Equidistant::new(139.7, 319.5, 239.5)?;
    Camera::new(640, 480, Model::Equidistant(lens))?.with_max_theta_rad(92.5f64.to_radians())
}

/// Grey levels of a furnished office, leaning by 4.15 degrees, with noise of two grey levels.
///
/// # Errors
/// None, for these numbers.
pub fn picture() -> Result<Vec<u8>> {
    seen_by(&fisheye()?, Matrix3::identity())
}

/// The same office through any camera with any mounting.
///
/// # Errors
/// If the mounting is no rotation.
pub fn seen_by(camera: &Camera, robot_from_camera: Matrix3<f64>) -> Result<Vec<u8>> {
    let world = World::new(&RoomOptions { light_spacing_m: 0.6, ..RoomOptions::new(RoomKind::Office, 3) })?;
    let pose = world.free_poses(1, 3)?.first().copied().unwrap_or_default();
    let lens = |x: f64, y: f64| camera.unproject(&Vector2::new(x, y));
    let tilt = Tilt::from_alpha_beta(4.15f64.to_radians(), 0.5);
    let size = (camera.width() as usize, camera.height() as usize);
    let view = View { tilt, robot_from_camera, ..View::new(&lens, size.0, size.1, pose) };
    Ok(render(&world, &view, &RenderOptions { noise_sigma: 2.0, ..RenderOptions::default() })?.image.gray)
}

/// The picture as the core sees it.
///
/// # Errors
/// If it is not of [`SIZE`].
pub fn view(picture: &[u8]) -> Result<ImageView<'_>> {
    ImageView::new(picture, SIZE.0, SIZE.1, SIZE.0)
}

/// The estimator of a method with its defaults, looking up.
///
/// # Errors
/// If there is no method of that name.
pub fn estimator(method: &str) -> Result<TiltEstimator> {
    TiltEstimator::new(fisheye()?, Matrix3::identity(), TiltOptions::for_method(method)?)
}
