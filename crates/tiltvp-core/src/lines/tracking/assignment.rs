//! Data association: the pairs of lines and tracks of least total cost, each line and each track at most once.

/// The cost of a pair that is not allowed: more than all allowed pairs of an image together, and small enough to keep
/// six decimals of these.
pub(crate) const FORBIDDEN: f64 = 1e9;

/// Memory of the assignment.
#[derive(Debug, Clone, Default)]
pub(crate) struct AssignmentScratch {
    row_price: Vec<f64>,
    column_price: Vec<f64>,
    /// Which row a column has, plus one.
    owner: Vec<usize>,
    way: Vec<usize>,
    slack: Vec<f64>,
    visited: Vec<bool>,
}

/// The column of each of `n` rows, none where the row stays alone, which costs `alone`; `costs` is `(n, m)` in row order.
///
/// The Hungarian method (Kuhn 1955) with prices: rows are added one by one, each along a shortest augmenting path.
pub(crate) fn assign(
    costs: &[f64],
    (n, m): (usize, usize),
    alone: f64,
    scratch: &mut AssignmentScratch,
    out: &mut Vec<Option<usize>>,
) {
    // As many columns more as rows, any of which is for being alone. Row and column 0 are the root.
    let columns = m + n;
    let AssignmentScratch { row_price, column_price, owner, way, slack, visited } = scratch;
    let cost = |row: usize, column: usize| if column <= m { costs[(row - 1) * m + column - 1] } else { alone };
    for (values, count) in [(&mut *row_price, n), (&mut *column_price, columns)] {
        values.clear();
        values.resize(count + 1, 0.0);
    }
    for values in [&mut *owner, &mut *way] {
        values.clear();
        values.resize(columns + 1, 0);
    }
    for row in 1..=n {
        owner[0] = row;
        let mut column = 0;
        slack.clear();
        slack.resize(columns + 1, f64::INFINITY);
        visited.clear();
        visited.resize(columns + 1, false);
        while owner[column] != 0 {
            visited[column] = true;
            let (here, mut least, mut next) = (owner[column], f64::INFINITY, 0);
            for other in 1..=columns {
                if visited[other] {
                    continue;
                }
                let reduced = cost(here, other) - row_price[here] - column_price[other];
                if reduced < slack[other] {
                    (slack[other], way[other]) = (reduced, column);
                }
                if slack[other] < least {
                    (least, next) = (slack[other], other);
                }
            }
            for other in 0..=columns {
                if visited[other] {
                    row_price[owner[other]] += least;
                    column_price[other] -= least;
                } else {
                    slack[other] -= least;
                }
            }
            column = next;
        }
        while column != 0 {
            let before = way[column];
            owner[column] = owner[before];
            column = before;
        }
    }
    out.clear();
    out.resize(n, None);
    for column in 1..=m {
        if owner[column] != 0 && cost(owner[column], column) < FORBIDDEN {
            out[owner[column] - 1] = Some(column - 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least cost over all assignments, one by one.
    fn least(costs: &[f64], m: usize, row: usize, used: &mut Vec<bool>, alone: f64) -> f64 {
        if row * m == costs.len() {
            return 0.0;
        }
        let mut best = alone + least(costs, m, row + 1, used, alone);
        for column in 0..m {
            if !used[column] && costs[row * m + column] < FORBIDDEN {
                used[column] = true;
                best = best.min(costs[row * m + column] + least(costs, m, row + 1, used, alone));
                used[column] = false;
            }
        }
        best
    }

    #[test]
    fn no_assignment_costs_less() {
        let (mut scratch, mut out, mut state) = (AssignmentScratch::default(), Vec::new(), 1u64);
        for (n, m) in [(1, 1), (3, 3), (4, 2), (2, 5), (5, 5), (3, 0)] {
            for _ in 0..50 {
                let costs: Vec<f64> = (0..n * m)
                    .map(|_| {
                        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                        let share = (state >> 40) as f64 / 16_777_216.0;
                        if share > 0.8 { FORBIDDEN } else { 20.0 * share }
                    })
                    .collect();
                assign(&costs, (n, m), 10.0, &mut scratch, &mut out);
                let cost: f64 = (0..n).map(|i| out[i].map_or(10.0, |j| costs[i * m + j])).sum();
                let mut columns: Vec<usize> = out.iter().flatten().copied().collect();
                let pairs = columns.len();
                columns.sort_unstable();
                columns.dedup();
                assert_eq!(columns.len(), pairs);
                if m > 0 {
                    assert!((cost - least(&costs, m, 0, &mut vec![false; m], 10.0)).abs() < 1e-9, "{n} x {m}");
                }
            }
        }
    }
}
