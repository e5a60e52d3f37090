//! Hypotheses of random sampling, drawn some ahead so that many are counted in one pass over the observations.

use tiltvp_kernels::rows::ConsensusBound;

use super::problem::Problem;
use super::ransac_options::RansacOptions;
use super::sampler::Sampler;
use super::sampling::Score;

/// Largest sample that a problem may ask for, for which there is room; the compiler checks it.
const MAX_SAMPLE: usize = 8;

/// Hypotheses that are counted in one pass: the rows that they share stay in the nearest cache. Only time depends on it.
const AT_ONCE: usize = 8;

/// Hypotheses drawn ahead once upper bounds tell of most of them that they are not better than the best, so that some are left to
/// count in one pass. Only time depends on it (`tests/consensus_bound.rs`).
const BOUNDED_AT_ONCE: usize = 32;

/// Draws samples, and scores the models through them.
///
/// What is drawn does not depend on what was found, so that drawing ahead changes nothing: of the hypotheses behind the last that
/// is asked for nobody learns.
pub(super) struct Hypotheses<'a, P: Problem> {
    problem: &'a P,
    options: &'a RansacOptions,
    sampler: Sampler<'a>,
    bound: &'a mut ConsensusBound,
    /// Whether the tables of the bound are filled.
    bounded: bool,
    /// None for degenerate samples, and for models that cannot be better than the best.
    models: [Option<P::Model>; BOUNDED_AT_ONCE],
    /// For [`Score::Count`] the inliers of the models.
    counts: [usize; BOUNDED_AT_ONCE],
    /// Which of them are not asked for yet.
    drawn: std::ops::Range<usize>,
}

impl<'a, P: Problem> Hypotheses<'a, P> {
    pub(super) fn new(
        problem: &'a P,
        options: &'a RansacOptions,
        sampler: Sampler<'a>,
        bound: &'a mut ConsensusBound,
    ) -> Self {
        const { assert!(P::SAMPLE_SIZE <= MAX_SAMPLE) };
        let (models, counts) = ([const { None }; BOUNDED_AT_ONCE], [0; BOUNDED_AT_ONCE]);
        Self { problem, options, sampler, bound, bounded: false, models, counts, drawn: 0..0 }
    }

    /// The next model and its score, if a score above `to_beat`, that of the best, is possible; without a best, every model. At most
    /// `left` are asked for, this one included.
    pub(super) fn next(&mut self, to_beat: Option<f64>, left: u32) -> Option<(P::Model, f64)> {
        if self.drawn.is_empty() {
            self.draw(to_beat, left);
        }
        let next = self.drawn.next()?;
        let model = self.models[next].take()?;
        let score = match self.options.sampling.score {
            // Counts are exact in double precision.
            Score::Count => self.counts[next] as f64,
            score @ Score::Msac => {
                let coefficients = self.problem.coefficients(&model);
                self.problem.rows().support(coefficients, self.options.threshold, score, to_beat.unwrap_or(0.0))
            }
        };
        to_beat.is_none_or(|most| score > most).then_some((model, score))
    }

    /// Draws samples ahead, and counts the inliers of the models that may beat the best.
    fn draw(&mut self, to_beat: Option<f64>, left: u32) {
        let (problem, rows, threshold) = (self.problem, self.problem.rows(), self.options.threshold);
        if !self.bounded && to_beat.is_some() && ConsensusBound::pays(rows.len(), left) {
            rows.tabulate(self.bound, threshold, P::BOUNDED_H2_MIN);
            self.bounded = true;
        }
        let ahead = if self.bounded { BOUNDED_AT_ONCE } else { AT_ONCE };
        self.drawn = 0..ahead.min(left as usize);
        let mut sample = [0; MAX_SAMPLE];
        let sample = &mut sample[..P::SAMPLE_SIZE];
        // No score is above the number of inliers.
        let hopeful = |model: &P::Model, bound: &ConsensusBound| {
            to_beat.is_none_or(|most| bound.at_most(problem.coefficients(model)) as f64 > most)
        };
        let models = &mut self.models[self.drawn.clone()];
        for model in &mut *models {
            self.sampler.draw(sample);
            *model = problem.fit_minimal(sample).filter(|model| !self.bounded || hopeful(model, self.bound));
        }
        if self.options.sampling.score == Score::Count {
            let models = models.iter().map(|model| model.as_ref().map(|model| problem.coefficients(model)));
            // A count up to that of the best may be any such number.
            let most = to_beat.unwrap_or(0.0) as usize;
            rows.count_each_to_beat(&models, threshold, most, &mut self.counts[self.drawn.clone()]);
        }
    }
}
