//! `Drive`: a robot's way through a room, any frame of which can be rendered.

use nalgebra::Matrix3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{DriveOptions, Mount, Way, Wheels, on_threads};

use crate::call::{call, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::synth::{Pictures, Room, pictures, seed_from, threads_from};

type Rows<'py> = Bound<'py, PyAny>;
type Sightings<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>, Rows<'py>, Rows<'py>, Rows<'py>);

/// A drive. The face class in `tiltvp.synth` says what its images and truth are.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Drive {
    room: Py<Room>,
    camera: Py<Camera>,
    inner: tiltvp_synth::Drive,
}

#[pymethods]
impl Drive {
    #[new]
    #[pyo3(signature = (
        room, *, camera, robot_from_camera=None, mount=None, blind_rad=None, frames=None, legs=None, seed=None, step_m=None, turn_max_rad=None,
        wheel_base_m=None, encoder_k_m=None, wheel_radius_errors=None, bumps_max_rad=None, lighting=None, samples=None,
        noise_sigma=None, blur_sigma_px=None, threads=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn new(
        room: &Bound<'_, Room>,
        camera: &Bound<'_, Camera>,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        mount: Option<&Bound<'_, PyAny>>,
        blind_rad: Option<f64>,
        frames: Option<&Bound<'_, PyAny>>,
        legs: Option<&Bound<'_, PyAny>>,
        seed: Option<&Bound<'_, PyAny>>,
        step_m: Option<f64>,
        turn_max_rad: Option<f64>,
        wheel_base_m: Option<f64>,
        encoder_k_m: Option<f64>,
        wheel_radius_errors: Option<&Bound<'_, PyAny>>,
        bumps_max_rad: Option<f64>,
        lighting: Option<f64>,
        samples: Option<&Bound<'_, PyAny>>,
        noise_sigma: Option<f64>,
        blur_sigma_px: Option<f64>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let own = DriveOptions::default();
        let options = DriveOptions {
            way: way_from(frames, legs, own.way)?,
            seed: seed.map_or(Ok(own.seed), seed_from)?,
            step_m: step_m.unwrap_or(own.step_m),
            turn_max_rad: turn_max_rad.unwrap_or(own.turn_max_rad),
            mount: mount.map_or(Ok(own.mount), mount_from)?,
            robot_from_camera: robot_from_camera
                .map_or(Ok(own.robot_from_camera), |r| convert::matrix3(r, "robot_from_camera"))?,
            blind_rad: blind_rad.unwrap_or(own.blind_rad),
            wheels: Wheels {
                base_m: wheel_base_m.unwrap_or(own.wheels.base_m),
                encoder_k_m: encoder_k_m.unwrap_or(own.wheels.encoder_k_m),
                radius_errors: wheel_radius_errors.map_or(Ok(own.wheels.radius_errors), pair_from)?,
            },
            bumps_max_rad: bumps_max_rad.unwrap_or(own.bumps_max_rad),
            lighting: lighting.unwrap_or(own.lighting),
            samples: samples.map_or(Ok(own.samples), |n| convert::whole(n, "samples", "a whole number from 1"))?,
            noise_sigma: noise_sigma.unwrap_or(own.noise_sigma),
            blur_sigma_px: blur_sigma_px.unwrap_or(own.blur_sigma_px),
        };
        let threads = threads_from(threads)?;
        let (world, lens) = (room.get().world.clone(), camera.get().inner.clone());
        let inner = call(room.py(), || on_threads(threads, || tiltvp_synth::Drive::new(world, lens, options))?)?;
        Ok(Self { room: room.clone().unbind(), camera: camera.clone().unbind(), inner })
    }

    /// The room.
    #[getter]
    fn room(&self, py: Python<'_>) -> Py<Room> {
        self.room.clone_ref(py)
    }

    /// The camera.
    #[getter]
    fn camera(&self, py: Python<'_>) -> Py<Camera> {
        self.camera.clone_ref(py)
    }

    /// How many frames it has.
    #[getter]
    fn frames(&self) -> usize {
        self.inner.trajectory().poses.len()
    }

    /// The seed of everything but the room.
    #[getter]
    fn seed(&self) -> u64 {
        self.inner.options().seed
    }

