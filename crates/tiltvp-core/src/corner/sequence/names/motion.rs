//! How the camera moves in a world that it knows, and which of its corners are seen: every corner at every place tells a motion,
//! and the one on which most agree is taken, if no other does as well.

use nalgebra::{Matrix3, Vector3};

use super::{KnownWorld, NamedPlace};
use crate::corner::estimate::BelievedCorner;
use crate::corner::estimator_options::EstimatorOptions;
use crate::corner::sequence::agreement::apart;
use crate::corner::sequence::track::{JUMP, JUMP_MIN, MOVED, SEEN_MIN};
use crate::geometry::RigidMotion;

/// The farthest turn of a camera from frame to frame, in its standard deviations: 99.7 % of them.
const TURN_SIGMAS: f64 = 3.0;

/// How much farther another explanation with as many corners has to be to be ruled out: a step of twice the length.
const FARTHER: f64 = 2.0;

/// The share of the distance below which steps are alike: the noise of a vertex (1 %, half of it in a mean over corners).
const STEP_MIN: f64 = 0.005;

/// How far an edge may be from where it was, radians: 10 degrees. Edges of a corner are far more apart, and an attitude is known
/// far better.
const SAME_EDGE: f64 = 0.17;

/// The farthest turn that is followed, radians: half of a right angle, beyond which an edge is nearer to where another one was. A
/// camera that lost its way is not looked for beyond it either.
const TURN_MAX: f64 = std::f64::consts::FRAC_PI_4;

/// How many corners have to be where they were to find the way back. Two corners have the distance of two others by chance;
/// three that do have to be the same three.
const FOUND_AGAIN_MIN: usize = 3;

/// The largest squared distance of a corner from its place by all covariances: chi-square of three degrees of freedom, 99.9 %.
const GATE: f64 = 16.27;

/// The farthest that a corner may be from its place, as a share of its distance, whatever covariances say: two standard deviations
/// of a triangulated vertex (1 %). Corners of furniture with edges to the same sides are farther apart.
const SAME_PLACE: f64 = 0.02;

/// The largest standard deviation of a place that is told from others, as a share of its distance. Rendered corners that were seen
/// worse were taken for others of their kind.
const PLACE_SIGMA_MAX: f64 = 0.02;

/// How many times as far, in standard deviations, another corner may be without being told from this one: within, it has no name.
const DOUBT: f64 = 2.0;

/// Standard deviation of what covariances do not tell, as a share of the distance: edges that are rounded or two edges.
const PLACE_SHARE: f64 = 0.002;

/// Standard deviation of the turn that one corner tells, radians: 0.3 degrees.
const TURN_SIGMA: f64 = 0.005;

/// How far apart lengths of one edge may be, as a share, beside five standard deviations; larger ones are of another edge.
const LENGTHS_APART: f64 = 0.06;

/// Most motions of a camera that knows its way that are tried, the shortest first, which bounds the time.
const MOTIONS_MAX: usize = 256;

/// Most places of a world that was lost that are looked for, those seen most often, which bounds the time.
const PLACES_LOST_MAX: usize = 64;

/// A corner with a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    pub(super) place_m: Vector3<f64>,
    pub(super) covariance_m2: Matrix3<f64>,
    pub(super) camera_from_object: Matrix3<f64>,
    pub(super) edges: [Vector3<f64>; 3],
    pub(super) lengths_m: [Option<(f64, f64)>; 3],
}

impl Sighting {
    /// In the camera's frame; none without a place, or with one that is hardly known.
    pub(super) fn of(corner: &BelievedCorner) -> Option<Self> {
        let pose = corner.hypotheses.first()?;
        let place_m = pose.vertex_m?;
        let covariance_m2 = pose.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        if covariance_m2.trace().sqrt() > PLACE_SIGMA_MAX * place_m.norm() {
            return None;
        }
        Some(Self {
            place_m,
            covariance_m2,
            camera_from_object: pose.camera_from_object,
            edges: pose.edges,
            lengths_m: corner.ends.map(|end| end.map(|end| (end.length_m, end.sigma_m))),
        })
    }

