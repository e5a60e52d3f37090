//! `StereoSequence`: a pair of cameras that moves through a world, with truth.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix2, Matrix2x3, Vector3};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{
    ColorImage, CornerSighting, ImuOptions, LaboratoryOptions, RoomOptions, StereoOptions, World, imu_readings,
    readings_of,
};

use crate::array::Array;
use crate::call::{call_long, exception, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::laboratory::Laboratory;
use crate::options;
use crate::synth::{Room, call_on_threads, frame_from};
use crate::value::{frozen, getters, of_class};

/// Position, directions of the edges x, y, z in rows, their lengths, and the kind, of a corner.
pub(crate) type CornerParts = ([f64; 3], [[f64; 3]; 3], [f64; 3], &'static str);
type Sightings<'py> = (Array<'py, i64>, Array<'py, f64>, Array<'py, f64>);
type Readings<'py> = (Array<'py, f64>, Array<'py, f64>, Array<'py, f64>, Array<'py, f64>);
type Picture<'py> = Array<'py, u8>;

/// What a sequence looks at.
#[derive(IntoPyObject)]
enum Scene<'py> {
    Laboratory(Bound<'py, Laboratory>),
    Room(Bound<'py, Room>),
}

/// A moving pair of cameras, any frame of which can be rendered by `tiltvp.synth.StereoSequence`.
///
/// Frozen, comparable, hashable, and to be pickled. N is the number of frames. A motion in the scene is found and rays
/// are made on `threads` threads (None: one per core), on which nothing depends.
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
        scene: "Laboratory | Room", *, left: "Camera", right: "Camera", threads: "SupportsIndex | None" = None,
        **options: "Option | None"
    ))]
    fn new(
        py: Python<'_>,
        scene: &Bound<'_, PyAny>,
        left: &Bound<'_, PyAny>,
        right: &Bound<'_, PyAny>,
        threads: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let parsed = options::given(StereoOptions::default(), options)?;
        let world = world_of(scene)?;
        let left: &Bound<'_, Camera> = convert::object(left, "left", "a tiltvp.Camera")?;
        let right: &Bound<'_, Camera> = convert::object(right, "right", "a tiltvp.Camera")?;
        let cameras = [left.get().inner.clone(), right.get().inner.clone()];
        let inner = call_on_threads(py, threads, || tiltvp_synth::StereoSequence::new(world, cameras, parsed))?;
        Ok(Self { scene: scene.clone().unbind(), left: left.clone().unbind(), right: right.clone().unbind(), inner })
    }

    /// Raises what `StereoSequence` raises for these options, whatever the scene.
    #[staticmethod]
    #[pyo3(signature = (**options: "Any"))]
    fn check(options: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        options::given(StereoOptions::default(), options)?.validate().map_err(|error| exception(&error))
    }

    /// The laboratory or room.
    #[getter]
    fn scene<'py>(&self, py: Python<'py>) -> PyResult<Scene<'py>> {
        let scene = self.scene.bind(py);
        Ok(match scene.cast() {
            Ok(laboratory) => Scene::Laboratory(laboratory.clone()),
            Err(_) => Scene::Room(scene.cast()?.clone()),
        })
    }

    /// The left and the right camera.
    #[getter]
    fn cameras(&self, py: Python<'_>) -> (Py<Camera>, Py<Camera>) {
        (self.left.clone_ref(py), self.right.clone_ref(py))
    }

    /// (4, 4): the right camera's pose in the left one's frame.
    #[getter]
    fn left_from_right<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        to_poses(py, &[self.inner.options().left_from_right], true)
    }

    /// (N,): when each frame is taken, seconds.
    #[getter]
    fn times_s<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        Array::new(PyArray1::from_vec(py, (0..self.__len__()).map(|frame| self.inner.time_s(frame)).collect()))
    }

    /// (N, 4, 4): the left camera's pose in the world at each frame.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let motion = self.inner.motion();
        let poses: Vec<_> = (0..self.__len__()).map(|frame| motion.pose(self.inner.time_s(frame))).collect();
        to_poses(py, &poses, false)
    }

    /// (T, 4, 4): the left camera's pose in the world at any times, seconds.
    #[pyo3(signature = (times_s: "ArrayLike"))]
    fn poses_at<'py>(&self, py: Python<'py>, times_s: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let times = convert::vector(times_s, "times_s")?;
        if !times.iter().all(|time| time.is_finite()) {
            return Err(invalid("times_s: not finite, expected seconds".to_owned()));
        }
        let poses: Vec<_> = times.iter().map(|time| self.inner.motion().pose(*time)).collect();
        to_poses(py, &poses, false)
    }

    /// Position, directions of the edges x, y, z in rows, their lengths, and the kind, of each corner of the scene.
    fn _corners(&self, py: Python<'_>) -> PyResult<Vec<CornerParts>> {
        Ok(corner_parts(&*world_of(self.scene.bind(py))?))
    }

    /// The left and the right image of a frame, (H, W, 3).
    #[pyo3(signature = (frame: "SupportsIndex", *, threads: "SupportsIndex | None" = None))]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Picture<'py>, Picture<'py>)> {
        let frame = frame_from(frame, self.__len__())?;
        let [left, right] = call_on_threads(py, threads, || self.inner.render(frame))?;
        Ok((picture(py, left)?, picture(py, right)?))
    }

    /// Corners in sight at a frame: numbers, vertices (M, 2, 2), visible lengths of edges (M, 2, 3).
    #[pyo3(signature = (frame: "SupportsIndex", *, threads: "SupportsIndex | None" = None))]
    fn _truth<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Sightings<'py>> {
        let frame = frame_from(frame, self.__len__())?;
        let seen = call_on_threads(py, threads, || self.inner.sightings(frame))?;
        let vertices = |s: &CornerSighting| Matrix2::from_columns(&s.vertex_px).transpose();
        let lengths = |s: &CornerSighting| Matrix2x3::from_row_slice(s.edges_px.as_flattened());
        Ok((
            Array::new(PyArray1::from_vec(py, seen.iter().map(|s| s.corner as i64).collect())),
            convert::to_matrices(py, &seen.iter().map(vertices).collect::<Vec<_>>(), false)?,
            convert::to_matrices(py, &seen.iter().map(lengths).collect::<Vec<_>>(), false)?,
        ))
    }

    /// (N,): how far away the first surface is along bearings (N, 3) of the left camera at a frame, metres; NaN
    /// where there is none.
    #[pyo3(signature = (frame: "SupportsIndex", bearings: "ArrayLike"))]
    fn distances<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        bearings: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        let pose = self.inner.pose(frame_from(frame, self.__len__())?).map_err(|error| exception(&error))?;
        let (bearings, _) = convert::rows::<3>(bearings, "bearings")?;
        let world = world_of(self.scene.bind(py))?;
        let distance = |bearing: [f64; 3]| {
            let hit = world.cast(&pose.translation.vector, &(pose.rotation * Vector3::from(bearing)));
            hit.map_or(f64::NAN, |hit| hit.distance_m)
        };
        Ok(Array::new(PyArray1::from_vec(py, bearings.into_iter().map(distance).collect())))
    }

    /// Readings of an inertial sensor: times, rates (M, 3), forces (M, 3), the rates' true biases (M, 3).
    #[pyo3(signature = (**options: "Any"))]
    fn _imu<'py>(&self, py: Python<'py>, options: Option<&Bound<'py, PyDict>>) -> PyResult<Readings<'py>> {
        let options = options::given(ImuOptions::default(), options)?;
        let duration_s = self.inner.time_s(self.__len__() - 1);
        let readings = call_long(py, || imu_readings(self.inner.motion(), duration_s, &options))?;
        imu_columns(py, &readings)
    }

    fn __len__(&self) -> usize {
        self.inner.options().frames
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let options = self.inner.options();
        let scene = self.scene.bind(py).repr()?;
        Ok(format!("StereoSequence({scene}, frames={}, seed={})", options.frames, options.seed))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((Py<PyAny>,), Bound<'py, PyDict>)> {
        let keywords = options::in_force(py, self.inner.options())?;
        keywords.set_item("left", &self.left)?;
        keywords.set_item("right", &self.right)?;
        Ok(((self.scene.clone_ref(py),), keywords))
    }
}

