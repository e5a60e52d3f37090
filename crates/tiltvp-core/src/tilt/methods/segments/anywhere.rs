//! The vertical of a view that may look anywhere: frames of a vertical and two orthogonal horizontals, of which one is chosen.
//!
//! Edges alone tell three orthogonal directions and not which of them is up; what tells it, weakly, is learned (`choice.rs`).

use nalgebra::{Matrix4, Rotation3, Vector3, Vector4};

use super::any_hypothesis::{
    EVEN_RAD, Edge, FEATURES, HORIZONTAL_RAD, Hypothesis, Odds, Prior, SKEW_RAD, VERTICAL_RAD,
};
use super::any_lightness::Lightness;
use super::choice::{features, log_odds};
use crate::geometry::tangent_basis;

/// Segments that are weighed, the longest ones, and those of which pairs make directions.
const WEIGHED: usize = 160;
const PAIRED: usize = 36;

/// Vanishing points that frames are made of, and frames that are refined.
const VANISHING_POINTS: usize = 16;
const REFINED: usize = 14;

/// Least sum of odds of a vanishing point.
const SCORE_MIN: f64 = 0.3;

/// Bins of azimuth, over the quarter turn after which two orthogonal horizontals are as before.
const BINS: usize = 45;

/// Cosines of angles within which two vanishing points, two hypotheses, and a turned frame and a hypothesis are the same: 3, 2 and
/// 1 degrees.
const SAME_POINT_COS: f64 = 0.998_629_5;
const SAME_UP_COS: f64 = 0.999_390_8;
const SAME_FRAME_COS: f64 = 0.999_847_7;

/// Steps of a refinement, and the longest of them in radians.
const STEPS: usize = 3;
const STEP_MAX_RAD: f64 = 0.05;

/// Odds, against the most probable hypothesis, that none is right: so that of the views of unseen buildings that are surer than 0.9
/// at most one in fifty is wrong.
const NONE_ODDS: f64 = 0.08;

/// Least share of a probability at which an edge counts in a step. Only time depends on it.
const NEGLIGIBLE: f64 = 1e-3;

/// Sum of the weighted logarithms of the odds that edges are of a direction.
fn score(edges: &[Edge], direction: &Vector3<f64>) -> f64 {
    edges.iter().map(|edge| edge.weight() * edge.odds(direction, VERTICAL_RAD).odds.ln_1p()).sum()
}

/// Memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Search {
    pub edges: Vec<Edge>,
    pub hypotheses: Vec<Hypothesis>,
    scored: Vec<(f64, Vector3<f64>)>,
    points: Vec<Vector3<f64>>,
    frames: Vec<(f64, [Vector3<f64>; 3])>,
    odds: Vec<[Odds; 3]>,
}

impl Search {
    /// Takes the longest edges.
    pub(super) fn take(&mut self, edges: impl Iterator<Item = Edge>) {
        self.edges.clear();
        self.edges.extend(edges.take(WEIGHED));
    }

