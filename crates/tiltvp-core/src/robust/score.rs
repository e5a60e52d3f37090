//! What an observation gains a model, given its residual: by count, by the truncated quadratic, or marginalised over noise.

use super::loss::Gate;
use super::marginal::{MARGINAL, marginal_gain};
use super::problem::Problem;
use super::sampling::Score;

impl Score {
    /// The score of a model, or some number up to `to_beat` where it cannot exceed that.
    pub(super) fn of<P: Problem>(self, problem: &P, model: &P::Model, threshold: f64, to_beat: f64) -> f64 {
        match self {
            // Counts are exact in double precision.
            Self::Count => problem.consensus(model, threshold, to_beat as usize) as f64,
            Self::Msac | Self::Magsac { .. } => problem.support(model, threshold, self, to_beat),
        }
    }

    /// The gain of one residual.
    pub fn gain(self, residual: f64, threshold: f64) -> f64 {
        let part = residual.abs() / threshold;
        match self {
            Self::Count => f64::from(u8::from(part <= 1.0)),
            Self::Msac => (1.0 - part * part).max(0.0),
            Self::Magsac { .. } => f64::from(marginal_gain(&MARGINAL.gain, part as f32)),
        }
    }

    /// The model after sigma-consensus++, which fits it again with the marginal weights until it stays where it is; the
    /// other scores leave it.
    pub(super) fn refit<P: Problem>(
        self,
        problem: &P,
        model: P::Model,
        threshold: f64,
        weights: &mut [f32],
    ) -> P::Model {
        let Self::Magsac { refits } = self else { return model };
        let mut model = model;
        for _ in 0..refits {
            let summary = problem.summarise(&model, Gate::Marginal { threshold }, weights);
            let Some(next) = problem.fit(&summary, &model) else { break };
            let change = problem.distance(&model, &next);
            model = next;
            if change <= STILL * threshold {
                break;
            }
        }
        model
    }
}

/// Change, in thresholds, below which sigma-consensus++ has converged.
const STILL: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::super::marginal::gain_at;
    use super::*;

    #[test]
    fn gains_fall_from_one_to_nothing() {
        for score in [Score::Count, Score::Msac, Score::magsac()] {
            let gains: Vec<f64> = (0..300).map(|i| score.gain(-0.01 * f64::from(i), 2.0)).collect();
            assert!(gains[0] > 0.99 && gains.windows(2).all(|pair| pair[0] >= pair[1] - 1e-3), "{score:?}");
            assert!(gains[201..].iter().all(|gain| *gain == 0.0), "{score:?}");
        }
        assert_eq!(Score::magsac().gain(f64::MAX, 1e-3), 0.0);
        for i in 0..=1000 {
            let part = 0.001 * f64::from(i);
            assert!((Score::magsac().gain(part, 1.0) - gain_at(part.max(1e-12))).abs() < 1e-3, "{part}");
        }
    }
}
