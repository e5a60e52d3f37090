//! `Camera`: the core's camera over arrays, by name and keyword.

use std::ops::Range;

use nalgebra::{Matrix2x3, Matrix3x2, Vector2};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple, PyType};
use tiltvp_core::Error;
use tiltvp_core::camera::{self as core, Kind, Model, Parameter};
use tiltvp_core::interrupt::check;

use crate::array::Array;
use crate::call::{call_by, call_long, exception, invalid};
use crate::convert::{self, Number, Word};
use crate::value::{frozen, getters};

/// Rows of a part, for which the slowest lens takes some 50 ms.
const PART: usize = 1 << 16;

/// Points and their Jacobians.
type Jacobians<'py> = (Array<'py, f64>, Array<'py, f64>);

/// A calibrated central camera: pixels to unit bearings and back. `Camera(model, width=..., height=..., ...)`.
///
/// Camera frame: z along the optical axis, x right (columns u), y down (rows v). Pixel centres are at integers. Frozen,
/// comparable, hashable, and to be pickled. `tiltvp.Camera` adds a constructor for each model, and calibration files.
///
/// `model` is one of `CAMERA_MODELS`; the model's parameters are keywords by name, None leaves one at its default.
/// `max_theta_rad` in (0, pi] limits the angle from the ray through the centre; by default the lens' own limit holds.
/// Raises `tiltvp.errors.CalibrationError` for a model, a parameter or a value that no such lens has.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Camera {
    pub(crate) inner: core::Camera,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (
        model, *, width: "int", height: "int", max_theta_rad=None, mirror: "bool" = false, **parameters: "ArrayLike | None"
    ))]
    fn new(
        model: Word,
        width: &Bound<'_, PyAny>,
        height: &Bound<'_, PyAny>,
        max_theta_rad: Option<Number>,
        #[pyo3(from_py_with = mirror_from)] mirror: bool,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let max_theta_rad = max_theta_rad.map(|number| number.of("max_theta_rad")).transpose()?;
        let pixels = format!("1 to {} pixels", core::LARGEST_SIDE_PX);
        let (width, height) = (convert::number(width, "width", &pixels)?, convert::number(height, "height", &pixels)?);
        let mut named = Vec::new();
        for (key, value) in parameters.into_iter().flat_map(PyDictMethods::iter) {
            let key: String = key.extract()?;
            if value.is_none() {
                continue;
            }
            let parameter = parameter(&value, &key)?;
            named.push((key, parameter));
        }
        let build = |model: &str| {
            let model = Model::from_parameters(model, width, height, &named)?;
            let camera = core::Camera::new(width, height, model)?;
            let camera = match max_theta_rad {
                Some(limit) => camera.with_max_theta_rad(limit)?,
                None => camera,
            };
            Ok(if mirror { camera.mirrored() } else { camera })
        };
        Ok(Self { inner: model.choose(build)? })
    }

    /// The model's parameters by name, defaults included: numbers and lists of numbers.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in self.inner.model().parameters() {
            match value {
                Parameter::Scalar(value) => dict.set_item(name, value)?,
                Parameter::List(values) => dict.set_item(name, values)?,
            }
        }
        Ok(dict)
    }

    /// Bearings (N, 3) or (3,) of any length but zero to pixels (u, v), (N, 2) or (2,) float64.
    ///
    /// Rows without an answer (behind the lens' reach, zero, not finite) are NaN. Pixels may lie outside the image.
    /// Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
    #[pyo3(signature = (bearings: "ArrayLike"))]
    fn project<'py>(&self, py: Python<'py>, bearings: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (bearings, single) = convert::rows::<3>(bearings, "bearings")?;
        let mut pixels = vec![[0.0; 2]; bearings.len()];
        in_parts(py, &bearings, |rows, places| self.inner.project_all(rows, &mut pixels[places]))?;
        convert::to_rows(py, &pixels, single)
    }

    /// Pixels (u, v), (N, 2) or (2,), to unit bearings, (N, 3) or (3,) float64; NaN rows outside the valid set.
    ///
    /// Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
    #[pyo3(signature = (pixels: "ArrayLike"))]
    fn unproject<'py>(&self, py: Python<'py>, pixels: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let (pixels, single) = convert::rows::<2>(pixels, "pixels")?;
        let mut bearings = vec![[0.0; 3]; pixels.len()];
        in_parts(py, &pixels, |rows, places| self.inner.unproject_all(rows, &mut bearings[places]))?;
        convert::to_rows(py, &bearings, single)
    }

    /// Pixels as `project` gives them, and d pixel / d bearing at the given bearings: (N, 2, 3), (2, 3).
    #[pyo3(signature = (bearings: "ArrayLike"))]
    fn project_jacobian<'py>(&self, py: Python<'py>, bearings: &Bound<'py, PyAny>) -> PyResult<Jacobians<'py>> {
        let (bearings, single) = convert::rows::<3>(bearings, "bearings")?;
        let mut pixels = vec![[0.0; 2]; bearings.len()];
        let mut jacobians = vec![Matrix2x3::zeros(); bearings.len()];
        in_parts(py, &bearings, |rows, places| {
            self.inner.project_jacobian_all(rows, &mut pixels[places.clone()], &mut jacobians[places])
        })?;
        Ok((convert::to_rows(py, &pixels, single)?, convert::to_matrices(py, &jacobians, single)?))
    }

    /// Bearings as `unproject` gives them, and d bearing / d pixel: (N, 3, 2) or (3, 2).
    #[pyo3(signature = (pixels: "ArrayLike"))]
    fn unproject_jacobian<'py>(&self, py: Python<'py>, pixels: &Bound<'py, PyAny>) -> PyResult<Jacobians<'py>> {
        let (pixels, single) = convert::rows::<2>(pixels, "pixels")?;
        let mut bearings = vec![[0.0; 3]; pixels.len()];
        let mut jacobians = vec![Matrix3x2::zeros(); pixels.len()];
        in_parts(py, &pixels, |rows, places| {
            self.inner.unproject_jacobian_all(rows, &mut bearings[places.clone()], &mut jacobians[places])
        })?;
        Ok((convert::to_rows(py, &bearings, single)?, convert::to_matrices(py, &jacobians, single)?))
    }

    /// Fresh (H, W) bool: the pixels that have a bearing.
    fn valid_mask<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, bool>> {
        let (width, height) = (self.inner.width() as usize, self.inner.height() as usize);
        let mask = call_long(py, || {
            self.inner.check_memory(2)?;
            let seen = |i: usize| {
                if i.is_multiple_of(width) {
                    check();
                }
                self.inner.unproject(&Vector2::new((i % width) as f64, (i / width) as f64)).is_some()
            };
            Ok((0..width * height).map(seen).collect::<Vec<bool>>())
        })?;
        Ok(Array::new(PyArray1::from_vec(py, mask).reshape([height, width])?))
    }

    /// The same camera with `mirror` turned over.
    #[pyo3(signature = () -> "Self")]
    fn mirrored<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let dict = Self::to_dict(slf)?;
        dict.set_item("mirror", !slf.get().inner.is_mirrored())?;
        slf.get_type().call((), Some(&dict))
    }

    /// The camera of the image resized by `factor`: what was at u is at factor (u + 1/2) - 1/2.
    ///
    /// The size is rounded to whole pixels. Raises `tiltvp.errors.InvalidInputError` for a factor that is not positive.
    #[pyo3(signature = (factor) -> "Self")]
    fn scaled<'py>(slf: &Bound<'py, Self>, factor: f64) -> PyResult<Bound<'py, PyAny>> {
        let inner = slf.get().inner.scaled(factor).map_err(|error| exception(&error))?;
        let dict = Self::to_dict(&Bound::new(slf.py(), Self { inner })?)?;
        slf.get_type().call((), Some(&dict))
    }

    /// Round trips and errors of the analytic Jacobians, measured from the axis to the rim.
    ///
    /// Counts `pixels_tested`, `pixels_outside`, `pixels_lost` (0 for a camera that is right); the largest errors
    /// `max_round_trip_px`, `max_round_trip_rad`, `max_jacobian_error_relative` (against central differences); and
    /// `rim_theta_rad`, the largest angle that was tested.
    #[pyo3(signature = () -> "dict[str, float]")]
    fn conformance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = call_long(py, || Ok(core::conformance(&self.inner)))?;
        let dict = PyDict::new(py);
        dict.set_item("pixels_tested", found.pixels_tested)?;
        dict.set_item("pixels_outside", found.pixels_outside)?;
        dict.set_item("pixels_lost", found.pixels_lost)?;
        dict.set_item("max_round_trip_px", found.max_round_trip_px)?;
        dict.set_item("max_round_trip_rad", found.max_round_trip_rad)?;
        dict.set_item("max_jacobian_error_relative", found.max_jacobian_error_relative)?;
        dict.set_item("rim_theta_rad", found.rim_theta_rad)?;
        Ok(dict)
    }

    /// The keywords that make the camera, with `model` among them.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let camera = slf.get();
        let dict = PyDict::new(slf.py());
        dict.set_item("model", camera.model())?;
        dict.set_item("width", camera.width())?;
        dict.set_item("height", camera.height())?;
        dict.set_item("max_theta_rad", camera.max_theta_rad())?;
        dict.set_item("mirror", camera.mirror())?;
        dict.update(camera.parameters(slf.py())?.as_mapping())?;
        Ok(dict)
    }

    /// The camera of a dict as `to_dict` makes it.
    #[classmethod]
    #[pyo3(signature = (values: "dict[str, Any]") -> "Self")]
    fn from_dict<'py>(cls: &Bound<'py, PyType>, values: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let values = convert::dict(values, "values")?;
        for key in ["model", "width", "height"] {
            if !values.contains(key)? {
                return Err(invalid(format!("values: \"{key}\" is missing, expected a dict as to_dict makes it")));
            }
        }
        cls.call((), Some(values))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let dict = Self::to_dict(slf)?;
        dict.del_item("model")?;
        let mut items = Vec::new();
        for (key, value) in dict.iter() {
            items.push(format!("{key}={}", value.repr()?));
        }
        Ok(format!("Camera(\"{}\", {})", slf.get().model(), items.join(", ")))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (Self::to_dict(slf)?,)).into_pyobject(slf.py())
    }
}

