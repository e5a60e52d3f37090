//! Matches and dissimilarities of arrays of descriptors and patches.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::lines::{self as core, BearingGate, MatchOptions, Profiles, WideOptions};

use crate::call::{call_by, call_long, invalid};
use crate::convert::{self, Number};
use crate::lines::values::Lines;
use crate::options;

/// `(N, K)` numbers as `f32` in row order, and K.
pub(super) fn descriptors(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<f32>, usize, usize)> {
    convert::refuse_masked(value, name, "an (N, K) array of float32")?;
    let array = value
        .cast::<PyArray2<f32>>()
        .map_err(|_| invalid(format!("{name}: {}, expected an (N, K) array of float32", convert::describe(value))))?;
    let aligned = value.py().import("numpy")?.call_method1("require", (array, "float32", "CA"))?;
    Ok((aligned.cast::<PyArray2<f32>>()?.to_vec()?, array.shape()[0], array.shape()[1]))
}

/// Two sets of rows of equal width.
struct Pair {
    a: Vec<f32>,
    b: Vec<f32>,
    rows: [usize; 2],
    width: usize,
}

impl Pair {
    /// Whether to compare each with each may take longer than a person waits.
    fn is_long(&self) -> bool {
        self.a.len().saturating_mul(self.rows[1]) > 1 << 26
    }
}

fn pair(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<Pair> {
    let ((a, n, width), (b, m, other)) = (descriptors(a, "a")?, descriptors(b, "b")?);
    if width != other || width == 0 {
        return Err(invalid(format!("a, b: {width} and {other} values a row, expected as many, and at least one")));
    }
    Ok(Pair { a, b, rows: [n, m], width })
}

/// (M, 2): rows of `a` (N_A, K) and the rows of `b` (N_B, K) that are the same lines, by rising row of `a`.
///
/// The nearest descriptor, if its distance is at most `f1` (eq. 8 of Scaramuzza 2009), `f2` times the mean distance
/// (eq. 9), and `f3` times the second smallest (eq. 10). `mutual` asks for the nearest both ways, `ordered` for matches
/// in cyclic order, for rows by rising bearing. With bearings of `a` as expected in `b`, bearings of `b` and a greatest
/// difference, far lines are no candidates. Raises `tiltvp.errors.InvalidInputError`.
#[pyfunction]
#[pyo3(signature = (
    a: "NDArray[np.float32]", b: "NDArray[np.float32]", *, expected_rad: "ArrayLike | None" = None,
    seen_rad: "ArrayLike | None" = None, gate_rad=None, **options: "Option"
) -> "NDArray[np.int64]")]
pub(crate) fn match_descriptors<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    expected_rad: Option<&Bound<'py, PyAny>>,
    seen_rad: Option<&Bound<'py, PyAny>>,
    gate_rad: Option<Number>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let gate_rad = gate_rad.map(|number| number.of("gate_rad")).transpose()?;
    let pair = pair(a, b)?;
    let mut parsed = MatchOptions::default();
    options::set(&mut parsed, options)?;
    let bearings = match (expected_rad, seen_rad, gate_rad) {
        (Some(expected), Some(seen), Some(gate)) => {
            Some((convert::vector(expected, "expected_rad")?, convert::vector(seen, "seen_rad")?, gate))
        }
        (None, None, None) => None,
        _ => return Err(invalid("expected_rad, seen_rad, gate_rad: expected all three or none".to_owned())),
    };
    let matches = call_by(py, pair.is_long(), || {
        let gate = bearings.as_ref().map(|(expected_rad, seen_rad, gate_rad)| BearingGate {
            expected_rad,
            seen_rad,
            gate_rad: *gate_rad,
        });
        let (mut scratch, mut out) = (core::MatchScratch::default(), Vec::new());
        core::match_descriptors(&pair.a, &pair.b, pair.width, &parsed, gate.as_ref(), &mut scratch, &mut out)?;
        Ok(out)
    })?;
    pairs(py, matches.iter().map(|found| [found.a, found.b]))
}

