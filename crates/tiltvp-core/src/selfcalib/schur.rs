//! The normal equations of a drive with the poses eliminated: first inside runs of poses, then the poses between the runs.
//!
//! A pose is coupled to its neighbours, to what is estimated once for the whole drive, and to the landmarks seen from it.
//! Eliminating a chain from one end couples every pose to every landmark before it. A run of a few poses sees few landmarks,
//! so its inner poses are eliminated among these; only the poses between the runs are coupled to all.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::graph::Graph;
use super::loss::Fit;
use super::measurement::Ray;
use super::pose_block::{Gathered, Link, after_leg, eliminate_pose, joined};

/// Poses of a run.
const RUN: usize = 20;

/// Numbers in the dense block up to which all poses are one run.
const NARROW: usize = 48;

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
    /// How well it fits as it is.
    pub(super) fit: Fit,
    /// By how much the cost falls, were it quadratic, due to the poses that were eliminated.
    pub(super) fall: f64,
}

impl Eliminated {
    /// The steps of all of so many poses for a step of the dense block, and of the last pose if it was kept.
    pub(super) fn poses(&self, step: &DVector<f64>, kept: Option<Vector3<f64>>, nodes: usize) -> Vec<Vector3<f64>> {
        self.substituted(step, kept, nodes, 1.0)
    }

    /// How all poses follow where the dense block, and the last pose if it was kept, are moved so.
    pub(super) fn follow(&self, step: &DVector<f64>, kept: Option<Vector3<f64>>, nodes: usize) -> Vec<Vector3<f64>> {
        self.substituted(step, kept, nodes, 0.0)
    }

    /// The steps of the poses, their own right-hand sides taken so many times.
    fn substituted(
        &self,
        step: &DVector<f64>,
        kept: Option<Vector3<f64>>,
        nodes: usize,
        own: f64,
    ) -> Vec<Vector3<f64>> {
        let mut steps = vec![Vector3::zeros(); nodes + 1];
        let mut after = nodes;
        if let Some(kept) = kept {
            after = nodes - 1;
            steps[after] = kept;
        }
        for (at, link) in self.between.iter().rev() {
            let mut side = link.rhs * own - link.next * steps[after];
            for (k, values) in link.coupling.rows().into_iter().enumerate() {
                side[k] -= values.iter().zip(step.iter()).map(|(a, b)| a * b).sum::<f64>();
            }
            steps[*at] = link.inverse * side;
            after = *at;
        }
        for run in &self.runs {
            let left = steps[run.left];
            for (i, link) in run.links.iter().enumerate().rev() {
                let at = run.left + 1 + i;
                let mut side = link.rhs * own - link.next * steps[at + 1] - link.before * left;
                for (k, values) in link.coupling.rows().into_iter().enumerate() {
                    side[k] -= values.iter().zip(&run.columns).map(|(a, c)| a * step[*c]).sum::<f64>();
                }
                steps[at] = link.inverse * side;
            }
        }
        steps.truncate(nodes);
        steps
    }
}

/// What a run leaves: normal equations of the poses at its ends and of the columns that it touches.
struct RunBlocks {
    left: Gathered,
    right: Gathered,
    across: Matrix3<f64>,
    dense: DMatrix<f64>,
    rhs: DVector<f64>,
    fit: Fit,
    fall: f64,
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
        let away = self.dense() - &self.prior_mean;
        let mut rhs = -(&self.prior_information * &away);
        let mut fit = Fit { cost: self.cost_of_spreads() - 0.5 * away.dot(&rhs), ..Fit::default() };
        let (rays, mut fall) = (self.rays(), 0.0);
        self.linearised(&self.nodes[0], &rays, |row| {
            fit.note(row.residual, self.loss);
            row.add_dense(&mut dense, &mut rhs, row.at, fixed);
        });
        let mut at = Gathered::new(width);
        let (mut runs, mut between) = (Vec::new(), Vec::new());
        let (mut left, mut reach) = (0, fixed);
        while left < last {
            let right = left.saturating_add(length).min(last);
            let (run, blocks) = self.eliminate_run(left, right, damping, &rays)?;
            for (c, column) in run.columns.iter().enumerate() {
                for (r, row) in run.columns[..=c].iter().enumerate() {
                    dense[(*row, *column)] += blocks.dense[(r, c)];
                }
                rhs[*column] += blocks.rhs[c];
            }
            fit += blocks.fit;
            fall += blocks.fall;
            reach = reach.max(run.columns.last().map_or(0, |c| c + 1));
            let mut next = Gathered::new(width);
            next.add(&blocks.right, &run.columns);
            if left > 0 {
                at.add(&blocks.left, &run.columns);
                let link = eliminate_pose(at, blocks.across, damping, &mut next, reach, &mut dense, &mut rhs)?;
                fall += link.fall();
                between.push((left, link));
            }
            self.linearised(&self.nodes[right], &rays, |row| {
                fit.note(row.residual, self.loss);
                row.add_dense(&mut dense, &mut rhs, row.at, fixed);
                next.add_row(row, row.at, fixed);
                reach = reach.max(row.at + 2);
            });
            runs.push(run);
            (at, left) = (next, right);
        }
        let mut kept = None;
        if keep {
            kept = Some(at);
        } else if last > 0 {
            let mut nothing = Gathered::new(width);
            let link = eliminate_pose(at, Matrix3::zeros(), damping, &mut nothing, reach, &mut dense, &mut rhs)?;
            fall += link.fall();
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
        Some(Eliminated { runs, between, information, rhs, fit, fall })
    }

