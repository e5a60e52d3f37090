//! `SegmentDetector` and `Segments`: the core's straight edges over arrays.

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tiltvp_core::segments::{self as core, Segment, SegmentScratch};

use crate::array::Array;
use crate::call::{call_long, invalid};
use crate::camera::Camera;
use crate::convert;
use crate::field::Field;
use crate::options;
use crate::reader;
use crate::scratch::ScratchPool;
use crate::value::{frozen, value};

/// Finds straight edges as arcs of great circles in the images of one camera, whatever its lens.
///
/// The tables of the camera are made once. `tiltvp.SegmentDetector` takes images of any usual kind.
///
/// `camera` is the camera whose images will come. `options` tells the options in force.
///
/// Raises `tiltvp.errors.InvalidInputError` for an option that it does not have (it names the near ones) or that is out of
/// its domain, for a mask of another size than the camera's images, and where no pixel is left.
#[pyclass(frozen, subclass, module = "tiltvp._core")]
pub(crate) struct SegmentDetector {
    inner: core::SegmentDetector,
    camera: Py<Camera>,
    scratch: ScratchPool<SegmentScratch>,
}

#[pymethods]
impl SegmentDetector {
    #[new]
    #[pyo3(signature = (camera: "Camera", **options: "Option"))]
    fn new(py: Python<'_>, camera: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let camera = reader::camera(camera)?;
        let mut parsed = core::SegmentDetectorOptions::default();
        options::set(&mut parsed, options)?;
        let lens = camera.get().inner.clone();
        let inner = call_long(py, move || core::SegmentDetector::new(lens, parsed))?;
        Ok(Self { inner, camera: camera.clone().unbind(), scratch: ScratchPool::default() })
    }

    /// The camera whose images are read.
    #[getter]
    fn camera(&self, py: Python<'_>) -> Py<Camera> {
        self.camera.clone_ref(py)
    }

    /// The options that are in force, by name, defaults included; a fresh dict, good as keywords.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        options::in_force(py, self.inner.options())
    }

    /// The straight edges of a C-contiguous (H, W) image of uint8.
    #[pyo3(signature = (image: "NDArray[np.uint8]"))]
    fn _detect(&self, py: Python<'_>, image: &Bound<'_, PyAny>) -> PyResult<Segments> {
        let image = convert::gray(image, "image")?;
        let (view, inner) = (convert::view(&image)?, &self.inner);
        let work = |scratch: &mut SegmentScratch| {
            let mut found = core::Segments::default();
            inner.detect(&view, scratch, &mut found).map(|()| found)
        };
        Ok(Segments::from(&self.scratch.with(py, inner.camera(), || inner.scratch(), work)?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("SegmentDetector({})", self.camera.bind(py).repr()?))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        let partial = py.import("functools")?.getattr("partial")?;
        let made = partial.call((slf.get_type(), this.camera(py)), Some(&this.options(py)?))?;
        (made, PyTuple::empty(py)).into_pyobject(py)
    }
}

frozen!(SegmentDetector, |own| (own.inner.camera(), own.inner.options()), |own| (
    own.inner.camera().width(),
    own.inner.camera().height()
));

