//! `Camera`: the core's camera over arrays, by name and keyword.

use nalgebra::{Matrix2x3, Matrix3x2, Vector2};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::camera::{self as core, Model, Parameter};

use crate::call::{call, exception, invalid};
use crate::convert;

/// A calibrated central camera. The face class in `tiltvp.cameras` adds a constructor for each model, and files.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct Camera {
    pub(crate) inner: core::Camera,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (model, *, width, height, max_theta_rad=None, mirror=false, **parameters))]
    fn new(
        model: &str,
        width: &Bound<'_, PyAny>,
        height: &Bound<'_, PyAny>,
        max_theta_rad: Option<f64>,
        mirror: bool,
        parameters: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let pixels = format!("a whole number of pixels from 1 to {}", u32::MAX);
        let (width, height) = (convert::whole(width, "width", &pixels)?, convert::whole(height, "height", &pixels)?);
        let mut named = Vec::new();
        for (key, value) in parameters.into_iter().flat_map(PyDictMethods::iter) {
            let key: String = key.extract()?;
            if value.is_none() {
                continue;
            }
            let parameter = if let Ok(scalar) = value.extract::<f64>() {
                Parameter::Scalar(scalar)
            } else {
                Parameter::List(convert::vector(&value, &key)?)
            };
            named.push((key, parameter));
        }
        let build = || {
            let model = Model::from_parameters(model, width, height, &named)?;
            let camera = core::Camera::new(width, height, model)?;
            let camera = match max_theta_rad {
                Some(limit) => camera.with_max_theta_rad(limit)?,
                None => camera,
            };
            Ok(if mirror { camera.mirrored() } else { camera })
        };
        Ok(Self { inner: build().map_err(|error| exception(&error))? })
    }

    /// The name of the lens model.
    #[getter]
    fn model(&self) -> &'static str {
        self.inner.model().name()
    }

    /// Columns of its images.
    #[getter]
    fn width(&self) -> u32 {
        self.inner.width()
    }

    /// Rows of its images.
    #[getter]
    fn height(&self) -> u32 {
        self.inner.height()
    }

    /// Largest angle in radians from the ray through the centre that has a pixel.
    #[getter]
    fn max_theta_rad(&self) -> f64 {
        self.inner.max_theta_rad()
    }

    /// Whether the image is seen in a mirror: the z component of bearings is negated.
    #[getter]
    fn mirror(&self) -> bool {
        self.inner.is_mirrored()
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

    /// Bearings (N, 3) or (3,) of any length to pixels (N, 2) or (2,); NaN where the lens does not see.
    fn project<'py>(&self, py: Python<'py>, bearings: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (bearings, single) = convert::rows::<3>(bearings, "bearings")?;
        let mut pixels = vec![[0.0; 2]; bearings.len()];
        call(py, || self.inner.project_all(&bearings, &mut pixels))?;
        convert::to_rows(py, &pixels, single)
    }

    /// Pixels (N, 2) or (2,) to unit bearings (N, 3) or (3,); NaN outside the valid set.
    fn unproject<'py>(&self, py: Python<'py>, pixels: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (pixels, single) = convert::rows::<2>(pixels, "pixels")?;
        let mut bearings = vec![[0.0; 3]; pixels.len()];
        call(py, || self.inner.unproject_all(&pixels, &mut bearings))?;
        convert::to_rows(py, &bearings, single)
    }

    /// Pixels and the Jacobians (N, 2, 3) or (2, 3), pixels per unit of the bearing.
    fn project_jacobian<'py>(&self, py: Python<'py>, bearings: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let (bearings, single) = convert::rows::<3>(bearings, "bearings")?;
        let mut pixels = vec![[0.0; 2]; bearings.len()];
        let mut jacobians = vec![Matrix2x3::zeros(); bearings.len()];
        call(py, || self.inner.project_jacobian_all(&bearings, &mut pixels, &mut jacobians))?;
        let flat: Vec<f64> = jacobians.iter().flat_map(|j| j.transpose().as_slice().to_vec()).collect();
        (convert::to_rows(py, &pixels, single)?, convert::to_matrices(py, &flat, [2, 3], single)?).into_pyobject(py)
    }

    /// Unit bearings and the Jacobians (N, 3, 2) or (3, 2), per pixel.
    fn unproject_jacobian<'py>(&self, py: Python<'py>, pixels: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let (pixels, single) = convert::rows::<2>(pixels, "pixels")?;
        let mut bearings = vec![[0.0; 3]; pixels.len()];
        let mut jacobians = vec![Matrix3x2::zeros(); pixels.len()];
        call(py, || self.inner.unproject_jacobian_all(&pixels, &mut bearings, &mut jacobians))?;
        let flat: Vec<f64> = jacobians.iter().flat_map(|j| j.transpose().as_slice().to_vec()).collect();
        (convert::to_rows(py, &bearings, single)?, convert::to_matrices(py, &flat, [3, 2], single)?).into_pyobject(py)
    }

    /// Fresh (H, W) bool: the pixels that have a bearing.
    fn valid_mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let (width, height) = (self.inner.width() as usize, self.inner.height() as usize);
        let mask = call(py, || {
            let seen = |i: usize| self.inner.unproject(&Vector2::new((i % width) as f64, (i / width) as f64)).is_some();
            Ok((0..width * height).map(seen).collect::<Vec<bool>>())
        })?;
        PyArray1::from_vec(py, mask).reshape([height, width])
    }

    /// The same camera with `mirror` turned over.
    fn mirrored<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let dict = Self::to_dict(slf)?;
        dict.set_item("mirror", !slf.get().inner.is_mirrored())?;
        slf.get_type().call((), Some(&dict))
    }

    /// The camera of the image resized by a factor.
    fn scaled<'py>(slf: &Bound<'py, Self>, factor: f64) -> PyResult<Bound<'py, PyAny>> {
        let inner = slf.get().inner.scaled(factor).map_err(|error| exception(&error))?;
        let dict = Self::to_dict(&Bound::new(slf.py(), Self { inner })?)?;
        slf.get_type().call((), Some(&dict))
    }

    /// Round trips and errors of the Jacobians, measured from the axis to the rim.
    fn conformance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = call(py, || Ok(core::conformance(&self.inner)))?;
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
    fn from_dict<'py>(cls: &Bound<'py, PyType>, values: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
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

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __hash__(slf: &Bound<'_, Self>) -> PyResult<isize> {
        Self::__repr__(slf)?.into_pyobject(slf.py())?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (Self::to_dict(slf)?,)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
