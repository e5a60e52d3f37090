//! Drives of a robot with a camera past vertical lines: wheel displacements and bearings with noise, and the truth behind.

use nalgebra::{Vector2, Vector3};
use tiltvp_core::geometry::wrap_angle;
use tiltvp_core::options::{Above, NOT_NEGATIVE};
use tiltvp_core::selfcalib::{MotionNoise, Mounting, RelativeMotion, WHEEL_BASE_MAX_M, WheelMotion, Wheels};
use tiltvp_core::{options, words};

use crate::rng::Rng;

words! {
    /// A trajectory.
    pub enum BearingDriveKind {
        /// That of Scaramuzza, Siegwart and Martinelli 2009, section 9.2: 2.3 m straight on in steps of 3.8 cm, then half a turn
        /// in place.
        Paper = "paper",
        /// Four times 1 m straight on and a quarter of a turn in place.
        Alternating = "alternating",
        /// 4 m straight on, nothing else.
        Straight = "straight",
        /// A whole turn in place, nothing else.
        Rotation = "rotation",
        /// Four arcs of 1 m, to the left and to the right by turns.
        Arcs = "arcs",
    }
}

impl BearingDriveKind {
    /// Distance in metres and turn in radians of each leg.
    pub fn legs(self) -> Vec<(f64, f64)> {
        let (straight, turn) = (|metres| (metres, 0.0), |degrees: f64| (0.0, degrees.to_radians()));
        match self {
            Self::Paper => vec![straight(2.3), turn(180.0)],
            Self::Alternating => [straight(1.0), turn(90.0)].repeat(4),
            Self::Straight => vec![straight(4.0)],
            Self::Rotation => vec![turn(360.0)],
            Self::Arcs => [90.0f64, -60.0, 120.0, -45.0].map(|degrees| (1.0, degrees.to_radians())).to_vec(),
        }
    }

    /// Distance and turn of each step.
    fn steps(self) -> Vec<(f64, f64)> {
        let steps = |(distance, turn): (f64, f64)| {
            let count = (distance / 0.038).max(turn.abs() / 3f64.to_radians()).round();
            vec![(distance / count, turn / count); count as usize]
        };
        self.legs().into_iter().flat_map(steps).collect()
    }
}

options! {
    /// What is drawn: by default the paper's mounting, lines and noise.
    #[derive(Copy)]
    pub struct BearingDriveOptions {
        /// The trajectory.
        kind: BearingDriveKind = BearingDriveKind::Paper;
        /// Seed of everything random.
        seed: u64 = 0;
        /// Where the camera is: (x_m, y_m, yaw_rad).
        mounting: Mounting = Mounting::from_polar(-0.34, 0.23, 0.33);
        /// How many vertical lines there are.
        landmarks: usize = 10 => 0.0..=1000.0, "a whole number from 0 to 1000";
        /// Standard deviation of a bearing, radians.
        bearing_sigma_rad: f64 = 0.5f64.to_radians() => NOT_NEGATIVE, "a finite number of zero or more";
        /// Variance of a wheel's displacement per metre (Scaramuzza, Siegwart and Martinelli 2009, eq. 31), metres.
        odometry_k_m: f64 = 1e-5 => NOT_NEGATIVE, "a finite number of zero or more";
        /// Distance between the wheels, metres.
        wheel_base_m: f64 = 0.4 => Above(0.0, WHEEL_BASE_MAX_M), "a positive number of metres, at most 200";
        /// Probability that a bearing is that of nothing: anywhere on the circle.
        outliers: f64 = 0.0 => NOT_NEGATIVE, "a finite number of zero or more";
    }
}

/// A drive, step by step.
#[derive(Debug, Clone, PartialEq)]
pub struct BearingDrive {
    /// What the wheels report.
    pub readings: Vec<WheelMotion>,
    /// The true pose (x, y, heading) after each step, from (0, 0, 0).
    pub poses: Vec<Vector3<f64>>,
    /// The places of the lines.
    pub landmarks_m: Vec<Vector2<f64>>,
    /// The bearing of every line after each step, in (-pi, pi].
    pub bearings_rad: Vec<Vec<f64>>,
}

impl BearingDrive {
    /// Draws a drive. Lines are 1 to 5 m from the middle of the path, and never nearer than 0.6 m to the robot.
    pub fn new(options: &BearingDriveOptions) -> Self {
        let mut rng = Rng::new(options.seed, 0);
        let wheels = Wheels::new(options.wheel_base_m);
        let (mut readings, mut poses) = (Vec::new(), Vec::new());
        let mut pose = Vector3::zeros();
        for (distance, turn) in options.kind.steps() {
            let reading = WheelMotion::from_motion(distance, turn, options.wheel_base_m);
            let mut noisy = |metres: f64| metres + (options.odometry_k_m * metres.abs()).sqrt() * rng.normal();
            let driven = WheelMotion { left_m: noisy(reading.left_m), right_m: noisy(reading.right_m) };
            let step = RelativeMotion::from_wheels(&driven, &wheels, &MotionNoise::new(0.0)).motion;
            let (sin, cos) = f64::sin_cos(pose.z);
            pose += Vector3::new(cos * step.x - sin * step.y, sin * step.x + cos * step.y, step.z);
            readings.push(reading);
            poses.push(pose);
        }
        let count = poses.len().max(1) as f64;
        let middle = poses.iter().fold(Vector2::zeros(), |sum, pose| sum + pose.xy()) / count;
        let mut landmarks_m = Vec::with_capacity(options.landmarks);
        while landmarks_m.len() < options.landmarks {
            let (distance, angle) = (rng.within(1.0, 5.0), rng.within(0.0, std::f64::consts::TAU));
            let place = middle + Vector2::new(angle.cos(), angle.sin()) * distance;
            if poses.iter().all(|pose| (pose.xy() - place).norm() > 0.6) {
                landmarks_m.push(place);
            }
        }
        let m = options.mounting;
        let mut look = |pose: &Vector3<f64>, place: &Vector2<f64>| {
            let (sin, cos) = pose.z.sin_cos();
            let camera = pose.xy() + Vector2::new(cos * m.x_m - sin * m.y_m, sin * m.x_m + cos * m.y_m);
            let ray = place - camera;
            let noise = options.bearing_sigma_rad * rng.normal();
            let astray = rng.chance(options.outliers).then(|| rng.within(-3.1, 3.1));
            astray.unwrap_or_else(|| wrap_angle(ray.y.atan2(ray.x) - pose.z - m.yaw_rad + noise))
        };
        let bearings_rad =
            poses.iter().map(|pose| landmarks_m.iter().map(|place| look(pose, place)).collect()).collect();
        Self { readings, poses, landmarks_m, bearings_rad }
    }
}
