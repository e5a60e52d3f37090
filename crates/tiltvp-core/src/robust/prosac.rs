//! When progressive sampling may stop: the beginning of the order that promises its inliers soonest (PROSAC, section 2.2).

use super::problem::Problem;

/// The 95 % quantile of the chi-squared distribution that PROSAC's non-randomness test uses, for one side: `1.645^2`.
const NON_RANDOM: f64 = 2.706;

/// The shortest beginning that can end the sampling, as in USAC (Raguram et al. 2013).
const SHORTEST: usize = 20;

/// The beginning of `order`, or the whole, from which a sample of inliers is most probable: its size, that probability and
/// its share of inliers. `inliers` is the number among all observations.
pub(super) fn best_beginning<P: Problem>(
    problem: &P,
    model: &P::Model,
    threshold: f64,
    inliers: usize,
    order: &[u32],
    chance_share: f64,
) -> (usize, f64, f64) {
    let len = problem.len();
    let mut best = (len, all_inliers(inliers, len, P::SAMPLE_SIZE), inliers as f64 / len as f64);
    let mut count = 0;
    for (place, observation) in order.iter().enumerate() {
        count += problem.consensus_among(std::slice::from_ref(observation), model, threshold);
        let n = place + 1;
        if n < SHORTEST || n == len {
            continue;
        }
        // I_n >= I_n,min: more agree than the sample itself and chance explain, eqs. 7 to 9 by the normal approximation.
        let others = n.saturating_sub(P::SAMPLE_SIZE) as f64;
        let spread = (NON_RANDOM * others * chance_share * (1.0 - chance_share)).sqrt();
        let least = P::SAMPLE_SIZE as f64 + others * chance_share + spread;
        let probability = all_inliers(count, n, P::SAMPLE_SIZE);
        if count as f64 > least && probability > best.1 {
            best = (n, probability, count as f64 / n as f64);
        }
    }
    best
}

/// The exact probability of drawing a sample of inliers without replacement.
pub(super) fn all_inliers(inliers: usize, len: usize, sample_size: usize) -> f64 {
    (0..sample_size).map(|i| inliers.saturating_sub(i) as f64 / (len - i) as f64).product()
}
