//! How a pair of cameras held by hand moves while it looks at a corner: smooth in all six degrees of freedom, at any time.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::corner::{Corner, CornerKind};
use crate::rng::Rng;
use crate::stereo_options::StereoOptions;

/// How far from the planes of the corner's faces the cameras stay, radians: at 10 degrees a face is still seen.
const MARGIN_RAD: f64 = 0.17;
/// Least and greatest slope of the line of sight, radians: 12 to 52 degrees, at which the top face and the upright edge are both
/// seen.
const SLOPE_RAD: [f64; 2] = [0.21, 0.90];
/// Least and greatest height of the cameras, metres: hands neither on the floor nor overhead.
const HEIGHT_M: [f64; 2] = [0.4, 2.0];
/// How far off the corner the optical axis points, to the side and up or down, radians: the corner wanders
/// over a fifth of a field of view of 1 radian.
const AIM_RAD: [f64; 2] = [0.10, 0.06];
/// Tremor of hands: metres, radians and hertz, within the 4 to 12 Hz of physiological tremor.
const TREMOR: (f64, f64, f64) = (1e-4, 5e-4, 6.0);

/// A motion in time.
#[derive(Debug, Clone)]
pub struct Handheld {
    corner: Corner,
    distance_m: [f64; 2],
    azimuth_rad: f64,
    roll_rad: f64,
    half_baseline: Vector3<f64>,
    distance: Wave,
    azimuth: Wave,
    slope: Wave,
    aim: [Wave; 2],
    roll: Wave,
    tremor: [Wave; 6],
}

impl Handheld {
    /// Draws a motion around a corner; `reach` in `[0, 1]` is how much of the range of distances it uses, from near on.
    pub(crate) fn draw(corner: &Corner, options: &StereoOptions, reach: f64, rng: &mut Rng) -> Self {
        let [near, far] = options.distance_m;
        // The faces of a corner of which the level edges enclose gamma are all seen from within a sector of gamma.
        let azimuth_rad = (0.5 * corner.gamma_rad() - MARGIN_RAD).clamp(0.02, 0.65);
        let mut slow = || Wave::draw(1.0 / options.period_s, rng);
        let (distance, azimuth, slope, roll) = (slow(), slow(), slow(), slow());
        let mut quicker = || Wave::draw(2.0 / options.period_s, rng);
        let aim = [quicker(), quicker()];
        Self {
            corner: *corner,
            distance_m: [near, near + (far - near) * reach],
            azimuth_rad,
            roll_rad: options.roll_max_rad,
            half_baseline: 0.5 * options.left_from_right.translation.vector,
            distance,
            azimuth,
            slope,
            aim,
            roll,
            tremor: std::array::from_fn(|_| Wave::pure(TREMOR.2, rng)),
        }
    }

    /// The pose of the left camera in the world (`world_from_left`) at a time, seconds.
    pub fn pose(&self, time_s: f64) -> Isometry3<f64> {
        let between = |[low, high]: [f64; 2], wave: &Wave| 0.5 * (low + high) + 0.5 * (high - low) * wave.at(time_s);
        let distance = between(self.distance_m, &self.distance);
        let azimuth = self.azimuth_rad * self.azimuth.at(time_s);
        let slope = between(self.slopes(distance), &self.slope);
        let towards = Rotation3::from_axis_angle(&Vector3::z_axis(), azimuth) * self.corner.towards_viewer();
        let rise = if self.corner.is_seen_from_above() { slope.sin() } else { -slope.sin() };
        let [shake, jitter] = [0, 3].map(|first| Vector3::from_fn(|k, _| self.tremor[first + k].at(time_s)));
        let vertex = self.corner.position;
        let middle = vertex + (towards * slope.cos() + Vector3::z() * rise) * distance + shake * TREMOR.0;
        let target = vertex
            + self
                .corner
                .edges
                .iter()
                .zip(self.corner.lengths_m)
                .map(|(e, l)| e * (0.25 * l.min(0.5)))
                .sum::<Vector3<f64>>();
        let forward = (target - middle).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let looking = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
        let [pan, tilt] = [0, 1].map(|k| AIM_RAD[k] * self.aim[k].at(time_s));
        let held = Rotation3::from_axis_angle(&Vector3::y_axis(), pan)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), tilt)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), self.roll_rad * self.roll.at(time_s))
            * Rotation3::new(jitter * TREMOR.1);
        let rotation = Rotation3::from_matrix_unchecked(looking) * held;
        let center = middle - rotation * self.half_baseline;
        Isometry3::from_parts(Translation3::from(center), UnitQuaternion::from_rotation_matrix(&rotation))
    }

    /// The least and greatest slope of the line of sight at a distance, for hands neither on the floor nor overhead.
    fn slopes(&self, distance: f64) -> [f64; 2] {
        let [low, high] = HEIGHT_M.map(|height| height - self.corner.position.z);
        let [least, most] = if self.corner.is_seen_from_above() { [low, high] } else { [-high, -low] };
        let [gentle, steep] = SLOPE_RAD.map(f64::sin);
        // Smooth, so that the acceleration is: the greater and the smaller of two by their eighth powers.
        let least = (gentle.powi(8) + (least / distance).max(0.0).powi(8)).powf(0.125).min(0.97);
        let most = (steep.powi(-8) + (most / distance).max(0.05).powi(-8)).powf(-0.125);
        if most > least { [least.asin(), most.asin()] } else { [least.asin(); 2] }
    }

    /// Whether the corner is one that such a motion can be around.
    pub(crate) fn suits(corner: &Corner) -> bool {
        // What stands on the floor shows no level face; from inside, a room's floor does.
        corner.is_large() && (corner.kind != CornerKind::Solid || corner.edges[1].z < 0.0)
    }
}

/// A smooth wave within `(-1, 1)`: four sines with periods of no common multiple.
#[derive(Debug, Clone)]
struct Wave {
    terms: [[f64; 3]; 4],
}

impl Wave {
    /// A wave with overtones.
    fn draw(frequency_hz: f64, rng: &mut Rng) -> Self {
        Self::mixed(frequency_hz, [(1.0, 0.55), (1.83, 0.27), (3.1, 0.13), (5.3, 0.05)], rng)
    }

    /// A wave of about one frequency.
    fn pure(frequency_hz: f64, rng: &mut Rng) -> Self {
        Self::mixed(frequency_hz, [(1.0, 0.4), (1.1, 0.3), (0.9, 0.2), (1.3, 0.1)], rng)
    }

    fn mixed(frequency_hz: f64, shares: [(f64, f64); 4], rng: &mut Rng) -> Self {
        let term = |(ratio, share): (f64, f64)| {
            let turns = std::f64::consts::TAU * frequency_hz * ratio * rng.within(0.8, 1.25);
            [turns, rng.within(0.0, std::f64::consts::TAU), share]
        };
        Self { terms: shares.map(term) }
    }

    fn at(&self, time_s: f64) -> f64 {
        let sum: f64 = self.terms.iter().map(|[turns, phase, share]| share * (turns * time_s + phase).sin()).sum();
        (1.8 * sum).tanh()
    }
}
