//! `StereoSequence`: a pair of cameras that moves through a world, with truth.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::geometry::RigidMotion;
use tiltvp_synth::{
    ColorImage, CornerSighting, ImuChannel, ImuOptions, StereoOptions, World, imu_readings, on_threads,
};

use crate::call::{call, exception, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::laboratory::Laboratory;
use crate::synth::{Room, seed_from, threads_from};

/// Position, directions of the edges x, y, z in rows, their lengths, and the kind, of a corner.
type CornerParts = ([f64; 3], [[f64; 3]; 3], [f64; 3], &'static str);
type Sightings<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyAny>, Bound<'py, PyAny>);
type Readings<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);
type Picture<'py> = Bound<'py, PyArray3<u8>>;

/// A moving pair of cameras. The face class in `tiltvp.synth` says what its images and truth are.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct StereoSequence {
    scene: Py<PyAny>,
    left: Py<Camera>,
    right: Py<Camera>,
    pub(crate) inner: tiltvp_synth::StereoSequence,
}

#[pymethods]
impl StereoSequence {
    #[new]
    #[pyo3(signature = (
        scene, *, left, right, left_from_right=None, frames=None, frame_rate_hz=None, seed=None, corner=None,
        distance_m=None, roll_max_rad=None, period_s=None, samples=None, noise_sigma=None, blur_sigma_px=None,
        exposure_s=None, gain=None, threads=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword-only on the Python side")]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        left: &Bound<'_, Camera>,
        right: &Bound<'_, Camera>,
        left_from_right: Option<&Bound<'_, PyAny>>,
        frames: Option<&Bound<'_, PyAny>>,
        frame_rate_hz: Option<f64>,
        seed: Option<&Bound<'_, PyAny>>,
        corner: Option<&Bound<'_, PyAny>>,
        distance_m: Option<&Bound<'_, PyAny>>,
        roll_max_rad: Option<f64>,
        period_s: Option<f64>,
        samples: Option<&Bound<'_, PyAny>>,
        noise_sigma: Option<f64>,
        blur_sigma_px: Option<f64>,
        exposure_s: Option<f64>,
        gain: Option<f64>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let own = StereoOptions::default();
        let options = StereoOptions {
            frames: frames.map_or(Ok(own.frames), |n| convert::whole(n, "frames", "a whole number from 1"))?,
            frame_rate_hz: frame_rate_hz.unwrap_or(own.frame_rate_hz),
            seed: seed.map_or(Ok(own.seed), seed_from)?,
            corner: corner.map(|k| convert::whole(k, "corner", "the number of a corner")).transpose()?,
            distance_m: distance_m.map_or(Ok(own.distance_m), range_from)?,
            roll_max_rad: roll_max_rad.unwrap_or(own.roll_max_rad),
            period_s: period_s.unwrap_or(own.period_s),
            left_from_right: left_from_right
                .map_or(Ok(own.left_from_right), |pose| pose_from(pose, "left_from_right"))?,
            samples: samples.map_or(Ok(own.samples), |n| convert::whole(n, "samples", "a whole number from 1"))?,
            noise_sigma: noise_sigma.unwrap_or(own.noise_sigma),
            blur_sigma_px: blur_sigma_px.unwrap_or(own.blur_sigma_px),
            exposure_s: exposure_s.unwrap_or(own.exposure_s),
            gain: gain.unwrap_or(own.gain),
        };
        let world = world_of(scene)?;
        let cameras = [left.get().inner.clone(), right.get().inner.clone()];
        let threads = threads_from(threads)?;
        let inner = call(py, || on_threads(threads, || tiltvp_synth::StereoSequence::new(world, cameras, options))?)?;
        Ok(Self { scene: scene.clone().unbind(), left: left.clone().unbind(), right: right.clone().unbind(), inner })
    }

    /// The laboratory or room.
    #[getter]
    fn scene(&self, py: Python<'_>) -> Py<PyAny> {
        self.scene.clone_ref(py)
    }

    /// The left and the right camera.
    #[getter]
    fn cameras(&self, py: Python<'_>) -> (Py<Camera>, Py<Camera>) {
        (self.left.clone_ref(py), self.right.clone_ref(py))
    }

    /// The seed of motion and noise.
    #[getter]
    fn seed(&self) -> u64 {
        self.inner.options().seed
    }

    /// Number of the corner that is looked at.
    #[getter]
    fn corner(&self) -> usize {
        self.inner.corner()
    }

    /// Frames per second.
    #[getter]
    fn frame_rate_hz(&self) -> f64 {
        self.inner.options().frame_rate_hz
    }

    /// How long the shutter is open, seconds.
    #[getter]
    fn exposure_s(&self) -> f64 {
        self.inner.options().exposure_s
    }

    /// (4, 4): the right camera's pose in the left one's frame.
    #[getter]
    fn left_from_right<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_poses(py, &[self.inner.options().left_from_right], true)
    }

    /// (N,): when each frame is taken, seconds.
    #[getter]
    fn times_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, (0..self.__len__()).map(|frame| self.inner.time_s(frame)).collect())
    }

    /// (N, 4, 4): the left camera's pose in the world at each frame.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let motion = self.inner.motion();
        let poses: Vec<_> = (0..self.__len__()).map(|frame| motion.pose(self.inner.time_s(frame))).collect();
        to_poses(py, &poses, false)
    }

    /// (T, 4, 4): the left camera's pose in the world at any times, seconds.
    fn poses_at<'py>(&self, py: Python<'py>, times_s: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let times = convert::vector(times_s, "times_s")?;
        if !times.iter().all(|time| time.is_finite()) {
            return Err(invalid("times_s: not finite, expected seconds".to_owned()));
        }
        let poses: Vec<_> = times.iter().map(|time| self.inner.motion().pose(*time)).collect();
        to_poses(py, &poses, false)
    }

    /// Position, directions of the edges x, y, z in rows, their lengths, and the kind, of each corner of the scene.
    fn _corners(&self, py: Python<'_>) -> PyResult<Vec<CornerParts>> {
        let world = world_of(self.scene.bind(py))?;
        let parts = |corner: &tiltvp_synth::Corner| {
            (corner.position.into(), corner.edges.map(Into::into), corner.lengths_m, corner.kind.name())
        };
        Ok(world.corners().iter().map(parts).collect())
    }

    /// The left and the right image of a frame, (H, W, 3).
    #[pyo3(signature = (frame, *, threads=None))]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Picture<'py>, Picture<'py>)> {
        let (frame, threads) = (self.frame(frame)?, threads_from(threads)?);
        let [left, right] = call(py, || on_threads(threads, || self.inner.render(frame))?)?;
        Ok((picture(py, left)?, picture(py, right)?))
    }

    /// Corners in sight at a frame: numbers, vertices (M, 2, 2), visible lengths of edges (M, 2, 3).
    #[pyo3(signature = (frame, *, threads=None))]
    fn _truth<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Sightings<'py>> {
        let (frame, threads) = (self.frame(frame)?, threads_from(threads)?);
        let seen = call(py, || on_threads(threads, || self.inner.sightings(frame))?)?;
        let vertices = seen.iter().flat_map(|s: &CornerSighting| s.vertex_px.iter().flat_map(|p| [p.x, p.y]));
        let lengths = seen.iter().flat_map(|s| s.edges_px.as_flattened().iter().copied());
        Ok((
            PyArray1::from_vec(py, seen.iter().map(|s| s.corner as i64).collect()),
            convert::to_matrices(py, &vertices.collect::<Vec<f64>>(), [2, 2], false)?,
            convert::to_matrices(py, &lengths.collect::<Vec<f64>>(), [2, 3], false)?,
        ))
    }

    /// Readings of an inertial sensor: times, rates (M, 3), forces (M, 3), the rates' true biases (M, 3).
    #[pyo3(signature = (*, rate_hz=None, seed=None, gyroscope=None, accelerometer=None))]
    fn _imu<'py>(
        &self,
        py: Python<'py>,
        rate_hz: Option<f64>,
        seed: Option<&Bound<'py, PyAny>>,
        gyroscope: Option<&Bound<'py, PyAny>>,
        accelerometer: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Readings<'py>> {
        let own = ImuOptions::default();
        let options = ImuOptions {
            rate_hz: rate_hz.unwrap_or(own.rate_hz),
            seed: seed.map_or(Ok(own.seed), seed_from)?,
            gyroscope: gyroscope.map_or(Ok(own.gyroscope), |channel| channel_from(channel, "gyroscope"))?,
            accelerometer: accelerometer
                .map_or(Ok(own.accelerometer), |channel| channel_from(channel, "accelerometer"))?,
        };
        let duration_s = self.inner.time_s(self.__len__() - 1);
        let readings = call(py, || imu_readings(self.inner.motion(), duration_s, &options))?;
        let rows = |value: fn(&tiltvp_synth::ImuReading) -> Vector3<f64>| {
            let rows: Vec<[f64; 3]> = readings.iter().map(|reading| value(reading).into()).collect();
            convert::to_rows(py, &rows, false)
        };
        Ok((
            PyArray1::from_vec(py, readings.iter().map(|reading| reading.time_s).collect()),
            rows(|reading| reading.rate_rad_s)?,
            rows(|reading| reading.force_m_s2)?,
            rows(|reading| reading.rate_bias_rad_s)?,
        ))
    }

    fn __len__(&self) -> usize {
        self.inner.options().frames
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let options = self.inner.options();
        let scene = self.scene.bind(py).repr()?;
        Ok(format!("StereoSequence({scene}, frames={}, seed={})", options.frames, options.seed))
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = other.get();
        let same = self.inner.options() == other.inner.options() && self.inner.cameras() == other.inner.cameras();
        Ok(same && self.scene.bind(py).eq(other.scene.bind(py))?)
    }

    fn __hash__(&self) -> u64 {
        self.inner.options().seed.wrapping_mul(31).wrapping_add(self.inner.options().frames as u64)
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((Py<PyAny>,), Bound<'py, PyDict>)> {
        let options = self.inner.options();
        let keywords = PyDict::new(py);
        keywords.set_item("left", &self.left)?;
        keywords.set_item("right", &self.right)?;
        keywords.set_item("left_from_right", self.left_from_right(py)?)?;
        keywords.set_item("frames", options.frames)?;
        keywords.set_item("frame_rate_hz", options.frame_rate_hz)?;
        keywords.set_item("seed", options.seed)?;
        keywords.set_item("corner", options.corner)?;
        keywords.set_item("distance_m", options.distance_m.to_vec())?;
        keywords.set_item("roll_max_rad", options.roll_max_rad)?;
        keywords.set_item("period_s", options.period_s)?;
        keywords.set_item("samples", options.samples)?;
        keywords.set_item("noise_sigma", options.noise_sigma)?;
        keywords.set_item("blur_sigma_px", options.blur_sigma_px)?;
        keywords.set_item("exposure_s", options.exposure_s)?;
        keywords.set_item("gain", options.gain)?;
        Ok(((self.scene.clone_ref(py),), keywords))
    }
}

