//! `LineExtractor`, `Lines`, `match_descriptors`, `LineTracker`: the core's vertical lines over arrays.

mod matching;
mod tracker;
mod values;

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::lines::{self as core, LineScratch};

pub(crate) use self::matching::{descriptor_distances, match_descriptors, match_wide, ssd_matrix, zncc_matrix};
pub(crate) use self::tracker::{LineTracker, TrackedLines};
pub(crate) use self::values::Lines;
use crate::array::Array;
use crate::call::{call_long, invalid};
use crate::camera::Camera;
use crate::convert::{self, Number, Word};
use crate::options;
use crate::reader::{self, image_reader};
use crate::scratch::ScratchPool;

/// Finds and describes the vertical lines of single images of one camera.
///
/// The tables of the camera are made once. `tiltvp.lines.LineExtractor` takes images of any usual kind.
///
/// `camera` is the camera whose images will come. `method` is "great-circle", for great circles through the vertical by
/// the camera model, or "radial", for lines through the rim's centre, as in Scaramuzza 2009. `robot_from_camera` is the
/// (3, 3) rotation R with v_robot = R v_camera, by default the identity: an upward camera, columns to the front.
/// `options` tells the options in force.
///
/// Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
/// that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images, and
/// where no pixel sees the band.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct LineExtractor {
    inner: core::LineExtractor,
    camera: Py<Camera>,
    scratch: ScratchPool<LineScratch>,
}

#[pymethods]
impl LineExtractor {
    #[new]
    #[pyo3(signature = (
        camera: "Camera", *, method=core::LineMethod::NAMES[0].into(), robot_from_camera: "ArrayLike | None" = None,
        **options: "Option"
    ))]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        method: Word,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let camera = reader::camera(camera)?;
        let rotation = reader::robot_from_camera(robot_from_camera)?;
        let mut parsed = method.choose(core::LineOptions::for_method)?;
        options::set(&mut parsed, options)?;
        let lens = camera.get().inner.clone();
        let inner = call_long(py, move || core::LineExtractor::new(lens, rotation, parsed))?;
        Ok(Self { inner, camera: camera.clone().unbind(), scratch: ScratchPool::default() })
    }

    /// Fresh (3, 3) float64: the rotation R in v_robot = R v_camera.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, self.inner.robot_from_camera())
    }

    /// Lowest and highest elevation that descriptors cover: what most directions see of the band.
    #[getter]
    fn band_rad(&self) -> (f64, f64) {
        self.inner.band_rad()
    }

    /// The lines of a C-contiguous (H, W) image of uint8; with a normal its standard deviation where known.
    #[pyo3(signature = (image: "NDArray[np.uint8]", normal: "ArrayLike | None", tilt_sigma_rad: "float | None"))]
    fn _extract(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        normal: Option<&Bound<'_, PyAny>>,
        tilt_sigma_rad: Option<Number>,
    ) -> PyResult<Lines> {
        let tilt_sigma_rad = tilt_sigma_rad.map(|number| number.of("tilt_sigma_rad")).transpose()?;
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let tilt = normal.map(|normal| convert::tilt(normal, "normal")).transpose()?;
        let lines = self.with_scratch(py, |scratch| {
            let mut lines = core::Lines::default();
            inner.extract(&view, tilt.as_ref(), tilt_sigma_rad, scratch, &mut lines).map(|()| lines)
        })?;
        Ok(Lines::from(lines))
    }

    /// (N, K): descriptors of the lines of such an image.
    #[pyo3(signature = (image: "NDArray[np.uint8]", lines) -> "NDArray[np.float32]")]
    fn _describe<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        lines: &Bound<'py, Lines>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let image = convert::gray(image, "image")?;
        let (view, inner, lines) = (convert::view(&image)?, &self.inner, &lines.get().inner);
        let mut values = Vec::new();
        self.with_scratch(py, |scratch| inner.describe(&view, lines, scratch, &mut values))?;
        PyArray1::from_vec(py, values).reshape([lines.lines.len(), inner.options().descriptor.values()])
    }

    /// (N, rows, columns): grey levels about the lines of such an image.
    #[pyo3(signature = (image: "NDArray[np.uint8]", lines) -> "NDArray[np.float32]")]
    fn _patches<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        lines: &Bound<'py, Lines>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = convert::gray(image, "image")?;
        let (view, inner, lines) = (convert::view(&image)?, &self.inner, &lines.get().inner);
        let (mut levels, mut size) = (Vec::new(), (0, 0));
        self.with_scratch(py, |scratch| {
            size = inner.patches(&view, lines, scratch, &mut levels)?;
            Ok(())
        })?;
        PyArray1::from_vec(py, levels).reshape([lines.lines.len(), size.0, size.1])
    }

    /// Lines at any bearings, without support.
    #[pyo3(signature = (bearing_rad: "ArrayLike", normal: "ArrayLike | None"))]
    fn _lines_at(&self, bearing_rad: &Bound<'_, PyAny>, normal: Option<&Bound<'_, PyAny>>) -> PyResult<Lines> {
        let bearings = convert::vector(bearing_rad, "bearing_rad")?;
        if bearings.iter().any(|bearing| !bearing.is_finite()) {
            return Err(invalid("bearing_rad: not finite, expected angles".to_owned()));
        }
        let tilt = normal.map(|normal| convert::tilt(normal, "normal")).transpose()?;
        Ok(Lines::from(self.inner.lines_at(&bearings, tilt.as_ref())))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("LineExtractor({}, method=\"{}\")", self.camera.bind(py).repr()?, self.method()))
    }
}

image_reader!(LineExtractor, LineScratch, robot_from_camera);
