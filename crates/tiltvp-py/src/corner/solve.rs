//! The functions of `tiltvp.corner`: closed form, screening, resolution, triangulation and poses.

use nalgebra::{Matrix2, Matrix3, Vector3};
use pyo3::prelude::*;
use tiltvp_core::Error;
use tiltvp_core::corner::{
    self as core, Alignment, BearingObservation, CornerOptions, FittedRay, IncludedAngle, Screening, View,
};
use tiltvp_core::filter::positive_semidefinite;

use super::attitude::{CornerAttitude, CornerAttitudes};
use super::feature::CornerFeature;
use super::pose::CornerPose;
use super::prior;
use super::resolved::ResolvedAttitude;
use crate::array::Array;
use crate::call::{call, exception, invalid};
use crate::convert::{self, Number, Word};

/// A feature from exact bearings, or what is wrong with them.
fn exact(vertex: [f64; 3], rays: [[f64; 3]; 3], place: &str) -> PyResult<core::CornerFeature> {
    core::CornerFeature::from_bearings(&vertex.into(), &rays.map(Vector3::from)).ok_or_else(|| {
        invalid(format!(
            "vertex, x_ray, y_ray, z_ray{place}: zero, not finite, or a ray's point at the vertex or opposite to it, \
             expected the bearing of the vertex and of a further point on each ray"
        ))
    })
}

fn is_unit(vector: &Vector3<f64>) -> bool {
    (vector.norm_squared() - 1.0).abs() < 1e-6
}

/// Every attitude that a corner seen at exact bearings may have; see `tiltvp.corner.solve`.
#[pyfunction]
#[pyo3(signature = (vertex: "ArrayLike", x_ray: "ArrayLike", y_ray: "ArrayLike", z_ray: "ArrayLike", gamma_rad))]
pub(crate) fn solve_corner(
    py: Python<'_>,
    vertex: &Bound<'_, PyAny>,
    x_ray: &Bound<'_, PyAny>,
    y_ray: &Bound<'_, PyAny>,
    z_ray: &Bound<'_, PyAny>,
    gamma_rad: Number,
) -> PyResult<Vec<CornerAttitude>> {
    let gamma_rad = gamma_rad.of("gamma_rad")?;
    let vector = |value, name| convert::vector3(value, name).map(<[f64; 3]>::from);
    let rays = [vector(x_ray, "x_ray")?, vector(y_ray, "y_ray")?, vector(z_ray, "z_ray")?];
    let feature = exact(vector(vertex, "vertex")?, rays, "")?;
    let found = call(py, || core::corner_attitudes(&feature, &IncludedAngle::exact(gamma_rad)))?;
    Ok(found.iter().map(|attitude| CornerAttitude::from(*attitude)).collect())
}

/// The same for many corners at once: (N, 3) arrays, and one included angle or one for each.
#[pyfunction]
#[pyo3(signature = (
    vertex: "ArrayLike", x_ray: "ArrayLike", y_ray: "ArrayLike", z_ray: "ArrayLike", gamma_rad: "ArrayLike",
))]
pub(crate) fn solve_corners(
    py: Python<'_>,
    vertex: &Bound<'_, PyAny>,
    x_ray: &Bound<'_, PyAny>,
    y_ray: &Bound<'_, PyAny>,
    z_ray: &Bound<'_, PyAny>,
    gamma_rad: &Bound<'_, PyAny>,
) -> PyResult<CornerAttitudes> {
    let rows = |value, name| match convert::rows::<3>(value, name)? {
        (rows, false) => Ok(rows),
        (_, true) => Err(invalid(format!("{name}: shape [3], expected an array (N, 3)"))),
    };
    let vertex = rows(vertex, "vertex")?;
    let rays = [rows(x_ray, "x_ray")?, rows(y_ray, "y_ray")?, rows(z_ray, "z_ray")?];
    // An array of one would pass for a number, with a warning.
    let many = gamma_rad.getattr("ndim").and_then(|ndim| ndim.extract::<usize>()).is_ok_and(|ndim| ndim > 0);
    let gamma = match (!many && !convert::is_no_real(gamma_rad)).then(|| gamma_rad.extract::<f64>()) {
        Some(Ok(gamma)) => vec![gamma; vertex.len()],
        _ => convert::vector(gamma_rad, "gamma_rad")?,
    };
    let lengths = [rays[0].len(), rays[1].len(), rays[2].len(), gamma.len()];
    if lengths.iter().any(|length| *length != vertex.len()) {
        return Err(invalid(format!(
            "x_ray, y_ray, z_ray, gamma_rad: {lengths:?} rows, expected {}, as vertex has",
            vertex.len()
        )));
    }
    let mut features = Vec::with_capacity(vertex.len());
    for (i, vertex) in vertex.iter().enumerate() {
        features.push(exact(*vertex, [rays[0][i], rays[1][i], rays[2][i]], &format!(", row {i}"))?);
    }
    let found: Vec<_> = call(py, || {
        let each = features.iter().zip(&gamma);
        each.map(|(feature, gamma)| core::corner_attitudes(feature, &IncludedAngle::exact(*gamma))).collect()
    })?;
    Ok(CornerAttitudes::new(&found))
}

