//! `Room`: a seeded room, built once, looked at as often as wished.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector2};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{Image, RenderOptions, RobotPose, RoomKind, RoomOptions, View, World, on_threads};

use crate::call::{call, exception, invalid};
use crate::camera::Camera;
use crate::convert;

pub(crate) type Pictures<'py> = (Bound<'py, PyArray2<u8>>, Bound<'py, PyArray3<u8>>);

/// A furnished, lit room. The face class in `tiltvp.synth` says what its images are.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Room {
    options: RoomOptions,
    pub(crate) world: Arc<World>,
}

#[pymethods]
impl Room {
    #[new]
    #[pyo3(signature = (
        kind, seed, *, clutter=None, daylight=None, light_spacing_m=None, extent=None, floor_gloss=None,
        wall_pattern=None, threads=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn new(
        py: Python<'_>,
        kind: &str,
        seed: &Bound<'_, PyAny>,
        clutter: Option<f64>,
        daylight: Option<f64>,
        light_spacing_m: Option<f64>,
        extent: Option<f64>,
        floor_gloss: Option<f64>,
        wall_pattern: Option<&str>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let kind: RoomKind = kind.parse().map_err(|error| exception(&error))?;
        let (seed, threads) = (seed_from(seed)?, threads_from(threads)?);
        let own = RoomOptions::new(kind, seed);
        let options = RoomOptions {
            clutter: clutter.unwrap_or(own.clutter),
            daylight: daylight.unwrap_or(own.daylight),
            light_spacing_m: light_spacing_m.unwrap_or(own.light_spacing_m),
            extent: extent.unwrap_or(own.extent),
            floor_gloss: floor_gloss.unwrap_or(own.floor_gloss),
            wall_pattern: match wall_pattern {
                Some(name) => name.parse().map_err(|error| exception(&error))?,
                None => own.wall_pattern,
            },
            ..own
        };
        let world = call(py, || on_threads(threads, || World::new(&options))?)?;
        Ok(Self { options, world: Arc::new(world) })
    }

