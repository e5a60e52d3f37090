//! A Kalman filter of the bearing of an upright edge and its inverse distance: prediction by the robot's motion, update by a bearing.

use crate::lines::angles::wrap;
use crate::lines::tracker_options::TrackerOptions;

/// What the robot did between two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Its turn, positive to the left, radians.
    pub turn_rad: f64,
    /// How far the middle between its wheels went along an arc, negative backwards, metres; none where it is unknown.
    pub distance_m: Option<f64>,
}

/// A bearing and its change with the robot's way, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallax {
    /// Bearing, radians.
    pub bearing_rad: f64,
    /// One over the distance from the camera, per metre; where distances driven are unknown, the change of the bearing from
    /// frame to frame beside the robot's turn, radians.
    pub inverse_distance: f64,
    /// Variance of the bearing, covariance, variance of the inverse distance.
    pub covariance: [f64; 3],
    /// Whether the inverse distance is per metre.
    pub is_metric: bool,
}

/// Standard deviation of the change of a bearing from frame to frame that no motion explains, radians: edges are no
/// perfect lines.
const DRIFT_RAD: f64 = 5e-4;

/// Standard deviation of a distance driven, beside a share of it, in metres: the resolution of wheel encoders.
const SLIP_M: f64 = 1e-3;

/// Standard deviation of the change of a bearing's rate from frame to frame, in radians, where distances driven are
/// unknown: a fifth of the rate's own default.
const RATE_DRIFT_RAD: f64 = 0.01;

impl Parallax {
    /// Of an edge that is seen for the first time.
    pub(crate) fn new(bearing_rad: f64, variance: f64, is_metric: bool, options: &TrackerOptions) -> Self {
        let (inverse_distance, sigma) = if is_metric {
            (0.25 / options.nearest_m, 0.25 / options.nearest_m)
        } else {
            (0.0, options.rate_sigma_rad)
        };
        Self { bearing_rad, inverse_distance, covariance: [variance, 0.0, sigma * sigma], is_metric }
    }

    /// Where the edge is after a motion. What is known of its inverse distance is lost if the motion's distance is known and those
    /// before were not, or the other way round.
    pub(crate) fn predict(&mut self, motion: &Motion, options: &TrackerOptions) {
        if self.is_metric != motion.distance_m.is_some() {
            *self = Self::new(self.bearing_rad, self.covariance[0], motion.distance_m.is_some(), options);
        }
        let [bb, bn, nn] = self.covariance;
        let Some(distance) = motion.distance_m else {
            self.bearing_rad = wrap(self.bearing_rad - motion.turn_rad + self.inverse_distance);
            self.covariance =
                [bb + 2.0 * bn + nn + DRIFT_RAD * DRIFT_RAD, bn + nn, nn + RATE_DRIFT_RAD * RATE_DRIFT_RAD];
            return;
        };
        let [tx, ty] = shift_of(distance, motion.turn_rad, options);
        let n = self.inverse_distance;
        let (sin, cos) = self.bearing_rad.sin_cos();
        // The edge in units of its distance, seen from the new place.
        let (x, y) = (cos - n * tx, sin - n * ty);
        let squared = (x * x + y * y).max(1e-6);
        let length = squared.sqrt();
        let along = (x * cos + y * sin) / squared;
        let across = (y * tx - x * ty) / squared;
        let nearer = n * (x * sin - y * cos) / (squared * length);
        let grows = 1.0 / length + n * (x * tx + y * ty) / (squared * length);
        let slip = n * sin.abs() * (options.distance_sigma * distance.abs() + SLIP_M);
        self.bearing_rad = wrap(y.atan2(x) - motion.turn_rad);
        self.inverse_distance = (n / length).clamp(0.0, 1.0 / options.nearest_m);
        self.covariance = [
            along * along * bb + 2.0 * along * across * bn + across * across * nn + slip * slip + DRIFT_RAD * DRIFT_RAD,
            along * nearer * bb + (along * grows + across * nearer) * bn + across * grows * nn,
            nearer * nearer * bb + 2.0 * nearer * grows * bn + grows * grows * nn,
        ];
    }

    /// Takes in a bearing of the edge with a variance.
    pub(crate) fn correct(&mut self, bearing_rad: f64, variance: f64, options: &TrackerOptions) {
        let [bb, bn, nn] = self.covariance;
        let spread = bb + variance;
        let off = wrap(bearing_rad - self.bearing_rad);
        self.bearing_rad = wrap(self.bearing_rad + bb / spread * off);
        self.inverse_distance += bn / spread * off;
        if self.is_metric {
            self.inverse_distance = self.inverse_distance.clamp(0.0, 1.0 / options.nearest_m);
        }
        self.covariance = [bb - bb * bb / spread, bn - bb * bn / spread, nn - bn * bn / spread];
    }
}