/// A corner from unit bearings along its rays, each by weighted least squares.
///
/// `x`, `y`, `z` are (N, 3) arrays, from the vertex outwards; `sigma_rad` is the standard deviation of each across its ray.
#[pyfunction]
#[pyo3(signature = (x: "ArrayLike", y: "ArrayLike", z: "ArrayLike", sigma_rad))]
pub(crate) fn fit_corner(
    py: Python<'_>,
    x: &Bound<'_, PyAny>,
    y: &Bound<'_, PyAny>,
    z: &Bound<'_, PyAny>,
    sigma_rad: Number,
) -> PyResult<CornerFeature> {
    let sigma_rad = sigma_rad.of("sigma_rad")?;
    if !(sigma_rad > 0.0 && sigma_rad.is_finite()) {
        return Err(invalid(format!("sigma_rad = {sigma_rad}, expected a standard deviation above 0, finite")));
    }
    let mut given = Vec::new();
    for (value, name) in [(x, "x"), (y, "y"), (z, "z")] {
        let (rows, single) = convert::rows::<3>(value, name)?;
        if single || rows.len() < 2 {
            return Err(invalid(format!("{name}: expected an array (N, 3) of at least two bearings")));
        }
        if let Some(row) = rows.iter().position(|row| !is_unit(&Vector3::from(*row))) {
            return Err(invalid(format!("{name}: row {row} is {:?}, expected a unit vector", rows[row])));
        }
        given.push(rows);
    }
    let fit = |rows: &Vec<[f64; 3]>| {
        let bearings: Vec<Vector3<f64>> = rows.iter().map(|row| Vector3::from(*row)).collect();
        FittedRay::fit(&bearings, &vec![sigma_rad; rows.len()], bearings.last()?)
    };
    let rays = call(py, || Ok(given.iter().map(fit).collect::<Option<Vec<_>>>()))?;
    let feature = rays.and_then(|rays| core::CornerFeature::from_rays(rays.try_into().ok()?));
    feature.map(CornerFeature::from).ok_or_else(|| {
        invalid("x, y, z: rays that are no great circles or do not meet, expected three that do".to_owned())
    })
}

/// Every attitude that a feature admits, with covariance; see `tiltvp.corner.attitudes`.
#[pyfunction]
pub(crate) fn corner_attitudes(
    py: Python<'_>,
    feature: &Bound<'_, CornerFeature>,
    gamma_rad: Number,
    gamma_sigma_rad: Number,
) -> PyResult<Vec<CornerAttitude>> {
    let (gamma_rad, gamma_sigma_rad) = (gamma_rad.of("gamma_rad")?, gamma_sigma_rad.of("gamma_sigma_rad")?);
    let feature = &feature.get().inner;
    let found = call(py, || core::corner_attitudes(feature, &IncludedAngle { gamma_rad, sigma_rad: gamma_sigma_rad }))?;
    Ok(found.iter().map(|attitude| CornerAttitude::from(*attitude)).collect())
}

