//! The attitude of a corner in closed form (section III): every root, both interpretations, covariance.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::standard_model::{CornerCase, Projected};
use crate::corner::feature::{CornerFeature, Edge, Pencil};
use crate::error::Result;
use crate::options;
use crate::options::{Between, NOT_NEGATIVE};

options! {
    /// The included angle of the horizontal edges.
    #[derive(Copy)]
    pub struct IncludedAngle {
        /// The angle gamma between the edges x and z, radians.
        gamma_rad: f64 = FRAC_PI_2 => Between(0.0, PI), "an angle strictly between 0 and pi";
        /// Its standard deviation, radians; 0 where it is known exactly.
        [as "gamma_sigma_rad"] sigma_rad: f64 = 0.0 => NOT_NEGATIVE, "a standard deviation, finite and not negative";
    }
}

/// How far an angle may be from the right one and be meant as such, radians: 1.5708 is, and 1.57.
const RIGHT_WITHIN_RAD: f64 = 1e-3;

/// The included angle that is meant by one in few digits: the right one, or itself.
pub(in crate::corner) fn meant_by(gamma_rad: f64) -> f64 {
    if (gamma_rad - FRAC_PI_2).abs() <= RIGHT_WITHIN_RAD { FRAC_PI_2 } else { gamma_rad }
}

impl IncludedAngle {
    /// A right angle, exactly.
    pub const RIGHT: Self = Self { gamma_rad: FRAC_PI_2, sigma_rad: 0.0 };

    /// An angle that is known exactly.
    pub fn exact(gamma_rad: f64) -> Self {
        Self { gamma_rad, sigma_rad: 0.0 }
    }

    /// cos gamma, exactly 0 for the right angle.
    pub(super) fn cosine(&self) -> f64 {
        if self.gamma_rad == FRAC_PI_2 { 0.0 } else { self.gamma_rad.cos() }
    }
}

/// One attitude that the rays of a corner admit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerAttitude {
    /// The rotation that takes vectors of the object's frame to the camera's. The object's y axis runs along the vertical
    /// edge, away from the vertex, its x axis along the edge x, its z axis is x cross y.
    pub camera_from_object: Matrix3<f64>,
    /// The directions of the edges x, y, z away from the vertex, camera frame, unit vectors.
    pub edges: [Vector3<f64>; 3],
    /// The angle between the vertical edge and the line of sight to the vertex, in [0, pi] radians: below a right angle the
    /// edge points away from the camera.
    pub alpha_rad: f64,
    /// Whether this is the second of the two interpretations (fig. 3c), in which every edge of the imaginary box points to
    /// the other side of the image's parallel plane through the vertex: the inner instead of the outer corner.
    pub mirrored: bool,
    /// How the edges of the imaginary box stand to the line of sight.
    pub case: CornerCase,
    /// Covariance of the attitude in square radians: of the rotation vector `w`, camera frame, with which the true
    /// `camera_from_object` is `exp(w)` times this one.
    pub covariance: Matrix3<f64>,
    /// Radians of attitude per radian of the rays' angles about the vertex (the Frobenius norm of the Jacobian): infinite
    /// where two roots fall together or the vertical edge runs along the line of sight.
    pub sensitivity: f64,
    /// Logarithm of the volume of attitudes per volume of the rays' angles about the vertex, `|d attitude / d angles|`: what
    /// makes one of two roots likelier than the other before anything else is known.
    pub ln_volume: f64,
}

impl CornerAttitude {
    /// The direction of an edge away from the vertex, camera frame, a unit vector.
    pub fn edge(&self, edge: Edge) -> Vector3<f64> {
        self.edges[edge as usize]
    }

    /// Whether the edges x, y, z are a right-handed triple: whether the edge z is on the side of the object's z axis. The
    /// two interpretations differ in it, so the object determines the interpretation.
    pub fn is_right_handed(&self) -> bool {
        self.camera_from_object.column(2).dot(&self.edges[2]) > 0.0
    }
}

/// Up to four attitudes: two roots in two interpretations each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerAttitudes {
    found: [Option<CornerAttitude>; 4],
    count: usize,
}

