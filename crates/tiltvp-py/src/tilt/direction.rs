//! `common_direction`: the robust core on normals that the user brings.

use nalgebra::{Matrix2, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::tilt::{self as core, CommonDirectionOptions};

use super::report::FitReport;
use crate::call::call;
use crate::convert;
use crate::field::{Field, Flat};
use crate::options;
use crate::value::value;

value! {
    /// A direction orthogonal to most of the normals. Frozen, comparable, hashable, pickled. True if there is one.
    CommonDirection as own {
        /// Fresh (3,) float64: the unit direction on the prior's side; NaN if the normals do not determine one.
        direction: Vector3<f64>,
        /// (2, 2) in squared radians: covariance in the tangent plane of the direction; infinite without one.
        ///
        /// Its axes are x and y, turned by the smallest rotation that takes z to the direction.
        covariance_rad2: Matrix2<f64>,
        /// Fresh (N,) bool: the normals whose great circles pass within three sigma_rad of the direction.
        inliers: Vec<bool>,
        /// How the fit went; the residual is in radians.
        report: Flat<FitReport>,
    }
    repr {
        let inliers = own.inliers.iter().filter(|inlier| **inlier).count();
        let (direction, reason) = (own.direction.show().unwrap_or_default(), &own.report.0.reason);
        if own.__bool__() {
            format!("CommonDirection(direction={direction}, {inliers} of {} inliers, {reason})", own.inliers.len())
        } else {
            format!("CommonDirection(none: {reason})")
        }
    };
}

#[pymethods]
impl CommonDirection {
    /// Whether there is a direction.
    fn __bool__(&self) -> bool {
        self.direction.iter().all(|x| x.is_finite())
    }
}

/// The direction most nearly orthogonal to great-circle normals (N, 3) of any length but zero and of either sign.
///
/// For people who bring line segments of their own, found in any central image: the normal of a segment's great circle
/// is the cross product of the bearings of its ends. `weights` (N,) are zero or more; None: all 1.
///
/// Raises `tiltvp.errors.InvalidInputError` for wrong shapes, zero or non-finite rows, negative weights and options out
/// of their domain. Too few or degenerate normals, and those of which no more agree than would by chance, give an
/// answer without a direction, and a reason. Two always have a direction in common, which no third one bears out: of pairs
/// at random 6 % have one within 20 degrees of the prior, and an answer.
#[pyfunction]
#[pyo3(signature = (normals: "ArrayLike", *, weights: "ArrayLike | None" = None, **options: "Option | None"))]
pub(crate) fn common_direction(
    py: Python<'_>,
    normals: &Bound<'_, PyAny>,
    weights: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<CommonDirection> {
    let normals: Vec<_> = convert::rows::<3>(normals, "normals")?.0.into_iter().map(Into::into).collect();
    let weights = weights.map(|w| convert::vector(w, "weights")).transpose()?;
    let parsed = options::given(CommonDirectionOptions::default(), options)?;
    let found = call(py, || core::common_direction(&normals, weights.as_deref(), &parsed))?;
    Ok(CommonDirection {
        direction: found.direction.unwrap_or(Vector3::repeat(f64::NAN)),
        covariance_rad2: found.covariance_rad2,
        inliers: found.inliers,
        report: Flat(FitReport::new(found.stop, found.iterations, found.residual_rms_rad)),
    })
}
