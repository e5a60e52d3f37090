//! The normal equations of a drive with the poses eliminated: first inside runs of poses, then the poses between the runs.
//!
//! A pose is coupled to its neighbours, to what is estimated once for the whole drive, and to the landmarks seen from it.
//! Eliminating a chain from one end couples every pose to every landmark before it. A run of a few poses sees few landmarks,
//! so its inner poses are eliminated among these; only the poses between the runs are coupled to all.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix3x2, Vector3};

use super::graph::{Graph, Node};
use super::measurement::predict;
use super::odometry::between;
use crate::geometry::wrap_angle;

/// Poses of a run.
const RUN: usize = 20;

/// Numbers in the dense block up to which all poses are one run.
const NARROW: usize = 48;

/// A pose that has been eliminated: `inverse (rhs - coupling dense - before pose_before - next pose_after)` gives it back.
struct Link {
    inverse: Matrix3<f64>,
    coupling: [Vec<f64>; 3],
    before: Matrix3<f64>,
    next: Matrix3<f64>,
    rhs: Vector3<f64>,
}

/// The inner poses of a run.
struct Run {
    /// The pose before them, which the run hangs on; 0 is the anchor.
    left: usize,
    /// The columns of the dense block that the couplings are about, ascending.
    columns: Vec<usize>,
    links: Vec<Link>,
}

/// The normal equations of the dense block, and of the last pose if it was kept, with the other poses eliminated.
pub(super) struct Eliminated {
    runs: Vec<Run>,
    /// The poses between the runs, each with its place.
    between: Vec<(usize, Link)>,
    /// Information about (last pose if kept, dense block); symmetric.
    pub(super) information: DMatrix<f64>,
    pub(super) rhs: DVector<f64>,
}

impl Eliminated {
    /// The steps of all poses but the anchor and one that was kept, for a step of the dense block.
    pub(super) fn poses(&self, step: &DVector<f64>, nodes: usize) -> Vec<Vector3<f64>> {
        let mut steps = vec![Vector3::zeros(); nodes + 1];
        let mut after = nodes;
        for (at, link) in self.between.iter().rev() {
            let mut side = link.rhs - link.next * steps[after];
            for (k, values) in link.coupling.iter().enumerate() {
                side[k] -= values.iter().zip(step.iter()).map(|(a, b)| a * b).sum::<f64>();
            }
            steps[*at] = link.inverse * side;
            after = *at;
        }
        for run in &self.runs {
            let left = steps[run.left];
            for (i, link) in run.links.iter().enumerate().rev() {
                let at = run.left + 1 + i;
                let mut side = link.rhs - link.next * steps[at + 1] - link.before * left;
                for (k, values) in link.coupling.iter().enumerate() {
                    side[k] -= values.iter().zip(&run.columns).map(|(a, c)| a * step[*c]).sum::<f64>();
                }
                steps[at] = link.inverse * side;
            }
        }
        steps.truncate(nodes);
        steps
    }
}

/// Normal equations of a pose as they are gathered: its own block, its couplings, its side.
struct Gathered {
    own: Matrix3<f64>,
    coupling: [Vec<f64>; 3],
    side: Vector3<f64>,
}

impl Gathered {
    fn new(width: usize) -> Self {
        Self { own: Matrix3::zeros(), coupling: std::array::from_fn(|_| vec![0.0; width]), side: Vector3::zeros() }
    }

    /// Adds a bearing taken here; `at` is where its landmark's columns are in the couplings.
    fn add_row(&mut self, row: &Row, at: usize, fixed: usize) {
        self.own += row.by_pose * row.by_pose.transpose() * row.weight;
        self.side -= row.by_pose * (row.weight * row.residual);
        for (k, values) in self.coupling.iter_mut().enumerate() {
            let scale = row.by_pose[k] * row.weight;
            for (value, by) in values[..fixed].iter_mut().zip(&row.by_fixed) {
                *value += by * scale;
            }
            values[at] += row.by_landmark[0] * scale;
            values[at + 1] += row.by_landmark[1] * scale;
        }
    }

    fn add_wheels(&mut self, block: &Matrix3x2<f64>) {
        for (k, values) in self.coupling.iter_mut().enumerate() {
            values[3] += block[(k, 0)];
            values[4] += block[(k, 1)];
        }
    }

