//! Trained corrections of the angle: as options, as frozen values, and how they are trained and applied.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};
use tiltvp_core::tilt::{self as core, ShiftModel, TrainedCorrection};

use super::values;
use crate::call::{call, exception, invalid};
use crate::convert;

/// A correction from a number or one of the classes here; `words` are what else the place takes.
pub(super) fn parse(value: &Bound<'_, PyAny>, name: &str, words: &str) -> PyResult<TrainedCorrection> {
    if let Ok(affine) = value.cast::<AffineCorrection>() {
        return Ok(TrainedCorrection::Affine(affine.get().inner));
    }
    if let Ok(posterior) = value.cast::<PosteriorCorrection>() {
        return Ok(TrainedCorrection::Posterior(posterior.get().inner.clone()));
    }
    if let Ok(factor) = value.extract::<f64>() {
        return Ok(TrainedCorrection::Factor(factor));
    }
    let shown = value.repr().map_or_else(|_| String::new(), |r| r.to_string());
    Err(invalid(format!(
        "{name} = {shown}, expected {words}a number (a factor), an AffineCorrection or a PosteriorCorrection"
    )))
}

/// What [`parse`] makes a correction from.
pub(super) fn show(py: Python<'_>, correction: &TrainedCorrection) -> PyResult<Py<PyAny>> {
    Ok(match correction {
        TrainedCorrection::Factor(factor) => factor.into_pyobject(py)?.into_any().unbind(),
        TrainedCorrection::Affine(affine) => Py::new(py, AffineCorrection { inner: *affine })?.into_any(),
        TrainedCorrection::Posterior(posterior) => {
            Py::new(py, PosteriorCorrection { inner: posterior.clone() })?.into_any()
        }
    })
}

/// alpha = shift / factor + offset_rad, but not below zero.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct AffineCorrection {
    inner: core::AffineCorrection,
}

#[pymethods]
impl AffineCorrection {
    #[new]
    fn new(factor: f64, offset_rad: f64) -> PyResult<Self> {
        let inner = core::AffineCorrection { factor, offset_rad };
        inner.validate().map_err(|error| exception(&error))?;
        Ok(Self { inner })
    }

    /// Units of the shift per radian: pixels per radian, or none for raw angles.
    #[getter]
    fn factor(&self) -> f64 {
        self.inner.factor
    }

    /// What is added, in radians.
    #[getter]
    fn offset_rad(&self) -> f64 {
        self.inner.offset_rad
    }

    /// The attributes by name.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("factor", self.inner.factor)?;
        dict.set_item("offset_rad", self.inner.offset_rad)?;
        Ok(dict)
    }

    /// The correction of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values::dict(values, &["factor", "offset_rad"])?;
        Self::new(convert::item(values, "factor", "a number")?, convert::item(values, "offset_rad", "a number")?)
    }

    fn __repr__(&self) -> String {
        format!("AffineCorrection({:?}, {:?})", self.inner.factor, self.inner.offset_rad)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        (self.inner.factor, self.inner.offset_rad).into_pyobject(py)?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let inner = slf.get().inner;
        (slf.get_type(), (inner.factor, inner.offset_rad)).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}

/// Keys of the dict of a `PosteriorCorrection`.
const KEYS: [&str; 8] =
    ["factor", "spread", "spread_per_rad", "stray_share", "stray_max", "step", "mean_rad", "std_rad"];

/// The mean and deviation of the lean over a grid of shifts, and the model of shifts that they were made with.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct PosteriorCorrection {
    inner: core::PosteriorCorrection,
}