impl CornerAttitudes {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether no attitude projects to such rays.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The attitudes, by rising angle between the vertical edge and the line of sight; of each pair first the plain one.
    pub fn iter(&self) -> impl Iterator<Item = &CornerAttitude> {
        self.found.iter().flatten()
    }

    /// One of them, in the order of [`iter`](Self::iter).
    pub fn get(&self, index: usize) -> Option<&CornerAttitude> {
        self.found.get(index)?.as_ref()
    }

    fn push(&mut self, attitude: CornerAttitude) {
        if let Some(place) = self.found.get_mut(self.count) {
            *place = Some(attitude);
            self.count += 1;
        }
    }
}

/// Every attitude under which a vertical and two horizontal edges that include `angle` look like the feature's rays.
///
/// None means that there is no such attitude (see [`Screening`](crate::corner::Screening) for why).
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) for an included angle that is none.
pub fn corner_attitudes(feature: &CornerFeature, angle: &IncludedAngle) -> Result<CornerAttitudes> {
    angle.validate()?;
    let pencil = &feature.pencil;
    let projected = Projected::of(pencil);
    let flipped = projected.flipped();
    let case = projected.case(flipped);
    let mut out = CornerAttitudes { found: [None; 4], count: 0 };
    for root in roots(&projected, angle.cosine()).into_iter().flatten() {
        for mirrored in [false, true] {
            let away = mirrored == (flipped == Some(Edge::Y));
            out.push(attitude(pencil, &projected, root, away, angle, mirrored, case));
        }
    }
    Ok(out)
}

/// Rounding of the discriminant, relative to the sizes of its terms, and of `C^2 - G^2`: about fifty units in the last
/// place, for some ten operations. The test of edges perpendicular to the line of sight needs it.
const ROUNDING: f64 = 1e-14;

/// The roots `t = tan^2 alpha >= 0` of
///
/// ```text
/// (C + t A B) / sqrt((1 + t A^2)(1 + t B^2)) = G,
/// ```
///
/// which is eq. 38 with its side condition (39), by rising t. Squared it is `a t^2 + b t + c = 0` with
///
/// ```text
/// a = A^2 B^2 (1 - G^2),  b = 2 A B C - G^2 (A^2 + B^2),  c = C^2 - G^2,  b^2 - 4 a c = G^2 D,
/// D = G^2 (A^2 - B^2)^2 + 4 A B (A - B C)(B - A C),
/// ```
///
/// where `(A - B C)(B - A C) = -S^2 (d_y x d_z)(d_y x d_x)` with `S = d_z x d_x`, because the directions lie in a plane. So
/// the discriminant is a square times D whatever G, and a right angle is nothing special. With
/// `t = (-b + s G sqrt D) / 2 a` the side condition reads `sign(G S^2 + s sqrt D) = sign(A B)`, and since
/// `D - G^2 S^4 = 4 A B (A - B C)(B - A C)(1 - G^2)`, it picks `s = sign(A B)` if that is positive; else both roots if
/// `sign G = sign(A B)`, and none if not.
pub(crate) fn roots(projected: &Projected, g: f64) -> [Option<f64>; 2] {
    let ([pa, pb, pc], [sx, sy, sz]) = (projected.cos, projected.sin);
    let product = pa * pb;
    // (A - B C)(B - A C), of which d_y x d_x is minus d_x x d_y.
    let between = sy * sy * sx * sz;
    let (first, second) = (g * g * (pa - pb).powi(2) * (pa + pb).powi(2), 4.0 * product * between);
    let d = first + second;
    if d < -ROUNDING * (g * g + second.abs()) {
        return [None; 2];
    }
    let width = g * d.max(0.0).sqrt();
    let a = product * product * (1.0 - g) * (1.0 + g);
    let b = 2.0 * product * pc - g * g * (pa * pa + pb * pb);
    let c = (pc - g) * (pc + g);
    let root = |s: f64| {
        let width = s * width;
        // Of the two forms of a root the one without cancellation.
        let t = if (b <= 0.0) == (width >= 0.0) { (width - b) / (2.0 * a) } else { 2.0 * c / (-b - width) };
        if t.is_finite() && t >= 0.0 {
            // No zero with a sign, of which the angle would be less than none.
            Some(t + 0.0)
        } else {
            (c.abs() <= ROUNDING && t < 0.0 && t > -1e-6).then_some(0.0)
        }
    };
    // With two rays in one line the other root of the square has the cosine 0.
    if second > 0.0 || (second == 0.0 && product != 0.0 && g * product >= 0.0) {
        return [root(product.signum()), None];
    }
    if product == 0.0 {
        // One edge perpendicular to the line of sight (III-B): b^2 is the discriminant, and C must have the sign of G.
        return if pc * g >= 0.0 && b != 0.0 { [root(-g.signum()), None] } else { [None; 2] };
    }
    if g * product <= 0.0 {
        return [None; 2];
    }
    match (root(1.0), root(-1.0)) {
        (Some(p), Some(q)) if p == q => [Some(p), None],
        (Some(p), Some(q)) => [Some(p.min(q)), Some(p.max(q))],
        (p, q) => [p.or(q), None],
    }
}

