//! The one door for arrays: what comes in is checked for type, shape and content, what goes out is fresh.

use std::num::NonZero;
use std::thread;

use nalgebra::{Matrix3, SMatrix, Vector3};
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyList};
use pyo3::{IntoPyObjectExt, PyTypeCheck};
use tiltvp_core::Error;
use tiltvp_core::edges::Mask;
use tiltvp_core::geometry::{RigidMotion, Tilt};
use tiltvp_core::image::{ColorView, ImageView};

use crate::array::Array;
use crate::call::{exception, invalid};

/// Whether an array has masked values, which would be taken like others.
pub(crate) fn is_masked(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    // What is plainly an array has no mask.
    Ok(!value.is_exact_instance_of::<PyUntypedArray>()
        && value.py().import("numpy.ma")?.call_method1("is_masked", (value,))?.is_truthy()?)
}

/// Refuses an array with masked values.
pub(crate) fn refuse_masked(value: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyResult<()> {
    if is_masked(value)? {
        return Err(invalid(format!("{name}: an array with masked values, expected {expected} without")));
    }
    Ok(())
}

/// `numpy.asarray(value)`, refused unless it holds plain numbers.
fn numbers<'py>(value: &Bound<'py, PyAny>, name: &str, expected: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    refuse_masked(value, name, expected)?;
    let numpy = value.py().import("numpy")?;
    let array = numpy
        .call_method1("asarray", (value,))
        .map_err(|error| invalid(format!("{name}: cannot be made an array ({error}), expected {expected}")))?;
    let array = array.cast_into::<PyUntypedArray>()?;
    let kind: String = array.dtype().getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(invalid(format!("{name}: dtype {}, expected {expected} of real numbers", array.dtype())));
    }
    Ok(array)
}

/// The values of an array as `f64` in row order.
fn values(array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<f64>> {
    let flat = array.py().import("numpy")?.call_method1("require", (array, "float64", "CA"))?;
    flat.call_method1("reshape", (-1,))?.cast_into::<PyArray1<f64>>()?.to_vec().map_err(Into::into)
}

/// Rows of `K` numbers: `(N, K)`, or a single `(K,)`, which the second value tells. NaN is allowed.
pub(crate) fn rows<const K: usize>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<[f64; K]>, bool)> {
    let expected = format!("an array (N, {K}) or ({K},)");
    let array = numbers(value, name, &expected)?;
    let shape = array.shape().to_vec();
    let single = match shape.as_slice() {
        [k] if *k == K => true,
        [_, k] if *k == K => false,
        _ => return Err(invalid(format!("{name}: shape {shape:?}, expected {expected}"))),
    };
    Ok((values(&array)?.as_chunks::<K>().0.to_vec(), single))
}

/// A vector `(N,)`.
pub(crate) fn vector(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    refuse_masked(value, name, "an array (N,)")?;
    // Arrays as they mostly come are read without a detour through numpy.
    if let Some(values) = value.cast::<PyArray1<f64>>().ok().and_then(|array| array.to_vec().ok()) {
        return Ok(values);
    }
    if let Some(values) = value.cast::<PyArray1<i64>>().ok().and_then(|array| array.to_vec().ok()) {
        return Ok(values.into_iter().map(|value| value as f64).collect());
    }
    let array = numbers(value, name, "an array (N,)")?;
    if array.ndim() != 1 {
        return Err(invalid(format!("{name}: shape {:?}, expected an array (N,)", array.shape())));
    }
    values(&array)
}

/// A matrix `(R, C)`, or a vector `(R,)` where it has one column. NaN is allowed.
pub(crate) fn matrix<const R: usize, const C: usize>(
    value: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<SMatrix<f64, R, C>> {
    let shape: &[usize] = if C == 1 { &[R] } else { &[R, C] };
    let expected = if C == 1 { format!("an array ({R},)") } else { format!("an array ({R}, {C})") };
    let array = numbers(value, name, &expected)?;
    if array.shape() != shape {
        return Err(invalid(format!("{name}: shape {:?}, expected {expected}", array.shape())));
    }
    Ok(SMatrix::from_row_slice(&values(&array)?))
}

/// Lists as `to_dict` makes them, with NaN for None: JSON has no other number for what is not finite.
fn with_nan<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    if value.is_none() {
        return f64::NAN.into_bound_py_any(py);
    }
    let Ok(list) = value.cast::<PyList>() else { return Ok(value.clone()) };
    list.iter().map(|item| with_nan(&item)).collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
}

