//! `render_room`: seeded rooms with known tilt, for demos and tests.

use nalgebra::{Matrix3, Vector2};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{RenderOptions, RoomKind, RoomOptions, View, World, render};

use crate::call::{call, exception, invalid};
use crate::camera::Camera;
use crate::convert;

/// Colour image `(H, W, 3)` of uint8 in RGB order of a seeded room, seen by a leaning robot.
#[pyfunction]
#[pyo3(signature = (camera, *, kind, seed, alpha_rad, beta_rad, robot_from_camera=None, noise_sigma=2.0, samples=None))]
#[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
pub(crate) fn render_room<'py>(
    py: Python<'py>,
    camera: &Bound<'py, Camera>,
    kind: &str,
    seed: &Bound<'py, PyAny>,
    alpha_rad: f64,
    beta_rad: f64,
    robot_from_camera: Option<&Bound<'py, PyAny>>,
    noise_sigma: f64,
    samples: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let kind: RoomKind = kind.parse().map_err(|error| exception(&error))?;
    if !(alpha_rad.is_finite() && beta_rad.is_finite()) {
        return Err(invalid(format!("alpha_rad, beta_rad = {alpha_rad}, {beta_rad}, expected finite angles")));
    }
    let rotation = robot_from_camera.map_or(Ok(Matrix3::identity()), |r| convert::matrix3(r, "robot_from_camera"))?;
    let seed = convert::whole(seed, "seed", "a whole number from 0 to 2^64 - 1")?;
    let samples = samples.map_or(Ok(3), |samples| convert::whole(samples, "samples", "a whole number from 1"))?;
    let camera = &camera.get().inner;
    let (width, height) = (camera.width() as usize, camera.height() as usize);
    let image = call(py, || {
        let world = World::new(&RoomOptions::new(kind, seed))?;
        let pose = world.free_poses(1, seed)?.swap_remove(0);
        let lens = |x: f64, y: f64| camera.unproject(&Vector2::new(x, y));
        let mut view = View::new(&lens, width, height, pose);
        view.robot_from_camera = rotation;
        view.tilt = Tilt::from_alpha_beta(alpha_rad, beta_rad);
        Ok(render(&world, &view, &RenderOptions { noise_sigma, samples, seed, ..RenderOptions::default() })?.image)
    })?;
    let gray = PyArray1::from_vec(py, image.gray).reshape([height, width])?.into_any();
    let rgb = PyArray1::from_vec(py, image.rgb).reshape([height, width, 3])?.into_any();
    Ok((gray, rgb))
}
