//! A corner in one image: three fitted rays and the vertex in which they meet, by least squares in bearings.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::ray::{FittedRay, VARIANCE_MIN};
use super::triangulation::BearingObservation;
use crate::filter::chi_square_cdf;
use crate::geometry::{RigidMotion, tangent_basis, unit};

/// An edge of a corner, in the order in which rays are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Edge {
    /// The horizontal edge along the object's x axis.
    X,
    /// The vertical edge.
    Y,
    /// The other horizontal edge, at the angle gamma from the first.
    Z,
}

impl Edge {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its name: `"x"`, `"y"` or `"z"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// One vertex and three rays (the TROVE feature of Liu et al. 2018), with covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerFeature {
    rays: [FittedRay; 3],
    vertex: Vector3<f64>,
    vertex_covariance: Matrix2<f64>,
    residual_rad: f64,
    chi_square: f64,
    pub(super) pencil: Pencil,
}

/// Three half-planes through the bearing of the vertex, the rays' planes moved as little as their covariances allow, and
/// how their errors are correlated.
///
/// With the vertex off by `e` (tangent to it) and `noise` independent of `e`, the half-plane of ray i is turned about the
/// vertex by `lever[i] (normal[i] . e) + noise[i]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pencil {
    /// Unit bearing of the vertex.
    pub(super) vertex: Vector3<f64>,
    /// Unit normals of the planes, all orthogonal to the vertex.
    pub(super) normal: [Vector3<f64>; 3],
    /// Unit tangents at the vertex along the rays: the projected directions of the standard model.
    pub(super) along: [Vector3<f64>; 3],
    /// Covariance of the vertex, 3 x 3 with the vertex as null space, square radians.
    pub(super) vertex_covariance: Matrix3<f64>,
    /// How far a half-plane turns with the vertex.
    pub(super) lever: [f64; 3],
    /// Variance of a half-plane's angle about the vertex when the vertex is known, square radians.
    pub(super) noise: [f64; 3],
}

/// The share of all three lengths in [`length_score`]: among corners with equal shortest edges the one with the longer
/// others comes first.
const LENGTH_SHARE: f64 = 0.3;

/// Length beyond which an edge adds nothing more to that share, pixels: its direction is then known far better than the
/// corner is.
const LENGTH_ENOUGH_PX: f64 = 200.0;

/// How much three edges of these lengths (pixels) support a corner: the shortest length, which limits the accuracy, and a share
/// of all three.
pub(super) fn length_score(lengths: &[f64; 3]) -> f64 {
    let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
    shortest + LENGTH_SHARE * lengths.iter().map(|length| length.min(LENGTH_ENOUGH_PX)).sum::<f64>()
}

/// The least sine of an angle between two planes that have a vertex in common: below it rounding turns the vertex by
/// more than 1e-7 rad.
const PLANES_APART: f64 = 1e-9;

/// Gauss-Newton steps to the vertex. The problem is linear but for the weights, which hardly depend on where the vertex
/// is.
const VERTEX_STEPS: usize = 3;

/// Rays with normals along `vertex x toward`; none where a `toward` is at the vertex.
fn turned_about(vertex: &Vector3<f64>, mut rays: [FittedRay; 3]) -> Option<[FittedRay; 3]> {
    for ray in &mut rays {
        let side = vertex.cross(&ray.toward).dot(&ray.normal);
        if side.abs() < PLANES_APART {
            return None;
        }
        if side < 0.0 {
            *ray = ray.reversed();
        }
    }
    Some(rays)
}

impl CornerFeature {
    /// The feature of three rays, in the order x, y (the vertical one), z; the vertex minimises the sum of its squared
    /// distances to the three great circles, each by its variance there (eqs. 25 to 27 in bearings, weighted).
    ///
    /// The vertex is on the side of the `toward`s: rays are shorter than a quarter of a turn. `None` for rays that are not
    /// valid ([`FittedRay::is_valid`]), planes that coincide, and a `toward` at the vertex.
    pub fn from_rays(rays: [FittedRay; 3]) -> Option<Self> {
        if !rays.iter().all(FittedRay::is_valid) {
            return None;
        }
        let side: Vector3<f64> = rays.iter().map(|ray| ray.toward).sum();
        let mut vertex = [(0, 1), (1, 2), (2, 0)]
            .map(|(i, j): (usize, usize)| rays[i].normal.cross(&rays[j].normal))
            .into_iter()
            .max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?
            .try_normalize(PLANES_APART)?;
        if vertex.dot(&side) < 0.0 {
            vertex = -vertex;
        }
        // Before the fit: the rays of a feature then make the same feature again, to the last bit.
        let rays = turned_about(&vertex, rays)?;
        let spread = rays.map(|ray| ray.covariance_3d());
        let mut covariance = Matrix2::zeros();
        for _ in 0..VERTEX_STEPS {
            let basis = tangent_basis(&vertex);
            let (mut information, mut pull) = (Matrix2::zeros(), nalgebra::Vector2::zeros());
            for (ray, spread) in rays.iter().zip(&spread) {
                let variance = vertex.dot(&(spread * vertex)).max(VARIANCE_MIN);
                let across = basis.transpose() * ray.normal;
                information += across * across.transpose() / variance;
                pull += across * (ray.normal.dot(&vertex) / variance);
            }
            covariance = information.try_inverse()?;
            vertex = (vertex - basis * (covariance * pull)).try_normalize(0.5)?;
        }
        // Rays of which some are known exactly and others hardly: rounding may leave no covariance.
        covariance.cholesky()?;
        let rays = turned_about(&vertex, rays)?;
        let off = rays.map(|ray| ray.normal.dot(&vertex));
        let basis = tangent_basis(&vertex);
        let pencil = Pencil::new(vertex, &rays, &spread, basis * covariance * basis.transpose())?;
        let variance = spread.map(|spread| vertex.dot(&(spread * vertex)).max(VARIANCE_MIN));
        Some(Self {
            rays,
            vertex,
            vertex_covariance: covariance,
            residual_rad: (off.iter().map(|off| off * off).sum::<f64>() / 3.0).sqrt(),
            chi_square: off.iter().zip(variance).map(|(off, variance)| off * off / variance).sum(),
            pencil,
        })
    }

