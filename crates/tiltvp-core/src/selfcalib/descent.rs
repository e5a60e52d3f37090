//! Descents of a graph's cost: Levenberg and Marquardt's, and Gauss and Newton's for a graph that is nearly at rest.

use nalgebra::{DVector, Vector3};

use super::dense::Factor;
use super::graph::Graph;
use super::loss::Fit;
use super::schur::Eliminated;

/// How an optimisation ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Descent {
    pub(super) iterations: u32,
    pub(super) converged: bool,
    pub(super) cost: f64,
}

/// A graph at rest.
pub(super) struct Settled {
    /// The normal equations of (last pose, dense block).
    pub(super) equations: Eliminated,
    pub(super) fit: Fit,
}

/// Where all unknowns are.
struct State {
    poses: Vec<Vector3<f64>>,
    dense: DVector<f64>,
}

impl Graph {
    fn state(&self) -> State {
        State { poses: self.nodes.iter().map(|node| node.pose).collect(), dense: self.dense() }
    }

    fn restore(&mut self, state: &State) {
        for (node, pose) in self.nodes.iter_mut().zip(&state.poses) {
            node.pose = *pose;
        }
        self.set_dense(&state.dense);
    }

    /// Moves every unknown by the solution of normal equations, of which the last pose may be part. `None`, and nothing
    /// moves, where they are singular or something is not finite. By how much the cost falls, were it quadratic, due to what
    /// was not eliminated.
    pub(super) fn step(&mut self, eliminated: &Eliminated) -> Option<f64> {
        let step = Factor::touched(eliminated.information.clone())?.solve(&eliminated.rhs)?;
        let fall = 0.5 * step.dot(&eliminated.rhs);
        let width = self.width();
        let kept = (step.len() > width).then(|| step.fixed_rows::<3>(0).into());
        let step = step.rows(step.len() - width, width).into_owned();
        let dense = self.dense() + &step;
        if !dense.iter().all(|x| x.is_finite()) {
            return None;
        }
        let steps = eliminated.poses(&step, kept, self.nodes.len());
        for (node, step) in self.nodes.iter_mut().zip(steps) {
            node.pose += step;
        }
        self.set_dense(&dense);
        Some(fall)
    }

    /// Levenberg and Marquardt's descent until the cost falls by less than `tolerance`.
    pub(super) fn descend(&mut self, max_iterations: u32, tolerance: f64, mut damping: f64) -> Descent {
        let mut cost = self.cost();
        let mut iterations = 0;
        while iterations < max_iterations {
            iterations += 1;
            let before = self.state();
            let last = self.nodes.len() - 1;
            let moved = self.eliminate(last, false, damping).and_then(|eliminated| self.step(&eliminated));
            let lower = moved.map(|_| self.cost()).filter(|next| next.is_finite() && *next <= cost + 1e-9 * cost);
            if let Some(next) = lower {
                let gain = cost - next;
                cost = next;
                let was = damping;
                damping = if damping < 1e-9 { 0.0 } else { 0.1 * damping };
                if gain < tolerance && was < 1e-2 {
                    return Descent { iterations, converged: true, cost };
                }
            } else {
                if moved.is_some() {
                    self.restore(&before);
                }
                damping = if damping == 0.0 { 1e-4 } else { 10.0 * damping };
                if damping > 1e9 {
                    break;
                }
            }
        }
        Descent { iterations, converged: false, cost }
    }

    /// Gauss and Newton's descent until the linear problem foretells the cost to within `tolerance`, or [`Self::descend`]
    /// where a step leads up. The normal equations there, with the last pose, and how well it fits; `None` where they are
    /// singular. Of a `rough` start the first step is taken without asking what it foretells.
    pub(super) fn settle(&mut self, max_iterations: u32, tolerance: f64, rough: bool) -> Option<Settled> {
        let last = self.nodes.len() - 1;
        let mut reached = f64::INFINITY;
        let mut before = self.state();
        for iteration in 0..max_iterations {
            let here = self.eliminate(last, true, 0.0).filter(|here| here.fit.cost <= reached * (1.0 + 1e-9));
            let Some(here) = here else { break };
            before = self.state();
            reached = here.fit.cost;
            let Some(fall) = self.step(&here) else { break };
            if rough && iteration == 0 {
                continue;
            }
            let fit = self.fit();
            if (fit.cost - (here.fit.cost - here.fall - fall)).abs() < tolerance {
                return Some(Settled { equations: here, fit });
            }
            if fit.cost.is_nan() || fit.cost > reached * (1.0 + 1e-9) {
                self.restore(&before);
                self.descend(max_iterations - iteration, tolerance, 1e-4);
                return self.settled();
            }
            reached = fit.cost;
        }
        let settled = self.settled().filter(|settled| settled.fit.cost <= reached * (1.0 + 1e-9));
        if settled.is_some() {
            return settled;
        }
        self.restore(&before);
        self.descend(max_iterations, tolerance, 1e-4);
        self.settled()
    }

    /// The normal equations and the fit where it is.
    pub(super) fn settled(&self) -> Option<Settled> {
        let here = self.eliminate(self.nodes.len() - 1, true, 0.0)?;
        let fit = here.fit;
        Some(Settled { equations: here, fit })
    }
}
