//! The pose of a corner from its rays, the further edges at the ends of its edges, and known lengths: least squares.

use nalgebra::{Cholesky, Matrix2, Matrix3, Matrix6, Rotation3, SMatrix, SVector, Vector3};

use super::far_edges::SeenEnd;
use crate::corner::closed_form::attitude::IncludedAngle;
use crate::corner::feature::CornerFeature;
use crate::corner::ray::{FittedRay, PlaneMiss};

/// Rotation vector, vertex, included angle, and the three lengths.
const UNKNOWNS: usize = 10;
const GAMMA: usize = 6;
const LENGTHS: usize = 7;

/// The most Gauss-Newton steps: a hypothesis that needs more does not fit.
const STEPS_MAX: usize = 12;

/// The step, in radians and in shares of the distance, below which it has converged: a thousandth of what a perfect image
/// resolves (1e-7).
const CONVERGED: f64 = 1e-10;

/// What is known of the lengths of the edges x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct KnownLengths {
    /// Metres.
    pub(crate) lengths_m: [Option<f64>; 3],
    /// Standard deviation of each, metres.
    pub(crate) sigma_m: f64,
}

/// A pose with scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SizedPose {
    /// The rotation from the frame of the edges x and y to the camera's.
    pub(crate) camera_from_object: Matrix3<f64>,
    /// The edges, camera frame.
    pub(crate) edges: [Vector3<f64>; 3],
    /// The vertex, camera frame, metres.
    pub(crate) vertex_m: Vector3<f64>,
    /// Covariance of rotation vector and vertex, as the rays' covariances have it.
    pub(crate) covariance: Matrix6<f64>,
    /// The lengths of the edges whose ends are seen, metres.
    pub(crate) lengths_m: [Option<f64>; 3],
    /// The standard deviations of these, as the rays' covariances have it; 0 for a length that is known exactly, and without one.
    pub(crate) length_sigmas_m: [f64; 3],
    /// Sum of the squared misses of all lines and known numbers, in standard deviations.
    pub(crate) chi_square: f64,
    /// Its degrees of freedom.
    pub(crate) freedom: usize,
}

impl SizedPose {
    /// Root mean square misfit per degree of freedom.
    pub(crate) fn misfit(&self) -> f64 {
        (self.chi_square / self.freedom.max(1) as f64).sqrt()
    }
}

/// Moves an attitude, and the place that the known lengths tell with it, to the least squares of the three rays, of the edges that
/// begin at the ends seen, of the lengths and of the included angle, each by its covariance.
///
/// The plane of a line with the direction `E` through the point `P` has the normal `P x E`; the end of the edge i is at
/// `P + L_i E_i`. None where no end of a known length is seen, and where nothing is found.
pub(crate) fn fit_sized(
    corner: &CornerFeature,
    edges: &[Vector3<f64>; 3],
    ends: &[(SeenEnd, f64)],
    known: &KnownLengths,
    angle: &IncludedAngle,
) -> Option<SizedPose> {
    let third = edges[0].cross(&edges[1]);
    let side = third.dot(&edges[2]).signum();
    let scales: Vec<f64> =
        ends.iter().filter_map(|(end, share)| known.lengths_m[end.axis].map(|length_m| length_m / share)).collect();
    if scales.is_empty() {
        return None;
    }
    let distance_m = scales.iter().sum::<f64>() / scales.len() as f64;
    let mut state = State {
        rotation: Matrix3::from_columns(&[edges[0], edges[1], third]),
        vertex: corner.vertex() * distance_m,
        gamma: angle.gamma_rad,
        lengths: [None; 3],
        side,
    };
    for (end, share) in ends {
        state.lengths[end.axis] = Some(known.lengths_m[end.axis].unwrap_or(share * distance_m));
    }
    let lines = lines(corner, ends)?;
    for step in 0..=STEPS_MAX {
        let mut system = System::new();
        for line in &lines {
            system.add_line(line, &state);
        }
        let free = system.add_known(&state, known, angle);
        // Metres against radians: the distance brings the two to one scale.
        let scale = state.vertex.norm();
        let units = SVector::<f64, UNKNOWNS>::from_fn(|i, _| if i < 3 || i == GAMMA { 1.0 } else { scale });
        let units_matrix = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::from_diagonal(&units);
        let mut scaled = units_matrix * system.information * units_matrix;
        let mut pull = system.pull.component_mul(&units);
        for i in (0..UNKNOWNS).filter(|i| !free[*i]) {
            scaled.row_mut(i).fill(0.0);
            scaled.column_mut(i).fill(0.0);
            scaled[(i, i)] = 1.0;
            pull[i] = 0.0;
        }
        let inverse = Cholesky::new(scaled)?.inverse();
        let change = -(inverse * pull);
        if !system.chi_square.is_finite() || !change.iter().all(|x| x.is_finite()) {
            return None;
        }
        if change.norm() <= CONVERGED || step == STEPS_MAX {
            let covariance = units_matrix * inverse * units_matrix;
            return Some(SizedPose {
                camera_from_object: state.rotation,
                edges: state.edges(),
                vertex_m: state.vertex,
                covariance: covariance.fixed_view::<6, 6>(0, 0).into_owned(),
                lengths_m: state.lengths,
                length_sigmas_m: [0, 1, 2]
                    .map(|i| if free[LENGTHS + i] { covariance[(LENGTHS + i, LENGTHS + i)].sqrt() } else { 0.0 }),
                chi_square: system.chi_square,
                freedom: (2 * lines.len() + system.known).checked_sub(free.iter().filter(|free| **free).count())?,
            });
        }
        state.change(&change.component_mul(&units));
    }
    None
}

