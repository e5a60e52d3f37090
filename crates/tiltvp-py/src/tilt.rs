//! `TiltEstimator`, `TiltEstimate`, `common_direction`: the core's tilt over arrays.

mod correction;
mod direction;
mod estimate;
mod filter;
mod filtered;
mod image_edges;
mod options;
mod report;
mod sampling;
mod values;

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::geometry::{Tilt, WheelLayout};
use tiltvp_core::tilt::{self as core, Scratch};

pub(crate) use self::correction::{
    AffineCorrection, PosteriorCorrection, PriorOfTilt, apply_correction, train_affine, train_factor, train_posterior,
};
pub(crate) use self::direction::{CommonDirection, common_direction};
pub(crate) use self::estimate::{EdgeElements, TiltEstimate};
pub(crate) use self::filter::TiltFilter;
pub(crate) use self::filtered::{FilterStep, FilteredTilt};
pub(crate) use self::image_edges::ImageEdges;
pub(crate) use self::report::FitReport;
use crate::call::{call, exception, invalid};
use crate::camera::Camera;
use crate::convert;

/// The tables of one camera and method, and the scratch of as many threads as have called at once.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct TiltEstimator {
    inner: core::TiltEstimator,
    camera: Py<Camera>,
    /// The options that the user has named.
    given: Vec<String>,
    /// Shared by the estimators that look at the same pixels.
    scratch: Arc<Mutex<Vec<Scratch>>>,
}

