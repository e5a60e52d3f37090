//! Which of several directions is up: what tells it, and how much each of it says.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use super::any_lightness::Lightness;
use super::choice_weights::{BIASES, HIDDEN, LINEAR, MEANS, OUT, SCALES};
use super::frame::Edge;
use super::hypothesis::{FEATURES, Hypothesis, OF_EDGES, Prior};

/// Features that say what was expected before the image was seen: they count in proportion, so that no lean is ruled out.
const EXPECTED: std::ops::Range<usize> = 1..4;

/// How probable any lean is, as a share of none at all, where leans above a right angle are allowed: a camera that is held anyhow. Of 54
/// views turned upside down by fisheyes and 108 by pinholes 3.7 and 4.6 % are sure (0.9) of the opposite with 0.01, 1.9 and 1.9 % with 0.03,
/// none with this; of upright ones 7 and 10 % fewer are answered than with 0.01.
const ANYHOW: f64 = 0.1;

/// Standard deviations beyond which a feature tells no more, in training too.
const FARTHEST: f64 = 4.0;

/// The logarithm of the odds of a hypothesis, up to a constant: a line and a layer of hidden units, whose weights `tiltvp measure
/// views` trains on views of panoramas; it tells how well they do on buildings that they have not seen.
pub(super) fn log_odds(features: &[f64; FEATURES], prior: &Prior) -> f64 {
    let scaled: [f64; FEATURES] = std::array::from_fn(|i| {
        let own = (features[i] - MEANS[i]) / SCALES[i];
        if EXPECTED.contains(&i) { own } else { own.clamp(-FARTHEST, FARTHEST) }
    });
    let sum = |weights: &[f64; FEATURES]| weights.iter().zip(&scaled).map(|(weight, own)| weight * own).sum::<f64>();
    let hidden = HIDDEN.iter().zip(BIASES).zip(OUT).map(|((weights, bias), out)| out * (sum(weights) + bias).tanh());
    let log_odds = sum(&LINEAR) + hidden.sum::<f64>();
    if prior.reach_rad <= FRAC_PI_2 {
        return log_odds;
    }
    let expected: f64 = EXPECTED.map(|i| LINEAR[i] * features[i] / SCALES[i]).sum();
    log_odds + (ANYHOW * (-expected).exp()).ln_1p()
}

/// The unit of leans in radians.
const LEAN_RAD: f64 = 30f64.to_radians();

/// Cosine of 45 degrees: cameras whose axis is nearer to the vertical than that have no roll.
pub(super) const AHEAD_SIN: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// What tells whether a hypothesis is the right one: its likelihood; how far it is from what was expected, by roll and pitch of the
/// camera; how much agrees with each of its axes, how long, how high and of which polarity that is; how light it is above and below.
pub(super) fn features(
    edges: &[Edge],
    hypothesis: &Hypothesis,
    prior: &Prior,
    lightness: &Lightness<'_>,
) -> [f64; FEATURES] {
    let (own, bands) = (of_edges(edges, hypothesis, prior), lightness.bands(&hypothesis.up));
    std::array::from_fn(|i| if i < OF_EDGES { own[i] } else { bands[i - OF_EDGES] })
}

fn of_edges(edges: &[Edge], hypothesis: &Hypothesis, prior: &Prior) -> [f64; OF_EDGES] {
    let up = &hypothesis.up;
    let (mut of_axis, mut total) = ([0.0; 3], 0.0);
    let (mut polarity, mut polarity_of_all, mut rest) = (0.0, 0.0, 0.0);
    let (mut height_of_verticals, mut height_of_horizontals, mut rise) = (0.0, 0.0, 0.0);
    let (mut longest_vertical, mut longest_horizontal) = (0.0f64, 0.0f64);
    let (mut length_of_verticals, mut length_of_horizontals) = (0.0, 0.0);
    for edge in edges {
        let [first, second, vertical] = hypothesis.frame.shares(edge);
        let (weight, horizontal) = (edge.weight, first + second);
        for (sum, share) in of_axis.iter_mut().zip([first, second, vertical]) {
            *sum += weight * share;
        }
        total += weight;
        let (brighter, height) = (edge.normal.dot(up), edge.middle.dot(up));
        polarity += weight * horizontal * brighter;
        polarity_of_all += weight * (1.0 - vertical) * brighter;
        rest += weight * (1.0 - vertical);
        height_of_verticals += weight * vertical * height.abs();
        height_of_horizontals += weight * horizontal * height.abs();
        rise += weight * horizontal * height;
        longest_vertical = longest_vertical.max(edge.length_rad * vertical);
        longest_horizontal = longest_horizontal.max(edge.length_rad * horizontal);
        length_of_verticals += edge.length_rad * vertical;
        length_of_horizontals += edge.length_rad * horizontal;
    }
    let [first, second, vertical] = of_axis;
    let (more, less, horizontal) = (first.max(second), first.min(second), first + second);
    let (lean, roll, pitch) = leans(up, prior);
    [
        0.1 * hypothesis.frame.log_likelihood,
        lean * lean,
        roll * roll,
        pitch * pitch,
        0.1 * vertical,
        0.1 * more,
        0.1 * less,
        vertical.ln_1p() - more.ln_1p(),
        less.ln_1p(),
        height_of_verticals / (1.0 + vertical),
        height_of_horizontals / (1.0 + horizontal),
        rise / (1.0 + horizontal),
        polarity / (1.0 + horizontal),
        polarity_of_all / (1.0 + rest),
        longest_vertical,
        longest_horizontal,
        length_of_verticals.ln_1p(),
        length_of_horizontals.ln_1p(),
        hypothesis.frame.log_likelihood / (5.0 + total),
    ]
}

/// How far a direction is from what was expected to be up, and by which roll and pitch of the camera, in units of 30 degrees. A
/// camera that looks up or down has no roll: both are the same share of the whole.
fn leans(up: &Vector3<f64>, prior: &Prior) -> (f64, f64, f64) {
    let lean = up.z.clamp(-1.0, 1.0).acos();
    let axis = prior.robot_from_camera * Vector3::z();
    let (roll, pitch) = if axis.z.abs() < AHEAD_SIN {
        let level = |direction: &Vector3<f64>| direction - axis * axis.dot(direction);
        let (own, expected) = (level(up), level(&Vector3::z()));
        let roll = axis.dot(&expected.cross(&own)).atan2(expected.dot(&own));
        (roll, axis.dot(up).clamp(-1.0, 1.0).asin() - axis.z.asin())
    } else {
        (lean / 2f64.sqrt(), lean / 2f64.sqrt())
    };
    (lean / LEAN_RAD, roll / LEAN_RAD, pitch / LEAN_RAD)
}
