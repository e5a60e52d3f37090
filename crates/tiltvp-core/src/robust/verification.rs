//! Whether a model is worth scoring: Wald's sequential test with adapting shares (Matas and Chum 2005).

use super::problem::Problem;
use super::sampling::Verification;

/// Observations that the test looks at; a model that is still undecided after them is scored.
pub(super) const PROBES: usize = 256;

/// Observations between two looks at the likelihood ratio.
const LOOK: usize = 16;

/// Tests whose record is kept; older ones count as the oldest kept.
const RECORDS: usize = 32;

/// Relative change of the chance share at which a new test is designed, as in the paper.
const CHANGE: f64 = 0.05;

/// A sequential test between "a share `good` agrees" and "a share `bad` agrees".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Test {
    good: f64,
    bad: f64,
    /// Decision threshold `A` of the likelihood ratio; infinite where nothing can be told.
    limit: f64,
}

impl Test {
    /// The test that minimises the time to a good model, for one model from each sample.
    fn design(good: f64, bad: f64, model_cost: f64) -> Self {
        if bad >= good || bad <= 0.0 || good >= 1.0 {
            return Self { good, bad, limit: f64::INFINITY };
        }
        // A = t_M C + 1 + ln A by fixed-point iteration.
        let gain = (1.0 - bad) * ((1.0 - bad) / (1.0 - good)).ln() + bad * (bad / good).ln();
        let least = model_cost * gain + 1.0;
        let limit = (0..10).fold(least, |limit, _| least + limit.ln());
        Self { good, bad, limit }
    }

    /// Likelihood ratio, as logarithms, of an observation that agrees and of one that does not.
    fn steps(&self) -> (f64, f64) {
        ((self.bad / self.good).ln(), ((1.0 - self.bad) / (1.0 - self.good)).ln())
    }

    /// The probability that a model with which a share `inliers` agrees passes: `1 - A^-h`, where `h` solves
    /// `inliers (bad / good)^h + (1 - inliers) ((1 - bad) / (1 - good))^h = 1`.
    fn passes(&self, inliers: f64) -> f64 {
        if self.limit.is_infinite() {
            return 1.0;
        }
        let (agree, differ) = self.steps();
        if inliers * agree + (1.0 - inliers) * differ >= 0.0 {
            return 0.0;
        }
        let excess = |h: f64| inliers * (h * agree).exp() + (1.0 - inliers) * (h * differ).exp() - 1.0;
        let (mut low, mut high) = (0.0, 1.0);
        while excess(high) < 0.0 && high < 1e3 {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        1.0 - self.limit.powf(-low)
    }
}

/// Decides which models are scored, and remembers how it has decided.
pub(super) struct Verifier<'a> {
    probes: &'a [u32],
    model_cost: f64,
    /// Least share that a good model is taken to have.
    least: f64,
    test: Option<Test>,
    /// Tests that were in force before, each with the number of trials it was.
    past: [(Option<Test>, u32); RECORDS],
    records: usize,
    /// Trials decided by the test in force.
    trials: u32,
    /// Sum and number of the shares that agreed with models that were not the best.
    chance: (f64, f64),
}

impl<'a> Verifier<'a> {
    /// `probes` are observations in random order.
    pub(super) fn new(options: Verification, probes: &'a [u32]) -> Self {
        let (model_cost, least, test, chance) = match options {
            Verification::Full => (0.0, 0.0, None, (0.0, 0.0)),
            Verification::Sprt { inlier_share, chance_share, model_cost } => {
                let test = Test::design(inlier_share, chance_share, model_cost);
                (model_cost, inlier_share, Some(test), (chance_share, 1.0))
            }
        };
        Self { probes, model_cost, least, test, past: [(None, 0); RECORDS], records: 0, trials: 0, chance }
    }

    /// Whether a model is worth scoring. The share that agreed is learnt as that of a bad model if it is not.
    pub(super) fn passes<P: Problem>(&mut self, problem: &P, model: &P::Model, threshold: f64) -> bool {
        self.trials += 1;
        let Some(test) = self.test else { return true };
        let ((agree, differ), limit) = (test.steps(), test.limit.ln());
        let (mut seen, mut agreed, mut ratio) = (0, 0, 0.0);
        for block in self.probes.chunks(LOOK) {
            let count = problem.consensus_among(block, model, threshold);
            (seen, agreed) = (seen + block.len(), agreed + count);
            ratio += count as f64 * agree + (block.len() - count) as f64 * differ;
            if ratio > limit {
                self.learn_bad(agreed as f64 / seen as f64);
                return false;
            }
            // As unlikely to be bad as the rejected ones are to be good: scored without looking further.
            if ratio < -limit {
                break;
            }
        }
        true
    }

    /// Learns that a share agreed with a model that is not the best.
    pub(super) fn learn_bad(&mut self, share: f64) {
        let Some(test) = self.test else { return };
        self.chance = (self.chance.0 + share, self.chance.1 + 1.0);
        let bad = self.chance.0 / self.chance.1;
        if (bad - test.bad).abs() > CHANGE * test.bad {
            self.redesign(test.good, bad);
        }
    }

    /// Learns that a share agrees with the best model.
    pub(super) fn learn_good(&mut self, share: f64) {
        if self.test.is_some() {
            self.redesign(share.max(self.least), self.chance.0 / self.chance.1);
        }
    }

    fn redesign(&mut self, good: f64, bad: f64) {
        match self.past.get_mut(self.records) {
            Some(record) => {
                *record = (self.test, self.trials);
                self.records += 1;
            }
            None => self.past[RECORDS - 1].1 += self.trials,
        }
        self.trials = 0;
        self.test = Some(Test::design(good, bad, self.model_cost));
    }

