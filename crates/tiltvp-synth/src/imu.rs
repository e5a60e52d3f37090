//! An inertial sensor of the MPU6050's grade that rides on a pair of cameras or a robot: rates and specific forces, with bias,
//! noise, wrong scales, a limited range and 16 bits.

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::options::{Kind, OptionValue, Value};
use tiltvp_core::{Error, Result, options};

use crate::handheld::Handheld;
use crate::rng::Rng;

/// Standard acceleration of free fall, metres per square second.
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// Step of the central differences that make rates and accelerations of poses, seconds: a
/// hundredth of a period of the tremor or less.
const STEP_S: f64 = 1e-3;

/// One kind of sensor, alike in its three axes. The unit is rad/s or m/s^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuChannel {
    /// Standard deviation of white noise at a bandwidth of one hertz, unit / sqrt(Hz).
    pub noise_density: f64,
    /// Standard deviation of the bias that is left after calibration.
    pub bias_sigma: f64,
    /// How the bias wanders: standard deviation after one second, unit / sqrt(s).
    pub bias_walk: f64,
    /// Standard deviation of the relative error of scales, and of the sines between axes.
    pub scale_sigma: f64,
    /// Greatest reading; greater ones are cut off.
    pub range: f64,
}

impl ImuChannel {
    /// The gyroscope of an MPU6050 at +-250 degrees per second: 0.005 deg/s/sqrt(Hz); a bias of 0.2 deg/s is left.
    pub const GYROSCOPE: Self =
        Self { noise_density: 8.7e-5, bias_sigma: 3.5e-3, bias_walk: 1e-4, scale_sigma: 0.005, range: 4.363_323 };
    /// The accelerometer of an MPU6050 at +-2 g: 400 ug/sqrt(Hz); a bias of 5 mg is left.
    pub const ACCELEROMETER: Self = Self {
        noise_density: 400e-6 * GRAVITY_M_S2,
        bias_sigma: 5e-3 * GRAVITY_M_S2,
        bias_walk: 1e-4,
        scale_sigma: 0.005,
        range: 2.0 * GRAVITY_M_S2,
    };
}

/// As (noise_density, bias_sigma, bias_walk, scale_sigma, range).
impl OptionValue for ImuChannel {
    const KIND: Kind = Kind::Array(&[5]);

    fn to_value(&self) -> Value {
        [self.noise_density, self.bias_sigma, self.bias_walk, self.scale_sigma, self.range].to_value()
    }

    fn from_value(value: &Value) -> Option<Self> {
        let [noise_density, bias_sigma, bias_walk, scale_sigma, range] = OptionValue::from_value(value)?;
        Some(Self { noise_density, bias_sigma, bias_walk, scale_sigma, range })
    }
}

options! {
    /// How the sensor is: equal options give equal readings of the same motion.
    #[derive(Copy)]
    pub struct ImuOptions {
        /// Readings per second.
        rate_hz: f64 = 200.0 => 10.0..=8000.0, "hertz in [10, 8000]";
        /// Seed of biases and noise.
        seed: u64 = 0;
        /// Rates of turn, rad/s: noise density, bias, bias walk, scale error and range.
        gyroscope: ImuChannel = ImuChannel::GYROSCOPE;
        /// Specific forces, m/s^2: the same.
        accelerometer: ImuChannel = ImuChannel::ACCELEROMETER;
    }
    check channels_are_possible
}

fn channels_are_possible(options: &ImuOptions) -> Result<()> {
    for (name, channel) in [("gyroscope", &options.gyroscope), ("accelerometer", &options.accelerometer)] {
        let small = [channel.noise_density, channel.bias_sigma, channel.bias_walk, channel.scale_sigma];
        if let Some(value) = small.iter().find(|value| !(0.0..=10.0).contains(*value)) {
            return Err(Error::option(name, value, "noise, bias, walk and scale errors in [0, 10]"));
        }
        if !(1e-3..=1e4).contains(&channel.range) {
            return Err(Error::option(name, channel.range, "a range in [0.001, 10000]"));
        }
    }
    Ok(())
}