value! {
    /// The straight edges of one image, the longest first. Frozen, comparable, to be pickled.
    ///
    /// `SegmentDetector` makes them. All directions are in the camera frame.
    Segments as own {
        /// (N, 3) float64: unit normals of the great circles, towards the brighter side.
        normal: Vec<Vector3<f64>>,
        /// (N, 2, 3) float64: unit bearings of the ends, a pixel beyond the outermost pixels that show the edge, because gradients
        /// there see what is behind it; from the first to the second is a positive turn about the normal.
        ends: Vec<Matrix2x3<f64>>,
        /// (N, 3) float64: unit bearings of the middles of the pixels.
        middle: Vec<Vector3<f64>>,
        /// (N,) float64: angles between the ends, radians.
        length_rad: Vec<f64>,
        /// (N, 2) float64: variances in squared radians of the turns of the normal about `normal` x `middle`, which moves the
        /// arc sideways, and about `middle`, which turns it.
        variances_rad2: Vec<Vector2<f64>>,
        /// (N,) float64: mean gradients, grey levels per pixel.
        contrast: Vec<f64>,
        /// (N,) float64: root mean square distances of the pixels from the circles, pixels.
        rms_px: Vec<f64>,
        /// (N,) uint32: how many pixels support each.
        support: Vec<u32>,
        /// (P, 2) float64: the places (u, v) of the edges in the supporting pixels, segment by segment.
        points_px: Vec<Vector2<f64>>,
    }
    check {
        let n = normal.len();
        let others = [
            ends.len(), middle.len(), length_rad.len(), variances_rad2.len(), contrast.len(), rms_px.len(), support.len(),
        ];
        if others.iter().any(|m| *m != n) {
            return Err(invalid(format!("values: lists of different lengths, expected {n} of each")));
        }
        let points: u64 = support.iter().map(|k| u64::from(*k)).sum();
        if points != points_px.len() as u64 {
            let got = points_px.len();
            return Err(invalid(format!("values[\"points_px\"]: {got} places, expected {points}, as support has")));
        }
    };
    repr {
        format!("Segments({} of {} pixels)", own.normal.len(), own.points_px.len())
    };
}

impl From<&core::Segments> for Segments {
    fn from(found: &core::Segments) -> Self {
        // The same pixel is a larger angle in one place than in another, so that the order may be another one.
        let mut list: Vec<_> = found.list.iter().collect();
        list.sort_by(|a, b| b.edge_length_rad().total_cmp(&a.edge_length_rad()));
        let own = || list.iter().copied();
        let row = |ends: &[Vector3<f64>; 2]| Matrix2x3::from_rows(&ends.map(|end| end.transpose()));
        let place = |pixel: [f32; 2]| Vector2::from(pixel.map(f64::from));
        let points = own().flat_map(|segment| found.points_of(segment));
        Self {
            normal: own().map(|segment| segment.normal).collect(),
            ends: own().map(|segment| row(&segment.edge_ends())).collect(),
            middle: own().map(|segment| segment.middle).collect(),
            length_rad: own().map(Segment::edge_length_rad).collect(),
            variances_rad2: own().map(|segment| segment.variances_rad2.into()).collect(),
            contrast: own().map(|segment| segment.contrast).collect(),
            rms_px: own().map(|segment| segment.rms_px).collect(),
            support: own().map(|segment| segment.support() as u32).collect(),
            points_px: points.map(|point| place(point.pixel)).collect(),
        }
    }
}

#[pymethods]
impl Segments {
    /// (N, 3, 3) float64: covariances of the normals, squared radians; of rank two, in the planes across the normals.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let all: Vec<Matrix3<f64>> = (0..self.normal.len())
            .map(|i| Segment::covariance_of(&self.normal[i], &self.middle[i], self.variances_rad2[i].into()))
            .collect();
        all.attribute(py)
    }

    /// (K, 2) float64: the places (u, v) of the edge in the pixels of segment `index`.
    ///
    /// Raises `IndexError` for a segment that is not there.
    #[pyo3(signature = (index: "SupportsIndex"))]
    fn pixels<'py>(&self, py: Python<'py>, index: &Bound<'py, PyAny>) -> PyResult<Array<'py, f64>> {
        let index: isize = convert::number(index, "index", "a whole number")?;
        let Some((index, support)) = usize::try_from(index).ok().and_then(|i| Some((i, self.support.get(i)?))) else {
            let n = self.support.len();
            return Err(pyo3::exceptions::PyIndexError::new_err(format!(
                "index = {index}, expected at least 0 and less than {n}"
            )));
        };
        let start: usize = self.support[..index].iter().map(|k| *k as usize).sum();
        self.points_px[start..start + *support as usize].to_vec().attribute(py)
    }

    fn __len__(&self) -> usize {
        self.normal.len()
    }
}