/// The largest step that the correction of rounding may be, radians. Half of the digits are lost at most (two equal
/// roots), 1e-8 rad; a larger step is no rounding.
const CORRECTION_MAX: f64 = 1e-4;

/// Rotations smaller than this, in radians, equal their first-order term to rounding: the second-order term is half of
/// the square, 5e-19.
const FIRST_ORDER: f64 = 1e-9;

/// Radians of attitude per radian of the rays' angles from which on the attitude is not determined: rounding of the rays alone, 1e-16
/// rad, then turns it by a tenth of a radian.
const UNDETERMINED: f64 = 1e15;

/// The attitude of one root in one interpretation, with its covariance.
///
/// An edge of the half-plane of `d` at the angle `a` from the line of sight `v` is `sin a d + cos a v`. With the vertical
/// edge at alpha, an edge perpendicular to it has `cot a = -tan alpha (d . d_y)`.
///
/// The edges stay in their planes: `n_i . (w x E_i) = -dn_i . E_i` for each, three linear equations `M w = r` for the small
/// rotation `w` that a change of the planes brings, whose rows are `E_i x n_i = sin a v - cos a d`. `r` is linear in the
/// errors of the pencil.
fn attitude(
    pencil: &Pencil,
    projected: &Projected,
    t: f64,
    away: bool,
    angle: &IncludedAngle,
    mirrored: bool,
    case: CornerCase,
) -> CornerAttitude {
    let [pa, pb, _] = projected.cos;
    let sign = if away { 1.0 } else { -1.0 };
    let tau = sign * t.sqrt();
    let across = (1.0 + t).sqrt();
    let horizontal = |cos: f64| {
        let length = (1.0 + t * cos * cos).sqrt();
        (1.0 / length, -tau * cos / length)
    };
    let leaning = [horizontal(pa), (t.sqrt() / across, sign / across), horizontal(pb)];
    let mut edges = [0, 1, 2].map(|i: usize| pencil.along[i] * leaning[i].0 + pencil.vertex * leaning[i].1);
    let third = edges[0].cross(&edges[1]);
    let mut rotation = Matrix3::from_columns(&[edges[0], edges[1], third]);

    let row = |i: usize| pencil.vertex * leaning[i].0 - pencil.along[i] * leaning[i].1;
    let rows = [row(0), row(1), row(2)];
    let matrix = Matrix3::from_columns(&rows).transpose();
    let undetermined = CornerAttitude {
        camera_from_object: rotation,
        edges,
        alpha_rad: leaning[1].0.atan2(leaning[1].1),
        mirrored,
        case,
        covariance: Matrix3::from_diagonal_element(f64::INFINITY),
        sensitivity: f64::INFINITY,
        ln_volume: f64::INFINITY,
    };
    let Some(inverse) = matrix.try_inverse().filter(|inverse| inverse.iter().all(|x| x.abs() < UNDETERMINED)) else {
        return undetermined;
    };

    // The z edge of the included angle beside the one of the root: what rounding has left of the equation.
    let side = third.dot(&edges[2]).signum();
    let (sin_gamma, cos_gamma) = (angle.gamma_rad.sin(), angle.cosine());
    let correction = inverse.column(2) * -pencil.normal[2].dot(&(edges[0] * cos_gamma + third * (side * sin_gamma)));
    if correction.norm() < CORRECTION_MAX {
        rotation = if correction.norm_squared() < FIRST_ORDER * FIRST_ORDER {
            rotation + correction.cross_matrix() * rotation
        } else {
            Rotation3::new(correction).matrix() * rotation
        };
        edges = [
            rotation.column(0).into_owned(),
            rotation.column(1).into_owned(),
            rotation.column(0) * cos_gamma + rotation.column(2) * (side * sin_gamma),
        ];
    }

    let opening = rotation.column(2) * (side * cos_gamma) - rotation.column(0) * sin_gamma;
    let spread = right_hand_side_covariance(pencil, &leaning, pencil.normal[2].dot(&opening) * angle.sigma_rad);
    let covariance = inverse * spread * inverse.transpose();
    if !covariance.iter().all(|x| x.is_finite()) {
        return undetermined;
    }
    let mut squares = 0.0;
    for (column, (sine, _)) in inverse.column_iter().zip(leaning) {
        squares += column.norm_squared() * sine * sine;
    }
    CornerAttitude {
        camera_from_object: rotation,
        edges,
        // No sine below zero, nor a zero with a sign: both are rounding of an edge along the line of sight.
        alpha_rad: (edges[1].dot(&pencil.along[1]).max(0.0) + 0.0).atan2(edges[1].dot(&pencil.vertex)),
        mirrored,
        case,
        covariance: 0.5 * (covariance + covariance.transpose()),
        sensitivity: squares.sqrt(),
        ln_volume: (leaning[0].0 * leaning[1].0 * leaning[2].0 * inverse.determinant().abs()).ln(),
    }
}

