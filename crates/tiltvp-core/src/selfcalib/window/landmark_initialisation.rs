//! Landmark initialisation without delay: in the direction of the first bearing, at the distance of the options.

use nalgebra::{DMatrix, DVector, Vector3};

use super::state::{MOUNTING, SlidingWindow};
use crate::selfcalib::bundle::Observation;
use crate::selfcalib::model::{InverseDistanceLandmark, camera_position, predict};

impl SlidingWindow {
    /// Adds a landmark to the state and to the window.
    pub(super) fn initialise_landmark(&mut self, id: u64, bearing: f64) {
        let (pose, mounting): (_, Vector3<f64>) = (self.pose(), self.mean.fixed_rows::<3>(MOUNTING).into());
        let log_inverse_distance = -self.options.start_distance_m.ln();
        let sigma = self.options.start_distance_log_sigma;
        let direction = bearing + pose.z + mounting.z;
        let anchor = camera_position(&pose, &mounting);
        let landmark = InverseDistanceLandmark { anchor, direction, log_inverse_distance };
        // The derivative of the bearing by the direction is 1 at the anchor: direction = bearing - its part by pose and mounting.
        let p = predict(&pose, &mounting, &landmark);
        let n = self.covariance.nrows();
        let mut cross = DVector::zeros(n);
        for i in 0..3 {
            cross.axpy(-p.by_pose[i], &self.covariance.column(i), 1.0);
            cross.axpy(-p.by_mounting[i], &self.covariance.column(MOUNTING + i), 1.0);
        }
        let own: f64 = (0..3).map(|i| -p.by_pose[i] * cross[i] - p.by_mounting[i] * cross[MOUNTING + i]).sum();
        let covariance = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0));
        let mut covariance = covariance.resize(n + 2, n + 2, 0.0);
        covariance.view_mut((0, n), (n, 1)).copy_from(&cross);
        covariance.view_mut((n, 0), (1, n)).copy_from(&cross.transpose());
        covariance[(n, n)] = own + self.options.bearing_sigma_rad.powi(2);
        covariance[(n + 1, n + 1)] = sigma * sigma;
        self.covariance = covariance;
        let mean = std::mem::replace(&mut self.mean, DVector::zeros(0));
        self.mean = mean.resize_vertically(n + 2, log_inverse_distance);
        self.mean[n] = direction;
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