    /// The feature of exact bearings of any length but zero: the vertex, and one further point on each of the rays x, y
    /// (the vertical one) and z.
    ///
    /// `None` where a ray's point is at the vertex or opposite to it, or anything is zero or not finite.
    pub fn from_bearings(vertex: &Vector3<f64>, toward: &[Vector3<f64>; 3]) -> Option<Self> {
        let vertex = unit(vertex)?;
        let mut rays = [None; 3];
        for (ray, toward) in rays.iter_mut().zip(toward) {
            let toward = unit(toward)?;
            // The difference keeps what the cross product of nearly equal vectors loses.
            let normal = vertex.cross(&(toward - vertex)).try_normalize(PLANES_APART)?;
            *ray = Some(FittedRay { normal, covariance: Matrix2::zeros(), toward, support: 2, residual_rms_rad: 0.0 });
        }
        let [Some(x), Some(y), Some(z)] = rays else { return None };
        let rays = [x, y, z];
        let pencil = Pencil::new(vertex, &rays, &[Matrix3::zeros(); 3], Matrix3::zeros())?;
        Some(Self { rays, vertex, vertex_covariance: Matrix2::zeros(), residual_rad: 0.0, chi_square: 0.0, pencil })
    }

    /// The rays x, y (the vertical one), z, with normals turned so that `normal = vertex x toward` up to length.
    pub fn rays(&self) -> &[FittedRay; 3] {
        &self.rays
    }

    /// Whether every two rays are at least `least_rad` apart at the vertex. The rays of one edge, found twice, are not.
    pub(super) fn rays_apart(&self, least_rad: f64) -> bool {
        let along = self.rays.map(|ray| ray.normal.cross(&self.vertex).normalize());
        let most = least_rad.cos();
        along[0].dot(&along[1]) <= most && along[1].dot(&along[2]) <= most && along[2].dot(&along[0]) <= most
    }

    /// How many of its edges are seen: three, or the two of an L-junction, whose third ray has no support.
    pub(super) fn seen_edges(&self) -> usize {
        self.rays.iter().filter(|ray| ray.support > 0).count()
    }

    /// How well the rays support the corner, pixels: see [`length_score`].
    pub(super) fn support_score(&self) -> f64 {
        length_score(&self.rays.map(|ray| ray.support as f64))
    }

