//! `LineExtractor`, `Lines`, `match_descriptors`, `LineTracker`: the core's vertical lines over arrays.

mod matching;
mod options;
mod tracker;
mod values;

use std::sync::{Mutex, PoisonError};

use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::geometry::Tilt;
use tiltvp_core::lines::{self as core, LineScratch};

pub(crate) use self::matching::{descriptor_distances, match_descriptors, ssd_matrix, zncc_matrix};
pub(crate) use self::tracker::{LineTracker, TrackedLines};
pub(crate) use self::values::Lines;
use crate::call::{call, exception, invalid};
use crate::camera::Camera;
use crate::convert;

/// The tables of one camera and method, and the scratch of as many threads as have called at once.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct LineExtractor {
    inner: core::LineExtractor,
    camera: Py<Camera>,
    scratch: Mutex<Vec<LineScratch>>,
}

#[pymethods]
impl LineExtractor {
    #[new]
    #[pyo3(signature = (camera, *, method=core::LINE_METHODS[0], robot_from_camera=None, **options))]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        method: &str,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let Ok(camera) = camera.cast::<Camera>() else {
            return Err(invalid(format!("camera: {}, expected a tiltvp.Camera", camera.get_type().name()?)));
        };
        let rotation =
            robot_from_camera.map_or(Ok(Matrix3::identity()), |r| convert::matrix3(r, "robot_from_camera"))?;
        let parsed = options::parse(method, options)?;
        let lens = camera.get().inner.clone();
        let inner = call(py, move || core::LineExtractor::new(lens, rotation, parsed))?;
        Ok(Self { inner, camera: camera.clone().unbind(), scratch: Mutex::default() })
    }

    /// The camera whose images are read.
    #[getter]
    fn camera(&self, py: Python<'_>) -> Py<Camera> {
        self.camera.clone_ref(py)
    }

    /// The name of the method.
    #[getter]
    fn method(&self) -> &'static str {
        self.inner.options().method.name()
    }

    /// Fresh (3, 3) float64: the rotation R in v_robot = R v_camera.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        PyArray1::from_slice(py, self.inner.robot_from_camera().transpose().as_slice()).reshape([3, 3])
    }

    /// The options that are in force, by name, defaults included.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        options::in_force(py, self.inner.options())
    }

    /// Lowest and highest elevation that descriptors cover, radians.
    #[getter]
    fn band_rad(&self) -> (f64, f64) {
        self.inner.band_rad()
    }

    /// The lines of a C-contiguous `(H, W)` image of uint8.
    fn _extract(&self, py: Python<'_>, image: &Bound<'_, PyAny>, normal: Option<&Bound<'_, PyAny>>) -> PyResult<Lines> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let tilt = normal.map(tilt_from).transpose()?;
        let mut lines = core::Lines::default();
        self.with_scratch(py, |scratch| inner.extract(&view, tilt.as_ref(), scratch, &mut lines))?;
        Ok(Lines::new(lines))
    }

    /// `(N, K)` float32 of such an image.
    fn _describe<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        lines: &Bound<'py, Lines>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let image = convert::gray(image, "image")?;
        let (view, inner, lines) = (convert::view(&image)?, &self.inner, lines.get().inner());
        let mut values = Vec::new();
        self.with_scratch(py, |scratch| inner.describe(&view, lines, scratch, &mut values))?;
        PyArray1::from_vec(py, values).reshape([lines.lines.len(), inner.options().descriptor.values()])
    }

    /// `(N, rows, columns)` float32 of such an image.
    fn _patches<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        lines: &Bound<'py, Lines>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = convert::gray(image, "image")?;
        let (view, inner, lines) = (convert::view(&image)?, &self.inner, lines.get().inner());
        let (mut levels, mut size) = (Vec::new(), (0, 0));
        self.with_scratch(py, |scratch| {
            size = inner.patches(&view, lines, scratch, &mut levels)?;
            Ok(())
        })?;
        PyArray1::from_vec(py, levels).reshape([lines.lines.len(), size.0, size.1])
    }

    /// Lines at any bearings, without support.
    fn _lines_at(&self, bearing_rad: &Bound<'_, PyAny>, normal: Option<&Bound<'_, PyAny>>) -> PyResult<Lines> {
        let bearings = convert::vector(bearing_rad, "bearing_rad")?;
        if bearings.iter().any(|bearing| !bearing.is_finite()) {
            return Err(invalid("bearing_rad: not finite, expected angles".to_owned()));
        }
        let tilt = normal.map(tilt_from).transpose()?;
        Ok(Lines::new(self.inner.lines_at(&bearings, tilt.as_ref())))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("LineExtractor({}, method=\"{}\")", self.camera.bind(py).repr()?, self.method()))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = &other.get().inner;
            (self.inner.camera(), self.inner.robot_from_camera(), self.inner.options())
                == (other.camera(), other.robot_from_camera(), other.options())
        })
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        (self.camera.bind(py).hash()?, self.method()).into_pyobject(py)?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let keywords = this.options(py)?;
        keywords.set_item("method", this.method())?;
        keywords.set_item("robot_from_camera", this.robot_from_camera(py)?)?;
        let partial = py.import("functools")?.getattr("partial")?;
        (partial.call((slf.get_type(), this.camera(py)), Some(&keywords))?, PyTuple::empty(py)).into_pyobject(py)
    }
}

impl LineExtractor {
    /// Runs `work` without the interpreter, with a scratch that no other thread has.
    fn with_scratch(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut LineScratch) -> Result<(), tiltvp_core::Error> + Send,
    ) -> PyResult<()> {
        let free = self.scratch.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = free.unwrap_or_else(|| self.inner.scratch());
        let outcome = call(py, || work(&mut scratch));
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
        outcome
    }
}

/// The lean of a frame from its ground normal.
fn tilt_from(normal: &Bound<'_, PyAny>) -> PyResult<Tilt> {
    let normal = convert::vector3(normal, "normal")?;
    Tilt::from_normal(&normal).ok_or_else(|| {
        exception(&tiltvp_core::Error::argument("normal", format!("{normal:?}"), "a finite vector, not zero"))
    })
}
