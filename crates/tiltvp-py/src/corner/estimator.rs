//! `CornerPoseEstimator`: poses from the images of one camera or a pair, frame after frame.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use nalgebra::{Matrix4, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::Error;
use tiltvp_core::corner::{
    self as core, CameraTurn, CornerMethod, CornerNames, EstimatorOptions, Frame, FrameKnowledge, GravityDirection,
    Track,
};
use tiltvp_core::geometry::RigidMotion;
use tiltvp_core::interrupt::check;

use super::detector::CornerDetector;
use super::estimate::CornerEstimate;
use super::memory;
use crate::array::Array;
use crate::call::{call_long, invalid};
use crate::convert;
use crate::options;
use crate::scratch::is_large;
use crate::shared::Shared;

/// Poses from the images of one camera or a pair; `tiltvp.corner.CornerPoseEstimator` takes cameras and any images.
///
/// It holds the detectors of one camera or a pair, and the last pose. Comparable, and to be copied and pickled with
/// what was seen.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct CornerPoseEstimator {
    inner: Shared<core::CornerPoseEstimator>,
    left: Py<CornerDetector>,
    right: Option<Py<CornerDetector>>,
    left_from_right: Option<RigidMotion>,
    options: EstimatorOptions,
    coloured: bool,
}

#[pymethods]
impl CornerPoseEstimator {
    #[new]
    #[pyo3(signature = (left, right=None, left_from_right: "ArrayLike | None" = None, **options: "Option"))]
    fn new(
        py: Python<'_>,
        left: &Bound<'_, CornerDetector>,
        right: Option<&Bound<'_, CornerDetector>>,
        left_from_right: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut parsed = EstimatorOptions::default();
        options::set(&mut parsed, options)?;
        if let Some(down) = &mut parsed.down {
            *down = direction(down, "down")?;
        }
        let motion = left_from_right.map(|matrix| convert::rigid_motion(matrix, "left_from_right")).transpose()?;
        if right.is_some() != motion.is_some() {
            return Err(invalid("right, left_from_right: one without the other, expected both or none".to_owned()));
        }
        let own = left.get().inner().clone();
        let other = right.map(|right| right.get().inner().clone()).zip(motion);
        let coloured = !matches!(own.options().method, CornerMethod::General(_));
        let inner = call_long(py, move || core::CornerPoseEstimator::new(own, other, parsed))?;
        let options = inner.options().clone();
        Ok(Self {
            inner: Shared::new(inner),
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
    fn left_from_right<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        let Some(motion) = &self.left_from_right else { return Ok(None) };
        let mut matrix = Matrix4::identity();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&motion.rotation);
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&motion.translation_m);
        convert::to_matrix(py, &matrix).map(Some)
    }

