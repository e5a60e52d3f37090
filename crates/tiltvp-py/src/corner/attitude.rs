//! What the closed form answers, as frozen Python values: `CornerAttitude` and `CornerAttitudes`.

use nalgebra::Matrix3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::corner::{self as core, CornerCase};

use super::matrix;
use crate::call::invalid;
use crate::convert;

/// Keys of the dict of a `CornerAttitude`.
const KEYS: [&str; 8] =
    ["camera_from_object", "edges", "alpha_rad", "mirrored", "case", "covariance_rad2", "sensitivity", "ln_volume"];

/// One attitude that the rays of a corner admit.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct CornerAttitude {
    inner: core::CornerAttitude,
}

impl From<core::CornerAttitude> for CornerAttitude {
    fn from(inner: core::CornerAttitude) -> Self {
        Self { inner }
    }
}

/// The edges as rows.
fn edge_rows(attitude: &core::CornerAttitude) -> Matrix3<f64> {
    Matrix3::from_columns(&attitude.edges).transpose()
}

impl CornerAttitude {
    fn bits(&self) -> Vec<u64> {
        let Self { inner } = self;
        let numbers = [inner.alpha_rad, inner.sensitivity, inner.ln_volume];
        let matrices = [inner.camera_from_object, edge_rows(inner), inner.covariance];
        let flags = [u64::from(inner.mirrored), inner.case as u64];
        matrices.iter().flatten().chain(&numbers).map(|x| x.to_bits()).chain(flags).collect()
    }
}

#[pymethods]
impl CornerAttitude {
    /// Fresh (3, 3) float64: the rotation R in v_camera = R v_object.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.camera_from_object)
    }

    /// Fresh (3, 3) float64: the directions of the edges x, y, z away from the vertex, camera frame, one a row.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &edge_rows(&self.inner))
    }

    /// The angle between the vertical edge and the line of sight, in [0, pi] radians.
    #[getter]
    fn alpha_rad(&self) -> f64 {
        self.inner.alpha_rad
    }

    /// Whether this is the second of the two interpretations (fig. 3c).
    #[getter]
    fn mirrored(&self) -> bool {
        self.inner.mirrored
    }

    /// How the edges of the imaginary box stand: "all-away", "one-perpendicular" or "one-toward".
    #[getter]
    fn case(&self) -> &'static str {
        self.inner.case.name()
    }

    /// Whether the edges x, y, z are a right-handed triple.
    #[getter]
    fn right_handed(&self) -> bool {
        self.inner.is_right_handed()
    }

    /// Fresh (3, 3) float64 in squared radians: covariance of the rotation vector, camera frame, of the error.
    #[getter]
    fn covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix::to_array(py, &self.inner.covariance)
    }

    /// Radians of attitude per radian of the rays' angles about the vertex; infinite where two roots fall together.
    #[getter]
    fn sensitivity(&self) -> f64 {
        self.inner.sensitivity
    }

    /// The attributes by name; arrays as nested lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("camera_from_object", matrix::nested(&self.inner.camera_from_object))?;
        dict.set_item("edges", matrix::nested(&edge_rows(&self.inner)))?;
        dict.set_item("alpha_rad", self.inner.alpha_rad)?;
        dict.set_item("mirrored", self.inner.mirrored)?;
        dict.set_item("case", self.case())?;
        dict.set_item("covariance_rad2", matrix::nested(&self.inner.covariance))?;
        dict.set_item("sensitivity", self.inner.sensitivity)?;
        dict.set_item("ln_volume", self.inner.ln_volume)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &KEYS)?;
        let edges: Matrix3<f64> = matrix::item(values, "edges")?;
        Ok(Self {
            inner: core::CornerAttitude {
                camera_from_object: matrix::item(values, "camera_from_object")?,
                edges: [0, 1, 2].map(|i| edges.row(i).transpose()),
                alpha_rad: convert::item(values, "alpha_rad", "a number")?,
                mirrored: convert::item(values, "mirrored", "True or False")?,
                case: case(values)?,
                covariance: matrix::item(values, "covariance_rad2")?,
                sensitivity: convert::item(values, "sensitivity", "a number")?,
                ln_volume: convert::item(values, "ln_volume", "a number")?,
            },
        })
    }

    fn __repr__(&self) -> String {
        let core::CornerAttitude { alpha_rad, sensitivity, .. } = self.inner;
        let (mirrored, case) = (if self.inner.mirrored { "True" } else { "False" }, self.case());
        format!(
            "CornerAttitude(alpha_rad={alpha_rad:.5}, mirrored={mirrored}, case=\"{case}\", sensitivity={sensitivity:.3})"
        )
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.bits() == other.get().bits())
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        PyTuple::new(py, self.bits())?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(slf.py())?,)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}

/// The case of a dict, by its name.
pub(super) fn case(values: &Bound<'_, PyDict>) -> PyResult<CornerCase> {
    let names = CornerCase::ALL.map(CornerCase::name).join(", ");
    let given: String = convert::item(values, "case", &names)?;
    CornerCase::ALL
        .into_iter()
        .find(|case| case.name() == given)
        .ok_or_else(|| invalid(format!("values[\"case\"] = {given:?}, expected one of {names}")))
}

/// Every attitude of many corners, as arrays of as many rows as there are attitudes.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct CornerAttitudes {
    corners: usize,
    rows: Vec<(usize, CornerAttitude)>,
}

