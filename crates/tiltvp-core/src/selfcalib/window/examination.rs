//! The examination of the window: what its solution contradicts, and which assumption is most likely wrong.

use super::state::{Examination, MOUNTING, SlidingWindow};
use super::tuning::{COST_TOLERANCE, ITERATIONS};
use crate::selfcalib::diagnosis::doubted_of_camera;
use crate::selfcalib::model::MotionLoss;

impl SlidingWindow {
    /// Solves a copy of the window, and asks what it contradicts and what is suspect.
    pub(crate) fn examine(&mut self) {
        let mut now = self.problem.clone();
        // What slips do not pull tells nothing of a delay.
        now.slip = MotionLoss::Logarithmic;
        if now.keyframes.len() < 3 || now.gauss_newton(ITERATIONS, COST_TOLERANCE, false).is_none() {
            return;
        }
        let counts = now.contradictions();
        let covariance = self.covariance.fixed_view::<3, 3>(MOUNTING, MOUNTING).into();
        let motion_scatter = now.doubted_parts().map(|parts| parts.scatter_of_mounting());
        let factors = now.noise_factors();
        let deviations = now.deviations(&covariance, factors.excess());
        let suspect = now.suspect(&self.options, &counts, (factors, &deviations), &covariance, motion_scatter.as_ref());
        let doubted_of_camera = doubted_of_camera(&deviations, factors.excess());
        self.examination = Examination { contradictions: counts, suspect, motion_scatter, doubted_of_camera };
    }

    /// What the last examination found.
    pub(crate) fn examination(&self) -> &Examination {
        &self.examination
    }
}