    /// Adds another's couplings, whose columns are named.
    fn add(&mut self, other: &Self, columns: &[usize]) {
        self.own += other.own;
        self.side += other.side;
        for (values, others) in self.coupling.iter_mut().zip(&other.coupling) {
            for (c, value) in columns.iter().zip(others) {
                values[*c] += value;
            }
        }
    }
}

/// The part of a motion in the normal equations.
struct LegBlocks {
    before: Matrix3<f64>,
    across: Matrix3<f64>,
    after: Matrix3<f64>,
    before_side: Vector3<f64>,
    after_side: Vector3<f64>,
    before_wheels: Matrix3x2<f64>,
    after_wheels: Matrix3x2<f64>,
}

/// What a run leaves: normal equations of the poses at its ends and of the columns that it touches.
struct RunBlocks {
    left: Gathered,
    right: Gathered,
    across: Matrix3<f64>,
    dense: DMatrix<f64>,
    rhs: DVector<f64>,
}

impl Graph {
    /// The normal equations up to node `last`, damped by `damping` times their diagonal, all poses before it eliminated,
    /// and it too unless `keep`. `None` where they are singular.
    pub(super) fn eliminate(&self, last: usize, keep: bool, damping: f64) -> Option<Eliminated> {
        let length = if self.width() <= NARROW { usize::MAX } else { RUN };
        self.eliminate_in_runs(last, keep, damping, length)
    }

    fn eliminate_in_runs(&self, last: usize, keep: bool, damping: f64, length: usize) -> Option<Eliminated> {
        let (width, fixed) = (self.width(), self.free.width());
        let mut dense = self.prior_information.clone();
        let mut rhs = -(&self.prior_information * (self.dense() - &self.prior_mean));
        for row in self.linearised(&self.nodes[0]) {
            row.add_dense(&mut dense, &mut rhs, row.at, fixed);
        }
        let mut at = Gathered::new(width);
        let (mut runs, mut between) = (Vec::new(), Vec::new());
        let (mut left, mut reach) = (0, fixed);
        while left < last {
            let right = left.saturating_add(length).min(last);
            let (run, blocks) = self.eliminate_run(left, right, damping)?;
            for (c, column) in run.columns.iter().enumerate() {
                for (r, row) in run.columns[..=c].iter().enumerate() {
                    dense[(*row, *column)] += blocks.dense[(r, c)];
                }
                rhs[*column] += blocks.rhs[c];
            }
            reach = reach.max(run.columns.last().map_or(0, |c| c + 1));
            let mut next = Gathered::new(width);
            next.add(&blocks.right, &run.columns);
            if left > 0 {
                at.add(&blocks.left, &run.columns);
                let link = eliminate_pose(at, blocks.across, damping, &mut next, reach, &mut dense, &mut rhs)?;
                between.push((left, link));
            }
            for row in self.linearised(&self.nodes[right]) {
                row.add_dense(&mut dense, &mut rhs, row.at, fixed);
                next.add_row(&row, row.at, fixed);
                reach = reach.max(row.at + 2);
            }
            runs.push(run);
            (at, left) = (next, right);
        }
        let mut kept = None;
        if keep {
            kept = Some(at);
        } else if last > 0 {
            let mut nothing = Gathered::new(width);
            let link = eliminate_pose(at, Matrix3::zeros(), damping, &mut nothing, reach, &mut dense, &mut rhs)?;
            between.push((last, link));
        }
        dense.fill_lower_triangle_with_upper_triangle();
        for k in 0..width {
            dense[(k, k)] *= 1.0 + damping;
        }
        let (information, rhs) = match kept {
            Some(pose) => joined(&pose, &dense, &rhs),
            None => (dense, rhs),
        };
        Some(Eliminated { runs, between, information, rhs })
    }