getters! {
    StereoSequence as own {
        /// The seed of motion and noise.
        seed: u64 = own.inner.options().seed,
        /// Which of the scene's corners is looked at.
        corner: usize = own.inner.corner(),
        /// Frames per second.
        frame_rate_hz: f64 = own.inner.options().frame_rate_hz,
        /// How long the shutter is open, seconds.
        exposure_s: f64 = own.inner.options().exposure_s,
    }
}

frozen!(StereoSequence, |own| (own.options_of_scene(), own.inner.cameras(), own.inner.options()), |own| (
    own.__len__(),
    own.inner.options().seed
));

impl StereoSequence {
    fn options_of_scene(&self) -> (Option<RoomOptions>, Option<LaboratoryOptions>) {
        Python::attach(|py| {
            let scene = self.scene.bind(py);
            let room = of_class::<Room>(scene).map(|room| room.options.clone());
            (room, of_class::<Laboratory>(scene).map(|laboratory| laboratory.options.clone()))
        })
    }
}

pub(crate) fn corner_parts(world: &World) -> Vec<CornerParts> {
    let parts = |corner: &tiltvp_synth::Corner| {
        (corner.position.into(), corner.edges.map(Into::into), corner.lengths_m, corner.kind.name())
    };
    world.corners().iter().map(parts).collect()
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

fn to_poses<'py>(py: Python<'py>, poses: &[Isometry3<f64>], single: bool) -> PyResult<Array<'py, f64>> {
    let matrices: Vec<_> = poses.iter().map(Isometry3::to_homogeneous).collect();
    convert::to_matrices(py, &matrices, single)
}

