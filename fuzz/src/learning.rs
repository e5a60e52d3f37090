//! Logs and training sets of any numbers: refused, or answers whose numbers are such.

use tiltvp_core::selfcalib::{LogBearing, LogOptions, SelfCalibratorOptions, WheelMotion, calibrate_log};
use tiltvp_core::tilt::{PriorOfTilt, train_affine, train_factor, train_posterior};

use crate::bytes::Bytes;

/// The log of a short drive.
pub fn log(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let steps = 2 + bytes.below(7);
    let filter = SelfCalibratorOptions { wheel_base_m: bytes.mostly(0.1, 1.0), ..SelfCalibratorOptions::default() };
    let options = LogOptions {
        filter,
        estimate_odometry: bytes.flag(),
        estimate_time_offset: bytes.flag(),
        estimate_centre: bytes.flag(),
        estimate_rolling_shutter: bytes.flag(),
        max_iterations: 10,
        jackknife_parts: if bytes.byte() < 16 { 2 } else { 0 },
    };
    let mut odometry = Vec::new();
    let mut times_s = vec![0.0];
    for step in 0..steps {
        odometry.push(WheelMotion { left_m: bytes.mostly(0.0, 0.2), right_m: bytes.mostly(0.0, 0.2) });
        times_s.push(times_s[step] + bytes.mostly(0.01, 1.0));
    }
    let times_s = bytes.flag().then_some(&times_s[1..]);
    let mut bearings = Vec::new();
    for _ in 0..bytes.byte() % 32 {
        let (step, landmark) = (bytes.below(steps + 1), bytes.byte() % 4);
        bearings.push(LogBearing { step, landmark: landmark.into(), bearing_rad: bytes.mostly(-3.2, 3.2) });
    }
    let Ok(found) = calibrate_log(&options, &odometry, times_s, &bearings) else { return };
    let what = || format!("{options:?} {odometry:?} {times_s:?} {bearings:?} {found:?}");
    assert!(found.outliers <= found.bearings && found.bearings <= bearings.len(), "{}", what());
    let mounting = found.estimate.mounting;
    let finite = [mounting.x_m, mounting.y_m, mounting.yaw_rad].iter().all(|x| x.is_finite());
    assert!(finite || !found.reliable(), "{}", what());
    let variances = found.estimate.covariance_xy_yaw.diagonal();
    assert!(variances.iter().all(|x| *x >= 0.0) || !found.reliable(), "{}", what());
}

/// Shifts of images of known leans.
pub fn training(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let factor = bytes.mostly(1.0, 100.0);
    let (mut shift, mut alpha_rad) = (Vec::new(), Vec::new());
    for _ in 0..bytes.byte() % 40 {
        let lean = bytes.mostly(0.0, 0.3);
        alpha_rad.push(lean);
        shift.push(if bytes.byte() < 240 { lean * factor * bytes.within(0.8, 1.2) } else { bytes.number() });
    }
    let what = || format!("{shift:?} {alpha_rad:?}");
    if let Ok(factor) = train_factor(&shift, &alpha_rad) {
        assert!(factor > 0.0 && factor.is_finite(), "{}", what());
    }
    if let Ok(line) = train_affine(&shift, &alpha_rad) {
        assert!(line.factor > 0.0 && line.factor.is_finite() && line.offset_rad.is_finite(), "{line:?} {}", what());
    }
    let prior = match bytes.below(3) {
        0 => PriorOfTilt::Empirical,
        1 => PriorOfTilt::Uniform { max_rad: bytes.mostly(0.01, 0.5) },
        _ => PriorOfTilt::Rayleigh { sigma_rad: bytes.mostly(0.01, 0.3) },
    };
    if let Ok(found) = train_posterior(&shift, &alpha_rad, prior) {
        let (mean_rad, std_rad) = (found.mean_rad(), found.std_rad());
        assert!(mean_rad.is_sorted() && std_rad.iter().all(|x| *x >= 0.0 && x.is_finite()), "{found:?} {}", what());
        assert!(mean_rad.iter().all(|x| (0.0..1.6).contains(x)), "{found:?} {}", what());
    }
}
