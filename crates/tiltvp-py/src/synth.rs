//! `Room`: a seeded room, built once, looked at as often as wished.

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix3x2, Vector2};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::Error;
use tiltvp_core::camera::Camera as CoreCamera;
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{Image, Lens, RenderOptions, RobotPose, RoomKind, RoomOptions, Segment, View, World, on_threads};

use crate::array::Array;
use crate::call::{call_long, invalid};
use crate::convert::{self, Number, Word};
use crate::options;
use crate::reader;
use crate::stereo::{CornerParts, corner_parts};
use crate::value::{frozen, getters};

pub(crate) type Pictures<'py> = (Array<'py, u8>, Array<'py, u8>);

/// A furnished, lit room of one of `ROOM_KINDS`, built once. `tiltvp.synth.Room` renders it.
///
/// The world frame has z up and the floor at z = 0; metres. Frozen, comparable, hashable, and to be pickled.
///
/// It is built and lit on `threads` threads (None: one per core), on which it does not depend.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Room {
    pub(crate) options: RoomOptions,
    pub(crate) world: Arc<World>,
}

#[pymethods]
impl Room {
    #[new]
    #[pyo3(signature = (
        kind, seed: "SupportsIndex", *, threads: "SupportsIndex | None" = None, **options: "Option | None"
    ))]
    fn new(
        py: Python<'_>,
        kind: Word,
        seed: &Bound<'_, PyAny>,
        threads: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let kind: RoomKind = kind.choose(str::parse)?;
        let options = options::given(RoomOptions::new(kind, seed_from(seed)?), options)?;
        let world = call_on_threads(py, threads, || World::new(&options))?;
        Ok(Self { options, world: Arc::new(world) })
    }

    /// (N, 2): the corners of the floor, counter-clockwise, metres.
    #[getter]
    fn floor_outline_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let corners: Vec<[f64; 2]> = self.world.floor_outline().iter().map(|corner| (*corner).into()).collect();
        convert::to_rows(py, &corners, false)
    }

    /// (N, 2, 3): lower and upper ends of the vertical edges of walls and furniture, visible or not, metres.
    #[getter]
    fn vertical_edges_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let ends = |edge: &Segment| Matrix3x2::from_columns(&[edge.bottom, edge.top]).transpose();
        let edges: Vec<_> = self.world.vertical_edges().iter().map(ends).collect();
        convert::to_matrices(py, &edges, false)
    }

    /// Whether a round robot of 0.22 m radius and less than 0.4 m height can stand with its centre there.
    fn is_free(&self, x_m: Number, y_m: Number) -> PyResult<bool> {
        Ok(self.world.is_free(x_m.of("x_m")?, y_m.of("y_m")?))
    }

    /// (count, 3): x_m, y_m, yaw_rad of poses at which the robot stands free, drawn by `seed`.
    ///
    /// Raises `tiltvp.errors.InvalidInputError` if the room is too full.
    #[pyo3(signature = (count: "SupportsIndex", seed: "SupportsIndex"))]
    fn free_poses<'py>(
        &self,
        py: Python<'py>,
        count: &Bound<'py, PyAny>,
        seed: &Bound<'py, PyAny>,
    ) -> PyResult<Array<'py, f64>> {
        let count = convert::number(count, "count", "a whole number")?;
        let seed = seed_from(seed)?;
        let poses = call_long(py, || self.world.free_poses(count, seed))?;
        let rows: Vec<[f64; 3]> = poses.iter().map(|pose| [pose.x_m, pose.y_m, pose.yaw_rad]).collect();
        convert::to_rows(py, &rows, false)
    }

    /// Grey (H, W) and RGB (H, W, 3) images of the room.
    #[pyo3(signature = (camera: "Camera", *, threads: "SupportsIndex | None", **options: "Any"))]
    fn _render<'py>(
        &self,
        py: Python<'py>,
        camera: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Pictures<'py>> {
        let shot = options::given(Shot::default(), options)?;
        shot.check()?;
        let camera = &reader::camera(camera)?.get().inner;
        let seen = call_on_threads(py, threads, || {
            let lens = |x: f64, y: f64| camera.unproject(&Vector2::new(x, y));
            tiltvp_synth::render(&self.world, &shot.view(&lens, camera), &shot.rendering)
        })?;
        pictures(py, seen.image)
    }

    /// Grey (height, 2 height) and RGB (height, 2 height, 3) images of everything around a place.
    #[pyo3(signature = (height: "SupportsIndex", *, threads: "SupportsIndex | None", **options: "Any"))]
    fn _render_panorama<'py>(
        &self,
        py: Python<'py>,
        height: &Bound<'py, PyAny>,
        threads: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Pictures<'py>> {
        let shot = options::given(Shot::default(), options)?;
        let pose = shot.pose();
        let height: usize = convert::number(height, "height", "a whole number of pixels")?;
        let seen = call_on_threads(py, threads, || {
            let up = shot.camera_height_m.unwrap_or_else(|| View::new(&|_, _| None, 1, 1, pose).camera_height_m);
            tiltvp_synth::render_panorama(&self.world, pose, up, height, &shot.rendering)
        })?;
        pictures(py, seen.image)
    }

    /// (N, 2, 3) bearings of the ends in the camera frame and (N,) contrasts of the straight edges in sight.
    #[pyo3(signature = (camera: "Camera", contrast_min, **options: "Any"))]
    fn _straight_edges<'py>(
        &self,
        py: Python<'py>,
        camera: &Bound<'py, PyAny>,
        contrast_min: Number,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let contrast_min = contrast_min.of("contrast_min")?;
        let shot = options::given(Shot::default(), options)?;
        shot.check()?;
        let camera = &reader::camera(camera)?.get().inner;
        let edges = call_long(py, || {
            let view = shot.view(&|_, _| None, camera);
            self.world.straight_edges(camera, &view, contrast_min)
        })?;
        let ends: Vec<_> = edges.iter().map(|edge| Matrix3x2::from_columns(&edge.ends).transpose()).collect();
        let contrasts = edges.iter().map(|edge| edge.contrast).collect();
        Ok((convert::to_matrices(py, &ends, false)?, Array::new(PyArray1::from_vec(py, contrasts))))
    }

    /// Position, directions of the edges x, y, z in rows, their lengths, and the kind, of each corner.
    fn _corners(&self) -> Vec<CornerParts> {
        corner_parts(&self.world)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let own = &self.options;
        let others = options::shown_beside(py, own, &RoomOptions::new(own.kind, own.seed))?;
        Ok(format!("Room(\"{}\", {}{others})", own.kind, own.seed))
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((&'static str, u64), Bound<'py, PyDict>)> {
        let keywords = options::in_force_without(py, &self.options, &["kind", "seed"])?;
        Ok(((self.options.kind.name(), self.options.seed), keywords))
    }
}

getters! {
    Room as own {
        /// Which of `ROOM_KINDS` it is.
        kind: &'static str = own.options.kind.name(),
        /// The seed of everything in it.
        seed: u64 = own.options.seed,
        /// How full it is, from 0 to 1.
        clutter: f64 = own.options.clutter,
        /// Brightness of the day outside, from 0 to 1.
        daylight: f64 = own.options.daylight,
        /// Spacing of the points where light was gathered, metres.
        light_spacing_m: f64 = own.options.light_spacing_m,
        /// How many times larger the floor is than the kind's own.
        extent: f64 = own.options.extent,
        /// How much the floor shines, from 0 to 1.
        floor_gloss: f64 = own.options.floor_gloss,
        /// Which of `WALL_PATTERNS` its walls have in common.
        wall_pattern: &'static str = own.options.wall_pattern.name(),
        /// Height of the ceiling, metres.
        height_m: f64 = own.world.height_m(),
    }
}

frozen!(Room, |own| &own.options, |own| (own.options.kind as u64, own.options.seed));

pub(crate) fn seed_from(seed: &Bound<'_, PyAny>) -> PyResult<u64> {
    convert::number(seed, "seed", "a whole number from 0 to 2^64 - 1")
}

/// The number of one of so many frames; one that is too great is left to who asks for it.
pub(crate) fn frame_from(frame: &Bound<'_, PyAny>, frames: usize) -> PyResult<usize> {
    convert::number(frame, "frame", &format!("a whole number below {frames}"))
}

/// As [`call_long`], on that many threads; without a number on one per core.
pub(crate) fn call_on_threads<T: Send>(
    py: Python<'_>,
    threads: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    let threads = convert::threads(threads)?.unwrap_or(0);
    call_long(py, || on_threads(threads, work)?)
}

tiltvp_core::options! {
    /// Where a picture of a room is taken from, and how.
    pub(crate) struct Shot {
        /// Where the robot stands: x_m, y_m, yaw_rad.
        pose: [f64; 3] = [0.0; 3];
        /// The lean, radians.
        alpha_rad: f64 = 0.0;
        /// The direction of the lean, radians.
        beta_rad: f64 = 0.0;
        /// The rotation from camera to robot.
        robot_from_camera: Matrix3<f64> = Matrix3::identity();
        /// Height of the camera's centre, metres; none for the usual one.
        camera_height_m: Option<f64> = None;
        /// How it becomes an image.
        [flat] rendering: RenderOptions = RenderOptions::default();
    }
}

impl Shot {
    fn pose(&self) -> RobotPose {
        let [x_m, y_m, yaw_rad] = self.pose;
        RobotPose { x_m, y_m, yaw_rad }
    }

    /// Refuses leans that are no angles; the rest is the view's.
    fn check(&self) -> PyResult<()> {
        let Self { alpha_rad, beta_rad, .. } = *self;
        if alpha_rad.is_finite() && beta_rad.is_finite() {
            return Ok(());
        }
        Err(invalid(format!("alpha_rad, beta_rad = {alpha_rad}, {beta_rad}, expected finite angles")))
    }

    fn view<'a>(&self, lens: &'a dyn Lens, camera: &CoreCamera) -> View<'a> {
        let mut view = View::new(lens, camera.width() as usize, camera.height() as usize, self.pose());
        view.robot_from_camera = self.robot_from_camera;
        view.tilt = Tilt::from_alpha_beta(self.alpha_rad, self.beta_rad);
        view.camera_height_m = self.camera_height_m.unwrap_or(view.camera_height_m);
        view
    }
}

pub(crate) fn pictures(py: Python<'_>, image: Image) -> PyResult<Pictures<'_>> {
    let (width, height) = (image.width_px, image.height_px);
    let gray = PyArray1::from_vec(py, image.gray).reshape([height, width])?;
    Ok((Array::new(gray), Array::new(PyArray1::from_vec(py, image.rgb).reshape([height, width, 3])?)))
}