/// A line of the box in the image: along one axis, from the vertex or from the end of an edge.
struct Line {
    along: usize,
    end_of: Option<usize>,
    ray: FittedRay,
    weight: Matrix2<f64>,
}

fn lines(corner: &CornerFeature, ends: &[(SeenEnd, f64)]) -> Option<Vec<Line>> {
    let own = corner.rays().iter().enumerate().map(|(along, ray)| (along, None, *ray));
    let far = ends.iter().flat_map(|(end, _)| end.far.map(|(along, ray)| (along, Some(end.axis), ray)));
    let line = |(along, end_of, ray): (usize, Option<usize>, FittedRay)| {
        Some(Line { along, end_of, ray, weight: ray.information()? })
    };
    own.chain(far).map(line).collect()
}

#[derive(Debug, Clone, Copy)]
struct State {
    rotation: Matrix3<f64>,
    vertex: Vector3<f64>,
    gamma: f64,
    lengths: [Option<f64>; 3],
    side: f64,
}

impl State {
    fn edges(&self) -> [Vector3<f64>; 3] {
        let (sin, cos) = self.gamma.sin_cos();
        [Vector3::x(), Vector3::y(), Vector3::new(cos, 0.0, self.side * sin)].map(|edge| self.rotation * edge)
    }

    /// How the edge z turns when the included angle opens.
    fn opens(&self) -> Vector3<f64> {
        let (sin, cos) = self.gamma.sin_cos();
        self.rotation * Vector3::new(-sin, 0.0, self.side * cos)
    }

    fn change(&mut self, by: &SVector<f64, UNKNOWNS>) {
        self.rotation = Rotation3::new(by.fixed_rows::<3>(0).into_owned()).matrix() * self.rotation;
        self.vertex += by.fixed_rows::<3>(3);
        self.gamma += by[GAMMA];
        for (i, length) in self.lengths.iter_mut().enumerate() {
            *length = length.map(|length| length + by[LENGTHS + i]);
        }
    }
}

/// The normal equations of one Gauss-Newton step.
struct System {
    information: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    pull: SVector<f64, UNKNOWNS>,
    chi_square: f64,
    known: usize,
}

impl System {
    fn new() -> Self {
        Self { information: SMatrix::zeros(), pull: SVector::zeros(), chi_square: 0.0, known: 0 }
    }