    pub(super) fn moved(&self, by: &RigidMotion) -> Self {
        Self {
            place_m: by.point(&self.place_m),
            covariance_m2: by.rotation * self.covariance_m2 * by.rotation.transpose(),
            camera_from_object: by.rotation * self.camera_from_object,
            edges: self.edges.map(|edge| by.rotation * edge),
            lengths_m: self.lengths_m,
        }
    }
}

/// The motion of the camera, and which corner is at which place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Found {
    pub(super) camera_from_world: RigidMotion,
    /// Numbers of corners and of places.
    pub(super) pairs: Vec<(usize, usize)>,
    /// Numbers of the corners that may be at several places, or hardly at one.
    pub(super) unsure: Vec<usize>,
    /// How far the camera moved, as a share of the distance of what it sees.
    pub(super) moved: f64,
}

impl Found {
    pub(super) fn nothing(camera_from_world: RigidMotion) -> Self {
        Self { camera_from_world, pairs: Vec::new(), unsure: Vec::new(), moved: 0.0 }
    }
}

/// The ways in which the edges of a corner may run along those of another one.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// For each edge of one corner the edge of another one that runs along it; none where one has none.
pub(super) fn paired(own: &[Vector3<f64>; 3], other: &[Vector3<f64>; 3]) -> Option<[usize; 3]> {
    let least = |order: &[usize; 3]| (0..3).map(|axis| own[axis].dot(&other[order[axis]])).fold(1.0, f64::min);
    let best = ORDERS.into_iter().max_by(|a, b| least(a).total_cmp(&least(b)))?;
    (least(&best) >= TURN_MAX.cos()).then_some(best)
}

/// A motion that one corner at one place tells.
struct Candidate {
    motion: RigidMotion,
    /// What its turn is about, world frame.
    about_m: Vector3<f64>,
    /// The covariance of the corner there, camera frame.
    covariance_m2: Matrix3<f64>,
    moved: f64,
    /// Whether the camera can have moved so far; what it cannot is only there to contradict.
    within: bool,
    /// Whether it moved no faster than before, so that one corner is enough.
    is_usual: bool,
}

/// How the camera moved in a world since it was seen there, and what is at which place; none where that is not sure. A world that
/// was lost wants more corners.
pub(super) fn find(world: &KnownWorld, seen: &[Sighting], options: &EstimatorOptions) -> Option<Found> {
    let is_lost = world.age > options.forget_after;
    let mut candidates = candidates(world, seen, options, is_lost);
    if !is_lost {
        candidates.sort_by(|a, b| a.moved.total_cmp(&b.moved));
        candidates.truncate(MOTIONS_MAX);
    }
    let mut tried: Vec<(Found, &Candidate)> = Vec::new();
    for candidate in &candidates {
        let spread = |place: &NamedPlace| {
            let lever_m = TURN_SIGMA * (place.place_m - candidate.about_m).norm();
            candidate.covariance_m2 + Matrix3::from_diagonal_element(lever_m * lever_m)
        };
        tried.push((assigned(world, seen, &candidate.motion, spread, is_lost), candidate));
    }
    let of = |(found, candidate): &(Found, &Candidate)| (found.pairs.len(), candidate.moved);
    let order = |a: &(usize, f64), b: &(usize, f64)| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1));
    let enough = |(found, candidate): &&(Found, &Candidate)| {
        let least = if is_lost { FOUND_AGAIN_MIN } else { 2 - usize::from(candidate.is_usual) };
        candidate.within && (candidate.is_usual || !is_lost) && found.pairs.len() >= least
    };
    let best = tried.iter().filter(enough).max_by(|a, b| order(&of(a), &of(b)))?;
    let (count, moved) = of(best);
    let contradicts = |other: &Found| {
        other.pairs.iter().any(|(number, place)| best.0.pairs.iter().any(|(n, p)| (n == number) != (p == place)))
    };
    for other in &tried {
        let (others, farther) = of(other);
        let is_near = farther < FARTHER * moved.max(STEP_MIN);
        let rivals = if is_lost { 2 * others > count } else { others >= count && is_near };
        if rivals && contradicts(&other.0) {
            return None;
        }
    }
    let (motion, spread) = refined(world, seen, &best.0)?;
    let mut found = assigned(world, seen, &motion, |_| spread, is_lost);
    let step_m = motion.inverse().translation_m - world.camera_from_world.inverse().translation_m;
    let distances_m: f64 = found.pairs.iter().map(|(number, _)| seen[*number].place_m.norm()).sum();
    found.moved = step_m.norm() * found.pairs.len() as f64 / distances_m;
    (!found.pairs.is_empty()).then_some(found)
}