    /// Trials by the `trial`-th after which a sample of inliers, drawn with probability `chance`, has passed with the given
    /// confidence; `inliers` is the share of inliers.
    pub(super) fn trials_needed(&self, trial: u32, chance: f64, inliers: f64, confidence: f64) -> u32 {
        let allowed = (1.0 - confidence).ln();
        let Some(test) = self.test else { return whole_trials(allowed, chance) };
        let missed = |test: &Test| (-chance * test.passes(inliers)).ln_1p();
        let past = self.past[..self.records].iter();
        let past: f64 = past.map(|(test, n)| f64::from(*n) * test.as_ref().map_or(0.0, missed)).sum();
        if past <= allowed {
            return trial;
        }
        let before = trial - self.trials;
        before.saturating_add(whole_trials(allowed - past, chance * test.passes(inliers)))
    }
}

/// Smallest `n` with `n ln(1 - chance) < allowed`.
fn whole_trials(allowed: f64, chance: f64) -> u32 {
    if chance >= 1.0 {
        return 1;
    }
    let needed = allowed / (-chance).ln_1p();
    if needed.is_finite() { (needed.floor() + 1.0).min(f64::from(u32::MAX)) as u32 } else { u32::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_solves_its_equation_and_bounds_false_rejections() {
        let (good, bad, cost) = (0.4, 0.1, 100.0);
        let test = Test::design(good, bad, cost);
        let gain = (1.0 - bad) * ((1.0 - bad) / (1.0 - good)).ln() + bad * (bad / good).ln();
        assert!((test.limit - (cost * gain + 1.0 + test.limit.ln())).abs() < 1e-6);
        assert!((test.passes(good) - (1.0 - 1.0 / test.limit)).abs() < 1e-9);
        assert!(test.passes(0.6) > test.passes(0.4) && test.passes(0.4) > test.passes(0.3));
        assert_eq!(test.passes(bad), 0.0);
        assert!(Test::design(0.1, 0.2, cost).limit.is_infinite());
    }

    #[test]
    fn without_a_test_the_trials_are_the_plain_ones() {
        let verifier = Verifier::new(Verification::Full, &[]);
        let exact = (1e-4f64.ln() / (5.0f64 / 6.0).ln()).floor() as u32 + 1;
        assert_eq!(verifier.trials_needed(1, 1.0 / 6.0, 0.5, 0.9999), exact);
        assert_eq!(verifier.trials_needed(1, 1.0, 1.0, 0.9999), 1);
        assert_eq!(verifier.trials_needed(1, 0.0, 0.0, 0.9999), u32::MAX);
        let mut tested = Verifier::new(Verification::sprt(), &[]);
        assert!(tested.trials_needed(0, 1.0 / 6.0, 0.5, 0.9999) >= exact);
        tested.learn_good(0.5);
        assert!(tested.trials_needed(0, 1.0 / 6.0, 0.5, 0.9999) >= exact);
    }

    /// Models with a known share of agreeing observations, in an order that the model decides.
    struct Agreement;

    impl Problem for Agreement {
        type Model = (u64, f64);
        type Summary = ();
        const SAMPLE_SIZE: usize = 1;

        fn len(&self) -> usize {
            PROBES
        }
        fn fit_minimal(&self, _: &[usize]) -> Option<Self::Model> {
            None
        }
        fn consensus(&self, _: &Self::Model, _: f64, _: usize) -> usize {
            0
        }
        fn consensus_among(&self, observations: &[u32], (model, share): &Self::Model, _: f64) -> usize {
            let dice = |i: &u32| {
                let mut x = (model << 32 | u64::from(*i)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                for _ in 0..3 {
                    x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                }
                (x >> 11) as f64 / (1u64 << 53) as f64
            };
            observations.iter().filter(|i| dice(i) < *share).count()
        }
        fn support(&self, _: &Self::Model, _: f64, _: super::super::Score, _: f64) -> f64 {
            0.0
        }
        fn quality(&self, _: usize) -> f32 {
            0.0
        }
        fn summarise(&self, _: &Self::Model, _: super::super::Gate, _: &mut [f32]) {}
        fn fit(&self, (): &(), _: &Self::Model) -> Option<Self::Model> {
            None
        }
        fn rms(&self, (): &(), _: &Self::Model) -> f64 {
            0.0
        }
        fn count((): &()) -> usize {
            0
        }
        fn distance(&self, _: &Self::Model, _: &Self::Model) -> f64 {
            0.0
        }
    }

    /// Of 20 000 good models at most a share `1 / A` is rejected (looks at every 16th observation reject fewer), and of bad
    /// ones most are; the seeds are fixed.
    #[test]
    fn good_models_pass_at_the_stated_rate() {
        let probes: Vec<u32> = (0..PROBES as u32).collect();
        let options = Verification::Sprt { inlier_share: 0.4, chance_share: 0.15, model_cost: 100.0 };
        let rejected = |share: f64| {
            let count = 20_000;
            let lost = (0..count).filter(|model| {
                // A verifier of its own for each, so that nothing is learnt.
                !Verifier::new(options, &probes).passes(&Agreement, &(*model, share), 1.0)
            });
            lost.count() as f64 / count as f64
        };
        let test = Test::design(0.4, 0.15, 100.0);
        let stated = 1.0 / test.limit;
        assert!(stated > 0.02 && stated < 0.1, "{stated}");
        let (good, better, bad) = (rejected(0.4), rejected(0.5), rejected(0.15));
        assert!(good < stated && good > 0.1 * stated, "{good} {stated}");
        assert!(better < 1.0 - test.passes(0.5), "{better}");
        assert!(bad > 0.9, "{bad}");
    }
}