    /// Fills the hypotheses, the most probable first.
    pub(super) fn run(&mut self, prior: &Prior, lightness: &Lightness<'_>) {
        self.hypotheses.clear();
        self.vanishing_points();
        self.make_frames(prior);
        let cone = prior.reach_rad.cos();
        for k in 0..self.frames.len().min(REFINED) {
            let axes = self.frames[k].1;
            let refined = self.refine(axes);
            for turn in 0..3 {
                let mut own = refined;
                own.0.rotate_left(turn);
                let towards = |up: Vector3<f64>| if up.z < 0.0 { -up } else { up };
                let up = towards(own.0[2]);
                if up.z < cone {
                    continue;
                }
                if turn > 0 {
                    if self.hypotheses.iter().any(|other| up.dot(&other.up).abs() > SAME_FRAME_COS) {
                        continue;
                    }
                    let vertical = own.0[2];
                    let level = |h: Vector3<f64>| (h - vertical * vertical.dot(&h)).normalize();
                    own = self.refine([level(own.0[0]), level(own.0[1]), vertical]);
                }
                let up = towards(own.0[2]);
                if up.z < cone {
                    continue;
                }
                let (axes, log_likelihood, information) = own;
                let same = |other: &Hypothesis| up.dot(&other.up).abs() > SAME_UP_COS;
                if self.hypotheses.iter().any(|other| same(other) && other.log_likelihood >= log_likelihood) {
                    continue;
                }
                self.hypotheses.retain(|other| !same(other));
                let mut hypothesis =
                    Hypothesis { up, log_likelihood, axes, information, features: [0.0; FEATURES], probability: 0.0 };
                hypothesis.features = features(&self.edges, &hypothesis, prior, lightness);
                self.hypotheses.push(hypothesis);
            }
        }
        let best = self.hypotheses.iter().map(|h| log_odds(&h.features)).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = self.hypotheses.iter().map(|h| (log_odds(&h.features) - best).exp()).sum::<f64>() + NONE_ODDS;
        for hypothesis in &mut self.hypotheses {
            hypothesis.probability = (log_odds(&hypothesis.features) - best).exp() / total;
        }
        self.hypotheses.sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    /// Directions in which pairs of long edges meet and many others pass: the best one, then the best of those apart from it.
    fn vanishing_points(&mut self) {
        let Self { edges, scored, points, .. } = self;
        scored.clear();
        points.clear();
        let paired = &edges[..edges.len().min(PAIRED)];
        for (i, a) in paired.iter().enumerate() {
            for b in &paired[i + 1..] {
                if let Some(direction) = a.normal.cross(&b.normal).try_normalize(EVEN_RAD) {
                    scored.push((score(edges, &direction), direction));
                }
            }
        }
        while points.len() < VANISHING_POINTS {
            let best = scored.iter().max_by(|a, b| a.0.total_cmp(&b.0)).filter(|best| best.0 > SCORE_MIN);
            let Some((_, point)) = best.copied() else { break };
            points.push(point);
            scored.retain(|(_, other)| other.dot(&point).abs() < SAME_POINT_COS);
        }
    }

    /// Frames about the vanishing points, and about what is across two of them, the most likely first.
    fn make_frames(&mut self, prior: &Prior) {
        let Self { edges, points, frames, .. } = self;
        frames.clear();
        let across = |i: usize, k: usize| points[i].cross(&points[k]).try_normalize(0.3);
        let crossed = (0..points.len()).flat_map(|i| (i + 1..points.len()).filter_map(move |k| across(i, k)));
        // A little beyond, for frames move when they are refined.
        let cone = (prior.reach_rad + VERTICAL_RAD * 10.0).min(std::f64::consts::FRAC_PI_2).cos();
        for direction in points.iter().copied().chain(crossed) {
            let up = if direction.z < 0.0 { -direction } else { direction };
            if up.z >= cone {
                let (likelihood, first) = best_heading(edges, &up);
                frames.push((likelihood, [first, up.cross(&first), up]));
            }
        }
        frames.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// Gauss-Newton over a turn of the axes and the angle between the horizontals: axes, log-likelihood and information.
    fn refine(&mut self, mut axes: [Vector3<f64>; 3]) -> ([Vector3<f64>; 3], f64, Matrix4<f64>) {
        let Self { edges, odds, .. } = self;
        let (mut skew, mut done) = (0.0, 0);
        loop {
            odds.clear();
            let scatters = [HORIZONTAL_RAD, HORIZONTAL_RAD, VERTICAL_RAD];
            odds.extend(edges.iter().map(|edge| [0, 1, 2].map(|d| edge.odds(&axes[d], scatters[d]))));
            let (mut information, mut pull, mut likelihood) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
            let second_turns = axes[2].cross(&axes[1]);
            for (edge, odds) in edges.iter().zip(odds.iter()) {
                let sum = 1.0 + odds.iter().map(|odds| odds.odds).sum::<f64>();
                likelihood += edge.weight() * sum.ln();
                for (d, odds) in odds.iter().enumerate() {
                    let share = odds.odds / sum;
                    if share < NEGLIGIBLE {
                        continue;
                    }
                    let turn = axes[d].cross(&edge.normal);
                    let bend = if d == 1 { edge.normal.dot(&second_turns) } else { 0.0 };
                    let slope = Vector4::new(turn.x, turn.y, turn.z, bend);
                    let weight = edge.weight() * share / odds.variance;
                    information += slope * slope.transpose() * weight;
                    pull += slope * (weight * edge.normal.dot(&axes[d]));
                }
            }
            if done == STEPS {
                return (axes, likelihood, information);
            }
            let stiffness = 1.0 / (SKEW_RAD * SKEW_RAD);
            pull[3] += stiffness * skew;
            let damped = information + Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, 1.0, 1.0 + stiffness));
            let Some(inverse) = damped.try_inverse() else { return (axes, likelihood, information) };
            let step = -(inverse * pull);
            let turn = Vector3::new(step.x, step.y, step.z);
            let turn = turn * (STEP_MAX_RAD / turn.norm().max(STEP_MAX_RAD));
            let rotation = Rotation3::from_scaled_axis(turn);
            axes = axes.map(|axis| rotation * axis);
            axes[1] = Rotation3::from_scaled_axis(axes[2] * step[3]) * axes[1];
            skew += step[3];
            done += 1;
        }
    }
}