impl StereoSequence {
    fn frame(&self, frame: &Bound<'_, PyAny>) -> PyResult<usize> {
        convert::whole(frame, "frame", &format!("a whole number below {}", self.inner.options().frames))
    }
}

fn world_of(scene: &Bound<'_, PyAny>) -> PyResult<Arc<World>> {
    if let Ok(room) = scene.cast::<Room>() {
        return Ok(room.get().world.clone());
    }
    if let Ok(laboratory) = scene.cast::<Laboratory>() {
        return Ok(laboratory.get().world.clone());
    }
    Err(invalid(format!("scene: a {}, expected a Laboratory or a Room", scene.get_type().name()?)))
}

fn range_from(range: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    match convert::vector(range, "distance_m")?.as_slice() {
        [low, high] => Ok([*low, *high]),
        other => Err(invalid(format!("distance_m: {} numbers, expected the least and the greatest", other.len()))),
    }
}

fn channel_from(channel: &Bound<'_, PyAny>, name: &str) -> PyResult<ImuChannel> {
    match convert::vector(channel, name)?.as_slice() {
        &[noise_density, bias_sigma, bias_walk, scale_sigma, range] => {
            Ok(ImuChannel { noise_density, bias_sigma, bias_walk, scale_sigma, range })
        }
        other => Err(invalid(format!(
            "{name}: {} numbers, expected noise density, bias, bias walk, scale error and range",
            other.len()
        ))),
    }
}

