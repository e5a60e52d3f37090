//! `Drive`: a robot's way through a room, any frame of which can be rendered.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_synth::{DriveOptions, Mount, RobotPose};

use crate::array::Array;
use crate::call::{exception, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::options;
use crate::reader;
use crate::synth::{Pictures, Room, call_on_threads, frame_from, pictures};
use crate::value::{frozen, getters};

type Rows<'py> = Array<'py, f64>;
type Sightings<'py> = (Array<'py, i64>, Rows<'py>, Rows<'py>, Rows<'py>, Rows<'py>);

/// A robot's way through a room, any frame of which can be rendered by `tiltvp.synth.Drive`.
///
/// Frozen, comparable, hashable, and to be pickled. N is the number of frames. The drive is planned and daylight
/// gathered on `threads` threads (None: one per core), on which nothing depends.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Drive {
    room: Py<Room>,
    camera: Py<Camera>,
    inner: tiltvp_synth::Drive,
}

#[pymethods]
impl Drive {
    #[new]
    #[pyo3(signature = (room: "Room", *, camera: "Camera", threads: "SupportsIndex | None" = None, **options: "Option | None"))]
    fn new(
        room: &Bound<'_, PyAny>,
        camera: &Bound<'_, PyAny>,
        threads: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let room: &Bound<'_, Room> = convert::object(room, "room", "a tiltvp.synth.Room")?;
        let camera = reader::camera(camera)?;
        let has =
            |name| options.is_some_and(|given| given.get_item(name).is_ok_and(|v| v.is_some_and(|v| !v.is_none())));
        if has("frames") && has("legs") {
            return Err(invalid("frames and legs, expected one of them: legs have as many frames as they need".into()));
        }
        let parsed = options::given(DriveOptions::default(), options)?;
        let (world, lens) = (room.get().world.clone(), camera.get().inner.clone());
        let inner = call_on_threads(room.py(), threads, || tiltvp_synth::Drive::new(world, lens, parsed))?;
        Ok(Self { room: room.clone().unbind(), camera: camera.clone().unbind(), inner })
    }

    /// Raises what `Drive` raises for these options, whatever the room.
    #[staticmethod]
    #[pyo3(signature = (**options: "Any"))]
    fn check(options: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        options::given(DriveOptions::default(), options)?.validate().map_err(|error| exception(&error))
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

    /// x_m, y_m, yaw_rad, height_m of the camera's centre on the robot.
    #[getter]
    fn mount(&self) -> (f64, f64, f64, f64) {
        let Mount { x_m, y_m, yaw_rad, height_m } = self.inner.options().mount;
        (x_m, y_m, yaw_rad, height_m)
    }

    /// (3, 3): rotation from camera to robot coordinates, the mount's yaw included.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.options().robot_from_mounted_camera())
    }

    /// (N, 3): true x_m, y_m, yaw_rad of the robot. Integrating `true_odometry` along arcs gives them exactly.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let poses = &self.inner.trajectory().poses;
        let rows: Vec<[f64; 3]> = poses.iter().map(|pose| [pose.x_m, pose.y_m, pose.yaw_rad]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (N, 2): true alpha_rad, beta_rad.
    #[getter]
    fn tilts<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let tilts = &self.inner.trajectory().tilts;
        let rows: Vec<[f64; 2]> = tilts.iter().map(|tilt| [tilt.alpha_rad(), tilt.beta_rad()]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (N, 2): how far the left and right wheel rolled since the last frame, by their encoders; metres.
    #[getter]
    fn odometry<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_rows(py, &self.inner.trajectory().odometry_m, false)
    }

    /// (N, 2): how far the left and right wheel rolled, metres.
    #[getter]
    fn true_odometry<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_rows(py, &self.inner.trajectory().displacements_m, false)
    }

