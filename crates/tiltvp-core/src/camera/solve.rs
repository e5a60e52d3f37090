//! Newton's method that cannot leave its bracket: the inverse of a growing function.

/// A step of Newton's method this small, relative to the root, leaves an error of its square.
const DONE: f64 = 1e-10;

/// The root of a growing function in `[low, high]`, to the last bits, from any start.
///
/// `function` returns value and slope and changes its sign from negative to positive within the bracket. A step that
/// leaves the bracket, or does not halve the one before it, is replaced by a bisection, so that the number of steps is
/// bounded (Press et al., Numerical Recipes, 9.4).
#[inline]
pub(super) fn increasing(mut low: f64, mut high: f64, start: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    let mut x = if start >= low && start <= high { start } else { 0.5 * (low + high) };
    let mut last = f64::INFINITY;
    for _ in 0..120 {
        let (value, slope) = function(x);
        if value > 0.0 {
            high = x;
        } else if value < 0.0 {
            low = x;
        } else {
            return x;
        }
        let mut next = x - value / slope;
        let newton = next >= low && next <= high && (next - x).abs() <= 0.5 * last;
        if !newton {
            next = 0.5 * (low + high);
        }
        last = (next - x).abs();
        x = next;
        if last <= if newton { DONE } else { f64::EPSILON } * x.abs() {
            return x;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn inverts_a_cubic_with_a_flat_start(root in 0.0..10.0f64, start in -5.0..15.0f64) {
            let target = root.powi(3) + 1e-3 * root;
            let found = increasing(0.0, 10.0, start, |x| (x.powi(3) + 1e-3 * x - target, 3.0 * x * x + 1e-3));
            prop_assert!((found - root).abs() < 1e-9);
        }
    }
}
