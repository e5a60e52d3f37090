//! Where a camera has moved between two images of vertical lines, from how alike they are at which ratios of distance.
//!
//! The camera moves in a plane by `B` in the direction `ahead_a` of the first image, which is `ahead_b` in the second. A line at
//! the angles `s` and `t` from these directions has the distances `B sin t / sin(t - s)` and `B sin s / sin(t - s)`: their
//! ratio `sin t / sin s` is the shift at which its profiles must be alike. Two bearings alone would fit any motion.

use std::f64::consts::PI;

use super::likeness::{COURSE, NEVER, SHIFTS};
use crate::interrupt::check;
use crate::lines::angles::wrap;
use crate::lines::description::profile_rows::PITCH;

/// Cells of the coarse search about the whole turn for each direction: every 5 degrees.
const CELLS: usize = 72;

/// How many cells are looked at closely.
const CLOSE: usize = 20;

/// Lines within 6 degrees of the way of both images may have any ratio of distances, at [`ANY_COSTS`].
const ALONG_SIN: f64 = 0.105;
const ANY_COSTS: f32 = 0.15;

/// A line turns away from where the camera goes by its parallax; a degree is left for errors of bearings.
const SLACK_RAD: f64 = 0.0175;

/// A motion beside another: more than 15 degrees away.
const BESIDE_RAD: f64 = 0.26;

/// A direction of motion as both images see it, and how well it explains them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    pub(super) ahead_a: f64,
    pub(super) ahead_b: f64,
    pub(super) total: f32,
}

/// The likenesses of all pairs, as a search looks at them.
#[derive(Debug, Clone, Default)]
pub(super) struct Search {
    /// Greatest over two shifts to either side, and over one.
    coarse: Vec<f32>,
    fine: Vec<f32>,
    /// Greatest of all shifts.
    any: Vec<f32>,
    scores: Vec<f32>,
    columns: Vec<f32>,
    turned: [Vec<[f64; 3]>; 2],
}

impl Search {
    /// Takes over likenesses `(N, M, COURSE)`.
    pub(super) fn fill(&mut self, likenesses: &[f32]) {
        let around = |reach: usize, out: &mut Vec<f32>| {
            out.clear();
            for course in likenesses.as_chunks::<COURSE>().0 {
                out.extend((0..COURSE).map(|k| {
                    let near = &course[k.saturating_sub(reach)..(k + reach + 1).min(COURSE)];
                    near.iter().copied().fold(NEVER, f32::max)
                }));
            }
        };
        around(2, &mut self.coarse);
        around(1, &mut self.fine);
        self.any.clear();
        self.any.extend(likenesses.as_chunks::<COURSE>().0.iter().map(|c| c.iter().copied().fold(NEVER, f32::max)));
    }

    /// Fills in and returns the scores `(N, M)` under a motion.
    pub(super) fn under(&mut self, a: &[f64], b: &[f64], motion: &Motion, coarse: bool) -> &[f32] {
        let table = if coarse { &self.coarse } else { &self.fine };
        let slack = if coarse { SLACK_RAD + 0.7 * 2.0 * PI / CELLS as f64 } else { SLACK_RAD };
        for (turned, (bearings, ahead)) in self.turned.iter_mut().zip([(a, motion.ahead_a), (b, motion.ahead_b)]) {
            turned.clear();
            turned.extend(bearings.iter().map(|bearing| {
                let angle = wrap(bearing - ahead);
                let sine = angle.sin().abs();
                [angle, sine, sine.max(1e-3).ln() / PITCH]
            }));
        }
        let [first, second] = &self.turned;
        self.scores.clear();
        for (i, [s, sine_s, log_s]) in first.iter().enumerate() {
            for (j, [t, sine_t, log_t]) in second.iter().enumerate() {
                let pair = i * second.len() + j;
                let mut score = NEVER;
                if (*s > 0.0) == (*t > 0.0) && t.abs() >= s.abs() - slack {
                    let shift = (log_t - log_s).round() + SHIFTS as f64;
                    if (0.0..COURSE as f64).contains(&shift) {
                        score = table[pair * COURSE + shift as usize];
                    }
                }
                if *sine_s < ALONG_SIN && *sine_t < ALONG_SIN && (s.abs() < 1.0) == (t.abs() < 1.0) {
                    score = score.max(self.any[pair] - ANY_COSTS);
                }
                self.scores.push(score);
            }
        }
        &self.scores
    }

