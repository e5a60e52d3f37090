//! The smallest value of a smooth function of a few numbers, by the downhill simplex of Nelder and Mead.

/// A place near `start` at which `value` is smallest, looked for with steps of about `step`, until the values at the
/// corners are within `tolerance` of one another or `evaluations` are spent. Values that are NaN count as infinite.
pub(super) fn minimise<const N: usize>(
    start: [f64; N],
    step: f64,
    tolerance: f64,
    evaluations: usize,
    mut value: impl FnMut(&[f64; N]) -> f64,
) -> [f64; N] {
    let mut spent = 0;
    let mut at = |x: [f64; N]| {
        spent += 1;
        let y = value(&x);
        (if y.is_nan() { f64::INFINITY } else { y }, x, spent)
    };
    let mut corners: Vec<(f64, [f64; N])> = Vec::with_capacity(N + 1);
    for i in 0..=N {
        let mut x = start;
        if let Some(x) = x.get_mut(i) {
            *x += step;
        }
        let (y, x, _) = at(x);
        corners.push((y, x));
    }
    loop {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(best, least), .., (second, _), (worst, most)] = corners[..] else { return start };
        let centre: [f64; N] = std::array::from_fn(|k| corners[..N].iter().map(|(_, x)| x[k]).sum::<f64>() / N as f64);
        let along = |t: f64| -> [f64; N] { std::array::from_fn(|k| centre[k] + t * (most[k] - centre[k])) };
        let (reflected, place, spent) = at(along(-1.0));
        if worst - best <= tolerance || spent >= evaluations {
            return if reflected < best { place } else { least };
        }
        let mut candidate = (reflected, place);
        if reflected < best {
            let (expanded, place, _) = at(along(-2.0));
            if expanded < reflected {
                candidate = (expanded, place);
            }
        } else if reflected >= second {
            let (contracted, place, _) = at(along(if reflected < worst { -0.5 } else { 0.5 }));
            if contracted >= worst.min(reflected) {
                for corner in &mut corners[1..] {
                    let (y, x, _) = at(std::array::from_fn(|k| 0.5 * (corner.1[k] + least[k])));
                    *corner = (y, x);
                }
                continue;
            }
            candidate = (contracted, place);
        }
        corners[N] = candidate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_a_bent_valley() {
        let valley = |x: &[f64; 2]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
        let [x, y] = minimise([-1.2, 1.0], 0.5, 1e-14, 2000, valley);
        assert!((x - 1.0).abs() < 1e-5 && (y - 1.0).abs() < 1e-5, "{x}, {y}");
    }

    #[test]
    fn the_last_reflection_counts_if_it_is_best() {
        // Of the corners (1, 0), (0, 1) and (0, 0) the second is worst, and reflected lies lowest.
        assert_eq!(minimise([0.0; 2], 1.0, 0.0, 1, |[x, y]| x + 2.0 * y), [1.0, -1.0]);
        assert_eq!(minimise([0.0; 2], 1.0, 0.0, 1, |[x, y]| x * x + 2.0 * y * y), [0.0, 0.0]);
    }

    #[test]
    fn keeps_to_its_evaluations_and_away_from_nan() {
        let mut spent = 0;
        let found = minimise([3.0, 1.0, 2.0], 1.0, 0.0, 60, |x| {
            spent += 1;
            if x[0] < 1.0 { f64::NAN } else { x.iter().map(|x| x * x).sum() }
        });
        assert!(found[0] >= 1.0 && spent < 70, "{found:?}, {spent}");
    }
}