#[pymethods]
impl TiltEstimator {
    #[new]
    #[pyo3(signature = (camera, *, method=core::METHODS[0], robot_from_camera=None, _like=None, **options))]
    #[expect(clippy::used_underscore_binding, reason = "a keyword of the package's own")]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        method: &str,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        _like: Option<&Bound<'_, Self>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if let Some(like) = _like {
            return like.get().with_options(py, options);
        }
        let Ok(camera) = camera.cast::<Camera>() else {
            return Err(invalid(format!("camera: {}, expected a tiltvp.Camera", camera.get_type().name()?)));
        };
        let rotation =
            robot_from_camera.map_or(Ok(Matrix3::identity()), |r| convert::matrix3(r, "robot_from_camera"))?;
        let parsed = options::parse(method, options)?;
        let lens = camera.get().inner.clone();
        let inner = call(py, move || core::TiltEstimator::new(lens, rotation, parsed))?;
        let given = options.map_or(Ok(Vec::new()), |options| options.keys().extract())?;
        Ok(Self { inner, camera: camera.clone().unbind(), given, scratch: Arc::default() })
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

    /// How many pixels are looked at: those of the elevation band, clear of the rim, the border and the mask.
    #[getter]
    fn region_pixels(&self) -> usize {
        self.inner.region_pixels()
    }

    /// The tilt of a C-contiguous `(H, W)` image of uint8.
    fn _estimate(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<TiltEstimate> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let mut scratch = self.borrow_scratch();
        let estimate = call(py, || inner.estimate(&view, &mut scratch));
        self.return_scratch(scratch);
        Ok(TiltEstimate::from(estimate?))
    }

    /// The edge pixels of a C-contiguous `(H, W)` image of uint8.
    fn _detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<ImageEdges> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let mut scratch = self.borrow_scratch();
        let edges = call(py, || inner.detect(&view, &mut scratch));
        self.return_scratch(scratch);
        Ok(ImageEdges::new(edges?, self.camera.clone_ref(py)))
    }

    /// The tilt of the image that the edges are of.
    fn estimate_edges(&self, py: Python<'_>, edges: &Bound<'_, PyAny>) -> PyResult<TiltEstimate> {
        let Ok(edges) = edges.cast::<ImageEdges>() else {
            return Err(invalid(format!("edges: {}, expected a tiltvp.ImageEdges", edges.get_type().name()?)));
        };
        let (edges, inner) = (edges.get().inner(), &self.inner);
        let mut scratch = self.borrow_scratch();
        let estimate = call(py, || inner.estimate_edges(edges, &mut scratch));
        self.return_scratch(scratch);
        Ok(TiltEstimate::from(estimate?))
    }

    /// The tilt of an image and its edge pixels.
    fn _estimate_with_edges(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<(TiltEstimate, EdgeElements)> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let mut scratch = self.borrow_scratch();
        let outcome = call(py, || inner.estimate_with_elements(&view, &mut scratch));
        self.return_scratch(scratch);
        let (estimate, elements) = outcome?;
        let size = (inner.camera().width() as usize, inner.camera().height() as usize);
        Ok((TiltEstimate::from(estimate), EdgeElements::new(elements, size)))
    }

    /// The tilts of many C-contiguous `(H, W)` images of uint8.
    #[pyo3(signature = (images, *, threads=None))]
    #[expect(clippy::needless_pass_by_value, reason = "what the interpreter hands over is owned")]
    fn _estimate_many(
        &self,
        py: Python<'_>,
        images: Vec<Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<TiltEstimate>> {
        let threads = threads.map_or(Ok(1), |threads| convert::whole(threads, "threads", "a whole number from 1"))?;
        let named = images.iter().enumerate().map(|(i, image)| convert::gray(image, &format!("images[{i}]")));
        let arrays = named.collect::<PyResult<Vec<_>>>()?;
        let views = arrays.iter().map(convert::view).collect::<PyResult<Vec<_>>>()?;
        let estimates = call(py, || self.inner.estimate_many(&views, threads))?;
        Ok(estimates.into_iter().map(TiltEstimate::from).collect())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let mut text = format!("TiltEstimator({}, method=\"{}\"", self.camera.bind(py).repr()?, self.method());
        let options = self.options(py)?;
        for key in &self.given {
            let value = convert::raw_item(&options, key)?;
            let is_mask = key == "mask" && !value.is_none();
            let value = if is_mask { "<mask>".to_owned() } else { value.repr()?.to_string() };
            text.extend([", ", key, "=", &value]);
        }
        Ok(text + ")")
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

impl TiltEstimator {
    /// An estimator of the same camera with some options changed, which shares tables and scratch where they are the same.
    fn with_options(&self, py: Python<'_>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut options = self.inner.options().clone();
        options::change(&mut options, changes)?;
        let inner = call(py, || self.inner.with_options(options))?;
        let mut given = self.given.clone();
        for key in changes.into_iter().flat_map(PyDictMethods::keys) {
            let key: String = key.extract()?;
            if !given.contains(&key) {
                given.push(key);
            }
        }
        let shares = inner.shares_scratch_with(&self.inner);
        let scratch = if shares { Arc::clone(&self.scratch) } else { Arc::default() };
        Ok(Self { inner, camera: self.camera.clone_ref(py), given, scratch })
    }

    fn borrow_scratch(&self) -> Scratch {
        let free = self.scratch.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| self.inner.scratch())
    }

    fn return_scratch(&self, scratch: Scratch) {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}

/// A tilt from the ground normal in the robot frame.
fn tilt_from(normal: &Bound<'_, PyAny>, name: &str) -> PyResult<Tilt> {
    let vector = convert::vector3(normal, name)?;
    Tilt::from_normal(&vector)
        .ok_or_else(|| invalid(format!("{name}: {:?}, expected a finite vector that is not zero", vector.as_slice())))
}

/// `(H, W, 2)` float32: where each pixel of the upright image is found in the leaning one.
#[pyfunction]
#[pyo3(signature = (camera, normal, *, robot_from_camera=None))]
pub(crate) fn level_map<'py>(
    py: Python<'py>,
    camera: &Bound<'py, Camera>,
    normal: &Bound<'py, PyAny>,
    robot_from_camera: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let tilt = tilt_from(normal, "normal")?;
    let rotation = robot_from_camera.map_or(Ok(Matrix3::identity()), |r| convert::matrix3(r, "robot_from_camera"))?;
    let camera = &camera.get().inner;
    let map = call(py, || core::level_map(camera, &rotation, &tilt))?;
    let shape = [camera.height() as usize, camera.width() as usize, 2];
    Ok(PyArray1::from_slice(py, map.as_flattened()).reshape(shape)?.into_any())
}

/// The angle in radians between two ground normals, eq. 44.
#[pyfunction]
pub(crate) fn tilt_error_rad(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(tilt_from(a, "a")?.angle_to(&tilt_from(b, "b")?))
}

/// `(3,)` ground normal of a lean, eq. 1.
#[pyfunction]
pub(crate) fn normal_from_alpha_beta(
    py: Python<'_>,
    alpha_rad: f64,
    beta_rad: f64,
) -> PyResult<Bound<'_, PyArray1<f64>>> {
    if !(alpha_rad.is_finite() && beta_rad.is_finite()) {
        return Err(invalid(format!("alpha_rad, beta_rad = {alpha_rad}, {beta_rad}, expected finite angles")));
    }
    Ok(PyArray1::from_slice(py, Tilt::from_alpha_beta(alpha_rad, beta_rad).normal().as_slice()))
}

/// `(alpha_rad, beta_rad)` of a robot whose wheels stand at these heights, eqs. 42 and 43.
#[pyfunction]
#[pyo3(signature = (*, left_m, right_m, caster_m, half_track_m, caster_behind_m))]
pub(crate) fn tilt_from_wheel_heights(
    left_m: f64,
    right_m: f64,
    caster_m: f64,
    half_track_m: f64,
    caster_behind_m: f64,
) -> PyResult<(f64, f64)> {
    let layout = WheelLayout { half_track_m, caster_behind_m };
    let tilt = layout.tilt(left_m, right_m, caster_m).map_err(|error| exception(&error))?;
    Ok((tilt.alpha_rad(), tilt.beta_rad()))
}

/// `(3, 3)` rotation from the upright robot's frame to the leaning one's, without a turn about the vertical.
#[pyfunction]
pub(crate) fn leaning_from_upright<'py>(
    py: Python<'py>,
    normal: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rotation = tilt_from(normal, "normal")?.leaning_from_upright();
    PyArray1::from_slice(py, rotation.transpose().as_slice()).reshape([3, 3])
}