    /// Eliminates the poses between two.
    fn eliminate_run(&self, left: usize, right: usize, damping: f64) -> Option<(Run, RunBlocks)> {
        let fixed = self.free.width();
        let inner = &self.nodes[left + 1..right];
        let mut seen: Vec<usize> = inner.iter().flat_map(|node| &node.sights).map(|sight| sight.landmark).collect();
        seen.sort_unstable();
        seen.dedup();
        let columns: Vec<usize> =
            (0..fixed).chain(seen.iter().flat_map(|slot| [fixed + 2 * slot, fixed + 2 * slot + 1])).collect();
        let width = columns.len();
        let (mut dense, mut rhs) = (DMatrix::zeros(width, width), DVector::zeros(width));
        let mut ends = Gathered::new(width);
        let mut links = Vec::with_capacity(inner.len());
        let mut leg = self.leg_blocks(left, &mut dense, &mut rhs);
        ends.own += leg.before;
        ends.side += leg.before_side;
        if self.free.wheels {
            ends.add_wheels(&leg.before_wheels);
        }
        // Of the pose at hand: its coupling to the pose at the left end.
        let mut before = leg.across.transpose();
        let mut at = after_leg(&leg, width, self.free.wheels);
        for i in left + 1..right {
            for row in self.linearised(&self.nodes[i]) {
                let slot = (row.at - fixed) / 2;
                let place = fixed + 2 * seen.partition_point(|s| *s < slot);
                row.add_dense(&mut dense, &mut rhs, place, fixed);
                at.add_row(&row, place, fixed);
            }
            leg = self.leg_blocks(i, &mut dense, &mut rhs);
            at.own += leg.before;
            at.side += leg.before_side;
            if self.free.wheels {
                at.add_wheels(&leg.before_wheels);
            }
            let mut next = after_leg(&leg, width, self.free.wheels);
            let mut link = eliminate_pose(at, leg.across, damping, &mut next, width, &mut dense, &mut rhs)?;
            if left > 0 {
                link.before = before;
                let onto = before.transpose() * link.inverse;
                ends.own -= onto * before;
                ends.side -= onto * link.rhs;
                subtract_product(&mut ends.coupling, &onto, &link.coupling, width);
                before = -(link.next.transpose() * link.inverse * before);
            }
            links.push(link);
            at = next;
        }
        let across = before.transpose();
        Some((Run { left, columns, links }, RunBlocks { left: ends, right: at, across, dense, rhs }))
    }

    /// The part of the motion that follows a node; what it says of the wheels alone is added to the dense block.
    fn leg_blocks(&self, from: usize, dense: &mut DMatrix<f64>, rhs: &mut DVector<f64>) -> LegBlocks {
        let (node, after) = (&self.nodes[from], &self.nodes[from + 1]);
        let b = between(&node.pose, &after.pose);
        let (sin, cos) = node.pose.z.sin_cos();
        let by_after = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        let by_before = Matrix3::new(-cos, -sin, b.y, sin, -cos, -b.x, 0.0, 0.0, -1.0);
        let r = b - after.leg.motion;
        let information = after.information * self.slip.weight(r.dot(&(after.information * r)));
        let (wb, wa, wr) = (information * by_before, information * by_after, information * r);
        let mut blocks = LegBlocks {
            before: by_before.transpose() * wb,
            across: by_before.transpose() * wa,
            after: by_after.transpose() * wa,
            before_side: -(by_before.transpose() * wr),
            after_side: -(by_after.transpose() * wr),
            before_wheels: Matrix3x2::zeros(),
            after_wheels: Matrix3x2::zeros(),
        };
        if self.free.wheels {
            let j = -after.leg.by_wheels;
            let own = j.transpose() * information * j;
            let side = j.transpose() * wr;
            for a in 0..2 {
                for b in 0..=a {
                    dense[(3 + b, 3 + a)] += own[(b, a)];
                }
                rhs[3 + a] -= side[a];
            }
            blocks.before_wheels = wb.transpose() * j;
            blocks.after_wheels = wa.transpose() * j;
        }
        blocks
    }

    /// The rows of a node's bearings.
    fn linearised<'a>(&'a self, node: &'a Node) -> impl Iterator<Item = Row> + 'a {
        let (pose, moved) = self.pose_of_sights(node);
        let fixed = self.free.width();
        node.sights.iter().map(move |sight| {
            let p = predict(&pose, &self.mounting, &self.landmarks[sight.landmark]);
            let s = 1.0 / self.bearing_sigma;
            let residual = wrap_angle(p.bearing - sight.bearing) * s;
            let mut by_fixed = [0.0; 6];
            by_fixed[..3].copy_from_slice((p.by_mounting * s).as_slice());
            let mut by_pose = p.by_pose * s;
            if let Some((first, by_offset)) = moved {
                if self.free.offset {
                    by_fixed[self.free.offset_at()] = by_pose.dot(&by_offset);
                }
                by_pose = first.transpose() * by_pose;
            }
            Row {
                by_pose,
                by_fixed,
                at: fixed + 2 * sight.landmark,
                by_landmark: [p.by_landmark.x * s, p.by_landmark.y * s],
                residual,
                weight: self.loss.weight(residual),
            }
        })
    }
}