/// What `read` makes of an item of a dict, where it must be with NaN for None.
pub(crate) fn nullable<'py, T>(
    value: &Bound<'py, PyAny>,
    read: impl Fn(&Bound<'py, PyAny>) -> PyResult<T>,
) -> PyResult<T> {
    read(value).or_else(|error| read(&with_nan(value)?).map_err(|_| error))
}

/// A `(3, 3)` matrix.
pub(crate) fn matrix3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Matrix3<f64>> {
    matrix(value, name)
}

/// A `(3,)` vector.
pub(crate) fn vector3(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vector3<f64>> {
    matrix(value, name)
}

/// A lean from the ground normal in the robot frame, `(3,)` of any length but zero.
pub(crate) fn tilt(normal: &Bound<'_, PyAny>, name: &str) -> PyResult<Tilt> {
    let vector = vector3(normal, name)?;
    Tilt::from_normal(&vector)
        .ok_or_else(|| invalid(format!("{name}: {:?}, expected a finite vector that is not zero", vector.as_slice())))
}

/// A rigid motion from a `(4, 4)` matrix.
pub(crate) fn rigid_motion(value: &Bound<'_, PyAny>, name: &'static str) -> PyResult<RigidMotion> {
    RigidMotion::from_matrix(name, &matrix(value, name)?).map_err(|error| exception(&error))
}

/// A C-contiguous `(H, W)` array of bytes.
pub(crate) fn gray<'py>(value: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArray2<'py, u8>> {
    refuse_masked(value, name, "a (H, W) array of uint8")?;
    let Ok(array) = value.cast::<PyArray2<u8>>() else {
        return Err(invalid(format!("{name}: {}, expected a (H, W) array of uint8", describe(value))));
    };
    let array = array.try_readonly().map_err(|error| invalid(format!("{name}: {error}")))?;
    if !array.is_c_contiguous() {
        return Err(invalid(format!("{name}: strided, expected C-contiguous rows")));
    }
    Ok(array)
}

/// Such an array as the core sees it.
pub(crate) fn view<'a>(image: &'a PyReadonlyArray2<'_, u8>) -> PyResult<ImageView<'a>> {
    let shape = image.shape();
    let data = image.as_slice().map_err(|error| invalid(format!("image: {error}")))?;
    ImageView::new(data, shape[1], shape[0], shape[1]).map_err(|error| exception(&error))
}

/// A C-contiguous `(H, W, 3)` array of bytes.
pub(crate) fn color<'py>(value: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArray3<'py, u8>> {
    refuse_masked(value, name, "a (H, W, 3) array of uint8")?;
    let array = value.cast::<PyArray3<u8>>().ok().filter(|array| array.shape()[2] == 3);
    let Some(array) = array else {
        return Err(invalid(format!("{name}: {}, expected a (H, W, 3) array of uint8", describe(value))));
    };
    let array = array.try_readonly().map_err(|error| invalid(format!("{name}: {error}")))?;
    if !array.is_c_contiguous() {
        return Err(invalid(format!("{name}: strided, expected C-contiguous rows")));
    }
    Ok(array)
}

/// Such an array as the core sees it.
pub(crate) fn color_view<'a>(image: &'a PyReadonlyArray3<'_, u8>) -> PyResult<ColorView<'a>> {
    let shape = image.shape();
    let data = image.as_slice().map_err(|error| invalid(format!("image: {error}")))?;
    ColorView::new(data, shape[1], shape[0], 3 * shape[1]).map_err(|error| exception(&error))
}

/// A `(H, W)` array of bool, with its shape.
pub(crate) fn mask(value: &Bound<'_, PyAny>, name: &str) -> PyResult<(usize, usize, Vec<bool>)> {
    refuse_masked(value, name, "a (H, W) array of bool")?;
    let Ok(array) = value.cast::<PyArray2<bool>>() else {
        return Err(invalid(format!("{name}: {}, expected a (H, W) array of bool", describe(value))));
    };
    let (height, width) = (array.shape()[0], array.shape()[1]);
    let flat = array.call_method0("ravel")?.cast_into::<PyArray1<bool>>()?;
    Ok((height, width, flat.to_vec()?))
}

/// Fresh `(H, W)` array of bool.
pub(crate) fn to_mask<'py>(py: Python<'py>, mask: &Mask) -> PyResult<Bound<'py, PyArray2<bool>>> {
    let (width, height) = mask.size();
    let usable = (0..width * height).map(|i| mask.usable(i % width, i / width)).collect();
    PyArray1::from_vec(py, usable).reshape([height, width])
}

