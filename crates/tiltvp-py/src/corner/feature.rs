//! `CornerFeature`: one vertex and three rays as a frozen Python value.

use nalgebra::{Matrix2, Vector3};
use pyo3::prelude::*;
use tiltvp_core::corner::{self as core, FittedRay};

use crate::array::Array;
use crate::call::invalid;
use crate::convert;
use crate::value::value;

value! {
    /// One vertex and the three rays x, y (the vertical one) and z of a corner, as one camera sees it.
    ///
    /// Frozen, comparable, and to be pickled.
    CornerFeature(core::CornerFeature as own) {
        /// (3, 3), rows x, y, z: unit normals of the rays' great circles, `vertex x toward` up to length.
        normals: [Vector3<f64>; 3] = own.rays().map(|ray| ray.normal),
        /// Fresh (3, 2, 2) float64: covariance of each normal in its tangent plane, square radians.
        ray_covariances_rad2: [Matrix2<f64>; 3] = own.rays().map(|ray| ray.covariance),
        /// Fresh (3, 3) float64, rows x, y, z: a unit bearing near the far end of each ray.
        toward: [Vector3<f64>; 3] = own.rays().map(|ray| ray.toward),
        /// How many places of each ray it was fitted to; 0 of the edge of an L-junction that is not seen.
        support_px: [usize; 3] = own.rays().map(|ray| ray.support),
        /// Root mean square distance of these from each ray, radians.
        ray_rms_rad: [f64; 3] = own.rays().map(|ray| ray.residual_rms_rad),
    }
    make {
        let rays = std::array::from_fn(|i| FittedRay {
            normal: normals[i],
            covariance: ray_covariances_rad2[i],
            toward: toward[i],
            support: support_px[i],
            residual_rms_rad: ray_rms_rad[i],
        });
        let inner = core::CornerFeature::from_rays(rays);
        inner.ok_or_else(|| invalid("values: rays that are not valid or do not meet".to_owned()))?
    };
    repr {
        let (vertex, [x, y, z]) = (own.vertex(), own.rays().map(|ray| ray.support));
        format!("CornerFeature(vertex ({:.4}, {:.4}, {:.4}), support {x} {y} {z} px)", vertex.x, vertex.y, vertex.z)
    };
}

#[pymethods]
impl CornerFeature {
    /// Fresh (3,) float64: unit bearing of the vertex, camera frame.
    #[getter]
    fn vertex<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.vertex())
    }

    /// Fresh (2, 2) float64: covariance of the vertex in its tangent plane, square radians.
    #[getter]
    fn vertex_covariance_rad2<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        convert::to_matrix(py, &self.inner.vertex_covariance())
    }

    /// Root mean square of the vertex' distances from the three rays' great circles, radians.
    #[getter]
    fn residual_rad(&self) -> f64 {
        self.inner.residual_rad()
    }

    /// The probability that three edges that do meet miss their vertex by more.
    #[getter]
    fn meets_probability(&self) -> f64 {
        self.inner.meets_probability()
    }
}