/// A rigid motion from a (4, 4) matrix.
fn pose_from(value: &Bound<'_, PyAny>, name: &'static str) -> PyResult<Isometry3<f64>> {
    let (rows, _) = convert::rows::<4>(value, name)?;
    let flat: Vec<f64> = rows.into_iter().flatten().collect();
    if flat.len() != 16 {
        return Err(invalid(format!("{name}: {} rows of 4, expected an array (4, 4)", flat.len() / 4)));
    }
    let motion = RigidMotion::from_matrix(name, &Matrix4::from_row_slice(&flat)).map_err(|error| exception(&error))?;
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(motion.rotation));
    Ok(Isometry3::from_parts(Translation3::from(motion.translation_m), turn))
}

fn to_poses<'py>(py: Python<'py>, poses: &[Isometry3<f64>], single: bool) -> PyResult<Bound<'py, PyAny>> {
    let flat: Vec<f64> = poses.iter().flat_map(|pose| pose.to_homogeneous().transpose().as_slice().to_vec()).collect();
    convert::to_matrices(py, &flat, [4, 4], single)
}

fn picture(py: Python<'_>, image: ColorImage) -> PyResult<Picture<'_>> {
    PyArray1::from_vec(py, image.bgr).reshape([image.height_px, image.width_px, 3])
}
