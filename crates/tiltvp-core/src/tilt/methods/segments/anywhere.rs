//! The vertical of a view that may look anywhere: frames of a vertical and two orthogonal horizontals, of which one is chosen.
//!
//! Edges alone tell three orthogonal directions and not which of them is up; what tells it, weakly, is learned (`choice.rs`).

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::any_lightness::Lightness;
use super::choice::{features, log_odds};
use super::frame::{EVEN_RAD, Edge, Frame, score};
use super::hypothesis::{FEATURES, Hypothesis, Prior};
use super::near::BEYOND_RAD;

/// Edges of which pairs make directions, the longest ones.
const PAIRED: usize = 36;

/// Vanishing points that frames are made of, and frames that are refined.
const VANISHING_POINTS: usize = 16;
const REFINED: usize = 14;

/// Least sum of odds of a vanishing point.
const SCORE_MIN: f64 = 0.3;

/// Cosines of angles within which two vanishing points, two hypotheses, and a turned frame and a hypothesis are the same: 3, 2 and
/// 1 degrees.
const SAME_POINT_COS: f64 = 0.998_629_5;
pub(super) const SAME_UP_COS: f64 = 0.999_390_8;
const SAME_FRAME_COS: f64 = 0.999_847_7;

/// Odds, against the most probable hypothesis, that none is right: so that of the views of unseen buildings that are surer than 0.9
/// at most one in fifty is wrong.
const NONE_ODDS: f64 = 0.08;

/// Memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Search {
    pub hypotheses: Vec<Hypothesis>,
    scored: Vec<(f64, Vector3<f64>)>,
    points: Vec<Vector3<f64>>,
    frames: Vec<Frame>,
}

impl Search {
    /// Fills the hypotheses, the most probable first.
    pub(super) fn run(&mut self, edges: &[Edge], scatter_rad: f64, prior: &Prior, lightness: &Lightness<'_>) {
        self.hypotheses.clear();
        self.vanishing_points(edges, scatter_rad);
        self.make_frames(edges, scatter_rad, prior);
        let Self { hypotheses, frames, .. } = self;
        let cone = prior.reach_rad.cos();
        for frame in frames.iter().take(REFINED) {
            let refined = frame.refined(edges);
            for turn in 0..3 {
                let towards = |up: Vector3<f64>| if up.z < 0.0 { -up } else { up };
                let up = towards(refined.axes[(2 + turn) % 3]);
                if up.z < cone {
                    continue;
                }
                let mut frame = refined;
                if turn > 0 {
                    if hypotheses.iter().any(|other| up.dot(&other.up).abs() > SAME_FRAME_COS) {
                        continue;
                    }
                    frame = refined.turned(turn).refined(edges);
                }
                let up = towards(frame.axes[2]);
                if up.z < cone {
                    continue;
                }
                let same = |other: &Hypothesis| up.dot(&other.up).abs() > SAME_UP_COS;
                if hypotheses.iter().any(|other| same(other) && other.frame.log_likelihood >= frame.log_likelihood) {
                    continue;
                }
                hypotheses.retain(|other| !same(other));
                let mut hypothesis = Hypothesis { up, frame, features: [0.0; FEATURES], probability: 0.0 };
                hypothesis.features = features(edges, &hypothesis, prior, lightness);
                hypotheses.push(hypothesis);
            }
        }
        if prior.reach_rad > FRAC_PI_2 {
            // The edges of an image are the same upside down: either side of an axis may be up.
            for i in 0..hypotheses.len() {
                let mut opposite = Hypothesis { up: -hypotheses[i].up, ..hypotheses[i].clone() };
                if opposite.up.z >= cone {
                    opposite.features = features(edges, &opposite, prior, lightness);
                    hypotheses.push(opposite);
                }
            }
        }
        let odds = |hypothesis: &Hypothesis| log_odds(&hypothesis.features, prior);
        let best = hypotheses.iter().map(odds).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = hypotheses.iter().map(|h| (odds(h) - best).exp()).sum::<f64>() + NONE_ODDS;
        for hypothesis in hypotheses.iter_mut() {
            hypothesis.probability = (odds(hypothesis) - best).exp() / total;
        }
        hypotheses.sort_unstable_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    /// Directions in which pairs of long edges meet and many others pass: the best one, then the best of those apart from it.
    fn vanishing_points(&mut self, edges: &[Edge], scatter_rad: f64) {
        let Self { scored, points, .. } = self;
        scored.clear();
        points.clear();
        let paired = &edges[..edges.len().min(PAIRED)];
        for (i, a) in paired.iter().enumerate() {
            for b in &paired[i + 1..] {
                if let Some(direction) = a.normal.cross(&b.normal).try_normalize(EVEN_RAD) {
                    scored.push((score(edges, &direction, scatter_rad), direction));
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
    fn make_frames(&mut self, edges: &[Edge], scatter_rad: f64, prior: &Prior) {
        let Self { points, frames, .. } = self;
        frames.clear();
        let across = |i: usize, k: usize| points[i].cross(&points[k]).try_normalize(0.3);
        let crossed = (0..points.len()).flat_map(|i| (i + 1..points.len()).filter_map(move |k| across(i, k)));
        // A little beyond, for frames move when they are refined.
        let cone = (prior.reach_rad + BEYOND_RAD).min(FRAC_PI_2).cos();
        for direction in points.iter().copied().chain(crossed) {
            let up = if direction.z < 0.0 { -direction } else { direction };
            if up.z >= cone {
                frames.push(Frame::about(edges, &up, scatter_rad));
            }
        }
        frames.sort_unstable_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    }
}
