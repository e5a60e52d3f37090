//! `CornerDetector`: corners of single images of one camera.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::corner::{self as core, CornerScratch};
use tiltvp_core::edges::Mask;

use super::feature::CornerFeature;
use crate::array::Array;
use crate::call::{call_long, exception, invalid};
use crate::camera::Camera;
use crate::convert::{self, Word};
use crate::options;
use crate::reader::{self, image_reader};
use crate::scratch::ScratchPool;

/// Finds corners in single images of one camera; `tiltvp.corner.CornerDetector` takes images of any usual kind.
///
/// The tables of the camera are made once. `options` tells the options in force; docs/corner_images.md says what they
/// mean.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct CornerDetector {
    inner: core::CornerDetector,
    camera: Py<Camera>,
    scratch: ScratchPool<CornerScratch>,
}

#[pymethods]
impl CornerDetector {
    #[new]
    #[pyo3(signature = (
        camera: "Camera", *, method=core::CornerMethod::NAMES[0].into(), mask: "NDArray[np.bool_] | None" = None,
        **options: "Option"
    ))]
    fn new(
        py: Python<'_>,
        camera: &Bound<'_, PyAny>,
        method: Word,
        mask: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let camera = reader::camera(camera)?;
        let mut parsed = method.choose(core::DetectorOptions::for_method)?;
        options::set(&mut parsed, options)?;
        let mask = mask.map(|mask| -> PyResult<Mask> {
            let (height, width, usable) = convert::mask(mask, "mask")?;
            Mask::new(width, height, usable).map_err(|error| exception(&error))
        });
        let mask = mask.transpose()?;
        let lens = camera.get().inner.clone();
        let inner = call_long(py, move || core::CornerDetector::new(lens, parsed, mask))?;
        Ok(Self { inner, camera: camera.clone().unbind(), scratch: ScratchPool::default() })
    }

    /// Fresh (H, W) bool, or None: which pixels may be used.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, bool>>> {
        self.inner.mask().map(|mask| Ok(Array::new(convert::to_mask(py, mask)?))).transpose()
    }

    /// The corners of a C-contiguous `(H, W)` image of uint8; `vertical` is a direction of the camera frame.
    #[pyo3(signature = (image: "NDArray[np.uint8]", vertical: "ArrayLike | None"))]
    fn _detect_gray(
        &self,
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        vertical: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<CornerFeature>> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let prior = vertical.map(|vertical| convert::vector3(vertical, "vertical")).transpose()?;
        let prior = match prior.map(|vertical| vertical.try_normalize(1e-12)) {
            Some(None) => return Err(invalid("vertical: a vector without a direction, expected one".to_owned())),
            Some(Some(vertical)) => Some(vertical),
            None => None,
        };
        let mut found = Vec::new();
        self.with_scratch(py, |scratch| inner.detect_general(&view, prior.as_ref(), scratch, &mut found))?;
        Ok(found.into_iter().map(CornerFeature::from).collect())
    }

    /// The corner of a C-contiguous `(H, W, 3)` image of uint8, blue first; at most one.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _detect_color(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<Vec<CornerFeature>> {
        let image = convert::color(image, "image")?;
        let (view, inner) = (convert::color_view(&image)?, &self.inner);
        let mut found = None;
        self.with_scratch(py, |scratch| {
            found = inner.detect_coloured(&view, None, scratch)?;
            Ok(())
        })?;
        Ok(found.into_iter().map(CornerFeature::from).collect())
    }

    /// `(N, 4)` float64: the ends `(u, v, u, v)` of the line segments of a C-contiguous `(H, W)` image of uint8.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _segments<'py>(&self, py: Python<'py>, image: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let (mut found, mut rows) = (Vec::new(), Vec::new());
        self.with_scratch(py, |scratch| {
            inner.detect_general(&view, None, scratch, &mut found)?;
            let pixels = inner.segments(scratch).iter().filter_map(|segment| {
                let [a, b] = segment.edge_ends().map(|end| inner.camera().project(&end));
                a.zip(b).map(|(a, b)| [a.x, a.y, b.x, b.y])
            });
            rows = pixels.collect();
            Ok(())
        })?;
        convert::to_rows(py, &rows, false)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("CornerDetector({}, method=\"{}\")", self.camera.bind(py).repr()?, self.method()))
    }
}

image_reader!(CornerDetector, CornerScratch, mask);

impl CornerDetector {
    pub(super) fn inner(&self) -> &core::CornerDetector {
        &self.inner
    }
}