/// The motions that corners at places tell: no farther than the camera can have moved, and for one that lost its way all others
/// too, as what looks the same from elsewhere, a table from its other side, tells nothing.
fn candidates(world: &KnownWorld, seen: &[Sighting], options: &EstimatorOptions, is_lost: bool) -> Vec<Candidate> {
    let frames = f64::from(world.age.max(1));
    // Of a world that is not lost it does not grow with the frames: then one more of 400 made-up worlds has a wrong name.
    let longest = if is_lost { MOVED * frames } else { MOVED };
    let usual = ((JUMP * world.pace + JUMP_MIN) * frames).min(longest);
    let turn_max = (TURN_SIGMAS * options.turn_sigma_rad * frames.sqrt()).min(TURN_MAX);
    let mut places: Vec<&NamedPlace> = world.places.iter().collect();
    if is_lost {
        places.retain(|place| place.seen >= SEEN_MIN);
        places.sort_by_key(|place| std::cmp::Reverse(place.seen));
        places.truncate(PLACES_LOST_MAX);
    }
    let mut out = Vec::new();
    for corner in seen {
        for place in &places {
            let expected = place.edges.map(|edge| world.camera_from_world.rotation * edge);
            let nearest = paired(&expected, &corner.edges);
            for order in ORDERS.into_iter().filter(|order| is_lost || nearest == Some(*order)) {
                let pairs = (0..3).map(|axis| corner.edges[order[axis]] * place.edges[axis].transpose());
                let Some(rotation) = nearest_rotation(&pairs.sum()) else { continue };
                let fits =
                    |axis: usize| corner.edges[order[axis]].dot(&(rotation * place.edges[axis])) >= SAME_EDGE.cos();
                if !(0..3).all(fits) {
                    continue;
                }
                let turn = rotation * world.camera_from_world.rotation.transpose();
                // A camera that turns about itself moves what it sees, and an attitude that errs seems to turn it: the lesser of what
                // the corner moved in its frame and of what is left of that when the turn is undone.
                let before_m = world.camera_from_world.point(&place.place_m);
                let [step_m, left_m] = [before_m, turn * before_m].map(|before| (corner.place_m - before).norm());
                let moved = step_m.min(left_m) / corner.place_m.norm();
                let within = moved <= longest && apart(&rotation, &world.camera_from_world.rotation) <= turn_max;
                if !within && !is_lost {
                    continue;
                }
                let motion = RigidMotion { rotation, translation_m: corner.place_m - rotation * place.place_m };
                let of_place = rotation * place.covariance_m2 * rotation.transpose();
                let covariance_m2 = corner.covariance_m2 + of_place;
                let is_usual = moved <= usual;
                out.push(Candidate { motion, about_m: place.place_m, covariance_m2, moved, within, is_usual });
            }
        }
    }
    out
}