/// A number as an argument of Python. Anything else is taken by its look, which is refused with the argument's name.
pub(crate) struct Number(Result<f64, String>);

impl<'py> FromPyObject<'_, 'py> for Number {
    type Error = PyErr;

    #[cfg(feature = "stub")]
    const INPUT_TYPE: pyo3::inspect::PyStaticExpr = <f64 as FromPyObject<'_, 'py>>::INPUT_TYPE;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let number = value.extract().ok().filter(|_| !is_no_real(&value));
        Ok(Self(number.ok_or_else(|| shown(&value))))
    }
}

impl Number {
    /// The number of the argument of that name; refuses everything else, and whole numbers beyond floats.
    pub(crate) fn of(self, name: &str) -> PyResult<f64> {
        self.0.map_err(|look| invalid(format!("{name} = {look}, expected a number that a float can hold")))
    }
}

/// A word as an argument of Python. Anything else is a word too, its look, which no choice has: who looks for the choice says what
/// there is to choose.
pub(crate) struct Word(String);

impl<'py> FromPyObject<'_, 'py> for Word {
    type Error = PyErr;

    #[cfg(feature = "stub")]
    const INPUT_TYPE: pyo3::inspect::PyStaticExpr = <String as FromPyObject<'_, 'py>>::INPUT_TYPE;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self(value.extract().unwrap_or_else(|_| shown(&value))))
    }
}

impl Word {
    /// What it stands for.
    pub(crate) fn choose<T>(self, choice: impl FnOnce(&str) -> Result<T, Error>) -> PyResult<T> {
        choice(&self.0).map_err(|error| exception(&error))
    }
}

impl From<&str> for Word {
    fn from(word: &str) -> Self {
        Self(word.to_owned())
    }
}

/// How a refusal shows a value: what it is where it does not fit a line, as those of images do not.
pub(crate) fn shown(value: &Bound<'_, PyAny>) -> String {
    let look = value.repr().map_or_else(|_| "an object".to_owned(), |repr| repr.to_string());
    if look.len() > LONGEST_LOOK || look.contains('\n') { describe(value) } else { look }
}

/// Whether a value is no real number, though Python would make one of it: True and False, and of NumPy also complex numbers and texts.
pub(crate) fn is_no_real(value: &Bound<'_, PyAny>) -> bool {
    let is_of_numpy = || value.getattr("dtype").and_then(|dtype| dtype.getattr("kind")?.extract::<String>());
    !value.is_exact_instance_of::<PyFloat>()
        && (value.extract::<bool>().is_ok() || is_of_numpy().is_ok_and(|kind| !"iufO".contains(&kind)))
}

/// A number that the type can hold.
pub(crate) fn number<'py, T>(value: &Bound<'py, PyAny>, name: &str, expected: &str) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
{
    if is_no_real(value) {
        return Err(invalid(format!("{name} = {value}, expected {expected}")));
    }
    taken(value, name, expected)
}

/// What the type can hold.
pub(crate) fn taken<'py, T>(value: &Bound<'py, PyAny>, name: &str, expected: &str) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
{
    value.extract().map_err(|_| invalid(format!("{name} = {}, expected {expected}", shown(value))))
}

/// Of a whole number that no float can hold: there are no shorter ones than 309 digits.
const LONGEST_LOOK: usize = 500;