    /// Distance between the wheels, metres.
    #[getter]
    fn wheel_base_m(&self) -> f64 {
        self.inner.options().wheels.base_m
    }

    /// Variance of a reading per metre that a wheel rolls, metres.
    #[getter]
    fn encoder_k_m(&self) -> f64 {
        self.inner.options().wheels.encoder_k_m
    }

    /// How much larger the left and the right wheel are than taken for, relative.
    #[getter]
    fn wheel_radius_errors(&self) -> (f64, f64) {
        self.inner.options().wheels.radius_errors.into()
    }

    /// Greatest lean from bumps, radians.
    #[getter]
    fn bumps_max_rad(&self) -> f64 {
        self.inner.options().bumps_max_rad
    }

    /// How much the light changes, from 0 to 1.
    #[getter]
    fn lighting(&self) -> f64 {
        self.inner.options().lighting
    }

    /// x_m, y_m, yaw_rad, height_m of the camera's centre on the robot.
    #[getter]
    fn mount(&self) -> (f64, f64, f64, f64) {
        let Mount { x_m, y_m, yaw_rad, height_m } = self.inner.options().mount;
        (x_m, y_m, yaw_rad, height_m)
    }

    /// (3, 3): rotation from camera to robot, with the mount's yaw.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        matrix(py, &self.inner.options().robot_from_mounted_camera())
    }

    /// (N, 3): x_m, y_m, yaw_rad.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let poses = &self.inner.trajectory().poses;
        let rows: Vec<[f64; 3]> = poses.iter().map(|pose| [pose.x_m, pose.y_m, pose.yaw_rad]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (N, 2): alpha_rad, beta_rad.
    #[getter]
    fn tilts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let tilts = &self.inner.trajectory().tilts;
        let rows: Vec<[f64; 2]> = tilts.iter().map(|tilt| [tilt.alpha_rad(), tilt.beta_rad()]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (N, 2): what the encoders of the left and right wheel say, metres.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_rows(py, &self.inner.trajectory().odometry_m, false)
    }

    /// (N, 2): how far the left and right wheel rolled, metres.
    #[getter]
    fn true_odometry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_rows(py, &self.inner.trajectory().displacements_m, false)
    }

    /// (N, 2): distance in metres and turn in radians that the encoders' readings stand for.
    #[getter]
    fn motions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let wheels = self.inner.options().wheels;
        let rows: Vec<[f64; 2]> =
            self.inner.trajectory().odometry_m.iter().map(|rolled| wheels.motion(*rolled).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (E, 4): x_m, y_m, lowest and highest z_m of the upright edges.
    #[getter]
    fn edges_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let ends = |spans: &[[f64; 2]]| [spans.first().map_or(0.0, |s| s[0]), spans.last().map_or(0.0, |s| s[1])];
        let rows: Vec<[f64; 4]> = self
            .inner
            .edges()
            .iter()
            .map(|edge| {
                let [low, high] = ends(&edge.spans);
                [edge.position.x, edge.position.y, low, high]
            })
            .collect();
        convert::to_rows(py, &rows, false)
    }

    /// Grey (H, W) and RGB (H, W, 3) images of a frame.
    #[pyo3(signature = (frame, *, threads=None))]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pictures<'py>> {
        let (frame, threads) = (self.frame(frame)?, threads_from(threads)?);
        let image = call(py, || on_threads(threads, || self.inner.render(frame))?)?;
        pictures(py, image)
    }

    /// Edges in sight at a frame: numbers, bearings, elevations, visible shares, contrasts.
    #[pyo3(signature = (frame, *, threads=None))]
    fn _truth<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Sightings<'py>> {
        let (frame, threads) = (self.frame(frame)?, threads_from(threads)?);
        let seen = call(py, || on_threads(threads, || self.inner.sightings(frame))?)?;
        let column =
            |value: fn(&tiltvp_synth::EdgeSighting) -> f64| PyArray1::from_vec(py, seen.iter().map(value).collect());
        let elevations: Vec<[f64; 2]> = seen.iter().map(|edge| edge.elevation_rad).collect();
        Ok((
            PyArray1::from_vec(py, seen.iter().map(|edge| edge.edge as i64).collect()),
            column(|edge| edge.bearing_rad),
            convert::to_rows(py, &elevations, false)?,
            column(|edge| edge.visible_share).into_any(),
            column(|edge| edge.contrast).into_any(),
        ))
    }

    fn __len__(&self) -> usize {
        self.inner.trajectory().poses.len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let options = self.inner.options();
        let room = self.room.bind(py).repr()?;
        Ok(format!("Drive({room}, frames={}, seed={})", self.frames(), options.seed))
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = other.get();
        let same = self.inner.options() == other.inner.options() && self.inner.camera() == other.inner.camera();
        Ok(same && self.room.bind(py).eq(other.room.bind(py))?)
    }

    fn __hash__(&self) -> u64 {
        self.inner.options().seed.wrapping_mul(31).wrapping_add(self.frames() as u64)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((Py<Room>,), Bound<'py, PyDict>)> {
        let options = self.inner.options();
        let keywords = PyDict::new(py);
        keywords.set_item("camera", &self.camera)?;
        keywords.set_item("robot_from_camera", matrix(py, &options.robot_from_camera)?)?;
        keywords.set_item("mount", self.mount())?;
        keywords.set_item("blind_rad", options.blind_rad)?;
        match &options.way {
            Way::Wander { frames } => keywords.set_item("frames", frames)?,
            Way::Legs(legs) => keywords.set_item("legs", legs.clone())?,
        }
        keywords.set_item("seed", options.seed)?;
        keywords.set_item("step_m", options.step_m)?;
        keywords.set_item("turn_max_rad", options.turn_max_rad)?;
        keywords.set_item("wheel_base_m", options.wheels.base_m)?;
        keywords.set_item("encoder_k_m", options.wheels.encoder_k_m)?;
        keywords.set_item("wheel_radius_errors", self.wheel_radius_errors())?;
        keywords.set_item("bumps_max_rad", options.bumps_max_rad)?;
        keywords.set_item("lighting", options.lighting)?;
        keywords.set_item("samples", options.samples)?;
        keywords.set_item("noise_sigma", options.noise_sigma)?;
        keywords.set_item("blur_sigma_px", options.blur_sigma_px)?;
        Ok(((self.room.clone_ref(py),), keywords))
    }
}