    /// Unit bearing of the vertex, camera frame.
    pub fn vertex(&self) -> Vector3<f64> {
        self.vertex
    }

    /// Covariance of the vertex in square radians, in the plane of [`tangent_basis`] at it.
    pub fn vertex_covariance(&self) -> Matrix2<f64> {
        self.vertex_covariance
    }

    /// The vertex as a camera of a rig observes it.
    pub(super) fn vertex_observation(&self, rig_from_camera: RigidMotion) -> BearingObservation {
        BearingObservation { bearing: self.vertex, covariance: self.vertex_covariance, rig_from_camera }
    }

    /// Root mean square of the vertex' distances from the three great circles, radians.
    pub fn residual_rad(&self) -> f64 {
        self.residual_rad
    }

    /// The same, squared, each by its variance, and summed: chi-square of one degree of freedom if the covariances are
    /// right and the three edges meet.
    pub fn chi_square(&self) -> f64 {
        self.chi_square
    }

    /// The probability that three edges that do meet have a larger `chi_square`: small values refuse the vertex.
    pub fn meets_probability(&self) -> f64 {
        1.0 - chi_square_cdf(self.chi_square, 1)
    }
}

impl Pencil {
    fn new(
        vertex: Vector3<f64>,
        rays: &[FittedRay; 3],
        spread: &[Matrix3<f64>; 3],
        vertex_covariance: Matrix3<f64>,
    ) -> Option<Self> {
        let (mut normal, mut along) = ([Vector3::zeros(); 3], [Vector3::zeros(); 3]);
        let (mut lever, mut noise) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            let to_vertex = spread[i] * vertex;
            let variance = vertex.dot(&to_vertex).max(VARIANCE_MIN);
            let moved = rays[i].normal - to_vertex * (rays[i].normal.dot(&vertex) / variance);
            // Rounding leaves a trace of the vertex, which the orthogonality of the pencil is too good for.
            normal[i] = (moved - vertex * vertex.dot(&moved)).try_normalize(0.5)?;
            along[i] = normal[i].cross(&vertex);
            lever[i] = along[i].dot(&to_vertex) / variance;
            noise[i] = (along[i].dot(&(spread[i] * along[i])) - lever[i] * along[i].dot(&to_vertex)).max(0.0);
        }
        Some(Self { vertex, normal, along, vertex_covariance, lever, noise })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use nalgebra::Vector2;

    /// A ray of a vertex along z in the direction `angle`, its plane shifted from the vertex by `off`, with these variances
    /// of the shift and of the angle.
    fn ray(angle: f64, off: f64, variances: [f64; 2]) -> FittedRay {
        let (sin, cos) = angle.sin_cos();
        let normal = (Vector3::new(-sin, cos, 0.0) * off.cos() + Vector3::z() * off.sin()).normalize();
        let basis = tangent_basis(&normal);
        let (shift, turn) = (basis.transpose() * Vector3::z(), basis.transpose() * Vector3::new(cos, sin, 0.0));
        let covariance = shift * shift.transpose() * variances[0] + turn * turn.transpose() * variances[1];
        let toward = Vector3::new(0.2 * cos, 0.2 * sin, 1.0).normalize();
        FittedRay { normal, covariance, toward, support: 9, residual_rms_rad: 0.0 }
    }

    #[test]
    fn the_vertex_is_nearest_to_the_three_by_their_variances() {
        let even = [1e-6, 1e-6];
        let rays = [ray(0.0, 1e-3, even), ray(2.0, 1e-3, even), ray(-2.0, 1e-3, even)];
        let feature = CornerFeature::from_rays(rays).unwrap();
        // Along the plane's normals: least squares of (sin w, -cos w) v = off.
        let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for angle in [0.0f64, 2.0, -2.0] {
            let across = Vector2::new(angle.sin(), -angle.cos());
            matrix += across * across.transpose();
            right += across * 1e-3;
        }
        let expected = matrix.try_inverse().unwrap() * right;
        assert_abs_diff_eq!(feature.vertex().xy(), expected, epsilon = 1e-8);
        assert!(feature.residual_rad() > 1e-4 && feature.chi_square() > 0.01);
        // One ray that is worth next to nothing leaves the vertex to the others.
        let rays = [ray(0.0, 0.0, even), ray(2.0, 0.0, even), ray(-2.0, 1e-2, [1.0, 1.0])];
        let feature = CornerFeature::from_rays(rays).unwrap();
        assert_abs_diff_eq!(feature.vertex().xy(), Vector2::zeros(), epsilon = 1e-6);
        assert!(feature.meets_probability() > 0.9);
        let sure = [1e-12, 1e-12];
        let rays = [ray(0.0, 1e-3, sure), ray(2.0, 1e-3, sure), ray(-2.0, 1e-3, sure)];
        assert!(CornerFeature::from_rays(rays).unwrap().meets_probability() < 1e-6);
    }