impl PosteriorCorrection {
    fn numbers(&self) -> [(&'static str, f64); 6] {
        let ShiftModel { factor, spread, spread_per_rad, stray_share, stray_max } = *self.inner.model();
        let [a, b, c, d, e, f, ..] = KEYS;
        [(a, factor), (b, spread), (c, spread_per_rad), (d, stray_share), (e, stray_max), (f, self.inner.step())]
    }
}

#[pymethods]
impl PosteriorCorrection {
    #[new]
    #[pyo3(signature = (*, factor, spread, spread_per_rad, stray_share, stray_max, step, mean_rad, std_rad))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a value's parts")]
    fn new(
        factor: f64,
        spread: f64,
        spread_per_rad: f64,
        stray_share: f64,
        stray_max: f64,
        step: f64,
        mean_rad: &Bound<'_, PyAny>,
        std_rad: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let model = ShiftModel { factor, spread, spread_per_rad, stray_share, stray_max };
        let (mean, std) = (convert::vector(mean_rad, "mean_rad")?, convert::vector(std_rad, "std_rad")?);
        let inner = core::PosteriorCorrection::new(model, step, &mean, &std).map_err(|error| exception(&error))?;
        Ok(Self { inner })
    }

    /// Units of the shift per radian, by and large.
    #[getter]
    fn factor(&self) -> f64 {
        self.inner.model().factor
    }

    /// Standard deviation of the error of the upright robot's shift in each direction, in units of the shift.
    #[getter]
    fn spread(&self) -> f64 {
        self.inner.model().spread
    }

    /// How it grows with the lean, in units of the shift per radian.
    #[getter]
    fn spread_per_rad(&self) -> f64 {
        self.inner.model().spread_per_rad
    }

    /// Share of shifts that have nothing to do with the lean.
    #[getter]
    fn stray_share(&self) -> f64 {
        self.inner.model().stray_share
    }

    /// Largest of these, in units of the shift.
    #[getter]
    fn stray_max(&self) -> f64 {
        self.inner.model().stray_max
    }

    /// Distance between the shifts of the table, which begins at zero.
    #[getter]
    fn step(&self) -> f64 {
        self.inner.step()
    }

    /// Fresh (N,) float64: the mean lean in radians at each shift of the table.
    #[getter]
    fn mean_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.mean_rad())
    }

    /// Fresh (N,) float64: the standard deviation of the lean in radians at each shift of the table.
    #[getter]
    fn std_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.std_rad())
    }

    /// The attributes by name, arrays as lists.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (key, number) in self.numbers() {
            dict.set_item(key, number)?;
        }
        dict.set_item("mean_rad", self.inner.mean_rad())?;
        dict.set_item("std_rad", self.inner.std_rad())?;
        Ok(dict)
    }

    /// The correction of a dict as `to_dict` makes it.
    #[classmethod]
    fn from_dict(_cls: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let values = values::dict(values, &KEYS)?;
        let number = |key| convert::item(values, key, "a number");
        Self::new(
            number("factor")?,
            number("spread")?,
            number("spread_per_rad")?,
            number("stray_share")?,
            number("stray_max")?,
            number("step")?,
            &convert::raw_item(values, "mean_rad")?,
            &convert::raw_item(values, "std_rad")?,
        )
    }

    fn __repr__(&self) -> String {
        let ShiftModel { factor, spread, spread_per_rad, stray_share, .. } = *self.inner.model();
        format!(
            "PosteriorCorrection(factor={factor:.4}, spread={spread:.4}, spread_per_rad={spread_per_rad:.4}, \
             stray_share={stray_share:.4}, {} shifts in steps of {:.4})",
            self.inner.mean_rad().len(),
            self.inner.step()
        )
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.numbers().map(|(_, number)| number).to_vec().into_pyobject(py)?.repr()?.hash()
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

/// How leans are distributed where the robot goes: one of `empirical()`, `uniform(max_rad)`, `rayleigh(sigma_rad)`.
#[pyclass(frozen, module = "tiltvp._core")]
#[derive(Clone)]
pub(crate) struct PriorOfTilt {
    inner: core::PriorOfTilt,
}

impl PriorOfTilt {
    fn checked(inner: core::PriorOfTilt) -> PyResult<Self> {
        inner.validate().map_err(|error| exception(&error))?;
        Ok(Self { inner })
    }

    /// The name of the constructor and its argument.
    fn parts(&self) -> (&'static str, Vec<f64>) {
        match self.inner {
            core::PriorOfTilt::Empirical => ("empirical", Vec::new()),
            core::PriorOfTilt::Uniform { max_rad } => ("uniform", vec![max_rad]),
            core::PriorOfTilt::Rayleigh { sigma_rad } => ("rayleigh", vec![sigma_rad]),
        }
    }
}

#[pymethods]
impl PriorOfTilt {
    /// As in the training set, smoothed.
    #[staticmethod]
    fn empirical() -> Self {
        Self { inner: core::PriorOfTilt::Empirical }
    }

    /// Every lean up to `max_rad` is as likely.
    #[staticmethod]
    fn uniform(max_rad: f64) -> PyResult<Self> {
        Self::checked(core::PriorOfTilt::Uniform { max_rad })
    }

    /// Leans forward and sideways are independent and normal, each with standard deviation `sigma_rad`.
    #[staticmethod]
    fn rayleigh(sigma_rad: f64) -> PyResult<Self> {
        Self::checked(core::PriorOfTilt::Rayleigh { sigma_rad })
    }

    fn __repr__(&self) -> String {
        let (name, arguments) = self.parts();
        let shown: Vec<_> = arguments.iter().map(|x| format!("{x:?}")).collect();
        format!("PriorOfTilt.{name}({})", shown.join(", "))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| self.inner == other.get().inner)
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.__repr__().into_pyobject(py)?.hash()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (name, arguments) = slf.get().parts();
        (slf.get_type().getattr(name)?, PyTuple::new(slf.py(), arguments)?).into_pyobject(slf.py())
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }
}

