//! The options of the tracker of lines.

use super::matcher::MatchOptions;
use crate::options;
use crate::options::Above;

options! {
    /// Options of the tracker.
    #[derive(Copy)]
    pub struct TrackerOptions {
        /// How many frames back a line is looked for before it is taken for a new one.
        look_back: usize = 20 => 1.0..=1e5, "a whole number of frames from 1 to 100000";
        /// The least distance of an edge from the camera, metres: how far bearings may change while nothing else is known.
        nearest_m: f64 = 0.3 => Above(0.0, 1e6), "a positive distance";
        /// Where the camera's centre is on the robot, x and y from the middle between the wheels, metres.
        camera_m: [f64; 2] = [0.0; 2] => -10.0..=10.0, "metres from -10 to 10";
        /// How far the frame of the bearings is turned to the left of the robot's, radians.
        camera_yaw_rad: f64 = 0.0 => -7.0..=7.0, "an angle from -7 to 7";
        /// Standard deviation of a turn that is given, radians.
        turn_sigma_rad: f64 = 0.005 => Above(0.0, 1e6), "a positive angle";
        /// Standard deviation of a distance driven that is given, as a share of it.
        distance_sigma: f64 = 0.03 => 0.0..=10.0, "a share from 0 to 10";
        /// Standard deviation of the change of a bearing per frame beside the turn, where no distance is given, radians.
        rate_sigma_rad: f64 = 0.05 => Above(0.0, 1e6), "a positive angle";
        /// Standard deviation of a bearing beside the line's own, from neighbouring edges that blend, radians.
        bearing_sigma_rad: f64 = 0.1f64.to_radians() => Above(0.0, 1e6), "a positive angle";
        /// The greatest difference from a predicted bearing, in standard deviations.
        gate_sigmas: f64 = 3.0 => Above(0.0, 1e6), "a positive number";
        /// Standard deviation of the distance between descriptors of one line.
        descriptor_sigma: f64 = 0.35 => Above(0.0, 1e6), "a positive distance";
        /// The greatest distance between descriptors of one line at its predicted bearing.
        descriptor_max: f64 = 1.25 => Above(0.0, 1e6), "a positive distance";
        /// What a new track costs, to be held against the squared deviations of a line that goes on.
        new_cost: f64 = 18.0 => Above(0.0, 1e6), "a positive number";
        /// How lines of two frames are matched where the motion is unknown.
        [flat] matching: MatchOptions = MatchOptions::default();
    }
}
