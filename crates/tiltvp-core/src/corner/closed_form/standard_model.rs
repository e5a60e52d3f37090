//! The standard type of a feature (section II-A): three half-planes about the vertex, none of the gaps above 180 degrees.

use nalgebra::Vector3;

use crate::corner::feature::{CornerFeature, Edge, Pencil};

/// How the edges of the imaginary box stand to the line of sight to the vertex (sections III-A to III-C).
///
/// The box is that of the standard type in its plain interpretation, so that its vertical edge points away; the mirrored
/// interpretation has every edge the other way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CornerCase {
    /// All edges point away (III-A).
    AllAway,
    /// One horizontal edge is perpendicular to the line of sight (III-B).
    OnePerpendicular,
    /// One horizontal edge points towards the camera (III-C): there may be two roots.
    OneToward,
}

impl CornerCase {
    /// Every case.
    pub const ALL: [Self; 3] = [Self::AllAway, Self::OnePerpendicular, Self::OneToward];

    /// Its name: `"all-away"`, `"one-perpendicular"` or `"one-toward"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::AllAway => "all-away",
            Self::OnePerpendicular => "one-perpendicular",
            Self::OneToward => "one-toward",
        }
    }
}

/// The cosine below which an edge counts as perpendicular to the line of sight: a thousand times the rounding of a
/// fitted ray, and far below any ray that can be measured. It names the case and changes no attitude.
const PERPENDICULAR: f64 = 1e-9;

/// A feature as the standard type sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandardType {
    /// The ray that is reversed to make the feature one of standard type: the one between the sides of a gap above 180
    /// degrees. None where it is one already.
    pub flipped: Option<Edge>,
    /// The included angle of the box' horizontal edges, radians: gamma, or pi - gamma where one of them is reversed.
    pub gamma_rad: f64,
    /// The projected angle of the x and z rays, in [0, pi] radians.
    pub horizontal_rad: f64,
    /// The projected angles of the x and the z ray with the vertical one, in [0, pi] radians.
    pub vertical_rad: [f64; 2],
    /// How the box' edges stand.
    pub case: CornerCase,
}

/// Sines and cosines of the angles between the projected directions of a pencil.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projected {
    /// `A = d_x . d_y`, `B = d_z . d_y`, `C = d_x . d_z`.
    pub(crate) cos: [f64; 3],
    /// `d_y x d_z`, `d_z x d_x`, `d_x x d_y`, each the sine that lacks the ray of its place.
    pub(crate) sin: [f64; 3],
}

impl Projected {
    pub(crate) fn of(pencil: &Pencil) -> Self {
        let [x, y, z] = &pencil.along;
        let sine = |a: &Vector3<f64>, b: &Vector3<f64>| pencil.vertex.dot(&a.cross(b));
        Self { cos: [x.dot(y), z.dot(y), x.dot(z)], sin: [sine(y, z), sine(z, x), sine(x, y)] }
    }

    /// The ray whose reversal makes all sines alike in sign, which is what "no gap above 180 degrees" means.
    pub(crate) fn flipped(&self) -> Option<Edge> {
        let [x, y, z] = self.sin;
        if y * z >= 0.0 && x * y >= 0.0 && x * z >= 0.0 {
            return None;
        }
        // The odd one out; a zero goes with either sign.
        Edge::ALL.into_iter().find(|edge| {
            let [own, first, second] = match edge {
                Edge::X => [x, y, z],
                Edge::Y => [y, z, x],
                Edge::Z => [z, x, y],
            };
            own * first <= 0.0 && own * second <= 0.0
        })
    }

    pub(crate) fn case(&self, flipped: Option<Edge>) -> CornerCase {
        let [a, b, _] = self.cos;
        let sign = |edge| if flipped == Some(Edge::Y) || flipped == Some(edge) { -1.0 } else { 1.0 };
        let largest = f64::max(sign(Edge::X) * a, sign(Edge::Z) * b);
        if largest.abs() <= PERPENDICULAR {
            CornerCase::OnePerpendicular
        } else if largest < 0.0 {
            CornerCase::AllAway
        } else {
            CornerCase::OneToward
        }
    }
}

impl StandardType {
    /// The standard type of a feature whose horizontal edges include the angle `gamma_rad`.
    pub fn of(feature: &CornerFeature, gamma_rad: f64) -> Self {
        let projected = Projected::of(&feature.pencil);
        let flipped = projected.flipped();
        let turned = |first: Edge, second: Edge, sin: f64, cos: f64| {
            let reversed = flipped == Some(first) || flipped == Some(second);
            sin.abs().atan2(if reversed { -cos } else { cos })
        };
        let ([a, b, c], [x, y, z]) = (projected.cos, projected.sin);
        Self {
            flipped,
            gamma_rad: if matches!(flipped, Some(Edge::X | Edge::Z)) {
                std::f64::consts::PI - gamma_rad
            } else {
                gamma_rad
            },
            horizontal_rad: turned(Edge::X, Edge::Z, y, c),
            vertical_rad: [turned(Edge::X, Edge::Y, z, a), turned(Edge::Z, Edge::Y, x, b)],
            case: projected.case(flipped),
        }
    }
}