    #[test]
    fn signs_of_normals_and_the_order_of_calls_do_not_matter() {
        let rays = [ray(0.1, 1e-3, [2e-6, 1e-6]), ray(2.0, 0.0, [1e-6, 3e-6]), ray(-2.2, -1e-3, [1e-6, 1e-6])];
        let feature = CornerFeature::from_rays(rays).unwrap();
        let turned = CornerFeature::from_rays([rays[0].reversed(), rays[1], rays[2].reversed()]).unwrap();
        assert_abs_diff_eq!(feature.vertex(), turned.vertex(), epsilon = 1e-12);
        assert_abs_diff_eq!(feature.vertex_covariance(), turned.vertex_covariance(), epsilon = 1e-16);
        for (a, b) in feature.rays().iter().zip(turned.rays()) {
            assert_abs_diff_eq!(a.normal, b.normal, epsilon = 1e-12);
            assert_abs_diff_eq!(a.covariance, b.covariance, epsilon = 1e-16);
            assert!(feature.vertex().cross(&a.toward).dot(&a.normal) > 0.0);
        }
        for made in [feature, turned] {
            assert_eq!(CornerFeature::from_rays(*made.rays()).unwrap(), made);
        }
        for plane in feature.pencil.normal {
            assert_abs_diff_eq!(plane.dot(&feature.vertex()), 0.0, epsilon = 1e-15);
        }
    }

    #[test]
    fn what_is_no_feature() {
        let even = [1e-6, 1e-6];
        let rays = [ray(0.0, 0.0, even), ray(2.0, 0.0, even), ray(-2.0, 0.0, even)];
        assert!(CornerFeature::from_rays([rays[0], rays[0], rays[0]]).is_none());
        let mut at_vertex = rays;
        at_vertex[1].toward = Vector3::z();
        assert!(CornerFeature::from_rays(at_vertex).is_none());
        for spoil in [
            |ray: &mut FittedRay| ray.normal *= 2.0,
            |ray: &mut FittedRay| ray.toward.x = f64::NAN,
            |ray: &mut FittedRay| ray.covariance[(0, 0)] = -1.0,
            |ray: &mut FittedRay| ray.covariance[(0, 1)] = 1.0,
        ] {
            let mut spoilt = rays;
            spoil(&mut spoilt[2]);
            assert!(!spoilt[2].is_valid() && CornerFeature::from_rays(spoilt).is_none());
        }
    }

    #[test]
    fn long_edges_support_a_corner_and_the_shortest_of_them_most() {
        let score = |x, y, z| length_score(&[x, y, z]);
        assert_abs_diff_eq!(score(10.0, 20.0, 30.0), 28.0, epsilon = 1e-12);
        assert!(score(20.0, 20.0, 20.0) > score(10.0, 20.0, 45.0));
        assert_abs_diff_eq!(score(200.0, 500.0, 900.0), 380.0, epsilon = 1e-12);
    }

    #[test]
    fn rays_are_apart_where_every_two_of_them_are() {
        let apart = |angles: [f64; 3]| {
            let rays = angles.map(|angle| ray(angle, 0.0, [1e-6, 1e-6]));
            CornerFeature::from_rays(rays).unwrap().rays_apart(0.1)
        };
        assert!(apart([0.0, 2.0, -2.0]) && apart([0.0, 0.11, 0.22]));
        assert!(!apart([0.0, 0.09, 2.0]) && !apart([2.0, 0.0, 0.09]) && !apart([0.09, 2.0, 0.0]));
    }
}
