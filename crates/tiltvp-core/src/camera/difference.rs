//! Derivatives by central differences with Richardson's extrapolation, at the step that serves best.

use nalgebra::SVector;

/// A derivative by differences, and how far its last two extrapolations lay apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivative<const N: usize> {
    /// The derivative.
    pub value: SVector<f64, N>,
    /// Estimate of its error, in the same unit.
    pub error: f64,
}

/// Steps tried, each half of the one before: the last is 2^-15 of the first, where rounding outweighs the curvature.
const STEPS: usize = 16;
/// Halvings allowed until the function has a value on both sides: 2^-40 of the largest step is a millionth of a millionth of it.
const APPROACH: usize = 40;
/// Extrapolations per step: the error goes with the step to the power of twice this, so that from the
/// fifth on the rounding of the values is all that is left.
const ORDER: usize = 5;

/// The derivative at 0 of a function that may have no value further away, by the method of Ridders (1982).
///
/// Central differences over steps `h, h/2, h/4, ..` are extrapolated to step zero; among all extrapolations the one that
/// agrees best with its neighbours wins, which balances the curvature of the function against the rounding of its
/// values. `None` if the function has no value on both sides even at the smallest step.
pub fn derivative<const N: usize>(
    largest_step: f64,
    function: impl Fn(f64) -> Option<SVector<f64, N>>,
) -> Option<Derivative<N>> {
    let mut best: Option<Derivative<N>> = None;
    let mut previous = [SVector::<f64, N>::zeros(); ORDER];
    let mut filled = 0;
    let sides = |h: f64| function(h).zip(function(-h));
    let mut h = largest_step;
    for _ in 0..APPROACH {
        if sides(h).is_some() {
            break;
        }
        h *= 0.5;
    }
    for _ in 0..STEPS {
        if let Some((right, left)) = sides(h) {
            let mut row = [SVector::<f64, N>::zeros(); ORDER];
            row[0] = (right - left) / (2.0 * h);
            let depth = (filled + 1).min(ORDER);
            // Where the values are rounded, neighbours may agree by chance.
            let rounding = f64::EPSILON * (right.norm() + left.norm()) / h;
            let mut factor = 1.0;
            for i in 1..depth {
                factor *= 4.0;
                row[i] = (row[i - 1] * factor - previous[i - 1]) / (factor - 1.0);
                let error = (row[i] - row[i - 1]).norm().max((row[i] - previous[i - 1]).norm()) + rounding;
                if best.is_none_or(|b| error < b.error) {
                    best = Some(Derivative { value: row[i], error });
                }
            }
            previous = row;
            filled += 1;
        } else {
            filled = 0;
        }
        h *= 0.5;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector1;

    #[test]
    fn finds_a_smooth_derivative_and_one_next_to_an_edge() {
        let smooth = derivative(0.5, |t| Some(Vector1::new((1.0 + t).exp())));
        assert!(smooth.is_some_and(|d| (d.value.x - 1f64.exp()).abs() < 1e-11));
        let edge = derivative(0.5, |t| (t > -1e-3).then(|| Vector1::new((1e-3 + t).sqrt())));
        assert!(edge.is_some_and(|d| (d.value.x * 2.0 * 1e-3f64.sqrt() - 1.0).abs() < 1e-9), "{edge:?}");
    }
}