impl CornerAttitudes {
    pub(super) fn new(found: &[core::CornerAttitudes]) -> Self {
        let of = |(corner, found): (usize, &core::CornerAttitudes)| {
            found.iter().map(move |attitude| (corner, CornerAttitude::from(*attitude))).collect::<Vec<_>>()
        };
        Self { corners: found.len(), rows: found.iter().enumerate().flat_map(of).collect() }
    }

    fn matrices<'py>(
        &self,
        py: Python<'py>,
        pick: fn(&core::CornerAttitude) -> Matrix3<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let flat: Vec<f64> =
            self.rows.iter().flat_map(|(_, row)| matrix::row_major(&pick(&row.inner)).collect::<Vec<_>>()).collect();
        if flat.is_empty() {
            return py.import("numpy")?.call_method1("empty", ((0, 3, 3),));
        }
        convert::to_matrices(py, &flat, [3, 3], false)
    }

    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        pick: impl Fn(&core::CornerAttitude) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_vec(py, self.rows.iter().map(|(_, row)| pick(&row.inner)).collect())
    }
}

#[pymethods]
impl CornerAttitudes {
    /// How many corners were asked for; as many attitudes or none may belong to each.
    #[getter]
    fn corners(&self) -> usize {
        self.corners
    }

    /// Fresh (M,) int64: to which corner each attitude belongs, rising.
    #[getter]
    fn corner<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.rows.iter().map(|(corner, _)| *corner as i64).collect())
    }

    /// Fresh (M, 3, 3) float64: the rotations R in v_camera = R v_object.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrices(py, |attitude| attitude.camera_from_object)
    }

    /// Fresh (M, 3, 3) float64: the directions of the edges x, y, z away from the vertex, camera frame, one a row.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.matrices(py, edge_rows)
    }

    /// Fresh (M,) float64: the angles between the vertical edge and the line of sight, radians.
    #[getter]
    fn alpha_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |attitude| attitude.alpha_rad)
    }

    /// Fresh (M,) bool: whether it is the second of two interpretations.
    #[getter]
    fn mirrored<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.column(py, |attitude| attitude.mirrored)
    }

    /// How the edges of the imaginary boxes stand, by name.
    #[getter]
    fn case(&self) -> Vec<&'static str> {
        self.rows.iter().map(|(_, row)| row.inner.case.name()).collect()
    }

    /// Fresh (M,) bool: whether the edges x, y, z are a right-handed triple.
    #[getter]
    fn right_handed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.column(py, core::CornerAttitude::is_right_handed)
    }

    /// Fresh (M,) float64: radians of attitude per radian of the rays' angles about the vertex.
    #[getter]
    fn sensitivity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |attitude| attitude.sensitivity)
    }

    /// The attitudes of one corner, by its number.
    fn of(&self, corner: usize) -> PyResult<Vec<CornerAttitude>> {
        if corner >= self.corners {
            return Err(invalid(format!("corner = {corner}, expected a number below {}", self.corners)));
        }
        let first = self.rows.partition_point(|(own, _)| *own < corner);
        Ok(self.rows[first..].iter().take_while(|(own, _)| *own == corner).map(|(_, row)| row.clone()).collect())
    }

    /// How many attitudes there are.
    fn __len__(&self) -> usize {
        self.rows.len()
    }

    /// The number of corners and, for each attitude, its corner and its own dict.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let attitudes: PyResult<Vec<_>> = self.rows.iter().map(|(_, row)| row.to_dict(py)).collect();
        dict.set_item("corners", self.corners)?;
        dict.set_item("corner", self.rows.iter().map(|(corner, _)| *corner).collect::<Vec<_>>())?;
        dict.set_item("attitudes", attitudes?)?;
        Ok(dict)
    }

    /// The value of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values.cast::<PyDict>().map_err(|_| invalid("values: expected a dict".to_owned()))?;
        convert::known_keys(values, &["corners", "corner", "attitudes"])?;
        let corners = convert::item(values, "corners", "a whole number")?;
        let corner: Vec<usize> = convert::item(values, "corner", "whole numbers")?;
        let attitudes: Vec<Bound<'_, PyAny>> = convert::item(values, "attitudes", "a list of dicts")?;
        if corner.len() != attitudes.len() || !corner.is_sorted() || corner.last().is_some_and(|last| *last >= corners)
        {
            return Err(invalid(format!(
                "values[\"corner\"]: {} numbers, expected {} rising ones below {corners}",
                corner.len(),
                attitudes.len()
            )));
        }
        let rows: PyResult<Vec<_>> = attitudes.iter().map(|values| CornerAttitude::from_dict(cls, values)).collect();
        Ok(Self { corners, rows: corner.into_iter().zip(rows?).collect() })
    }

    fn __repr__(&self) -> String {
        format!("CornerAttitudes({} of {} corners)", self.rows.len(), self.corners)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            let same =
                |(a, b): (&(usize, CornerAttitude), &(usize, CornerAttitude))| a.0 == b.0 && a.1.bits() == b.1.bits();
            self.corners == other.corners
                && self.rows.len() == other.rows.len()
                && self.rows.iter().zip(&other.rows).all(same)
        })
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        PyTuple::new(py, [self.corners, self.rows.len()])?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        (slf.get_type().getattr("from_dict")?, (slf.get().to_dict(slf.py())?,)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}