    /// (N, 2): distance in metres and turn in radians that the encoders' readings stand for.
    #[getter]
    fn motions<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let wheels = self.inner.options().wheels;
        let rows: Vec<[f64; 2]> =
            self.inner.trajectory().odometry_m.iter().map(|rolled| wheels.motion(*rolled).into()).collect();
        convert::to_rows(py, &rows, false)
    }

    /// (E, 4): x_m, y_m, lowest and highest z_m of the room's upright edges, visible or not; the row is the number.
    ///
    /// All upright edges within 3 mm of a vertical line are one. Those of wallpaper and tiles come last.
    #[getter]
    fn edges_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
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
    #[pyo3(signature = (frame: "SupportsIndex", *, threads: "SupportsIndex | None" = None))]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pictures<'py>> {
        let frame = frame_from(frame, self.__len__())?;
        let image = call_on_threads(py, threads, || self.inner.render(frame))?;
        pictures(py, image)
    }

    /// Grey (H, W) and RGB (H, W, 3) images in a frame's light, from a pose (3,) with a ground normal (3,).
    #[pyo3(signature = (frame: "SupportsIndex", pose: "ArrayLike", normal: "ArrayLike", *, threads: "SupportsIndex | None" = None))]
    fn _render_at<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        pose: &Bound<'py, PyAny>,
        normal: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Pictures<'py>> {
        let frame = convert::number(frame, "frame", "a whole number from 0")?;
        let [x_m, y_m, yaw_rad] = convert::vector3(pose, "pose")?.into();
        let tilt = convert::tilt(normal, "normal")?;
        let pose = RobotPose { x_m, y_m, yaw_rad };
        let image = call_on_threads(py, threads, || self.inner.render_at(frame, pose, tilt))?;
        pictures(py, image)
    }

    /// Edges in sight at a frame: numbers, bearings, elevations, visible shares, contrasts.
    #[pyo3(signature = (frame: "SupportsIndex", *, threads: "SupportsIndex | None" = None))]
    fn _truth<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Sightings<'py>> {
        let frame = frame_from(frame, self.__len__())?;
        let seen = call_on_threads(py, threads, || self.inner.sightings(frame))?;
        let column = |value: fn(&tiltvp_synth::EdgeSighting) -> f64| {
            Array::new(PyArray1::from_vec(py, seen.iter().map(value).collect()))
        };
        let elevations: Vec<[f64; 2]> = seen.iter().map(|edge| edge.elevation_rad).collect();
        Ok((
            Array::new(PyArray1::from_vec(py, seen.iter().map(|edge| edge.edge as i64).collect())),
            column(|edge| edge.bearing_rad),
            convert::to_rows(py, &elevations, false)?,
            column(|edge| edge.visible_share),
            column(|edge| edge.contrast),
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

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((Py<Room>,), Bound<'py, PyDict>)> {
        let keywords = options::in_force(py, self.inner.options())?;
        keywords.set_item("camera", &self.camera)?;
        Ok(((self.room.clone_ref(py),), keywords))
    }
}

getters! {
    Drive as own {
        /// N, how many frames it has; also its `len`.
        frames: usize = own.inner.trajectory().poses.len(),
        /// The seed of everything but the room.
        seed: u64 = own.inner.options().seed,
        /// Distance between the wheels, metres.
        wheel_base_m: f64 = own.inner.options().wheels.base_m,
        /// Variance of a reading per metre that a wheel rolls, metres.
        encoder_k_m: f64 = own.inner.options().wheels.encoder_k_m,
        /// How much larger the left and the right wheel are than the readings assume, relative.
        wheel_radius_errors: (f64, f64) = own.inner.options().wheels.radius_errors.into(),
        /// Greatest lean from bumps, radians.
        bumps_max_rad: f64 = own.inner.options().bumps_max_rad,
        /// How much the light changes along the way, from 0 to 1.
        lighting: f64 = own.inner.options().lighting,
    }
}

frozen!(Drive, |own| (&own.room.get().options, own.inner.camera(), own.inner.options()), |own| (
    own.frames(),
    own.inner.options().seed
));