/// How the camera's centre moves, in the frame of the bearings before the motion, metres.
fn shift_of(distance_m: f64, turn_rad: f64, options: &TrackerOptions) -> [f64; 2] {
    let [x, y] = options.camera_m;
    let half = 0.5 * turn_rad;
    let chord = distance_m * if half.abs() < 1e-8 { 1.0 } else { half.sin() / half };
    let ((sin_half, cos_half), (sin, cos)) = (half.sin_cos(), turn_rad.sin_cos());
    let ahead = chord * cos_half + (cos - 1.0) * x - sin * y;
    let aside = chord * sin_half + sin * x + (cos - 1.0) * y;
    let (sin_yaw, cos_yaw) = options.camera_yaw_rad.sin_cos();
    [cos_yaw * ahead + sin_yaw * aside, cos_yaw * aside - sin_yaw * ahead]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An edge at a place, a robot on its way: bearings and distances are those of plane geometry, derivatives too.
    #[test]
    fn a_motion_moves_an_edge_as_in_the_plane() {
        let camera_yaw_rad = 0.7;
        let options = TrackerOptions { camera_m: [0.1, -0.05], camera_yaw_rad, ..TrackerOptions::default() };
        let motion = Motion { turn_rad: 0.3, distance_m: Some(0.2) };
        let seen = |bearing: f64, inverse_distance: f64| {
            let mut edge =
                Parallax { bearing_rad: bearing, inverse_distance, covariance: [1.0, 0.0, 0.0], is_metric: true };
            edge.predict(&motion, &options);
            edge
        };
        let (bearing, inverse_distance) = (0.8f64, 0.5f64);
        let edge = seen(bearing, inverse_distance);
        // World frame: the robot starts at the origin. The arc has the radius 0.2 / 0.3.
        let azimuth = camera_yaw_rad + bearing;
        let place = [0.1 + 2.0 * azimuth.cos(), -0.05 + 2.0 * azimuth.sin()];
        let (radius, yaw) = (0.2 / 0.3, 0.3f64);
        let robot = [radius * yaw.sin(), radius * (1.0 - yaw.cos())];
        let camera = [robot[0] + 0.1 * yaw.cos() + 0.05 * yaw.sin(), robot[1] + 0.1 * yaw.sin() - 0.05 * yaw.cos()];
        let (dx, dy) = (place[0] - camera[0], place[1] - camera[1]);
        assert!((edge.bearing_rad - (dy.atan2(dx) - yaw - camera_yaw_rad)).abs() < 1e-12);
        assert!((edge.inverse_distance - 1.0 / dx.hypot(dy)).abs() < 1e-12);
        let step = 1e-6;
        let (more, nearer) = (seen(bearing + step, inverse_distance), seen(bearing, inverse_distance + step));
        let slope = |a: &Parallax| {
            [(a.bearing_rad - edge.bearing_rad) / step, (a.inverse_distance - edge.inverse_distance) / step]
        };
        let ([bb, nb], [bn, _]) = (slope(&more), slope(&nearer));
        assert!((edge.covariance[1] - bb * nb).abs() < 1e-5 && (edge.covariance[2] - nb * nb).abs() < 1e-5);
        assert!((edge.covariance[0] - bb * bb).abs() < 1e-5 && bn > 0.0);
    }

    #[test]
    fn bearings_along_the_way_tell_how_near_an_edge_is() {
        let options = TrackerOptions::default();
        let motion = Motion { turn_rad: 0.0, distance_m: Some(0.05) };
        let place = |k: f64| (0.8f64).atan2(1.0 - 0.05 * k);
        let mut edge = Parallax::new(place(0.0), 1e-6, true, &options);
        for k in 1..20 {
            edge.predict(&motion, &options);
            edge.correct(place(f64::from(k)), 1e-6, &options);
        }
        let truth = 1.0 / 0.8f64.hypot(0.05);
        assert!((edge.inverse_distance - truth).abs() < 0.05 * truth, "{} {truth}", edge.inverse_distance);
        assert!((edge.inverse_distance - truth).abs() < 4.0 * edge.covariance[2].sqrt());
    }
}