/// The covariance of the attitude with these edges, and its covariance with the error of the vertex' bearing; none where the attitude
/// is not determined.
pub(in crate::corner) fn with_vertex(
    feature: &CornerFeature,
    edges: &[Vector3<f64>; 3],
    gamma_sigma_rad: f64,
) -> Option<(Matrix3<f64>, Matrix3<f64>)> {
    let pencil = &feature.pencil;
    let leaning = [0, 1, 2].map(|i: usize| (edges[i].dot(&pencil.along[i]), edges[i].dot(&pencil.vertex)));
    let rows = [0, 1, 2].map(|i: usize| pencil.vertex * leaning[i].0 - pencil.along[i] * leaning[i].1);
    let inverse = Matrix3::from_columns(&rows).transpose().try_inverse()?;
    let pulled = [0, 1, 2].map(|i: usize| pencil.normal[i] * (leaning[i].1 + pencil.lever[i] * leaning[i].0));
    let opening = edges[1].cross(&edges[2]);
    let spread = right_hand_side_covariance(pencil, &leaning, pencil.normal[2].dot(&opening) * gamma_sigma_rad);
    let with = inverse * Matrix3::from_columns(&pulled).transpose() * pencil.vertex_covariance;
    Some((inverse * spread * inverse.transpose(), with))
}

/// The covariance of the right-hand side `r` of [`attitude`]'s equations; `leaning` holds the sine and cosine of each edge's
/// angle from the line of sight, `gamma_sigma` is what an uncertain gamma adds to the third equation, as a standard deviation.
///
/// `r_i = (cos a_i + lever_i sin a_i) n_i . e + sin a_i noise_i`.
fn right_hand_side_covariance(pencil: &Pencil, leaning: &[(f64, f64); 3], gamma_sigma: f64) -> Matrix3<f64> {
    let mut spread = Matrix3::zeros();
    let pulled = [0, 1, 2].map(|i: usize| pencil.normal[i] * (leaning[i].1 + pencil.lever[i] * leaning[i].0));
    for i in 0..3 {
        let moved = pencil.vertex_covariance * pulled[i];
        for j in 0..3 {
            spread[(i, j)] = pulled[j].dot(&moved);
        }
        spread[(i, i)] += leaning[i].0 * leaning[i].0 * pencil.noise[i];
    }
    spread[(2, 2)] += gamma_sigma.powi(2);
    spread
}
