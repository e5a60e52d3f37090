//! Trained corrections of the angle: as options, as frozen values, and how they are trained and applied.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use tiltvp_core::tilt::{self as core, ShiftModel, TrainedCorrection};

use crate::call::{call, call_long, exception, invalid};
use crate::convert::{self, Number};
use crate::value::{frozen, value};

/// A correction from a number or one of the classes here.
pub(super) fn parse(value: &Bound<'_, PyAny>, name: &str) -> PyResult<TrainedCorrection> {
    if let Some(trained) = object(value) {
        return Ok(trained);
    }
    let expected = "a number (a factor), an AffineCorrection or a PosteriorCorrection";
    convert::number(value, name, expected).map(TrainedCorrection::Factor)
}

/// A correction from one of the classes here.
pub(crate) fn object(value: &Bound<'_, PyAny>) -> Option<TrainedCorrection> {
    if let Ok(affine) = value.cast::<AffineCorrection>() {
        return Some(TrainedCorrection::Affine(affine.get().inner));
    }
    let posterior = value.cast::<PosteriorCorrection>().ok()?;
    Some(TrainedCorrection::Posterior(posterior.get().inner.clone()))
}

/// What [`parse`] makes a correction from.
pub(crate) fn show(py: Python<'_>, correction: &TrainedCorrection) -> PyResult<Py<PyAny>> {
    Ok(match correction {
        TrainedCorrection::Factor(factor) => factor.into_pyobject(py)?.into_any().unbind(),
        TrainedCorrection::Affine(affine) => Py::new(py, AffineCorrection { inner: *affine })?.into_any(),
        TrainedCorrection::Posterior(posterior) => {
            Py::new(py, PosteriorCorrection { inner: posterior.clone() })?.into_any()
        }
    })
}

value! {
    /// alpha = shift / factor + offset_rad, but not below zero. Frozen, comparable, hashable, pickled.
    ///
    /// Raises `tiltvp.errors.InvalidInputError` unless the factor is positive and both are finite.
    AffineCorrection(core::AffineCorrection as own) {
        /// Units of the shift per radian: pixels per radian, or none for raw angles.
        factor: f64,
        /// What is added, in radians.
        offset_rad: f64,
    }
    make Self::checked(factor, offset_rad)?.inner;
    repr format!("AffineCorrection({:?}, {:?})", own.factor, own.offset_rad);
}

#[pymethods]
impl AffineCorrection {
    #[new]
    fn new(factor: Number, offset_rad: Number) -> PyResult<Self> {
        Self::checked(factor.of("factor")?, offset_rad.of("offset_rad")?)
    }
}

impl AffineCorrection {
    fn checked(factor: f64, offset_rad: f64) -> PyResult<Self> {
        let inner = core::AffineCorrection { factor, offset_rad };
        inner.validate().map_err(|error| exception(&error))?;
        Ok(Self { inner })
    }
}

value! {
    /// The mean and deviation of P(alpha | l) over a grid of shifts from zero, and the model of shifts behind it.
    ///
    /// `train_posterior` makes them, `from_dict` from their parts. Applying one is one interpolation; shifts beyond the grid have the answer of its
    /// end. Frozen, comparable, hashable, pickled.
    PosteriorCorrection(core::PosteriorCorrection as own) {
        /// Units of the shift per radian, by and large.
        factor: f64 = own.model().factor,
        /// Standard deviation of the error of the upright robot's shift in each direction, in units of the shift.
        spread: f64 = own.model().spread,
        /// How it grows with the lean, in units of the shift per radian.
        spread_per_rad: f64 = own.model().spread_per_rad,
        /// Share of shifts that have nothing to do with the lean.
        stray_share: f64 = own.model().stray_share,
        /// Largest of these, in units of the shift.
        stray_max: f64 = own.model().stray_max,
        /// Distance between the shifts of the table, which begins at zero.
        step: f64 = own.step(),
        /// Fresh (N,) float64: the mean lean in radians at each shift of the table.
        mean_rad: Vec<f64> = own.mean_rad().to_vec(),
        /// Fresh (N,) float64: the standard deviation of the lean in radians at each shift of the table.
        std_rad: Vec<f64> = own.std_rad().to_vec(),
    }
    make {
        let model = ShiftModel { factor, spread, spread_per_rad, stray_share, stray_max };
        core::PosteriorCorrection::new(model, step, &mean_rad, &std_rad).map_err(|error| exception(&error))?
    };
}