/// Which corner is at which place, if the camera is where a motion says, known up to `spread`.
fn assigned(
    world: &KnownWorld,
    seen: &[Sighting],
    motion: &RigidMotion,
    spread: impl Fn(&NamedPlace) -> Matrix3<f64>,
    is_lost: bool,
) -> Found {
    let mut near: Vec<(f64, usize, usize)> = Vec::new();
    for (number, corner) in seen.iter().enumerate() {
        let share_m = PLACE_SHARE * corner.place_m.norm();
        for (which, place) in world.places.iter().enumerate() {
            let off_m = corner.place_m - motion.point(&place.place_m);
            if off_m.norm() > DOUBT * SAME_PLACE * corner.place_m.norm() {
                continue;
            }
            let expected = place.edges.map(|edge| motion.rotation * edge);
            let Some(order) = paired(&expected, &corner.edges) else { continue };
            if (0..3).any(|axis| expected[axis].dot(&corner.edges[order[axis]]) < SAME_EDGE.cos()) {
                continue;
            }
            if is_lost && !alike(place, corner, &order) {
                continue;
            }
            let of_place = motion.rotation * place.covariance_m2 * motion.rotation.transpose();
            let all =
                corner.covariance_m2 + of_place + spread(place) + Matrix3::from_diagonal_element(share_m * share_m);
            if let Some(weight) = all.try_inverse() {
                let by_share = GATE * (off_m.norm() / (SAME_PLACE * corner.place_m.norm())).powi(2);
                near.push((off_m.dot(&(weight * off_m)).max(by_share), number, which));
            }
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = Found::nothing(*motion);
    for (off, number, which) in &near {
        let is_free = |(n, p): &(usize, usize)| n != number && p != which;
        if *off <= GATE && found.pairs.iter().all(is_free) {
            found.pairs.push((*number, *which));
        }
    }
    // A corner that may as well be at another place that nothing else is at, or is near one that it does not fit.
    for (off, number, which) in &near {
        let own = found.pairs.iter().find(|(n, _)| n == number);
        let is_taken = found.pairs.iter().any(|(_, p)| p == which);
        let as_well = match own {
            Some((_, place)) if place != which => {
                let fits = near.iter().find(|(_, n, p)| n == number && p == place).map_or(GATE, |(fits, ..)| *fits);
                *off <= GATE.min(DOUBT * DOUBT * fits.max(1.0))
            }
            Some(_) => false,
            None => *off <= DOUBT * DOUBT * GATE,
        };
        if as_well && !is_taken && !found.unsure.contains(number) {
            found.unsure.push(*number);
        }
    }
    let Found { pairs, unsure, .. } = &mut found;
    pairs.retain(|(number, _)| !unsure.contains(number));
    found
}

/// Whether no edge of a corner has another length than that at a place.
fn alike(place: &NamedPlace, corner: &Sighting, order: &[usize; 3]) -> bool {
    (0..3).all(|axis| match (place.lengths_m[axis], corner.lengths_m[order[axis]]) {
        (Some((own, own_sigma)), Some((other, other_sigma))) => {
            (own - other).abs() <= LENGTHS_APART * own.max(other) + 5.0 * own_sigma.hypot(other_sigma)
        }
        _ => true,
    })
}

/// The motion by all corners that were found, and the covariance of its translation.
fn refined(world: &KnownWorld, seen: &[Sighting], found: &Found) -> Option<(RigidMotion, Matrix3<f64>)> {
    let mut sum = Matrix3::zeros();
    for (number, which) in &found.pairs {
        let (corner, place) = (&seen[*number], &world.places[*which]);
        let expected = place.edges.map(|edge| found.camera_from_world.rotation * edge);
        let order = paired(&expected, &corner.edges)?;
        for (edge, other) in place.edges.iter().zip(order) {
            sum += corner.edges[other] * edge.transpose();
        }
    }
    let rotation = nearest_rotation(&sum)?;
    let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
    for (number, which) in &found.pairs {
        let (corner, place) = (&seen[*number], &world.places[*which]);
        let share_m = PLACE_SHARE * corner.place_m.norm();
        let of_place = rotation * place.covariance_m2 * rotation.transpose();
        let all = corner.covariance_m2 + of_place + Matrix3::from_diagonal_element(share_m * share_m);
        let weight = all.try_inverse()?;
        information += weight;
        pull += weight * (corner.place_m - rotation * place.place_m);
    }
    let covariance = information.try_inverse()?;
    Some((RigidMotion { rotation, translation_m: covariance * pull }, covariance))
}

/// The rotation nearest to a matrix; none for one that is not of full rank.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    let side = (u * v).determinant().signum();
    (svd.singular_values.min() > 0.1).then(|| u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, side)) * v)
}
