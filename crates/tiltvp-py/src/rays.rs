//! `PixelRays`: the rays of a camera's pixels, and where they meet panoramas.

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::camera::{self as core, Equirectangular};

use crate::array::Array;
use crate::call::call_long;
use crate::camera::Camera;
use crate::convert;
use crate::value::frozen;

/// `samples` x `samples` rays in each pixel of a camera that sees anything, made once, to be met with panoramas.
///
/// The rays are at the centres of equal parts of the pixels; `samples` is from 1 to 16.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct PixelRays {
    inner: core::PixelRays,
    camera: Py<Camera>,
}

#[pymethods]
impl PixelRays {
    #[new]
    #[pyo3(signature = (camera, *, samples: "SupportsIndex"))]
    fn new(py: Python<'_>, camera: &Bound<'_, Camera>, samples: &Bound<'_, PyAny>) -> PyResult<Self> {
        let samples = convert::number(samples, "samples", "rays per pixel and side from 1 to 16")?;
        let lens = &camera.get().inner;
        let inner = call_long(py, || core::PixelRays::new(lens, samples))?;
        Ok(Self { inner, camera: camera.clone().unbind() })
    }

    /// Rays per pixel and side.
    #[getter]
    fn samples(&self) -> usize {
        self.inner.samples()
    }

    /// (N,): places in row order, v width + u, of the pixels in which some ray is seen.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> Array<'py, u32> {
        Array::new(PyArray1::from_slice(py, self.inner.pixels()))
    }

    /// (2, samples^2, N): columns and rows of an equirectangular panorama of that size that the rays meet.
    ///
    /// `rotation` (3, 3) takes bearings of the camera to the panorama's: x right, y down, z towards longitude 0. Rays
    /// that the lens does not see are at -1e6, far outside.
    #[pyo3(signature = (
        rotation: "ArrayLike", *, width: "SupportsIndex", height: "SupportsIndex",
    ) -> "NDArray[np.float32]")]
    fn panorama_map<'py>(
        &self,
        py: Python<'py>,
        rotation: &Bound<'py, PyAny>,
        width: &Bound<'py, PyAny>,
        height: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let rotation = convert::matrix3(rotation, "rotation")?;
        let pixels = "a whole number of pixels";
        let (width, height) = (convert::number(width, "width", pixels)?, convert::number(height, "height", pixels)?);
        let map = call_long(py, || {
            let mut map = vec![0.0; 2 * self.inner.len()];
            let (u, v) = map.split_at_mut(self.inner.len());
            self.inner.panorama_map(&Equirectangular::new(width, height)?, &rotation, u, v)?;
            Ok(map)
        })?;
        let rays = self.inner.samples().pow(2);
        PyArray1::from_vec(py, map).reshape([2, rays, self.inner.pixels().len()])
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("PixelRays({}, samples={})", self.camera.bind(py).repr()?, self.samples()))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Py<Camera>,))> {
        let (py, keywords) = (slf.py(), PyDict::new(slf.py()));
        keywords.set_item("samples", slf.get().samples())?;
        let make = py.import("functools")?.getattr("partial")?.call((slf.get_type(),), Some(&keywords))?;
        Ok((make, (slf.get().camera.clone_ref(py),)))
    }
}

frozen!(PixelRays, |own| (&own.camera.get().inner, own.samples()), |own| (own.inner.pixels().len(), own.samples()));