    /// How much a motion explains: the sum over lines of what their best pair scores above `least`, of the image where it is less.
    fn total(&mut self, a: &[f64], b: &[f64], motion: &mut Motion, coarse: bool, least: f32) {
        check();
        self.under(a, b, motion, coarse);
        let Self { scores, columns, .. } = self;
        columns.clear();
        columns.resize(b.len(), least);
        let mut rows = 0.0;
        for row in scores.chunks_exact(b.len()) {
            let mut best = least;
            for (score, column) in row.iter().zip(columns.iter_mut()) {
                best = best.max(*score);
                *column = column.max(*score);
            }
            rows += best - least;
        }
        motion.total = rows.min(columns.iter().map(|column| column - least).sum());
    }

    /// The motion that explains most, and what the best one beside it explains.
    pub(super) fn best(&mut self, a: &[f64], b: &[f64], least: f32) -> (Motion, f32) {
        let cell = |k: usize| (k as f64 / CELLS as f64 - 0.5) * 2.0 * PI;
        let mut found: Vec<Motion> = Vec::with_capacity(CELLS * CELLS);
        for (p, q) in (0..CELLS).flat_map(|p| (0..CELLS).map(move |q| (p, q))) {
            let mut motion = Motion { ahead_a: cell(p), ahead_b: cell(q), total: 0.0 };
            self.total(a, b, &mut motion, true, least);
            found.push(motion);
        }
        found.sort_by(|x, y| y.total.total_cmp(&x.total));
        found.truncate(CLOSE);
        for motion in &mut found {
            self.refine(a, b, motion, cell(1) - cell(0), least);
        }
        let best = found.iter().copied().max_by(|x, y| x.total.total_cmp(&y.total)).unwrap_or_default();
        let beside = |motion: &&Motion| {
            wrap(motion.ahead_a - best.ahead_a).abs() > BESIDE_RAD
                || wrap(motion.ahead_b - best.ahead_b).abs() > BESIDE_RAD
        };
        let rival = found.iter().filter(beside).map(|motion| motion.total).fold(0.0, f32::max);
        (best, rival)
    }

    /// The motion that explains most of those up to `reach` from a known one, in both directions.
    pub(super) fn near(&mut self, a: &[f64], b: &[f64], ahead: [f64; 2], reach: f64, least: f32) -> Motion {
        let mut best = Motion { ahead_a: ahead[0], ahead_b: ahead[1], total: 0.0 };
        self.total(a, b, &mut best, false, least);
        self.refine(a, b, &mut best, 1.5 * reach, least);
        best
    }

    /// Twice moves a motion to the best of those around it, by up to two thirds of a step and two thirds of a third of it.
    fn refine(&mut self, a: &[f64], b: &[f64], motion: &mut Motion, step: f64, least: f32) {
        for step in [step / 3.0, step / 9.0] {
            let (middle, mut best) = (*motion, Motion { total: -1.0, ..*motion });
            for (p, q) in (-2..=2).flat_map(|p| (-2..=2).map(move |q| (p, q))) {
                let (ahead_a, ahead_b) = (middle.ahead_a + f64::from(p) * step, middle.ahead_b + f64::from(q) * step);
                let mut near = Motion { ahead_a, ahead_b, total: 0.0 };
                self.total(a, b, &mut near, false, least);
                if near.total > best.total {
                    best = near;
                }
            }
            *motion = best;
        }
    }
}