/// How leans are distributed where the robot goes: one of `empirical()`, `uniform(max_rad)`, `rayleigh(sigma_rad)`.
/// Frozen, comparable, hashable, pickled.
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

    /// Every lean up to `max_rad`, in (0, pi/2), is as likely.
    #[staticmethod]
    fn uniform(max_rad: Number) -> PyResult<Self> {
        let max_rad = max_rad.of("max_rad")?;
        Self::checked(core::PriorOfTilt::Uniform { max_rad })
    }

    /// Leans forward and sideways are independent and normal, each with standard deviation `sigma_rad`.
    #[staticmethod]
    fn rayleigh(sigma_rad: Number) -> PyResult<Self> {
        let sigma_rad = sigma_rad.of("sigma_rad")?;
        Self::checked(core::PriorOfTilt::Rayleigh { sigma_rad })
    }

    fn __repr__(&self) -> String {
        let (name, arguments) = self.parts();
        let shown: Vec<_> = arguments.iter().map(|x| format!("{x:?}")).collect();
        format!("PriorOfTilt.{name}({})", shown.join(", "))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (name, arguments) = slf.get().parts();
        Ok((slf.get_type().getattr(name)?, PyTuple::new(slf.py(), arguments)?))
    }
}

frozen!(PriorOfTilt, |own| own.parts(), |own| own.__repr__());

/// A training set from two arrays.
fn training(shift: &Bound<'_, PyAny>, alpha_rad: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<f64>)> {
    Ok((convert::vector(shift, "shift")?, convert::vector(alpha_rad, "alpha_rad")?))
}

/// The factor of eq. 31: the mean of shift / alpha over images of known leans (N,) above zero.
///
/// `shift` (N,) is `shift_px` of an image-space method, or `alpha_rad` of an uncorrected "vector-consensus". Leave out
/// images without an estimate. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense.
#[pyfunction]
#[pyo3(signature = (shift: "ArrayLike", alpha_rad: "ArrayLike"))]
pub(crate) fn train_factor(py: Python<'_>, shift: &Bound<'_, PyAny>, alpha_rad: &Bound<'_, PyAny>) -> PyResult<f64> {
    let (shift, alpha) = training(shift, alpha_rad)?;
    call(py, || core::train_factor(&shift, &alpha))
}

/// The line alpha = shift / factor + offset through images of known leans (N,), by least squares of the shift.
///
/// The truth is known and the shift errs, and the line does not depend on how many images there are of each lean.
/// Raises `tiltvp.errors.InvalidInputError` for fewer than two different leans or shifts that do not grow with them.
#[pyfunction]
#[pyo3(signature = (shift: "ArrayLike", alpha_rad: "ArrayLike"))]
pub(crate) fn train_affine(
    py: Python<'_>,
    shift: &Bound<'_, PyAny>,
    alpha_rad: &Bound<'_, PyAny>,
) -> PyResult<AffineCorrection> {
    let (shift, alpha) = training(shift, alpha_rad)?;
    Ok(AffineCorrection { inner: call(py, || core::train_affine(&shift, &alpha))? })
}

/// P(alpha | l) from images of known leans (N,), at least ten, under a prior; None: `PriorOfTilt.empirical()`.
///
/// The shift is modelled as the length of a plane vector of mean length factor * alpha with normal errors that grow
/// with the lean (a Rice distribution), a share of which strays; the model is fitted by maximum likelihood. Raises
/// `tiltvp.errors.InvalidInputError` for numbers that make no sense or shifts that do not grow with the lean.
#[pyfunction]
#[pyo3(signature = (shift: "ArrayLike", alpha_rad: "ArrayLike", *, prior: "PriorOfTilt | None" = None))]
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
    Ok(PosteriorCorrection { inner: call_long(py, || core::train_posterior(&shift, &alpha, prior))? })
}

/// (N,): the leans in radians of shifts or raw angles (N,) of zero or more, as an estimator so corrected has them.
///
/// NaN stays NaN. A number is a factor by which the shift is divided.
#[pyfunction]
#[pyo3(signature = (
    correction: "float | AffineCorrection | PosteriorCorrection", shift: "ArrayLike",
) -> "NDArray[np.float64]")]
pub(crate) fn apply_correction<'py>(
    py: Python<'py>,
    correction: &Bound<'py, PyAny>,
    shift: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let correction = parse(correction, "correction")?;
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