fn picture(py: Python<'_>, image: ColorImage) -> PyResult<Picture<'_>> {
    Ok(Array::new(PyArray1::from_vec(py, image.bgr).reshape([image.height_px, image.width_px, 3])?))
}

/// Readings of an inertial sensor, such as those of `StereoSequence.imu`, along any motion.
///
/// `rates_rad_s` and `forces_m_s2` are its true rates of turn and specific forces in the sensor's axes, (M, 3) each and `rate_hz` a
/// second. Times, rates (M, 3), forces (M, 3), and the rates' true biases (M, 3).
#[pyfunction]
#[pyo3(signature = (rates_rad_s: "ArrayLike", forces_m_s2: "ArrayLike", **options: "Option | None"))]
pub(crate) fn read_imu<'py>(
    py: Python<'py>,
    rates_rad_s: &Bound<'py, PyAny>,
    forces_m_s2: &Bound<'py, PyAny>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Readings<'py>> {
    let options = options::given(ImuOptions::default(), options)?;
    let (rates, _) = convert::rows::<3>(rates_rad_s, "rates_rad_s")?;
    let (forces, _) = convert::rows::<3>(forces_m_s2, "forces_m_s2")?;
    if rates.len() != forces.len() {
        let (rates, forces) = (rates.len(), forces.len());
        return Err(invalid(format!("forces_m_s2: {forces} rows, expected {rates}, as rates_rad_s has")));
    }
    let truths = rates.into_iter().zip(forces).map(|(rate, force)| (rate.into(), force.into()));
    let readings = readings_of(truths, &options).map_err(|error| exception(&error))?;
    imu_columns(py, &readings)
}

fn imu_columns<'py>(py: Python<'py>, readings: &[tiltvp_synth::ImuReading]) -> PyResult<Readings<'py>> {
    let rows = |value: fn(&tiltvp_synth::ImuReading) -> Vector3<f64>| {
        let rows: Vec<[f64; 3]> = readings.iter().map(|reading| value(reading).into()).collect();
        convert::to_rows(py, &rows, false)
    };
    Ok((
        Array::new(PyArray1::from_vec(py, readings.iter().map(|reading| reading.time_s).collect())),
        rows(|reading| reading.rate_rad_s)?,
        rows(|reading| reading.force_m_s2)?,
        rows(|reading| reading.rate_bias_rad_s)?,
    ))
}