/// A training set from two arrays.
fn training(shift: &Bound<'_, PyAny>, alpha_rad: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<f64>)> {
    Ok((convert::vector(shift, "shift")?, convert::vector(alpha_rad, "alpha_rad")?))
}

/// The factor of eq. 31, the mean of shift / alpha.
#[pyfunction]
pub(crate) fn train_factor(py: Python<'_>, shift: &Bound<'_, PyAny>, alpha_rad: &Bound<'_, PyAny>) -> PyResult<f64> {
    let (shift, alpha) = training(shift, alpha_rad)?;
    call(py, || core::train_factor(&shift, &alpha))
}

/// The line alpha = shift / factor + offset by least squares of the shift.
#[pyfunction]
pub(crate) fn train_affine(
    py: Python<'_>,
    shift: &Bound<'_, PyAny>,
    alpha_rad: &Bound<'_, PyAny>,
) -> PyResult<AffineCorrection> {
    let (shift, alpha) = training(shift, alpha_rad)?;
    Ok(AffineCorrection { inner: call(py, || core::train_affine(&shift, &alpha))? })
}

/// The posterior of the lean given the shift.
#[pyfunction]
#[pyo3(signature = (shift, alpha_rad, *, prior=None))]
pub(crate) fn train_posterior(
    py: Python<'_>,
    shift: &Bound<'_, PyAny>,
    alpha_rad: &Bound<'_, PyAny>,
    prior: Option<&Bound<'_, PyAny>>,
) -> PyResult<PosteriorCorrection> {
    let (shift, alpha) = training(shift, alpha_rad)?;
    let prior = match prior {
        None => core::PriorOfTilt::Empirical,
        Some(prior) => match prior.cast::<PriorOfTilt>() {
            Ok(prior) => prior.get().inner,
            Err(_) => return Err(invalid(format!("prior = {}, expected a tiltvp.PriorOfTilt or None", prior.repr()?))),
        },
    };
    Ok(PosteriorCorrection { inner: call(py, || core::train_posterior(&shift, &alpha, prior))? })
}

/// Fresh (N,) float64: the leans of shifts (or raw angles) of zero or more; NaN for NaN.
#[pyfunction]
pub(crate) fn apply_correction<'py>(
    py: Python<'py>,
    correction: &Bound<'py, PyAny>,
    shift: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let correction = parse(correction, "correction", "")?;
    correction.validate().map_err(|error| exception(&error))?;
    let mut values = convert::vector(shift, "shift")?;
    if let Some(i) = values.iter().position(|l| *l < 0.0) {
        return Err(invalid(format!("shift: {} in place {i}, expected numbers of zero or more, or NaN", values[i])));
    }
    for l in &mut values {
        *l = correction.apply(*l);
    }
    Ok(PyArray1::from_vec(py, values))
}