/// One reading, in the sensor's axes: on a pair of cameras those of the left one, at its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuReading {
    /// When, seconds.
    pub time_s: f64,
    /// Rate of turn, rad/s.
    pub rate_rad_s: Vector3<f64>,
    /// Specific force, m/s^2: at rest it points upwards.
    pub force_m_s2: Vector3<f64>,
    /// The gyroscope's true bias, rad/s.
    pub rate_bias_rad_s: Vector3<f64>,
}

/// The readings along a motion, from time 0 to `duration_s` or just beyond.
///
/// # Errors
/// If the options are outside their domains.
pub fn imu_readings(motion: &Handheld, duration_s: f64, options: &ImuOptions) -> Result<Vec<ImuReading>> {
    let count = (duration_s * options.rate_hz).ceil().max(0.0) as usize + 1;
    readings_of((0..count).map(|k| truth(motion, k as f64 / options.rate_hz)), options)
}

/// What the sensor makes of true rates of turn (rad/s) and specific forces (m/s^2) in its axes, `rate_hz` a second from time 0.
///
/// # Errors
/// If the options are outside their domains.
pub fn readings_of(
    truths: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>,
    options: &ImuOptions,
) -> Result<Vec<ImuReading>> {
    options.validate()?;
    let mut gyroscope = Sensor::new(options.gyroscope, options.rate_hz, options.seed, 1 << 35);
    let mut accelerometer = Sensor::new(options.accelerometer, options.rate_hz, options.seed, (1 << 35) + 1);
    let readings = truths.enumerate().map(|(k, (rate, force))| {
        let time_s = k as f64 / options.rate_hz;
        let rate_bias_rad_s = gyroscope.bias;
        let (rate_rad_s, force_m_s2) = (gyroscope.read(&rate), accelerometer.read(&force));
        ImuReading { time_s, rate_rad_s, force_m_s2, rate_bias_rad_s }
    });
    Ok(readings.collect())
}

/// Rate of turn and specific force, in the axes of the left camera.
fn truth(motion: &Handheld, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
    let [before, now, after] = [-STEP_S, 0.0, STEP_S].map(|aside| motion.pose(time_s + aside));
    let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * STEP_S);
    let acceleration =
        (before.translation.vector - 2.0 * now.translation.vector + after.translation.vector) / (STEP_S * STEP_S);
    let force = now.rotation.inverse() * (acceleration + Vector3::z() * GRAVITY_M_S2);
    (rate, force)
}

/// A sensor as it reads.
struct Sensor {
    channel: ImuChannel,
    rate_hz: f64,
    rng: Rng,
    gain: Matrix3<f64>,
    bias: Vector3<f64>,
}

impl Sensor {
    fn new(channel: ImuChannel, rate_hz: f64, seed: u64, stream: u64) -> Self {
        let mut rng = Rng::new(seed, stream);
        let gain = Matrix3::identity() + Matrix3::from_fn(|_, _| channel.scale_sigma * rng.normal());
        let bias = Vector3::from_fn(|_, _| channel.bias_sigma * rng.normal());
        Self { channel, rate_hz, rng, gain, bias }
    }

    fn read(&mut self, truth: &Vector3<f64>) -> Vector3<f64> {
        let (range, step) = (self.channel.range, self.channel.range / 32_768.0);
        // White noise over half the rate of readings.
        let sigma = self.channel.noise_density * (0.5 * self.rate_hz).sqrt();
        let walk = self.channel.bias_walk / self.rate_hz.sqrt();
        let (noise, wander) =
            (Vector3::from_fn(|_, _| sigma * self.rng.normal()), Vector3::from_fn(|_, _| walk * self.rng.normal()));
        let reading = self.gain * truth + self.bias + noise;
        self.bias += wander;
        reading.map(|value| (value.clamp(-range, range - step) / step).round() * step)
    }
}