/// What a motion says of the pose that it leads to.
fn after_leg(leg: &LegBlocks, width: usize, wheels: bool) -> Gathered {
    let mut at = Gathered::new(width);
    at.own = leg.after;
    at.side = leg.after_side;
    if wheels {
        at.add_wheels(&leg.after_wheels);
    }
    at
}

/// A bearing's whitened residual, its derivatives, and its weight.
struct Row {
    by_pose: Vector3<f64>,
    by_fixed: [f64; 6],
    /// Where its landmark is in the dense block.
    at: usize,
    by_landmark: [f64; 2],
    residual: f64,
    weight: f64,
}

impl Row {
    /// Adds to the upper triangle, the landmark being at `at`.
    fn add_dense(&self, dense: &mut DMatrix<f64>, rhs: &mut DVector<f64>, at: usize, fixed: usize) {
        let w = self.weight;
        for c in 0..fixed {
            for r in 0..=c {
                dense[(r, c)] += self.by_fixed[r] * self.by_fixed[c] * w;
            }
            rhs[c] -= self.by_fixed[c] * self.residual * w;
        }
        for (k, by) in self.by_landmark.iter().enumerate() {
            let c = at + k;
            for r in 0..fixed {
                dense[(r, c)] += self.by_fixed[r] * by * w;
            }
            for j in 0..=k {
                dense[(at + j, c)] += self.by_landmark[j] * by * w;
            }
            rhs[c] -= by * self.residual * w;
        }
    }
}

/// Eliminates a pose from the next one, to which `across` couples it, and from the dense block, whose columns from `reach` on
/// it does not touch.
fn eliminate_pose(
    at: Gathered,
    across: Matrix3<f64>,
    damping: f64,
    next: &mut Gathered,
    reach: usize,
    dense: &mut DMatrix<f64>,
    rhs: &mut DVector<f64>,
) -> Option<Link> {
    let Gathered { mut own, coupling, side } = at;
    for k in 0..3 {
        own[(k, k)] *= 1.0 + damping;
    }
    let inverse = Cholesky::new(own)?.inverse();
    subtract_outer(dense, &inverse, &coupling, reach);
    let y = inverse * side;
    for c in 0..reach {
        rhs[c] -= coupling[0][c] * y.x + coupling[1][c] * y.y + coupling[2][c] * y.z;
    }
    let onto = across.transpose() * inverse;
    subtract_product(&mut next.coupling, &onto, &coupling, reach);
    next.own -= onto * across;
    next.side -= onto * side;
    Some(Link { inverse, coupling, before: Matrix3::zeros(), next: across, rhs: side })
}

/// `into -= factor coupling` in the first `reach` columns.
fn subtract_product(into: &mut [Vec<f64>; 3], factor: &Matrix3<f64>, coupling: &[Vec<f64>; 3], reach: usize) {
    let [b0, b1, b2] = coupling.each_ref().map(|b| &b[..reach]);
    for (k, values) in into.iter_mut().enumerate() {
        let (a, b, d) = (factor[(k, 0)], factor[(k, 1)], factor[(k, 2)]);
        for (((value, b0), b1), b2) in values.iter_mut().zip(b0).zip(b1).zip(b2) {
            *value -= a * b0 + b * b1 + d * b2;
        }
    }
}

/// `dense -= coupling^T inverse coupling` in the upper triangle of the first `reach` rows and columns.
fn subtract_outer(dense: &mut DMatrix<f64>, inverse: &Matrix3<f64>, coupling: &[Vec<f64>; 3], reach: usize) {
    let rows = dense.nrows();
    let [b0, b1, b2] = coupling.each_ref().map(|b| &b[..reach]);
    for (c, column) in dense.as_mut_slice().chunks_exact_mut(rows).take(reach).enumerate() {
        let y = inverse * Vector3::new(b0[c], b1[c], b2[c]);
        if y == Vector3::zeros() {
            continue;
        }
        for (((value, b0), b1), b2) in column[..=c].iter_mut().zip(b0).zip(b1).zip(b2) {
            *value -= b0 * y.x + b1 * y.y + b2 * y.z;
        }
    }
}

/// The normal equations of a pose and the dense block together.
fn joined(pose: &Gathered, dense: &DMatrix<f64>, rhs: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let width = dense.nrows();
    let mut whole = DMatrix::zeros(width + 3, width + 3);
    whole.view_mut((3, 3), (width, width)).copy_from(dense);
    whole.fixed_view_mut::<3, 3>(0, 0).copy_from(&pose.own);
    for (k, values) in pose.coupling.iter().enumerate() {
        for (c, value) in values.iter().enumerate() {
            whole[(k, 3 + c)] = *value;
            whole[(3 + c, k)] = *value;
        }
    }
    let mut whole_rhs = DVector::zeros(width + 3);
    whole_rhs.rows_mut(3, width).copy_from(rhs);
    whole_rhs.fixed_rows_mut::<3>(0).copy_from(&pose.side);
    (whole, whole_rhs)
}

