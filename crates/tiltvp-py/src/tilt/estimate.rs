//! What an estimator answers, as frozen Python values: `TiltEstimate` and `EdgeElements`.

use nalgebra::{Matrix2, Vector3};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::tilt as core;

use super::report::FitReport;
use super::values;
use crate::array::Array;
use crate::call::invalid;
use crate::convert;
use crate::field::{Field, Flat};
use crate::value::value;

value! {
    /// The tilt of one image. Frozen, comparable (to the last bit), hashable, and to be pickled. True if there is a tilt.
    ///
    /// Without a tilt the angles and the normal are NaN, the covariance is infinite, the confidence 0, and `reason` says
    /// why.
    TiltEstimate as own {
        /// How far the robot leans, in [0, pi] radians (eq. 1).
        alpha_rad: f64,
        /// In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left (eq. 1).
        beta_rad: f64,
        /// Roll about the robot's x in radians, right side down positive (`Rz Ry Rx`, ROS REP 103).
        roll_rad: f64,
        /// Pitch about the robot's y in radians, nose down positive (`Rz Ry Rx`, ROS REP 103).
        pitch_rad: f64,
        /// (3,): the unit ground normal in the robot frame, (-sin a cos b, -sin a sin b, cos a) (eq. 1).
        normal: Vector3<f64>,
        /// (2, 2) in squared radians: covariance of the normal in its tangent plane.
        ///
        /// Its axes are the robot's x and y, turned by the smallest rotation that takes z to the normal. Pixels of one edge
        /// err together, so residuals are pooled over 64 sectors of azimuth; to them come the pull of a little unnoticed
        /// clutter, a fifth of the lean for methods that approximate the lens, and 0.17 degrees a side for what no image
        /// tells.
        covariance_rad2: Matrix2<f64>,
        /// Probability, in [0, 1], that the error (eq. 44) is below two degrees, were it normal with that covariance, and that no
        /// alternative is right.
        confidence: f64,
        /// Edge pixels in the elevation band; of the method of straight edges those that are part of one.
        edge_pixels: usize,
        /// Edge pixels that passed the prefilter and were not left out.
        prefiltered_pixels: usize,
        /// Edge pixels that agree with the estimate.
        inlier_pixels: usize,
        /// The shift l of the vanishing point in pixels (eq. 20), before any factor; None but for the image-space methods.
        shift_px: Option<f64>,
        /// Directions that may be up, the most probable first; only of the method "segments". The first is the tilt, where
        /// there is one.
        alternatives: Alternatives,
        /// How the fit went.
        report: Flat<FitReport>,
    }
    check {
        let tilt = values::lean(&normal, [alpha_rad, beta_rad, roll_rad, pitch_rad])?;
        if tilt.is_some_and(|tilt| tilt.normal() != normal) {
            return Err(invalid(format!("values[\"normal\"]: {:?}, expected a unit vector", normal.as_slice())));
        }
        if !(0.0..=1.0).contains(&confidence) {
            return Err(invalid(format!("values[\"confidence\"]: {confidence}, expected a probability from 0 to 1")));
        }
    };
    repr if own.found() {
        format!(
            "TiltEstimate(alpha_rad={:.5}, beta_rad={:.5}, confidence={:.3}, inlier_pixels={} of {}, {})",
            own.alpha_rad, own.beta_rad, own.confidence, own.inlier_pixels, own.edge_pixels, own.reason()
        )
    } else {
        format!("TiltEstimate(no tilt: {}, edge_pixels={})", own.reason(), own.edge_pixels)
    };
}

impl From<core::TiltEstimate> for TiltEstimate {
    fn from(found: core::TiltEstimate) -> Self {
        let [alpha_rad, beta_rad, roll_rad, pitch_rad] = values::angles(found.tilt.as_ref());
        Self {
            alpha_rad,
            beta_rad,
            roll_rad,
            pitch_rad,
            normal: values::normal(found.tilt.as_ref()),
            covariance_rad2: found.covariance_rad2,
            confidence: found.confidence,
            edge_pixels: found.edge_pixels,
            prefiltered_pixels: found.prefiltered_pixels,
            inlier_pixels: found.inlier_pixels,
            shift_px: found.shift_px,
            alternatives: Alternatives(found.alternatives.into_iter().flatten().map(TiltAlternative::from).collect()),
            report: Flat(FitReport {
                reason: found.reason(),
                ..FitReport::new(found.stop, found.iterations, found.residual_rms)
            }),
        }
    }
}

impl TiltEstimate {
    /// The part of it that a filter looks at.
    pub(super) fn measurement(&self) -> (Option<Tilt>, Matrix2<f64>, f64) {
        (Tilt::from_normal(&self.normal), self.covariance_rad2, self.confidence)
    }

    fn found(&self) -> bool {
        !self.alpha_rad.is_nan()
    }
}

#[pymethods]
impl TiltEstimate {
    /// Why the fit stopped, in a sentence: `report.reason`.
    #[getter]
    fn reason(&self) -> &str {
        &self.report.0.reason
    }

    /// Whether there is a tilt.
    fn __bool__(&self) -> bool {
        self.found()
    }
}