impl Drive {
    fn frame(&self, frame: &Bound<'_, PyAny>) -> PyResult<usize> {
        convert::whole(frame, "frame", &format!("a whole number below {}", self.inner.trajectory().poses.len()))
    }
}

fn matrix<'py>(py: Python<'py>, matrix: &Matrix3<f64>) -> PyResult<Bound<'py, PyAny>> {
    convert::to_matrices(py, matrix.transpose().as_slice(), [3, 3], true)
}

fn way_from(frames: Option<&Bound<'_, PyAny>>, legs: Option<&Bound<'_, PyAny>>, own: Way) -> PyResult<Way> {
    match (frames, legs) {
        (Some(_), Some(_)) => {
            Err(invalid("frames and legs, expected one of them: legs have as many frames as they need".into()))
        }
        (Some(frames), None) => Ok(Way::Wander { frames: convert::whole(frames, "frames", "a whole number from 1")? }),
        (None, Some(legs)) => {
            let (rows, _) = convert::rows::<2>(legs, "legs")?;
            Ok(Way::Legs(rows.iter().map(|[distance_m, turn_rad]| (*distance_m, *turn_rad)).collect()))
        }
        (None, None) => Ok(own),
    }
}

fn mount_from(mount: &Bound<'_, PyAny>) -> PyResult<Mount> {
    match convert::vector(mount, "mount")?.as_slice() {
        [x_m, y_m, yaw_rad, height_m] => Ok(Mount { x_m: *x_m, y_m: *y_m, yaw_rad: *yaw_rad, height_m: *height_m }),
        other => Err(invalid(format!("mount: {} numbers, expected x_m, y_m, yaw_rad, height_m", other.len()))),
    }
}

fn pair_from(pair: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    match convert::vector(pair, "wheel_radius_errors")?.as_slice() {
        [left, right] => Ok([*left, *right]),
        other => Err(invalid(format!("wheel_radius_errors: {} numbers, expected left and right", other.len()))),
    }
}
