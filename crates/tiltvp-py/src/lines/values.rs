//! `Lines`: the vertical lines of one image as a frozen Python value.

use nalgebra::Vector2;
use numpy::{Element, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::lines::{self as core, Line, LineFrame};

use crate::call::invalid;
use crate::convert;

/// Keys of the dict of `Lines`.
const KEYS: [&str; 8] = [
    "bearing_rad",
    "sigma_rad",
    "support_px",
    "elevation_min_rad",
    "elevation_max_rad",
    "polarity",
    "normal",
    "center_px",
];

/// The vertical lines of one image, by rising bearing.
#[pyclass(frozen, module = "tiltvp._core")]
pub(crate) struct Lines {
    inner: core::Lines,
}

impl Lines {
    pub(super) fn new(inner: core::Lines) -> Self {
        Self { inner }
    }

    pub(super) fn inner(&self) -> &core::Lines {
        &self.inner
    }

    fn column<'py, T: Element>(&self, py: Python<'py>, pick: fn(&Line) -> T) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.inner.lines.iter().map(pick))
    }

    fn list<T>(&self, pick: fn(&Line) -> T) -> Vec<T> {
        self.inner.lines.iter().map(pick).collect()
    }
}

#[pymethods]
impl Lines {
    /// (N,) float64: azimuth about the vertical in the upright robot's frame, radians.
    #[getter]
    fn bearing_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |line| line.bearing_rad)
    }

    /// (N,) float64: standard deviation of the bearing, radians.
    #[getter]
    fn sigma_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |line| line.sigma_rad)
    }

    /// (N,) uint32: edge pixels on the line, one across the edge.
    #[getter]
    fn support_px<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        self.column(py, |line| line.support_px)
    }

    /// (N,) float64: elevation of the lowest pixel above the upright robot's horizon, radians.
    #[getter]
    fn elevation_min_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |line| line.elevation_min_rad)
    }

    /// (N,) float64: elevation of the highest pixel, radians.
    #[getter]
    fn elevation_max_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |line| line.elevation_max_rad)
    }

    /// (N,) float64: share of the pixels that are brighter towards greater azimuth minus that of the others.
    #[getter]
    fn polarity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |line| line.polarity)
    }

    /// Fresh (3,) float64: the ground normal in the robot frame that was taken for the vertical.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.frame.normal.as_slice())
    }

    /// Where radial lines meet, (u, v); None but for the method "radial".
    #[getter]
    fn center_px(&self) -> Option<(f64, f64)> {
        self.inner.frame.center_px.map(|center| (center.x, center.y))
    }

    fn __len__(&self) -> usize {
        self.inner.lines.len()
    }

    fn __repr__(&self) -> String {
        let degrees: Vec<String> =
            self.inner.lines.iter().map(|l| format!("{:.1}", l.bearing_rad.to_degrees())).collect();
        format!("Lines({} at {} deg)", self.inner.lines.len(), degrees.join(", "))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let bits = |lines: &core::Lines| -> Vec<u64> {
            let frame = lines.frame.center_px.map_or([u64::MAX; 2], |c| [c.x.to_bits(), c.y.to_bits()]);
            let line = |l: &Line| {
                [
                    l.bearing_rad,
                    l.sigma_rad,
                    f64::from(l.support_px),
                    l.elevation_min_rad,
                    l.elevation_max_rad,
                    l.polarity,
                ]
                .map(f64::to_bits)
            };
            let normal = lines.frame.normal.iter().map(|x| x.to_bits());
            lines.lines.iter().flat_map(line).chain(frame).chain(normal).collect()
        };
        other.cast::<Self>().is_ok_and(|other| bits(&self.inner) == bits(&other.get().inner))
    }

    /// Plain numbers and lists, good for JSON.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("bearing_rad", self.list(|line| line.bearing_rad))?;
        dict.set_item("sigma_rad", self.list(|line| line.sigma_rad))?;
        dict.set_item("support_px", self.list(|line| line.support_px))?;
        dict.set_item("elevation_min_rad", self.list(|line| line.elevation_min_rad))?;
        dict.set_item("elevation_max_rad", self.list(|line| line.elevation_max_rad))?;
        dict.set_item("polarity", self.list(|line| line.polarity))?;
        dict.set_item("normal", self.inner.frame.normal.as_slice().to_vec())?;
        dict.set_item("center_px", self.center_px())?;
        Ok(dict)
    }

    /// The lines that `to_dict` wrote.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        convert::known_keys(values, &KEYS)?;
        let numbers = |key: &str| convert::item::<Vec<f64>>(values, key, "a list of numbers");
        let (bearings, sigmas) = (numbers("bearing_rad")?, numbers("sigma_rad")?);
        let (lowest, highest) = (numbers("elevation_min_rad")?, numbers("elevation_max_rad")?);
        let (polarity, normal) = (numbers("polarity")?, convert::item::<[f64; 3]>(values, "normal", "three numbers")?);
        let support: Vec<u32> = convert::item(values, "support_px", "a list of whole numbers")?;
        let n = bearings.len();
        if [sigmas.len(), lowest.len(), highest.len(), polarity.len(), support.len()].iter().any(|m| *m != n) {
            return Err(invalid(format!("values: lists of different lengths, expected {n} of each")));
        }
        let center: Option<[f64; 2]> = convert::item(values, "center_px", "None or two numbers")?;
        let lines = (0..n).map(|i| Line {
            bearing_rad: bearings[i],
            sigma_rad: sigmas[i],
            support_px: support[i],
            elevation_min_rad: lowest[i],
            elevation_max_rad: highest[i],
            polarity: polarity[i],
        });
        let frame = LineFrame { normal: normal.into(), center_px: center.map(Vector2::from) };
        Ok(Self { inner: core::Lines { lines: lines.collect(), frame } })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(py)?,)).into_pyobject(py)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