/// `(M, 2)`.
fn pairs(py: Python<'_>, rows: impl Iterator<Item = [usize; 2]>) -> PyResult<Bound<'_, PyArray2<i64>>> {
    let flat: Vec<i64> = rows.flatten().map(|row| row as i64).collect();
    let count = flat.len() / 2;
    PyArray1::from_vec(py, flat).reshape([count, 2])
}

/// Pairs `(M, 2)` and confidences `(M,)`.
type WideMatches<'py> = (Bound<'py, PyArray2<i64>>, Bound<'py, PyArray1<f64>>);

/// (M, 2) and (M,): lines of an image and those of another, metres away, that are the same, and how confident that is.
///
/// `a` and `b` are the descriptors of the lines, of `descriptor_kind` "profile", (N_A, 190) and (N_B, 190) float32. One motion
/// of the camera in the plane must explain all matches; `ahead_rad` is its direction as the first and as the second image
/// see it, bearings in radians, where it is known, as by odometry. By rising line of the first image; confidences are
/// float64 from 0 to 1. Raises `tiltvp.errors.InvalidInputError`.
#[pyfunction]
#[pyo3(signature = (
    lines_a: "Lines", a: "NDArray[np.float32]", lines_b: "Lines", b: "NDArray[np.float32]", *,
    ahead_rad: "ArrayLike | None" = None, **options: "Option"
) -> "tuple[NDArray[np.int64], NDArray[np.float64]]")]
pub(crate) fn match_wide<'py>(
    py: Python<'py>,
    lines_a: &Bound<'py, PyAny>,
    a: &Bound<'py, PyAny>,
    lines_b: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    ahead_rad: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<WideMatches<'py>> {
    let ((a, ..), (b, ..)) = (descriptors(a, "a")?, descriptors(b, "b")?);
    let mut parsed = WideOptions::default();
    options::set(&mut parsed, options)?;
    let ahead = match ahead_rad.map(|ahead| convert::vector(ahead, "ahead_rad")).transpose()?.as_deref() {
        None => None,
        Some(&[first, second]) => Some([first, second]),
        Some(other) => {
            return Err(invalid(format!("ahead_rad: {} values, expected two bearings", other.len())));
        }
    };
    let first: &Bound<'_, Lines> = convert::object(lines_a, "lines_a", "Lines")?;
    let second: &Bound<'_, Lines> = convert::object(lines_b, "lines_b", "Lines")?;
    let (first, second) = (&first.get().inner, &second.get().inner);
    let matches = call_long(py, || {
        let (mut scratch, mut out) = (core::WideScratch::default(), Vec::new());
        let (a, b) = (Profiles { lines: first, values: &a }, Profiles { lines: second, values: &b });
        core::match_wide(&a, &b, ahead, &parsed, &mut scratch, &mut out)?;
        Ok(out)
    })?;
    let confidences = matches.iter().map(|found| found.confidence).collect();
    Ok((pairs(py, matches.iter().map(|found| [found.a, found.b]))?, PyArray1::from_vec(py, confidences)))
}

fn matrix<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    of: impl FnOnce(&[f32], &[f32], usize) -> Result<Vec<f64>, tiltvp_core::Error> + Send,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let pair = pair(a, b)?;
    let values = call_by(py, pair.is_long(), || of(&pair.a, &pair.b, pair.width))?;
    PyArray1::from_vec(py, values).reshape(pair.rows)
}

/// (N_A, N_B): Euclidean distances of descriptors, eq. 6 (Scaramuzza 2009).
#[pyfunction]
#[pyo3(signature = (a: "NDArray[np.float32]", b: "NDArray[np.float32]") -> "NDArray[np.float64]")]
pub(crate) fn descriptor_distances<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, a, b, |a, b, width| {
        let mut out = Vec::new();
        core::descriptor_distances(a, b, width, &mut out)?;
        Ok(out)
    })
}

/// (N_A, N_B): means of squared differences of patches (N, K), eq. 12 over the samples that both have.
#[pyfunction]
#[pyo3(signature = (a: "NDArray[np.float32]", b: "NDArray[np.float32]") -> "NDArray[np.float64]")]
pub(crate) fn ssd_matrix<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, a, b, core::ssd_matrix)
}

/// (N_A, N_B): zero-mean normalised cross-correlations of patches (N, K), eq. 13; 1 for equal ones.
#[pyfunction]
#[pyo3(signature = (a: "NDArray[np.float32]", b: "NDArray[np.float32]") -> "NDArray[np.float64]")]
pub(crate) fn zncc_matrix<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    matrix(py, a, b, core::zncc_matrix)
}