/// The heading of a horizontal that is most likely with another across it, given what is up, and the logarithm of its likelihood.
fn best_heading(edges: &[Edge], up: &Vector3<f64>) -> (f64, Vector3<f64>) {
    const STEP: f64 = std::f64::consts::FRAC_PI_2 / BINS as f64;
    let basis = tangent_basis(up);
    let (a, b) = (basis.column(0).into_owned(), basis.column(1).into_owned());
    let (mut bins, mut base) = ([0.0; BINS], 0.0);
    for edge in edges {
        let vertical = edge.odds(up, VERTICAL_RAD).odds;
        let alone = edge.weight() * vertical.ln_1p();
        base += alone;
        let meets = up.cross(&edge.normal);
        let length = meets.norm();
        if length < LEVEL_MIN {
            continue;
        }
        let horizontal = meets / length;
        let heading = horizontal.dot(&b).atan2(horizontal.dot(&a)).rem_euclid(std::f64::consts::FRAC_PI_2);
        let (across, turn) = (edge.middle.dot(&horizontal), edge.along.dot(&horizontal));
        let own = edge.offset * across * across + edge.slope * turn * turn + HORIZONTAL_RAD * HORIZONTAL_RAD;
        let variance = own / (length * length) + 0.25 * STEP * STEP;
        let odds = EVEN_RAD * ((1.0 - across * across).max(1e-3) / variance).sqrt() / length;
        let reach = ((3.0 * variance.sqrt() / STEP) as usize + 1).min(BINS / 2);
        let nearest = (heading / STEP) as usize;
        for k in 0..=2 * reach {
            let place = nearest as f64 + k as f64 - reach as f64;
            let off = (place + 0.5) * STEP - heading;
            let both = vertical + odds * (-0.5 * off * off / variance).exp();
            bins[(nearest + k + BINS - reach) % BINS] += edge.weight() * both.ln_1p() - alone;
        }
    }
    let best = (0..BINS).max_by(|i, k| bins[*i].total_cmp(&bins[*k])).unwrap_or(0);
    let (sin, cos) = ((best as f64 + 0.5) * STEP).sin_cos();
    (base + bins[best], a * cos + b * sin)
}

/// Least sine of the angle between an edge's plane and the horizontal one: planes that nearly coincide meet nowhere in particular.
const LEVEL_MIN: f64 = 0.05;