    fn add_line(&mut self, line: &Line, state: &State) {
        let edges = state.edges();
        let edge = edges[line.along];
        // From the vertex to where the line begins.
        let begins = line.end_of.and_then(|end| Some(edges[end] * state.lengths[end]?)).unwrap_or_default();
        let point = state.vertex + begins;
        let PlaneMiss { miss, by_plane, chi_square } = line.ray.missed_by(&point.cross(&edge), &line.weight);
        let mut plane_by = SMatrix::<f64, 3, UNKNOWNS>::zeros();
        let turned = edge.cross_matrix() * begins.cross_matrix() - point.cross_matrix() * edge.cross_matrix();
        plane_by.fixed_view_mut::<3, 3>(0, 0).copy_from(&turned);
        plane_by.fixed_view_mut::<3, 3>(0, 3).copy_from(&-edge.cross_matrix());
        let mut opened = Vector3::zeros();
        if line.along == 2 {
            opened += point.cross(&state.opens());
        }
        if let Some(end) = line.end_of {
            plane_by.column_mut(LENGTHS + end).copy_from(&edges[end].cross(&edge));
            if end == 2 {
                opened += (state.opens() * state.lengths[2].unwrap_or(0.0)).cross(&edge);
            }
        }
        plane_by.column_mut(GAMMA).copy_from(&opened);
        let by = by_plane * plane_by;
        let weighted = by.transpose() * line.weight;
        self.information += weighted * by;
        self.pull += weighted * miss;
        self.chi_square += chi_square;
    }

    /// Adds what is known of angle and lengths, and says which unknowns are free.
    fn add_known(&mut self, state: &State, known: &KnownLengths, angle: &IncludedAngle) -> [bool; UNKNOWNS] {
        let mut free = [true; UNKNOWNS];
        let mut number = |place: usize, off: f64, sigma: f64| {
            free[place] = sigma > 0.0;
            if sigma > 0.0 {
                let information = sigma.powi(-2);
                self.information[(place, place)] += information;
                self.pull[place] += off * information;
                self.chi_square += off * off * information;
                self.known += 1;
            }
        };
        number(GAMMA, state.gamma - angle.gamma_rad, angle.sigma_rad);
        for (i, (length, known_m)) in state.lengths.iter().zip(known.lengths_m).enumerate() {
            match (length, known_m) {
                (Some(length), Some(known_m)) => number(LENGTHS + i, length - known_m, known.sigma_m),
                (Some(_), None) => {}
                (None, _) => number(LENGTHS + i, 0.0, 0.0),
            }
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_z_turns_as_the_angle_opens() {
        let rotation = *Rotation3::from_euler_angles(0.4, -0.3, 1.1).matrix();
        for side in [1.0, -1.0] {
            let at = |gamma: f64| State { rotation, vertex: Vector3::z(), gamma, lengths: [None; 3], side };
            let difference = (at(1.2 + 1e-6).edges()[2] - at(1.2 - 1e-6).edges()[2]) / 2e-6;
            assert!((at(1.2).opens() - difference).norm() < 1e-8, "{side}");
        }
    }

    /// A Gauss-Newton step over what is known alone is onto what is known, and half the gradient of the sum of squares is the pull.
    #[test]
    fn what_is_known_pulls_by_its_deviation() {
        let angle = IncludedAngle { gamma_rad: 1.2, sigma_rad: 0.02 };
        let known = KnownLengths { lengths_m: [Some(0.4), None, Some(0.3)], sigma_m: 0.005 };
        let state = |gamma: f64, length_m: f64| State {
            rotation: Matrix3::identity(),
            vertex: Vector3::z(),
            gamma,
            lengths: [Some(length_m), Some(0.7), None],
            side: 1.0,
        };
        let of = |gamma: f64, length_m: f64| {
            let mut system = System::new();
            let free = system.add_known(&state(gamma, length_m), &known, &angle);
            (system, free)
        };
        let (system, free) = of(1.23, 0.42);
        for (place, off) in [(GAMMA, 0.03), (LENGTHS, 0.02)] {
            assert!((system.pull[place] / system.information[(place, place)] - off).abs() < 1e-12, "{place}");
        }
        let slope = |more: f64, less: f64, by: f64| (more - less) / (4.0 * by);
        let by_gamma = slope(of(1.231, 0.42).0.chi_square, of(1.229, 0.42).0.chi_square, 0.001);
        let by_length = slope(of(1.23, 0.421).0.chi_square, of(1.23, 0.419).0.chi_square, 0.001);
        assert!((by_gamma - system.pull[GAMMA]).abs() < 1e-6 && (by_length - system.pull[LENGTHS]).abs() < 1e-6);
        // Only the edge whose end is not seen has no length.
        let held: Vec<usize> = (0..UNKNOWNS).filter(|place| !free[*place]).collect();
        assert_eq!((held, system.known), (vec![LENGTHS + 2], 2));
    }
}