#[cfg(test)]
mod tests {
    use super::super::graph::{Free, Sight, information};
    use super::super::loss::{Loss, Slip};
    use super::super::measurement::{Landmark, camera};
    use super::super::odometry::{Leg, MotionNoise, WheelMotion, Wheels, compose};
    use super::*;
    use nalgebra::Vector2;

    /// A winding drive past twelve landmarks, each seen for a while and some again, with guesses that are a little off.
    fn drive(free: Free) -> Graph {
        let wheels = Wheels::new(0.4);
        let width = free.width();
        let mut graph = Graph {
            mounting: Vector3::new(0.2, -0.1, 0.3),
            wheels,
            offset_s: 0.0,
            free,
            noise: MotionNoise::new(1e-4),
            landmarks: Vec::new(),
            nodes: vec![Node::anchor()],
            prior_mean: DVector::zeros(width),
            prior_information: DMatrix::identity(width, width),
            bearing_sigma: 0.01,
            loss: Loss::Linear(2.0),
            slip: Slip(5.0),
        };
        for i in 0..12 {
            let direction = f64::from(i) * 0.7 - 3.0;
            let anchor = Vector2::new(f64::from(i % 3), 0.1 * f64::from(i));
            graph.add_landmark(Landmark { anchor, direction, closeness: -0.8 }, -0.8, 1.5);
        }
        for i in 0..31usize {
            let bend = 0.02 * (i as f64 * 0.4).sin();
            let reading = WheelMotion { left_m: 0.1 - bend, right_m: 0.1 + bend };
            let leg = Leg::from_wheels(&reading, &wheels, &MotionNoise::new(1e-4));
            let last = graph.nodes[i].pose;
            let pose = compose(&last, &leg.motion) + Vector3::new(1e-3, -2e-3, 3e-3) * (i as f64 * 1.3).sin();
            let seen = [i / 3, (i / 3 + 1) % 12, (i / 2 + 5) % 12];
            let mounting = graph.mounting;
            let sights = seen.iter().filter(|_| i % 4 != 2).map(|slot| {
                let p = predict(&pose, &mounting, &graph.landmarks[*slot]);
                Sight { landmark: *slot, bearing: p.bearing + 0.02 * (i as f64 + 3.0 * *slot as f64).cos() }
            });
            let sights = sights.collect();
            let velocity = leg.motion;
            let information = information(&leg.covariance);
            graph.nodes.push(Node { pose, leg, information, readings: vec![reading], velocity, sights });
        }
        assert!(camera(&graph.nodes[31].pose, &graph.mounting).norm() > 1.0);
        graph
    }

    #[test]
    fn runs_of_any_length_leave_the_same() {
        for free in [Free::default(), Free { wheels: true, offset: true }] {
            let graph = drive(free);
            for (last, keep, damping) in [(31, false, 0.0), (31, true, 0.0), (17, true, 0.0)] {
                let whole = graph.eliminate_in_runs(last, keep, damping, usize::MAX).unwrap();
                let step = whole.information.clone().lu().solve(&whole.rhs).unwrap();
                for length in [1, 2, 7] {
                    let runs = graph.eliminate_in_runs(last, keep, damping, length).unwrap();
                    let scale = whole.information.amax();
                    assert!((&runs.information - &whole.information).amax() < 1e-9 * scale, "{length}");
                    assert!((&runs.rhs - &whole.rhs).amax() < 1e-9 * scale);
                    if !keep {
                        let (a, b) = (runs.poses(&step, 32), whole.poses(&step, 32));
                        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).amax() < 1e-8), "{length}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_step_is_downhill_and_comes_to_rest() {
        let mut graph = drive(Free { wheels: true, offset: false });
        let before = graph.cost();
        let descent = graph.descend(50, 1e-9, 1e-3);
        assert!(descent.converged && descent.cost < before);
        let eliminated = graph.eliminate(31, false, 0.0).unwrap();
        assert!(eliminated.rhs.amax() < 1e-2 * graph.dense().len() as f64 * eliminated.information.amax().sqrt());
    }
}
