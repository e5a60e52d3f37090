//! Landmark initialisation without delay: in the direction of the first bearing, at the distance of the options.

use nalgebra::{DMatrix, DVector, DVectorViewMut, Vector3};

use super::state::{MOUNTING, SlidingWindow};
use crate::interrupt::check;
use crate::selfcalib::bundle::Observation;
use crate::selfcalib::model::{InverseDistanceLandmark, camera_position, predict};

impl SlidingWindow {
    /// Adds landmarks, each by its number and bearing, to the state and to the window.
    pub(super) fn initialise_landmarks(&mut self, new: &[(u64, f64)]) {
        if new.is_empty() {
            return;
        }
        // Room for all is made once: to move the matrices for each would take time by the cube of their number.
        let n = self.covariance.nrows();
        let (size, mut cross) = (n + 2 * new.len(), DVector::zeros(n + 2 * new.len()));
        let covariance = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0));
        self.covariance = covariance.resize(size, size, 0.0);
        let mean = std::mem::replace(&mut self.mean, DVector::zeros(0));
        self.mean = mean.resize_vertically(size, 0.0);
        self.problem.make_room(new.len());
        for (k, (id, bearing)) in new.iter().enumerate() {
            check();
            let at = n + 2 * k;
            self.initialise_landmark(*id, *bearing, at, &mut cross.rows_mut(0, at));
        }
    }

    /// Adds a landmark at a place of the state behind which nothing is known yet; `cross` is scratch as long as what is before it.
    fn initialise_landmark(&mut self, id: u64, bearing: f64, n: usize, cross: &mut DVectorViewMut<'_, f64>) {
        let (pose, mounting): (_, Vector3<f64>) = (self.pose(), self.mean.fixed_rows::<3>(MOUNTING).into());
        let log_inverse_distance = -self.options.start_distance_m.ln();
        let sigma = self.options.start_distance_log_sigma;
        let direction = bearing + pose.z + mounting.z;
        let anchor = camera_position(&pose, &mounting);
        let landmark = InverseDistanceLandmark { anchor, direction, log_inverse_distance };
        // The derivative of the bearing by the direction is 1 at the anchor: direction = bearing - its part by pose and mounting.
        let p = predict(&pose, &mounting, &landmark);
        cross.fill(0.0);
        for i in 0..3 {
            cross.axpy(-p.by_pose[i], &self.covariance.view((0, i), (n, 1)).column(0), 1.0);
            cross.axpy(-p.by_mounting[i], &self.covariance.view((0, MOUNTING + i), (n, 1)).column(0), 1.0);
        }
        let own: f64 = (0..3).map(|i| -p.by_pose[i] * cross[i] - p.by_mounting[i] * cross[MOUNTING + i]).sum();
        for (i, value) in cross.iter().enumerate() {
            self.covariance[(i, n)] = *value;
            self.covariance[(n, i)] = *value;
        }
        self.covariance[(n, n)] = own + self.options.bearing_sigma_rad.powi(2);
        self.covariance[(n + 1, n + 1)] = sigma * sigma;
        self.mean[n] = direction;
        self.mean[n + 1] = log_inverse_distance;
        let heading = self.problem.keyframes.last().map_or(0.0, |keyframe| keyframe.pose.z);
        let direction = bearing + heading + self.problem.mounting.z;
        let slot =
            self.problem.add_landmark(InverseDistanceLandmark { direction, ..landmark }, log_inverse_distance, sigma);
        self.landmark_ids.push(Some(id));
        self.rejections.push(0);
        if let Some(keyframe) = self.problem.keyframes.last_mut() {
            keyframe.observations.push(Observation::new(slot, bearing));
        }
    }
}
