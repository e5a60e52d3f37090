//! `TiltEstimator`, `TiltEstimate`, `common_direction`: the core's tilt over arrays.

pub(crate) mod correction;
mod direction;
mod estimate;
mod filter;
mod filtered;
mod image_edges;
mod report;
mod values;

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::geometry::{Tilt, WheelLayout};
use tiltvp_core::tilt::{self as core, Scratch};

pub(crate) use self::correction::{
    AffineCorrection, PosteriorCorrection, PriorOfTilt, apply_correction, train_affine, train_factor, train_posterior,
};
pub(crate) use self::direction::{CommonDirection, common_direction};
pub(crate) use self::estimate::{EdgeElements, TiltAlternative, TiltEstimate};
pub(crate) use self::filter::TiltFilter;
pub(crate) use self::filtered::{FilterStep, FilteredTilt};
pub(crate) use self::image_edges::ImageEdges;
pub(crate) use self::report::FitReport;
use crate::array::Array;
use crate::call::{call_long, exception, invalid};
use crate::camera::Camera;
use crate::convert::{self, Number, Word};
use crate::options;
use crate::reader::{self, image_reader};
use crate::scratch::ScratchPool;

/// Estimates how far and in which direction a robot leans from single images of one camera.
///
/// The tables of the camera are made once. `tiltvp.TiltEstimator` takes images of any usual kind.
///
/// `camera` is the camera whose images will come, `method` one of `METHODS`, `robot_from_camera` the (3, 3) rotation R
/// with v_robot = R v_camera, by default the identity: an upward camera, columns to the front. Options and their
/// defaults depend on the method; `options` tells those in force.
///
/// Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
/// that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images, and
/// where no pixel sees the band.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct TiltEstimator {
    inner: core::TiltEstimator,
    camera: Py<Camera>,
    /// Shared by the estimators that look at the same pixels.
    scratch: Arc<ScratchPool<Scratch>>,
}

#[pymethods]
impl TiltEstimator {
    #[new]
    #[pyo3(signature = (
        camera: "Camera", *, method=core::METHODS[0].into(), robot_from_camera: "ArrayLike | None" = None, _like=None,
        **options: "Option"
    ))]
    #[expect(clippy::used_underscore_binding, reason = "a keyword of the package's own")]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        method: Word,
        robot_from_camera: Option<&Bound<'_, PyAny>>,
        _like: Option<&Bound<'_, Self>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if let Some(like) = _like {
            return like.get().with_options(py, options);
        }
        let camera = reader::camera(camera)?;
        let rotation = reader::robot_from_camera(robot_from_camera)?;
        let mut parsed = method.choose(core::TiltOptions::for_method)?;
        options::set(&mut parsed, options)?;
        let lens = camera.get().inner.clone();
        let inner = call_long(py, move || core::TiltEstimator::new(lens, rotation, parsed))?;
        Ok(Self { inner, camera: camera.clone().unbind(), scratch: Arc::default() })
    }

    /// Fresh (3, 3) float64: the rotation R in v_robot = R v_camera.
    #[getter]
    fn robot_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, self.inner.robot_from_camera())
    }

    /// How many pixels are looked at: those of the elevation band, clear of the rim, the border and the mask.
    #[getter]
    fn region_pixels(&self) -> usize {
        self.inner.region_pixels()
    }

    /// The tilt of a C-contiguous (H, W) image of uint8.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _estimate(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<TiltEstimate> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        Ok(self.with_scratch(py, |scratch| inner.estimate(&view, scratch))?.into())
    }

    /// The edge pixels of a C-contiguous `(H, W)` image of uint8.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<ImageEdges> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let edges = self.with_scratch(py, |scratch| inner.detect(&view, scratch))?;
        Ok(ImageEdges::new(edges, self.camera.clone_ref(py)))
    }

    /// The tilt of the image that the edges are of, the same to the last bit as the image itself gives.
    ///
    /// `edges` may be those of any estimator with equal camera, robot_from_camera, mask and edge options (gradient_min,
    /// smoothing_px, elevations, margin_px, row_stride); else `tiltvp.errors.InvalidInputError` says what differs.
    /// Other threads run meanwhile.
    #[pyo3(signature = (edges: "ImageEdges"))]
    fn estimate_edges(&self, py: Python<'_>, edges: &Bound<'_, PyAny>) -> PyResult<TiltEstimate> {
        let Ok(edges) = edges.cast::<ImageEdges>() else {
            return Err(invalid(format!("edges: {}, expected a tiltvp.ImageEdges", edges.get_type().name()?)));
        };
        let (edges, inner) = (edges.get().inner(), &self.inner);
        Ok(self.with_scratch(py, |scratch| inner.estimate_edges(edges, scratch))?.into())
    }

    /// The tilt of such an image, and its edge pixels.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _estimate_with_edges(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<(TiltEstimate, EdgeElements)> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let (estimate, elements) = self.with_scratch(py, |scratch| inner.estimate_with_elements(&view, scratch))?;
        let size = (inner.camera().width() as usize, inner.camera().height() as usize);
        Ok((TiltEstimate::from(estimate), EdgeElements::new(&elements, size)))
    }

    /// (K, 3), (K, F): directions that may be up in such an image and what tells which is, for training.
    #[pyo3(signature = (image: "NDArray[np.uint8]") -> "tuple[NDArray[np.float64], NDArray[np.float64]]")]
    fn _hypotheses<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'_, PyAny>,
    ) -> PyResult<(Array<'py, f64>, Array<'py, f64>)> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let found = self.with_scratch(py, |scratch| inner.hypotheses(&view, scratch))?;
        let (n, width) = (found.len(), found.first().map_or(0, |(_, features)| features.len()));
        let ups = found.iter().flat_map(|(up, _)| up.iter().copied());
        let features = found.iter().flat_map(|(_, features)| features.iter().copied());
        Ok((
            Array::new(PyArray1::from_iter(py, ups).reshape([n, 3])?),
            Array::new(PyArray1::from_iter(py, features).reshape([n, width])?),
        ))
    }

    /// (F,): what tells whether the estimate of such an image is of the vertical at all, for training.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _trust_features<'py>(&self, py: Python<'py>, image: &Bound<'_, PyAny>) -> PyResult<Array<'py, f64>> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let found = self.with_scratch(py, |scratch| inner.trust_features(&view, scratch))?;
        Ok(Array::new(PyArray1::from_vec(py, found)))
    }

    /// The tilts of many such images, in their order, the same for any number of threads.
    #[pyo3(signature = (images: "list[NDArray[np.uint8]]", *, threads: "int | None" = None))]
    #[expect(clippy::needless_pass_by_value, reason = "what the interpreter hands over is owned")]
    fn _estimate_many(
        &self,
        py: Python<'_>,
        images: Vec<Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<TiltEstimate>> {
        let threads = convert::threads(threads)?.unwrap_or(1);
        let named = images.iter().enumerate().map(|(i, image)| convert::gray(image, &format!("images[{i}]")));
        let arrays = named.collect::<PyResult<Vec<_>>>()?;
        let views = arrays.iter().map(convert::view).collect::<PyResult<Vec<_>>>()?;
        let estimates = call_long(py, || self.inner.estimate_many(&views, threads))?;
        Ok(estimates.into_iter().map(TiltEstimate::from).collect())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let usual = core::TiltOptions::for_method(self.method()).map_err(|error| exception(&error))?;
        let others = options::shown_beside(py, self.inner.options(), &usual)?;
        Ok(format!("TiltEstimator({}, method=\"{}\"{others})", self.camera.bind(py).repr()?, self.method()))
    }
}

