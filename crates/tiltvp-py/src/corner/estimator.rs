//! `CornerPoseEstimator`: poses from the images of one camera or a pair, frame after frame.

use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::Matrix4;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::corner::{self as core, CornerMethod, EstimatorOptions, Frame, IncludedAngle};
use tiltvp_core::geometry::RigidMotion;

use super::detector::CornerDetector;
use super::estimate::CornerEstimate;
use super::memory;
use crate::call::{call, exception, invalid};
use crate::convert;

/// Names of the options.
const OPTIONS: [&str; 13] = [
    "gamma_rad",
    "gamma_sigma_rad",
    "right_handed",
    "down",
    "down_sigma_rad",
    "turn_sigma_rad",
    "forget_after",
    "agree_max_rad",
    "parallel_max_rad",
    "misfit_max",
    "distance_min_m",
    "distance_max_m",
    "probability_min",
];

/// The detectors of one camera or a pair, and the last pose. Comparable, and to be copied and pickled with what was seen.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct CornerPoseEstimator {
    inner: Mutex<core::CornerPoseEstimator>,
    left: Py<CornerDetector>,
    right: Option<Py<CornerDetector>>,
    left_from_right: Option<RigidMotion>,
    options: EstimatorOptions,
    coloured: bool,
}

#[pymethods]
impl CornerPoseEstimator {
    #[new]
    #[pyo3(signature = (left, right=None, left_from_right=None, **options))]
    fn new(
        py: Python<'_>,
        left: &Bound<'_, CornerDetector>,
        right: Option<&Bound<'_, CornerDetector>>,
        left_from_right: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let options = parse(options)?;
        let motion = left_from_right.map(|matrix| motion_from(matrix)).transpose()?;
        if right.is_some() != motion.is_some() {
            return Err(invalid("right, left_from_right: one without the other, expected both or none".to_owned()));
        }
        let own = left.get().inner().clone();
        let other = right.map(|right| right.get().inner().clone()).zip(motion);
        let (copy, coloured) = (options.clone(), matches!(own.options().method, CornerMethod::Coloured(_)));
        let inner = call(py, move || core::CornerPoseEstimator::new(own, other, copy))?;
        Ok(Self {
            inner: Mutex::new(inner),
            left: left.clone().unbind(),
            right: right.map(|right| right.clone().unbind()),
            left_from_right: motion,
            options,
            coloured,
        })
    }

    /// The detector of the left or only camera.
    #[getter]
    fn left(&self, py: Python<'_>) -> Py<CornerDetector> {
        self.left.clone_ref(py)
    }

    /// The detector of the right camera, or None.
    #[getter]
    fn right(&self, py: Python<'_>) -> Option<Py<CornerDetector>> {
        self.right.as_ref().map(|right| right.clone_ref(py))
    }

    /// Fresh (4, 4) float64, or None: the right camera's pose in the left one's frame.
    #[getter]
    fn left_from_right<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(motion) = &self.left_from_right else { return Ok(None) };
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&motion.rotation);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&motion.translation_m);
        PyArray1::from_slice(py, matrix.transpose().as_slice()).reshape([4, 4]).map(Some)
    }

    /// The options that are in force, by name, defaults included.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        in_force(py, &self.options)
    }

    /// Whether images in colour are wanted.
    #[getter]
    fn _coloured(&self) -> bool {
        self.coloured
    }

    /// Forgets the poses of the frames before.
    fn reset(&self) {
        self.lock().reset();
    }

    /// What one frame tells: C-contiguous images of uint8, (H, W, 3) or (H, W) as `_coloured` says.
    fn _observe(
        &self,
        py: Python<'_>,
        left: &Bound<'_, PyAny>,
        right: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<CornerEstimate> {
        let inner = &self.inner;
        let observe = |left: Frame<'_>, right: Option<Frame<'_>>| {
            let work = || inner.lock().unwrap_or_else(PoisonError::into_inner).observe(&left, right.as_ref());
            call(py, work).map(CornerEstimate::new)
        };
        if self.coloured {
            let left = convert::color(left, "left")?;
            let right = right.map(|right| convert::color(right, "right")).transpose()?;
            let view = right.as_ref().map(convert::color_view).transpose()?;
            observe(Frame::Color(convert::color_view(&left)?), view.map(Frame::Color))
        } else {
            let left = convert::gray(left, "left")?;
            let right = right.map(|right| convert::gray(right, "right")).transpose()?;
            let view = right.as_ref().map(convert::view).transpose()?;
            observe(Frame::Gray(convert::view(&left)?), view.map(Frame::Gray))
        }
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let left = self.left.bind(py).repr()?;
        Ok(match &self.right {
            Some(right) => format!("CornerPoseEstimator({left}, {})", right.bind(py).repr()?),
            None => format!("CornerPoseEstimator({left})"),
        })
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = other.get();
        let right = match (&self.right, &other.right) {
            (Some(own), Some(other)) => own.bind(py).eq(other)?,
            (own, other) => own.is_none() && other.is_none(),
        };
        if !right || !self.left.bind(py).eq(&other.left)? {
            return Ok(false);
        }
        // One at a time: an estimator may be compared with itself.
        let own = self.lock().clone();
        let inner = other.lock();
        Ok((own.options(), own.state(), &self.left_from_right)
            == (inner.options(), inner.state(), &other.left_from_right))
    }

    /// Sets what pickle has kept.
    fn __setstate__(slf: &Bound<'_, Self>, state: (u32, Option<Bound<'_, PyDict>>)) -> PyResult<()> {
        let (objects, track) = state;
        let track = track.map(|values| memory::from_dict(&slf.get_type(), &values)).transpose()?;
        let mut inner = slf.get().lock();
        *inner = inner.clone().with_state(objects, track);
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let cameras = (slf.get_type(), this.left(py), this.right(py), this.left_from_right(py)?);
        let make = py.import("functools")?.getattr("partial")?.call(cameras, Some(&this.options(py)?))?;
        let inner = this.lock();
        let (objects, track) = inner.state();
        let track = track.map(|track| memory::to_dict(py, track)).transpose()?;
        (make, PyTuple::empty(py), (objects, track)).into_pyobject(py)
    }
}