value! {
    /// A direction that may be up. Frozen, comparable, hashable, and to be pickled.
    TiltAlternative(core::Alternative as own) {
        /// (3,): the unit ground normal in the robot frame.
        normal: Vector3<f64>,
        /// Probability, in [0, 1], of being the right one of all.
        probability: f64,
    }
}

/// A list of values that stands in a dict only where there are some: most estimates have none.
#[derive(Clone)]
pub(crate) struct Alternatives(Vec<TiltAlternative>);

impl Field for Alternatives {
    type Attribute<'py> = Vec<TiltAlternative>;

    fn attribute(&self, py: Python<'_>) -> PyResult<Vec<TiltAlternative>> {
        self.0.attribute(py)
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.plain(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        Vec::read(value, name).map(Self)
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        self.0.bits(bits);
    }

    fn show(&self) -> Option<String> {
        self.0.show()
    }

    fn write(&self, values: &Bound<'_, PyDict>, key: &str) -> PyResult<()> {
        if self.0.is_empty() { Ok(()) } else { values.set_item(key, self.plain(values.py())?) }
    }

    fn take(values: &Bound<'_, PyDict>, key: &str) -> PyResult<Self> {
        values
            .get_item(key)?
            .map_or_else(|| Ok(Self(Vec::new())), |own| Self::read(&own, &format!("values[\"{key}\"]")))
    }
}

value! {
    /// The edge pixels of one image, in row order: where each is, its direction and offset, and what became of it.
    EdgeElements as own {
        /// (N,): columns.
        u: Vec<u16>,
        /// (N,): rows.
        v: Vec<u16>,
        /// (N,): gradient directions in [0, pi) radians (eq. 16).
        phi_rad: Vec<f64>,
        /// (N,): edge offsets s in pixels (eq. 17); NaN where the lens sees neither zenith nor nadir.
        offset_px: Vec<f64>,
        /// (N, 3): unit normals of the edges' great circles in the robot frame (eq. 37), of either sign.
        ///
        /// Those of the method, before any prefilter; NaN for the image-space methods, which have none.
        normal: Vec<[f32; 3]>,
        /// (N,): the pixels that passed the prefilter and were not left out.
        prefiltered: Vec<bool>,
        /// (N,): the pixels that agree with the estimate.
        inlier: Vec<bool>,
        /// Columns and rows of the image.
        size_px: (usize, usize),
    }
    check {
        let n = u.len();
        let others = [v.len(), phi_rad.len(), offset_px.len(), normal.len(), prefiltered.len(), inlier.len()];
        if others.iter().any(|m| *m != n) {
            return Err(invalid(format!("values: lists of different lengths, expected {n} of each")));
        }
        let (width, height) = size_px;
        let holds = |(u, v): (&u16, &u16)| usize::from(*u) < width && usize::from(*v) < height;
        if width.max(height) > usize::from(u16::MAX) || !u.iter().zip(&v).all(holds) {
            let expected = "those of an image that has these pixels, at most 65535";
            return Err(invalid(format!("values[\"size_px\"]: {size_px:?}, expected {expected}")));
        }
    };
    repr {
        let inliers = own.inlier.iter().filter(|inlier| **inlier).count();
        format!("EdgeElements({} edge pixels, {inliers} inliers)", own.u.len())
    };
}

impl EdgeElements {
    pub(super) fn new(elements: &[core::EdgeElement], size_px: (usize, usize)) -> Self {
        Self {
            u: elements.iter().map(|e| e.u).collect(),
            v: elements.iter().map(|e| e.v).collect(),
            phi_rad: elements.iter().map(|e| e.phi_rad).collect(),
            offset_px: elements.iter().map(|e| e.offset_px).collect(),
            normal: elements.iter().map(|e| e.normal).collect(),
            prefiltered: elements.iter().map(|e| e.prefiltered).collect(),
            inlier: elements.iter().map(|e| e.inlier).collect(),
            size_px,
        }
    }
}

#[pymethods]
impl EdgeElements {
    /// (H, W): the pixels that agree with the estimate, over the image.
    #[getter]
    fn inlier_mask<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, bool>> {
        let (width, height) = self.size_px;
        let mut mask = vec![false; width * height];
        for ((u, v), _) in self.u.iter().zip(&self.v).zip(&self.inlier).filter(|(_, inlier)| **inlier) {
            if let Some(place) = mask.get_mut(usize::from(*v) * width + usize::from(*u)) {
                *place = true;
            }
        }
        Ok(Array::new(PyArray1::from_vec(py, mask).reshape([height, width])?))
    }

    fn __len__(&self) -> usize {
        self.u.len()
    }
}

/// Normals of great circles: one array `(N, 3)` of doubles.
impl Field for Vec<[f32; 3]> {
    type Attribute<'py> = Array<'py, f64>;

    fn attribute<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        let entries = self.as_flattened().iter().copied().map(f64::from);
        Ok(Array::new(PyArray1::from_iter(py, entries).reshape([self.len(), 3])?))
    }

    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.into_bound_py_any(py)
    }

    fn read(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        convert::taken(value, name, "rows of three numbers")
    }

    fn bits(&self, bits: &mut Vec<u64>) {
        bits.push(self.len() as u64);
        for x in self.as_flattened() {
            f64::from(*x).bits(bits);
        }
    }

    fn show(&self) -> Option<String> {
        None
    }
}