image_reader!(TiltEstimator, Scratch, robot_from_camera);

impl TiltEstimator {
    /// An estimator of the same camera with some options changed, which shares tables and scratch where they are the same.
    fn with_options(&self, py: Python<'_>, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut options = self.inner.options().clone();
        options::set(&mut options, changes)?;
        let inner = call_long(py, || self.inner.with_options(options))?;
        let shares = inner.shares_scratch_with(&self.inner);
        let scratch = if shares { Arc::clone(&self.scratch) } else { Arc::default() };
        Ok(Self { inner, camera: self.camera.clone_ref(py), scratch })
    }
}

/// The angle in [0, pi] radians between two ground normals (3,), of any length but zero (eq. 44).
#[pyfunction]
#[pyo3(signature = (a: "ArrayLike", b: "ArrayLike"))]
pub(crate) fn tilt_error_rad(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(convert::tilt(a, "a")?.angle_to(&convert::tilt(b, "b")?))
}

/// (3,): the ground normal of a lean, (-sin a cos b, -sin a sin b, cos a) (eq. 1).
#[pyfunction]
pub(crate) fn normal_from_alpha_beta(py: Python<'_>, alpha_rad: Number, beta_rad: Number) -> PyResult<Array<'_, f64>> {
    let (alpha_rad, beta_rad) = (alpha_rad.of("alpha_rad")?, beta_rad.of("beta_rad")?);
    if !(alpha_rad.is_finite() && beta_rad.is_finite()) {
        return Err(invalid(format!("alpha_rad, beta_rad = {alpha_rad}, {beta_rad}, expected finite angles")));
    }
    convert::to_matrix(py, &Tilt::from_alpha_beta(alpha_rad, beta_rad).normal())
}

/// (alpha_rad, beta_rad) of a robot whose wheels stand at these heights above a common level (eqs. 42 and 43).
///
/// The main wheels are at (0, +-half_track_m) in the robot's frame, the caster at (-caster_behind_m, 0): r_w and r_c of
/// fig. 20. With h_r = right - left and h_c = caster - left the ground normal is (-(2 h_c - h_r) / (2 r_c), -h_r / (2
/// r_w), cos alpha). Raises `tiltvp.errors.InvalidInputError` for lengths that are not positive, heights that are not
/// finite, and heights that no robot of this layout can stand at.
#[pyfunction]
#[pyo3(signature = (*, left_m, right_m, caster_m, half_track_m, caster_behind_m))]
pub(crate) fn tilt_from_wheel_heights(
    left_m: Number,
    right_m: Number,
    caster_m: Number,
    half_track_m: Number,
    caster_behind_m: Number,
) -> PyResult<(f64, f64)> {
    let layout = WheelLayout {
        half_track_m: half_track_m.of("half_track_m")?,
        caster_behind_m: caster_behind_m.of("caster_behind_m")?,
    };
    let tilt = layout.tilt(left_m.of("left_m")?, right_m.of("right_m")?, caster_m.of("caster_m")?);
    let tilt = tilt.map_err(|error| exception(&error))?;
    Ok((tilt.alpha_rad(), tilt.beta_rad()))
}

/// (3, 3): the rotation from the upright robot's frame to the leaning one's, without a turn about the vertical.
///
/// `normal` is the ground normal (3,) in the robot frame, of any length but zero.
#[pyfunction]
#[pyo3(signature = (normal: "ArrayLike"))]
pub(crate) fn leaning_from_upright<'py>(py: Python<'py>, normal: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
    convert::to_matrix(py, &convert::tilt(normal, "normal")?.leaning_from_upright())
}
