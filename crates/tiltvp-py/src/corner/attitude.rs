//! What the closed form answers, as frozen Python values: `CornerAttitude` and `CornerAttitudes`.

use nalgebra::{Matrix3, Vector3};
use numpy::PyArray1;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use tiltvp_core::corner::{self as core, CornerCase};

use crate::array::Array;
use crate::call::invalid;
use crate::convert;
use crate::field::Field;
use crate::value::value;

value! {
    /// One attitude that the rays of a corner admit. Frozen, comparable (bit by bit), hashable, and to be pickled.
    CornerAttitude(core::CornerAttitude as own) {
        /// (3, 3): the rotation R in v_camera = R v_object, whose columns are the edge x, the edge y, and x cross y.
        camera_from_object: Matrix3<f64>,
        /// Fresh (3, 3) float64: the directions of the edges x, y, z away from the vertex, camera frame, one a row.
        edges: [Vector3<f64>; 3],
        /// The angle between the vertical edge and the line of sight to the vertex, in [0, pi] radians.
        alpha_rad: f64,
        /// Whether this is the second of the two interpretations (fig. 3c), the inner instead of the outer corner.
        mirrored: bool,
        /// How the edges of the imaginary box stand: "all-away", "one-perpendicular" or "one-toward".
        case: CornerCase,
        /// (3, 3) in squared radians: covariance of the rotation vector w, camera frame, of the error.
        ///
        /// The true rotation is exp(w) times `camera_from_object`. Infinite where two roots fall together.
        covariance_rad2: Matrix3<f64> = own.covariance,
        /// Radians of attitude per radian of the rays' angles about the vertex; infinite where roots fall together.
        sensitivity: f64,
        /// The logarithm of the volume of attitudes that a volume of the rays' angles admits, up to a constant.
        ln_volume: f64,
    }
    make core::CornerAttitude {
        camera_from_object,
        edges,
        alpha_rad,
        mirrored,
        case,
        covariance: covariance_rad2,
        sensitivity,
        ln_volume,
    };
}

#[pymethods]
impl CornerAttitude {
    /// Whether the edges x, y, z are a right-handed triple; the two interpretations differ in it.
    #[getter]
    fn right_handed(&self) -> bool {
        self.inner.is_right_handed()
    }
}

/// Cases go by name.
impl Field for CornerCase {
    type Attribute<'py> = &'static str;

    fn attribute(&self, _py: Python<'_>) -> PyResult<&'static str> {
        Ok(self.name())
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.name().into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let names = CornerCase::ALL.map(CornerCase::name).join(", ");
        let given: String = convert::taken(value, name, &names)?;
        let known = CornerCase::ALL.into_iter().find(|case| case.name() == given);
        known.ok_or_else(|| invalid(format!("{name} = {given:?}, expected one of {names}")))
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.push(*self as u64);
    }

    fn show(&self) -> Option<String> {
        Some(format!("{:?}", self.name()))
    }
}

value! {
    /// Every attitude of many corners, as arrays of as many rows as there are attitudes.
    ///
    /// Frozen, comparable, hashable, and to be pickled.
    CornerAttitudes as own {
        /// How many corners were asked for; as many attitudes or none may belong to each.
        corners: usize,
        /// Fresh (M,) int64: to which corner each attitude belongs, rising.
        corner: Vec<i64>,
        /// The attitudes, in that order.
        attitudes: Vec<CornerAttitude>,
    }
    check {
        let within = |(first, last): (&i64, &i64)| *first >= 0 && *last < corners as i64;
        let ends = corner.first().zip(corner.last());
        if corner.len() != attitudes.len() || !corner.is_sorted() || !ends.is_none_or(within) {
            let (got, expected) = (corner.len(), attitudes.len());
            return Err(invalid(format!(
                "values[\"corner\"]: {got} numbers, expected {expected} rising ones below {corners}"
            )));
        }
    };
    repr format!("CornerAttitudes({} of {} corners)", own.corner.len(), own.corners);
}

impl CornerAttitudes {
    pub(super) fn new(found: &[core::CornerAttitudes]) -> Self {
        let of = |(corner, found): (usize, &core::CornerAttitudes)| {
            found.iter().map(move |attitude| (corner as i64, CornerAttitude::from(*attitude))).collect::<Vec<_>>()
        };
        let (corner, attitudes) = found.iter().enumerate().flat_map(of).unzip();
        Self { corners: found.len(), corner, attitudes }
    }

    fn matrices<'py>(
        &self,
        py: Python<'py>,
        pick: fn(&core::CornerAttitude) -> Matrix3<f64>,
    ) -> PyResult<Array<'py, f64>> {
        let matrices: Vec<_> = self.attitudes.iter().map(|row| pick(&row.inner)).collect();
        convert::to_matrices(py, &matrices, false)
    }

    fn column<'py, T: numpy::Element + crate::array::Dtype>(
        &self,
        py: Python<'py>,
        pick: impl Fn(&core::CornerAttitude) -> T,
    ) -> Array<'py, T> {
        Array::new(PyArray1::from_iter(py, self.attitudes.iter().map(|row| pick(&row.inner))))
    }
}

#[pymethods]
impl CornerAttitudes {
    /// Fresh (M, 3, 3) float64: the rotations R in v_camera = R v_object.
    #[getter]
    fn camera_from_object<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.matrices(py, |attitude| attitude.camera_from_object)
    }

    /// (M, 3, 3): the directions of the edges x, y, z away from the vertex, camera frame, one a row.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        self.matrices(py, |attitude| Matrix3::from_columns(&attitude.edges).transpose())
    }

    /// Fresh (M,) float64: the angles between the vertical edge and the line of sight, radians.
    #[getter]
    fn alpha_rad<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.column(py, |attitude| attitude.alpha_rad)
    }

    /// Fresh (M,) bool: whether it is the second of two interpretations.
    #[getter]
    fn mirrored<'py>(&self, py: Python<'py>) -> Array<'py, bool> {
        self.column(py, |attitude| attitude.mirrored)
    }

    /// How the edges of the imaginary boxes stand, by name.
    #[getter]
    fn case(&self) -> Vec<&'static str> {
        self.attitudes.iter().map(|row| row.inner.case.name()).collect()
    }

    /// Fresh (M,) bool: whether the edges x, y, z are a right-handed triple.
    #[getter]
    fn right_handed<'py>(&self, py: Python<'py>) -> Array<'py, bool> {
        self.column(py, core::CornerAttitude::is_right_handed)
    }

    /// Fresh (M,) float64: radians of attitude per radian of the rays' angles about the vertex.
    #[getter]
    fn sensitivity<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.column(py, |attitude| attitude.sensitivity)
    }

    /// The attitudes of one corner, by its number.
    #[pyo3(signature = (corner: "SupportsIndex"))]
    fn of(&self, corner: &Bound<'_, PyAny>) -> PyResult<Vec<CornerAttitude>> {
        let corner: usize = convert::number(corner, "corner", &format!("a number below {}", self.corners))?;
        if corner >= self.corners {
            return Err(invalid(format!("corner = {corner}, expected a number below {}", self.corners)));
        }
        let [first, next] = [corner, corner + 1].map(|n| self.corner.partition_point(|own| *own < n as i64));
        Ok(self.attitudes[first..next].to_vec())
    }

    /// How many attitudes there are.
    fn __len__(&self) -> usize {
        self.attitudes.len()
    }
}
