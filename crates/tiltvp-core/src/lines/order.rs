//! Matches of two images, and the ordering constraint: lines keep their cyclic order about the robot.

/// Line `a` of the first image is line `b` of the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Place in the first image.
    pub a: usize,
    /// Place in the second image.
    pub b: usize,
    /// Distance of the descriptors.
    pub distance: f64,
}

/// Keeps the most matches whose second indices rise cyclically with the first, of these those nearest in sum. The matches
/// must be sorted by first index; `m` is the number of lines that second indices number.
pub(super) fn keep_cyclic_order(matches: &mut Vec<Match>, m: usize) {
    let n = matches.len();
    if n < 3 {
        return;
    }
    // For each first member: the longest rising chain that starts with it, once around.
    let mut best: (usize, f64, Vec<usize>) = (0, 0.0, Vec::new());
    let (mut count, mut cost, mut before) = (vec![0usize; n], vec![0.0f64; n], vec![usize::MAX; n]);
    for start in 0..n {
        let turned = |k: usize| (matches[(start + k) % n].b + m - matches[start].b) % m;
        (count[0], cost[0], before[0]) = (1, matches[start].distance, usize::MAX);
        let mut last = 0;
        for k in 1..n {
            count[k] = 0;
            if turned(k) == 0 {
                continue;
            }
            for j in 0..k {
                let longer = count[j] + 1 > count[k]
                    || (count[j] + 1 == count[k] && cost[j] < cost[k] - matches[(start + k) % n].distance);
                if count[j] > 0 && turned(j) < turned(k) && longer {
                    (count[k], before[k]) = (count[j] + 1, j);
                    cost[k] = cost[j] + matches[(start + k) % n].distance;
                }
            }
            if (count[k], -cost[k]) > (count[last], -cost[last]) {
                last = k;
            }
        }
        if (count[last], -cost[last]) > (best.0, -best.1) {
            let mut chain = Vec::with_capacity(count[last]);
            let mut k = last;
            while k != usize::MAX {
                chain.push((start + k) % n);
                k = before[k];
            }
            best = (count[last], cost[last], chain);
        }
    }
    best.2.sort_unstable();
    let mut i = 0;
    matches.retain(|_| {
        i += 1;
        best.2.binary_search(&(i - 1)).is_ok()
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(seconds: &[usize], m: usize) -> Vec<usize> {
        let mut matches: Vec<Match> =
            seconds.iter().enumerate().map(|(a, b)| Match { a, b: *b, distance: 0.5 }).collect();
        keep_cyclic_order(&mut matches, m);
        matches.iter().map(|m| m.b).collect()
    }

    #[test]
    fn a_turn_keeps_all_and_a_crossing_loses_one() {
        assert_eq!(kept(&[3, 4, 5, 0, 1, 2], 6), [3, 4, 5, 0, 1, 2]);
        assert_eq!(kept(&[3, 4, 0, 5, 1, 2], 6).len(), 5);
        assert_eq!(kept(&[0, 1, 9, 2, 3, 5], 10), [0, 1, 2, 3, 5]);
        assert_eq!(kept(&[1, 0], 2), [1, 0]);
    }
}
