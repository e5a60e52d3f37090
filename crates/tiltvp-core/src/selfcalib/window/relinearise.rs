//! Relinearisation: the window solved again as a bundle problem, whose solution becomes the filter's mean and covariance.

use nalgebra::Vector3;

use super::state::{MOUNTING, ROBUST_LOSS, SlidingWindow};
use super::tuning::{
    COST_TOLERANCE, EVERY_STEP_KEYFRAMES, FIXED_OUTLIER_ITERATIONS, OUTLIER_SHARE, RESTART_KEYFRAMES, RESTART_YAWS,
};
use crate::selfcalib::bundle::{CholeskyFactor, FIRST_DAMPING, Solution};
use crate::selfcalib::model::{BearingLoss, FitSummary, MotionLoss, OUTLIER_SIGMAS};

impl SlidingWindow {
    /// Solves the window and linearises it there, for mean and covariance. The search starts from the filter's mean if that is
    /// `trusted`, and from the last solution otherwise.
    pub(super) fn relinearise(&mut self, iterations: u32, trusted: bool) {
        let before = self.problem.landmarks.clone();
        (self.problem.loss, self.problem.slip) = (ROBUST_LOSS, MotionLoss::Logarithmic);
        let settled = self.problem.keyframes.len() >= EVERY_STEP_KEYFRAMES;
        let from_filter = trusted && settled && !self.monitor.is_inconsistent();
        if from_filter {
            self.start_from_filter();
        }
        self.problem.reanchor();
        let solution = self.problem.gauss_newton(iterations, COST_TOLERANCE, from_filter);
        let mut solution = self.restart_while_outliers(solution, iterations);
        let fit = solution.as_ref().map(|solution| solution.fit);
        let few = |fit: FitSummary| (fit.outliers as f64) < OUTLIER_SHARE * fit.bearings as f64;
        if fit.is_some_and(|fit| fit.outliers > 0 && few(fit)) {
            solution = self.solve_without_outliers(iterations);
        } else if settled && fit.is_some_and(few) && self.problem.estimate_scatters() {
            solution = self.problem.gauss_newton(iterations, COST_TOLERANCE, false);
        }
        if solution.is_some() && self.problem.any_slipped() {
            self.problem.slip = MotionLoss::Redescending;
            solution = self.problem.gauss_newton(iterations, COST_TOLERANCE, false);
        }
        if !solution.is_some_and(|solution| self.adopt(&solution)) {
            // The filter's mean and covariance are about these.
            self.problem.landmarks = before;
        }
    }

    /// Other starts while a solution has outliers, and the best solution: a landmark may have been initialised at a wrong
    /// distance, and in a short window all of them with a wrong yaw.
    fn restart_while_outliers(&mut self, mut solution: Option<Solution>, iterations: u32) -> Option<Solution> {
        let sigma = self.options.start_covariance[(2, 2)].sqrt();
        let yaws =
            if self.problem.keyframes.len() > RESTART_KEYFRAMES { &RESTART_YAWS[..1] } else { &RESTART_YAWS[..] };
        for (i, yaw) in yaws.iter().enumerate() {
            let fit = solution.as_ref().map(|solution| solution.fit);
            if fit.is_some_and(|fit| fit.outliers == 0) {
                break;
            }
            let mut other = self.problem.clone();
            if *yaw != 0.0 {
                other.mounting = self.options.start.vector() + Vector3::z() * (yaw * sigma);
            }
            other.search_distances(if i == 0 { OUTLIER_SIGMAS } else { 0.0 });
            let descent = other.levenberg_marquardt(2 * iterations, COST_TOLERANCE, FIRST_DAMPING);
            if fit.is_none_or(|fit| descent.cost < fit.cost) {
                self.problem = other;
                solution = self.problem.solution();
            }
        }
        solution
    }

    /// Solves the window without outliers, and with the scatters of the landmarks.
    fn solve_without_outliers(&mut self, iterations: u32) -> Option<Solution> {
        self.problem.loss = BearingLoss::Truncated(OUTLIER_SIGMAS);
        let solution = self.problem.gauss_newton(FIXED_OUTLIER_ITERATIONS, COST_TOLERANCE, false);
        if !self.problem.estimate_scatters() {
            return solution;
        }
        self.problem.loss = ROBUST_LOSS;
        self.problem.gauss_newton(iterations, COST_TOLERANCE, false);
        self.problem.loss = BearingLoss::Truncated(OUTLIER_SIGMAS);
        self.problem.gauss_newton(FIXED_OUTLIER_ITERATIONS, COST_TOLERANCE, false)
    }

    /// Sets the window to the filter's mean. Keyframes since the last solution share the difference of the last pose evenly.
    fn start_from_filter(&mut self) {
        self.problem.set_shared(&self.mean.rows(3, self.mean.len() - 3).into_owned());
        let (here, keyframes) = (self.pose(), &mut self.problem.keyframes);
        let Some(away) = keyframes.last().map(|keyframe| here - keyframe.pose) else { return };
        let count = keyframes.len().saturating_sub(self.solved_keyframes) as f64;
        for (k, keyframe) in keyframes.iter_mut().skip(self.solved_keyframes).enumerate() {
            keyframe.pose += away * ((k + 1) as f64 / count);
        }
    }

    /// Takes a solution of the window for mean and covariance; false, and nothing changes, if its equations are singular.
    pub(super) fn adopt(&mut self, solution: &Solution) -> bool {
        let information = solution.system.equations.information.clone();
        let Some(factor) = CholeskyFactor::regularised(&information) else { return false };
        self.covariance = factor.inverse();
        self.widening = self.problem.covariance_widening(&solution.system, &self.covariance);
        self.mean = self.problem.shared().insert_rows(0, 3, 0.0);
        if let Some(keyframe) = self.problem.keyframes.last() {
            self.mean.fixed_rows_mut::<3>(0).copy_from(&keyframe.pose);
        }
        self.solved_keyframes = self.problem.keyframes.len();
        self.solved_covariance = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        true
    }
}