/// Why a feature is no corner of that angle, in a sentence; None if it is one.
#[pyfunction]
pub(crate) fn screen_corner(feature: &Bound<'_, CornerFeature>, gamma_rad: Number) -> PyResult<Option<String>> {
    let gamma_rad = gamma_rad.of("gamma_rad")?;
    let screening = Screening::of(&feature.get().inner, &IncludedAngle::exact(gamma_rad)).map_err(|e| exception(&e))?;
    let degrees = f64::to_degrees;
    Ok(match screening {
        Screening::Passes => None,
        Screening::HorizontalAngle { projected_rad, least_rad } => Some(format!(
            "the horizontal edges are {:.2} degrees apart in the image, not more than the {:.2} that they include",
            degrees(projected_rad),
            degrees(least_rad)
        )),
        Screening::VerticalAngle { projected_rad, least_rad } => Some(format!(
            "a horizontal edge is {:.2} degrees from the vertical one in the image, less than {:.2}",
            degrees(projected_rad),
            degrees(least_rad)
        )),
        Screening::NoRoot { projected_rad } => Some(format!(
            "a horizontal edge is {:.2} degrees from the vertical one in the image, too few for the other angles",
            degrees(projected_rad)
        )),
    })
}

/// The included angle of the horizontal edges and its standard deviation; None where the vertex is seen horizontally.
#[pyfunction]
#[pyo3(signature = (feature, vertical: "ArrayLike", vertical_covariance_rad2: "ArrayLike"))]
pub(crate) fn included_angle(
    feature: &Bound<'_, CornerFeature>,
    vertical: &Bound<'_, PyAny>,
    vertical_covariance_rad2: &Bound<'_, PyAny>,
) -> PyResult<Option<(f64, f64)>> {
    let vertical = convert::vector3(vertical, "vertical")?;
    if !is_unit(&vertical) {
        return Err(invalid(format!("vertical: of length {}, expected a unit vector", vertical.norm())));
    }
    let covariance = convert::matrix3(vertical_covariance_rad2, "vertical_covariance_rad2")?;
    if !positive_semidefinite(&covariance) {
        return Err(invalid(
            "vertical_covariance_rad2: no covariance, expected symmetric and positive semidefinite".to_owned(),
        ));
    }
    let found = core::included_angle(&feature.get().inner, &vertical, &covariance);
    Ok(found.map(|angle| (angle.gamma_rad, angle.sigma_rad)))
}

/// What is known of an object and its attitude before its corners are looked at, by name.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct KnownBeforehand<'py> {
    gamma_rad: Number,
    gamma_sigma_rad: Number,
    right_handed: Option<bool>,
    priors: Bound<'py, PyAny>,
}

impl KnownBeforehand<'_> {
    fn options(self) -> PyResult<CornerOptions> {
        Ok(CornerOptions {
            angle: IncludedAngle {
                gamma_rad: self.gamma_rad.of("gamma_rad")?,
                sigma_rad: self.gamma_sigma_rad.of("gamma_sigma_rad")?,
            },
            right_handed: self.right_handed,
            priors: prior::parse(&self.priors)?,
            ..CornerOptions::default()
        })
    }
}

/// The attitudes that several features agree on, the likeliest first; see `tiltvp.corner.resolve`.
#[pyfunction]
#[pyo3(signature = (
    features: "Sequence[CornerFeature]", common_from_camera: "Sequence[ArrayLike]", known: "Mapping[str, Any]",
    alignment,
))]
#[expect(clippy::needless_pass_by_value, reason = "lists are extracted")]
pub(crate) fn resolve_corners(
    py: Python<'_>,
    features: Vec<Bound<'_, CornerFeature>>,
    common_from_camera: Vec<Bound<'_, PyAny>>,
    known: KnownBeforehand<'_>,
    alignment: Word,
) -> PyResult<Vec<ResolvedAttitude>> {
    let names = Alignment::ALL.map(Alignment::name).join(", ");
    let alignment = alignment.choose(|word| {
        let found = Alignment::ALL.into_iter().find(|known| known.name() == word);
        found.ok_or_else(|| Error::argument("alignment", word, format!("one of {names}")))
    })?;
    if features.len() != common_from_camera.len() {
        let (a, b) = (features.len(), common_from_camera.len());
        return Err(invalid(format!("common_from_camera: {b} rotations, expected {a}, one of each feature")));
    }
    let CornerOptions { angle, right_handed, priors, .. } = known.options()?;
    let mut rotations = Vec::new();
    for rotation in &common_from_camera {
        rotations.push(convert::matrix3(rotation, "common_from_camera")?);
    }
    let features: Vec<_> = features.iter().map(|feature| feature.get().inner).collect();
    let resolved = call(py, || {
        let found: Vec<_> = features.iter().map(|f| core::corner_attitudes(f, &angle)).collect::<Result<_, _>>()?;
        let views: Vec<_> = found
            .iter()
            .zip(&rotations)
            .map(|(attitudes, rotation)| View { attitudes, common_from_camera: *rotation })
            .collect();
        core::resolve(&views, alignment, right_handed, &priors)
    })?;
    Ok(resolved.into_iter().map(ResolvedAttitude::from).collect())
}