getters! {
    Camera as own {
        /// The name of the lens model.
        model: &'static str = own.inner.model().name(),
        /// Columns of its images.
        width: u32 = own.inner.width(),
        /// Rows of its images.
        height: u32 = own.inner.height(),
        /// Largest angle in radians from the ray through the centre that has a pixel.
        max_theta_rad: f64 = own.inner.max_theta_rad(),
        /// Whether the image is seen in a mirror: the z component of bearings is negated.
        mirror: bool = own.inner.is_mirrored(),
    }
}

frozen!(Camera, |own| &own.inner, |own| (own.model(), own.width(), own.height()));

/// Works on many rows part by part, between which a signal is heard.
fn in_parts<R: Sync>(
    py: Python<'_>,
    rows: &[R],
    mut work: impl FnMut(&[R], Range<usize>) -> Result<(), Error> + Send,
) -> PyResult<()> {
    call_by(py, rows.len() > PART, || {
        for (part, first) in rows.chunks(PART).zip((0..).step_by(PART)) {
            check();
            work(part, first..first + part.len())?;
        }
        Ok(())
    })
}

/// True or False, and no other value that is true or false.
fn mirror_from(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    convert::taken(value, "mirror", "True or False")
}

/// A number, or numbers in order. What is no real number is neither.
fn parameter(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Parameter> {
    if convert::is_no_real(value) {
        return Err(invalid(format!("{name}: {value}, expected one number or an array (N,)")));
    }
    match value.extract::<f64>() {
        Ok(scalar) => Ok(Parameter::Scalar(scalar)),
        Err(_) => convert::vector(value, name).map(Parameter::List),
    }
}

/// Raises what `Camera` raises for these numbers. `parameters` has the names of the lens' parameters alone.
#[pyfunction]
#[pyo3(signature = (model, width: "int", height: "int", parameters: "Mapping[str, ArrayLike]", max_theta_rad=None))]
pub(crate) fn check_camera(
    model: Word,
    width: &Bound<'_, PyAny>,
    height: &Bound<'_, PyAny>,
    parameters: &Bound<'_, PyDict>,
    max_theta_rad: Option<Number>,
) -> PyResult<()> {
    Camera::new(model, width, height, max_theta_rad, false, Some(parameters)).map(|_| ())
}

/// What the lens model of a name declares: `name`, `doc`, and its `parameters` in order, each with `name`, `required`,
/// `default`, `is_list` and `doc`.
#[pyfunction]
pub(crate) fn lens_schema<'py>(py: Python<'py>, model: &str) -> PyResult<Bound<'py, PyDict>> {
    let schema = Model::schema_of(model).map_err(|error| exception(&error))?;
    let mut parameters = Vec::new();
    for one in schema.parameters {
        let dict = PyDict::new(py);
        dict.set_item("name", one.name)?;
        dict.set_item("required", one.kind.is_required())?;
        match one.kind {
            Kind::Optional(default) => dict.set_item("default", default)?,
            Kind::OptionalList => dict.set_item("default", PyList::empty(py))?,
            Kind::Required | Kind::RequiredList => dict.set_item("default", py.None())?,
        }
        dict.set_item("is_list", one.kind.is_list())?;
        dict.set_item("doc", one.doc)?;
        parameters.push(dict);
    }
    let dict = PyDict::new(py);
    dict.set_item("name", schema.name)?;
    dict.set_item("doc", schema.doc)?;
    dict.set_item("parameters", parameters)?;
    Ok(dict)
}