    /// The options that are in force, by name, defaults included.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        options::in_force(py, &self.options)
    }

    /// Whether images in colour are wanted.
    #[getter]
    fn _coloured(&self) -> bool {
        self.coloured
    }

    /// Forgets the poses of the frames before and the corners that have a name; no name is given again.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.inner.change(py, |estimator| {
            estimator.reset();
            Ok(())
        })
    }

    /// What one frame tells: C-contiguous images of uint8, (H, W, 3) or (H, W) as `_coloured` says; which way is
    /// down (3,) with its standard deviation, and the turn since the frame before (3, 3) with its covariance (3, 3).
    #[pyo3(signature = (
        left: "NDArray[np.uint8]", right: "NDArray[np.uint8] | None", gravity: "tuple[ArrayLike, float] | None" = None,
        gyro: "tuple[ArrayLike, ArrayLike] | None" = None
    ))]
    fn _observe(
        &self,
        py: Python<'_>,
        left: &Bound<'_, PyAny>,
        right: Option<&Bound<'_, PyAny>>,
        gravity: Option<(Bound<'_, PyAny>, f64)>,
        gyro: Option<(Bound<'_, PyAny>, Bound<'_, PyAny>)>,
    ) -> PyResult<CornerEstimate> {
        let known = knowledge(gravity, gyro)?;
        let observe = |left: Frame<'_>, right: Option<Frame<'_>>| {
            let change = |estimator: &mut _| observe(estimator, &left, right.as_ref(), &known);
            self.inner.change_by(py, is_large(self.left.get().inner().camera()), change).map(CornerEstimate::from)
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

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, Self>) -> PyResult<bool> {
        let other = other.get();
        let right = match (&self.right, &other.right) {
            (Some(own), Some(other)) => own.bind(py).eq(other)?,
            (own, other) => own.is_none() && other.is_none(),
        };
        if !right || !self.left.bind(py).eq(&other.left)? {
            return Ok(false);
        }
        // One at a time: an estimator may be compared with itself.
        let own = self.state(py);
        Ok((&self.options, own, &self.left_from_right) == (&other.options, other.state(py), &other.left_from_right))
    }

    /// Sets what pickle has kept.
    fn __setstate__(slf: &Bound<'_, Self>, state: (u32, Option<Bound<'_, PyDict>>, Bound<'_, PyDict>)) -> PyResult<()> {
        let (objects, track, names) = state;
        let track = track.map(|values| memory::from_dict(&values)).transpose()?;
        let names = memory::names_from_dict(&names)?;
        slf.get().inner.change(slf.py(), |estimator| {
            estimator.set_state(objects, track, names);
            Ok(())
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let cameras = (slf.get_type(), this.left(py), this.right(py), this.left_from_right(py)?);
        let make = py.import("functools")?.getattr("partial")?.call(cameras, Some(&this.options(py)?))?;
        let (objects, track, names) = this.state(py);
        let track = track.map(|track| memory::to_dict(py, &track)).transpose()?;
        (make, PyTuple::empty(py), (objects, track, memory::names_to_dict(py, &names)?)).into_pyobject(py)
    }
}

fn direction(vector: &Vector3<f64>, name: &str) -> PyResult<Vector3<f64>> {
    vector.try_normalize(1e-12).ok_or_else(|| invalid(format!("{name}: no direction, expected a vector")))
}

fn knowledge(
    gravity: Option<(Bound<'_, PyAny>, f64)>,
    gyro: Option<(Bound<'_, PyAny>, Bound<'_, PyAny>)>,
) -> PyResult<FrameKnowledge> {
    let gravity = gravity.map(|(down, sigma_rad)| {
        let down = direction(&convert::vector3(&down, "gravity")?, "gravity")?;
        PyResult::Ok(GravityDirection { down, sigma_rad })
    });
    let turn = gyro.map(|(before_from_now, covariance)| {
        let before_from_now = convert::matrix3(&before_from_now, "gyro")?;
        PyResult::Ok(CameraTurn { before_from_now, covariance: convert::matrix3(&covariance, "gyro")? })
    });
    Ok(FrameKnowledge { gravity: gravity.transpose()?, turn: turn.transpose()? })
}

/// What a frame tells. Where that is ended the estimator is one that has not begun with the frame.
fn observe(
    estimator: &mut core::CornerPoseEstimator,
    left: &Frame<'_>,
    right: Option<&Frame<'_>>,
    known: &FrameKnowledge,
) -> Result<core::CornerEstimate, Error> {
    let (objects, track, names) = owned(estimator.state());
    let look = || {
        let seen = estimator.observe(left, right, known)?;
        check();
        Ok(seen)
    };
    catch_unwind(AssertUnwindSafe(look)).unwrap_or_else(|ended| {
        let (left, right) = (estimator.left().clone(), estimator.right().cloned());
        *estimator = core::CornerPoseEstimator::new(left, right, estimator.options().clone())?;
        estimator.set_state(objects, track, names);
        resume_unwind(ended)
    })
}

fn owned((objects, track, names): (u32, Option<&Track>, &CornerNames)) -> (u32, Option<Track>, CornerNames) {
    (objects, track.cloned(), names.clone())
}

impl CornerPoseEstimator {
    /// The number of objects so far, the track of the last one, and the corners that have a name.
    fn state(&self, py: Python<'_>) -> (u32, Option<Track>, CornerNames) {
        self.inner.look(py, |estimator| owned(estimator.state()))
    }
}