/// The poses that explain the features of a pair of cameras, the likeliest first; see `tiltvp.corner.poses`.
#[pyfunction]
#[pyo3(signature = (left, right, left_from_right: "ArrayLike", known: "Mapping[str, Any]", fuse))]
pub(crate) fn corner_poses(
    py: Python<'_>,
    left: &Bound<'_, CornerFeature>,
    right: &Bound<'_, CornerFeature>,
    left_from_right: &Bound<'_, PyAny>,
    known: KnownBeforehand<'_>,
    fuse: bool,
) -> PyResult<Vec<CornerPose>> {
    let options = CornerOptions { fuse, ..known.options()? };
    let motion = convert::rigid_motion(left_from_right, "left_from_right")?;
    let (left, right) = (&left.get().inner, &right.get().inner);
    let poses = call(py, || core::corner_poses(left, right, &motion, &options))?;
    Ok(poses.into_iter().map(CornerPose::from).collect())
}

/// The point that bearings of two or more cameras meet in: (3,) metres, (3, 3) square metres, and chi-square; None where
/// they are parallel or the point would be behind a camera.
#[pyfunction]
#[expect(clippy::type_complexity, clippy::needless_pass_by_value, reason = "a tuple of arrays; lists are extracted")]
#[pyo3(signature = (
    bearings: "ArrayLike", covariances_rad2: "Sequence[ArrayLike]", rig_from_camera: "Sequence[ArrayLike]",
))]
pub(crate) fn triangulate<'py>(
    py: Python<'py>,
    bearings: &Bound<'py, PyAny>,
    covariances_rad2: Vec<Bound<'py, PyAny>>,
    rig_from_camera: Vec<Bound<'py, PyAny>>,
) -> PyResult<Option<(Array<'py, f64>, Array<'py, f64>, f64)>> {
    let (rows, single) = convert::rows::<3>(bearings, "bearings")?;
    if single || rows.len() != covariances_rad2.len() || rows.len() != rig_from_camera.len() {
        return Err(invalid(format!(
            "bearings, covariances_rad2, rig_from_camera: {}, {} and {}, expected as many of each",
            rows.len(),
            covariances_rad2.len(),
            rig_from_camera.len()
        )));
    }
    let mut sightings = Vec::new();
    for ((row, covariance), camera) in rows.iter().zip(&covariances_rad2).zip(&rig_from_camera) {
        let bearing = Vector3::from(*row);
        if !is_unit(&bearing) {
            return Err(invalid(format!("bearings: {row:?}, expected unit vectors")));
        }
        let covariance: Matrix2<f64> = convert::matrix(covariance, "covariances_rad2")?;
        if !positive_semidefinite(&covariance) {
            return Err(invalid(
                "covariances_rad2: no covariance, expected symmetric and positive semidefinite".to_owned(),
            ));
        }
        sightings.push(BearingObservation {
            bearing,
            covariance,
            rig_from_camera: convert::rigid_motion(camera, "rig_from_camera")?,
        });
    }
    let found = call(py, || Ok(core::triangulate(&sightings)))?;
    let Some(found) = found else { return Ok(None) };
    let covariance: Matrix3<f64> = found.covariance_m2;
    let point = convert::to_matrix(py, &found.point_m)?;
    Ok(Some((point, convert::to_matrix(py, &covariance)?, found.chi_square)))
}
