//! `ImageEdges`: the edge pixels of one image, between finding them and fitting to them.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};
use tiltvp_core::edges::{EdgeOptions, Mask};
use tiltvp_core::tilt::{self as core, EdgeOrigin};

use crate::call::exception;
use crate::camera::Camera;
use crate::convert;
use crate::value::frozen;

/// Normals of great circles.
type Normals = Vec<[f64; 3]>;

/// The edge pixels of one image and their gradients: every pixel of the band of at least `gradient_min`.
///
/// `TiltEstimator.detect` makes them, `TiltEstimator.estimate_edges` takes them. Frozen, comparable, to be pickled.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct ImageEdges {
    inner: core::ImageEdges,
    camera: Py<Camera>,
}

impl ImageEdges {
    pub(super) fn new(inner: core::ImageEdges, camera: Py<Camera>) -> Self {
        Self { inner, camera }
    }

    pub(super) fn inner(&self) -> &core::ImageEdges {
        &self.inner
    }
}

#[pymethods]
impl ImageEdges {
    /// The least gradient magnitude that was asked for.
    #[getter]
    fn gradient_min(&self) -> f64 {
        self.inner.origin().options.gradient_min
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    fn __repr__(&self) -> String {
        format!("ImageEdges({} edge pixels, gradient_min={})", self.inner.len(), self.gradient_min())
    }

    /// The value of its parts, for pickle.
    #[classmethod]
    fn _from_parts(
        _cls: &Bound<'_, PyType>,
        camera: Py<Camera>,
        robot_from_camera: &Bound<'_, PyAny>,
        options: ([f64; 5], u32),
        mask: Option<&Bound<'_, PyAny>>,
        pixels: ([PyReadonlyArray1<'_, u32>; 2], [PyReadonlyArray1<'_, f32>; 2]),
        seen: (Option<[f64; 2]>, Vec<f64>, f64, Normals),
    ) -> PyResult<Self> {
        let ([gradient_min, smoothing_px, elevation_min_rad, elevation_max_rad, margin_px], row_stride) = options;
        let options = EdgeOptions { gradient_min, smoothing_px, elevation_min_rad, elevation_max_rad, margin_px };
        let mask = mask.map(|mask| {
            let (height, width, usable) = convert::mask(mask, "mask")?;
            Mask::new(width, height, usable).map_err(|error| exception(&error))
        });
        let origin = EdgeOrigin {
            camera: camera.get().inner.clone(),
            robot_from_camera: convert::matrix3(robot_from_camera, "robot_from_camera")?,
            options,
            mask: mask.transpose()?,
            row_stride,
        };
        let ([slots, steps], gradients) = pixels;
        let (centre_off_px, lights, blur_rad, overhead) = seen;
        let overhead: Vec<_> = overhead.into_iter().map(Into::into).collect();
        let steps = steps.to_vec()?;
        let [gx, gy] = gradients.each_ref().map(|g| g.to_vec());
        let inner = core::ImageEdges::new(Arc::new(origin), &slots.to_vec()?, &gx?, &gy?)
            .and_then(|edges| edges.with_centre_off_px(centre_off_px.map(Into::into)))
            .and_then(|edges| edges.with_lights(&lights))
            .and_then(|edges| edges.with_steps(&steps))
            .and_then(|edges| edges.with_blur_rad(blur_rad))
            .and_then(|edges| edges.with_overhead(&overhead));
        Ok(Self { inner: inner.map_err(|error| exception(&error))?, camera })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let EdgeOrigin { robot_from_camera, options: o, mask, row_stride, .. } = &**this.inner.origin();
        let rotation = convert::to_matrix(py, robot_from_camera)?;
        let options = [o.gradient_min, o.smoothing_px, o.elevation_min_rad, o.elevation_max_rad, o.margin_px];
        let options = (options, *row_stride);
        let mask = mask.as_ref().map(|mask| convert::to_mask(py, mask)).transpose()?;
        let slots = [this.inner.slots(), this.inner.steps()].map(|slots| PyArray1::from_slice(py, slots));
        let gradients = [this.inner.gx(), this.inner.gy()].map(|g| PyArray1::from_slice(py, g));
        let off = this.inner.centre_off_px().map(<[f64; 2]>::from);
        let lights = this.inner.lights().to_vec();
        let overhead: Normals = this.inner.overhead().into_iter().map(Into::into).collect();
        let seen = (off, lights, this.inner.blur_rad(), overhead);
        let parts = (this.camera.clone_ref(py), rotation, options, mask, (slots, gradients), seen);
        (slf.get_type().getattr("_from_parts")?, parts).into_pyobject(py)
    }
}

frozen!(ImageEdges, |own| &own.inner, |own| own.inner.slots());