    /// Eliminates the poses between two.
    fn eliminate_run(&self, left: usize, right: usize, damping: f64, rays: &[Ray]) -> Option<(Run, RunBlocks)> {
        let fixed = self.free.width();
        let inner = &self.nodes[left + 1..right];
        // Where the landmarks that are seen have their columns; 0 for the others.
        let mut places = vec![0; self.landmarks.len()];
        for sight in inner.iter().flat_map(|node| &node.sights) {
            places[sight.landmark] = 1;
        }
        let mut columns: Vec<usize> = (0..fixed).collect();
        for (slot, place) in places.iter_mut().enumerate().filter(|(_, place)| **place > 0) {
            *place = columns.len();
            columns.extend([fixed + 2 * slot, fixed + 2 * slot + 1]);
        }
        let width = columns.len();
        let (mut dense, mut rhs) = (DMatrix::zeros(width, width), DVector::zeros(width));
        let mut ends = Gathered::new(width);
        let mut links = Vec::with_capacity(inner.len());
        let (mut fit, mut fall) = (Fit::default(), 0.0);
        let mut leg = self.leg_blocks(left, &mut dense, &mut rhs);
        fit.cost += leg.cost;
        ends.own += leg.before;
        ends.side += leg.before_side;
        if self.free.wheels {
            ends.add_wheels(&leg.before_wheels);
        }
        // Of the pose at hand: its coupling to the pose at the left end.
        let mut before = leg.across.transpose();
        let mut at = after_leg(&leg, width, self.free.wheels);
        for i in left + 1..right {
            self.linearised(&self.nodes[i], rays, |row| {
                fit.note(row.residual, self.loss);
                let place = places[(row.at - fixed) / 2];
                row.add_dense(&mut dense, &mut rhs, place, fixed);
                at.add_row(row, place, fixed);
            });
            leg = self.leg_blocks(i, &mut dense, &mut rhs);
            fit.cost += leg.cost;
            at.own += leg.before;
            at.side += leg.before_side;
            if self.free.wheels {
                at.add_wheels(&leg.before_wheels);
            }
            let mut next = after_leg(&leg, width, self.free.wheels);
            let mut link = eliminate_pose(at, leg.across, damping, &mut next, width, &mut dense, &mut rhs)?;
            fall += link.fall();
            if left > 0 {
                link.before = before;
                let onto = before.transpose() * link.inverse;
                ends.own -= onto * before;
                ends.side -= onto * link.rhs;
                ends.coupling.subtract_product(&onto, &link.coupling, width);
                before = -(link.next.transpose() * link.inverse * before);
            }
            links.push(link);
            at = next;
        }
        let across = before.transpose();
        Some((Run { left, columns, links }, RunBlocks { left: ends, right: at, across, dense, rhs, fit, fall }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::graph::{Free, Node, Sight, information};
    use super::super::loss::{Loss, Slip};
    use super::super::measurement::{Landmark, camera, predict};
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
            spreads: Vec::new(),
            loss: Loss::Linear(2.0),
            slip: Slip(5.0),
        };
        for i in 0..12 {
            let direction = f64::from(i) * 0.7 - 3.0;
            let anchor = Vector2::new(f64::from(i % 3), 0.1 * f64::from(i));
            let slot = graph.add_landmark(Landmark { anchor, direction, closeness: -0.8 }, -0.8, 1.5);
            graph.spreads[slot] = 1.0 + 0.1 * f64::from(i);
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
                Sight::new(*slot, p.bearing + 0.02 * (i as f64 + 3.0 * *slot as f64).cos())
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
                    if last == 31 {
                        assert!((runs.fit.cost - graph.cost()).abs() < 1e-9 * runs.fit.cost);
                        let kept = keep.then(|| step.fixed_rows::<3>(0).into());
                        let dense = step.rows(if keep { 3 } else { 0 }, graph.width()).into_owned();
                        let (a, b) = (runs.poses(&dense, kept, 32), whole.poses(&dense, kept, 32));
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