    /// Which of `ROOM_KINDS` it is.
    #[getter]
    fn kind(&self) -> &'static str {
        self.options.kind.name()
    }

    /// The seed of everything in it.
    #[getter]
    fn seed(&self) -> u64 {
        self.options.seed
    }

    /// How full it is, from 0 to 1.
    #[getter]
    fn clutter(&self) -> f64 {
        self.options.clutter
    }

    /// Brightness of the day outside, from 0 to 1.
    #[getter]
    fn daylight(&self) -> f64 {
        self.options.daylight
    }

    /// Spacing of the points where light was gathered, metres.
    #[getter]
    fn light_spacing_m(&self) -> f64 {
        self.options.light_spacing_m
    }

    /// How many times larger the floor is than the kind's own.
    #[getter]
    fn extent(&self) -> f64 {
        self.options.extent
    }

    /// How much the floor shines, from 0 to 1.
    #[getter]
    fn floor_gloss(&self) -> f64 {
        self.options.floor_gloss
    }

    /// Which of `WALL_PATTERNS` its walls have in common.
    #[getter]
    fn wall_pattern(&self) -> &'static str {
        self.options.wall_pattern.name()
    }

    /// Height of the ceiling, metres.
    #[getter]
    fn height_m(&self) -> f64 {
        self.world.height_m()
    }

    /// (N, 2): the corners of the floor, counter-clockwise, metres.
    #[getter]
    fn floor_outline_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let corners: Vec<[f64; 2]> = self.world.floor_outline().iter().map(|corner| (*corner).into()).collect();
        convert::to_rows(py, &corners, false)
    }

    /// (N, 2, 3): lower and upper ends of the vertical edges, visible or not, metres.
    #[getter]
    fn vertical_edges_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let ends = self.world.vertical_edges().iter().flat_map(|edge| [edge.bottom, edge.top]);
        let flat: Vec<f64> = ends.flat_map(<[f64; 3]>::from).collect();
        convert::to_matrices(py, &flat, [2, 3], false)
    }

    /// Whether a robot can stand there, metres.
    fn is_free(&self, x_m: f64, y_m: f64) -> bool {
        self.world.is_free(x_m, y_m)
    }

    /// (N, 3): x_m, y_m, yaw_rad of poses at which the robot stands free.
    fn free_poses<'py>(
        &self,
        py: Python<'py>,
        count: &Bound<'py, PyAny>,
        seed: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let count = convert::whole(count, "count", "a whole number")?;
        let seed = seed_from(seed)?;
        let poses = call(py, || self.world.free_poses(count, seed))?;
        let rows: Vec<[f64; 3]> = poses.iter().map(|pose| [pose.x_m, pose.y_m, pose.yaw_rad]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Grey (H, W) and RGB (H, W, 3) images of the room.
    #[pyo3(signature = (
        camera, *, pose, alpha_rad, beta_rad, robot_from_camera, camera_height_m, noise_sigma, samples, seed, threads
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        camera: &Bound<'py, Camera>,
        pose: &Bound<'py, PyAny>,
        alpha_rad: f64,
        beta_rad: f64,
        robot_from_camera: Option<&Bound<'py, PyAny>>,
        camera_height_m: Option<f64>,
        noise_sigma: f64,
        samples: Option<&Bound<'py, PyAny>>,
        seed: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pictures<'py>> {
        if !(alpha_rad.is_finite() && beta_rad.is_finite()) {
            return Err(invalid(format!("alpha_rad, beta_rad = {alpha_rad}, {beta_rad}, expected finite angles")));
        }
        let pose = pose_from(pose)?;
        let rotation =
            robot_from_camera.map_or(Ok(Matrix3::identity()), |r| convert::matrix3(r, "robot_from_camera"))?;
        let options = options_from(noise_sigma, samples, seed)?;
        let threads = threads_from(threads)?;
        let camera = &camera.get().inner;
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let image = call(py, || {
            let lens = |x: f64, y: f64| camera.unproject(&Vector2::new(x, y));
            let mut view = View::new(&lens, width, height, pose);
            view.robot_from_camera = rotation;
            view.tilt = Tilt::from_alpha_beta(alpha_rad, beta_rad);
            view.camera_height_m = camera_height_m.unwrap_or(view.camera_height_m);
            Ok(on_threads(threads, || tiltvp_synth::render(&self.world, &view, &options))??.image)
        })?;
        pictures(py, image)
    }

    /// Grey (height, 2 height) and RGB images of everything around a place.
    #[pyo3(signature = (*, pose, camera_height_m, height, noise_sigma, samples, seed, threads))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn _render_panorama<'py>(
        &self,
        py: Python<'py>,
        pose: &Bound<'py, PyAny>,
        camera_height_m: Option<f64>,
        height: &Bound<'py, PyAny>,
        noise_sigma: f64,
        samples: Option<&Bound<'py, PyAny>>,
        seed: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pictures<'py>> {
        let pose = pose_from(pose)?;
        let height: u16 = convert::whole(height, "height", "a whole number of pixels")?;
        let options = options_from(noise_sigma, samples, seed)?;
        let threads = threads_from(threads)?;
        let image = call(py, || {
            let up = camera_height_m.unwrap_or_else(|| View::new(&|_, _| None, 1, 1, pose).camera_height_m);
            let work = || tiltvp_synth::render_panorama(&self.world, pose, up, usize::from(height), &options);
            Ok(on_threads(threads, work)??.image)
        })?;
        pictures(py, image)
    }

    fn __repr__(&self) -> String {
        let (own, mut text) = (&self.options, format!("Room(\"{}\", {}", self.options.kind, self.options.seed));
        let plain = RoomOptions::new(own.kind, own.seed);
        let numbers = [
            ("clutter", own.clutter, plain.clutter),
            ("daylight", own.daylight, plain.daylight),
            ("light_spacing_m", own.light_spacing_m, plain.light_spacing_m),
            ("extent", own.extent, plain.extent),
            ("floor_gloss", own.floor_gloss, plain.floor_gloss),
        ];
        for (name, value, _) in numbers.into_iter().filter(|(_, value, usual)| value != usual) {
            text = format!("{text}, {name}={value:?}");
        }
        if own.wall_pattern != plain.wall_pattern {
            text = format!("{text}, wall_pattern=\"{}\"", own.wall_pattern.name());
        }
        text + ")"
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.options == other.get().options)
    }

    fn __hash__(&self) -> u64 {
        self.options.seed.wrapping_mul(31).wrapping_add(self.options.kind as u64)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((&'static str, u64), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("clutter", self.options.clutter)?;
        keywords.set_item("daylight", self.options.daylight)?;
        keywords.set_item("light_spacing_m", self.options.light_spacing_m)?;
        keywords.set_item("extent", self.options.extent)?;
        keywords.set_item("floor_gloss", self.options.floor_gloss)?;
        keywords.set_item("wall_pattern", self.options.wall_pattern.name())?;
        Ok(((self.options.kind.name(), self.options.seed), keywords))
    }
}

pub(crate) fn seed_from(seed: &Bound<'_, PyAny>) -> PyResult<u64> {
    convert::whole(seed, "seed", "a whole number from 0 to 2^64 - 1")
}

/// How many threads; 0 for one per core.
pub(crate) fn threads_from(threads: Option<&Bound<'_, PyAny>>) -> PyResult<usize> {
    let Some(threads) = threads else { return Ok(0) };
    match convert::whole(threads, "threads", "a whole number from 1")? {
        0 => Err(invalid("threads = 0, expected a whole number from 1".to_owned())),
        threads => Ok(threads),
    }
}

fn pose_from(pose: &Bound<'_, PyAny>) -> PyResult<RobotPose> {
    let [x_m, y_m, yaw_rad] = convert::vector3(pose, "pose")?.into();
    Ok(RobotPose { x_m, y_m, yaw_rad })
}

fn options_from(
    noise_sigma: f64,
    samples: Option<&Bound<'_, PyAny>>,
    seed: &Bound<'_, PyAny>,
) -> PyResult<RenderOptions> {
    let mut options = RenderOptions { noise_sigma, seed: seed_from(seed)?, ..RenderOptions::default() };
    if let Some(samples) = samples {
        options.samples = convert::whole(samples, "samples", "a whole number from 1")?;
    }
    Ok(options)
}

pub(crate) fn pictures(py: Python<'_>, image: Image) -> PyResult<Pictures<'_>> {
    let (width, height) = (image.width_px, image.height_px);
    let gray = PyArray1::from_vec(py, image.gray).reshape([height, width])?;
    Ok((gray, PyArray1::from_vec(py, image.rgb).reshape([height, width, 3])?))
}