impl CornerPoseEstimator {
    fn lock(&self) -> MutexGuard<'_, core::CornerPoseEstimator> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn motion_from(value: &Bound<'_, PyAny>) -> PyResult<RigidMotion> {
    let (rows, _) = convert::rows::<4>(value, "left_from_right")?;
    let flat: Vec<f64> = rows.into_iter().flatten().collect();
    if flat.len() != 16 {
        return Err(invalid(format!("left_from_right: {} rows of 4, expected an array (4, 4)", flat.len() / 4)));
    }
    RigidMotion::from_matrix("left_from_right", &Matrix4::from_row_slice(&flat)).map_err(|error| exception(&error))
}

fn parse(given: Option<&Bound<'_, PyDict>>) -> PyResult<EstimatorOptions> {
    let mut options = EstimatorOptions::default();
    for (key, value) in given.into_iter().flat_map(PyDictMethods::iter) {
        let key: String = key.extract()?;
        let name = format!("option {key}");
        let number = || convert::whole::<f64>(&value, &name, "a number");
        match key.as_str() {
            "gamma_rad" => options.angle = IncludedAngle { gamma_rad: number()?, ..options.angle },
            "gamma_sigma_rad" => options.angle = IncludedAngle { sigma_rad: number()?, ..options.angle },
            "right_handed" => options.right_handed = convert::whole(&value, &name, "True, False or None")?,
            "down" if value.is_none() => options.down = None,
            "down" => {
                let down = convert::vector3(&value, "down")?.try_normalize(1e-12);
                options.down = Some(down.ok_or_else(|| invalid("down: no direction, expected a vector".to_owned()))?);
            }
            "down_sigma_rad" => options.down_sigma_rad = number()?,
            "turn_sigma_rad" => options.turn_sigma_rad = number()?,
            "forget_after" => options.forget_after = convert::whole(&value, &name, "a whole number of frames")?,
            "agree_max_rad" => options.agree_max_rad = number()?,
            "parallel_max_rad" => options.parallel_max_rad = number()?,
            "misfit_max" => options.misfit_max = number()?,
            "distance_min_m" => options.distance_m[0] = number()?,
            "distance_max_m" => options.distance_m[1] = number()?,
            "probability_min" => options.probability_min = number()?,
            _ => return Err(invalid(format!("option {key}: unknown, expected one of {}", OPTIONS.join(", ")))),
        }
    }
    Ok(options)
}

fn in_force<'py>(py: Python<'py>, options: &EstimatorOptions) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("gamma_rad", options.angle.gamma_rad)?;
    dict.set_item("gamma_sigma_rad", options.angle.sigma_rad)?;
    dict.set_item("right_handed", options.right_handed)?;
    dict.set_item("down", options.down.map(|down| PyArray1::from_slice(py, down.as_slice())))?;
    dict.set_item("down_sigma_rad", options.down_sigma_rad)?;
    dict.set_item("turn_sigma_rad", options.turn_sigma_rad)?;
    dict.set_item("forget_after", options.forget_after)?;
    dict.set_item("agree_max_rad", options.agree_max_rad)?;
    dict.set_item("parallel_max_rad", options.parallel_max_rad)?;
    dict.set_item("misfit_max", options.misfit_max)?;
    dict.set_item("distance_min_m", options.distance_m[0])?;
    dict.set_item("distance_max_m", options.distance_m[1])?;
    dict.set_item("probability_min", options.probability_min)?;
    Ok(dict)
}