/// How many threads were asked for, but no more than four for each core: no answer depends on it, and thousands take longer to start
/// than all work.
pub(crate) fn threads(value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<usize>> {
    let Some(value) = value else { return Ok(None) };
    let asked: NonZero<usize> = number(value, "threads", "a whole number from 1")?;
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    Ok(Some(asked.get().min(4 * cores)))
}

/// A dict as `to_dict` makes it.
pub(crate) fn dict<'a, 'py>(values: &'a Bound<'py, PyAny>, name: &str) -> PyResult<&'a Bound<'py, PyDict>> {
    values.cast().map_err(|_| invalid(format!("{name}: {}, expected a dict as to_dict makes it", describe(values))))
}

/// An item of a dict as `to_dict` makes it.
pub(crate) fn item<'py, T>(values: &Bound<'py, PyDict>, key: &str, expected: &str) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
{
    let value = raw_item(values, key)?;
    value.extract().map_err(|_| invalid(format!("values[\"{key}\"] = {value}, expected {expected}")))
}

/// An item of a dict as `to_dict` makes it, of any type.
pub(crate) fn raw_item<'py>(values: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    let value = values.get_item(key)?;
    value.ok_or_else(|| invalid(format!("values: \"{key}\" is missing, expected a dict as to_dict makes it")))
}

/// Refuses a dict that has any other key than these.
pub(crate) fn known_keys(values: &Bound<'_, PyDict>, keys: &[&str]) -> PyResult<()> {
    for key in values.keys() {
        if !key.extract::<&str>().is_ok_and(|key| keys.contains(&key)) {
            return Err(invalid(format!("values: unknown key {key:?}, expected {}", keys.join(", "))));
        }
    }
    Ok(())
}

/// An object of a class of ours, such as `expected` says.
pub(crate) fn object<'a, 'py, T: PyTypeCheck>(
    value: &'a Bound<'py, PyAny>,
    name: &str,
    expected: &str,
) -> PyResult<&'a Bound<'py, T>> {
    value.cast().map_err(|_| invalid(format!("{name}: {}, expected {expected}", describe(value))))
}

/// What a value is, for a message.
pub(crate) fn describe(value: &Bound<'_, PyAny>) -> String {
    match value.cast::<PyUntypedArray>() {
        Ok(array) => {
            let hidden = if is_masked(value).unwrap_or(false) { " with masked values" } else { "" };
            format!("shape {:?} of {}{hidden}", array.shape(), array.dtype())
        }
        Err(_) => value.get_type().name().map_or_else(|_| "an object".to_owned(), |name| name.to_string()),
    }
}

/// Fresh `(N, K)` array, or `(K,)` for a single row.
pub(crate) fn to_rows<'py, const K: usize>(
    py: Python<'py>,
    rows: &[[f64; K]],
    single: bool,
) -> PyResult<Array<'py, f64>> {
    let flat = PyArray1::from_slice(py, rows.as_flattened());
    Ok(if single { Array::new(flat) } else { Array::new(flat.reshape([rows.len(), K])?) })
}

/// Fresh `(N, R, C)` array, or `(R, C)` for a single matrix.
pub(crate) fn to_matrices<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    matrices: &[SMatrix<f64, R, C>],
    single: bool,
) -> PyResult<Array<'py, f64>> {
    let array = PyArray1::from_vec(py, matrices.iter().flat_map(row_major).collect());
    Ok(if single { Array::new(array.reshape([R, C])?) } else { Array::new(array.reshape([matrices.len(), R, C])?) })
}

/// Fresh `(R, C)` array, or `(R,)` of one column.
pub(crate) fn to_matrix<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    m: &SMatrix<f64, R, C>,
) -> PyResult<Array<'py, f64>> {
    let flat = PyArray1::from_vec(py, row_major(m).collect());
    Ok(if C == 1 { Array::new(flat) } else { Array::new(flat.reshape([R, C])?) })
}

/// The entries, row by row.
pub(crate) fn row_major<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> impl Iterator<Item = f64> + '_ {
    (0..R * C).map(|i| m[(i / C, i % C)])
}
