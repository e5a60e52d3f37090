//! `PixelRays`: the rays of a camera's pixels, and where they meet panoramas.

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use tiltvp_core::camera::{self as core, Equirectangular};

use crate::call::call;
use crate::camera::Camera;
use crate::convert;

/// Several rays in each pixel of a camera that sees anything.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct PixelRays {
    inner: core::PixelRays,
}

#[pymethods]
impl PixelRays {
    #[new]
    #[pyo3(signature = (camera, *, samples))]
    fn new(py: Python<'_>, camera: &Bound<'_, Camera>, samples: &Bound<'_, PyAny>) -> PyResult<Self> {
        let samples = convert::whole(samples, "samples", "rays per pixel and side from 1 to 16")?;
        let camera = &camera.get().inner;
        Ok(Self { inner: call(py, || core::PixelRays::new(camera, samples))? })
    }

    /// Rays per pixel and side.
    #[getter]
    fn samples(&self) -> usize {
        self.inner.samples()
    }

    /// (N,) uint32: places in row order of the pixels in which some ray is seen.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_slice(py, self.inner.pixels())
    }

    /// (2, samples^2, N) float32: columns and rows of a panorama that the rays meet.
    #[pyo3(signature = (rotation, *, width, height))]
    fn panorama_map<'py>(
        &self,
        py: Python<'py>,
        rotation: &Bound<'py, PyAny>,
        width: &Bound<'py, PyAny>,
        height: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let rotation = convert::matrix3(rotation, "rotation")?;
        let pixels = "a whole number of pixels";
        let (width, height) = (convert::whole(width, "width", pixels)?, convert::whole(height, "height", pixels)?);
        let map = call(py, || {
            let mut map = vec![0.0; 2 * self.inner.len()];
            let (u, v) = map.split_at_mut(self.inner.len());
            self.inner.panorama_map(&Equirectangular::new(width, height)?, &rotation, u, v)?;
            Ok(map)
        })?;
        let rays = self.inner.samples().pow(2);
        PyArray1::from_vec(py, map).reshape([2, rays, self.inner.pixels().len()])
    }
}
