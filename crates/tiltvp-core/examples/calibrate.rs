//! Where a camera sits on a robot, from a log: `calibrate ODOMETRY.csv BEARINGS.csv WHEEL_BASE_M`.
//!
//! `ODOMETRY.csv` has a header and rows of step, left and right displacement in metres; `BEARINGS.csv` a header and rows of step,
//! landmark, bearing in radians, seen at the end of that step's motion.

use std::str::FromStr;

use tiltvp_core::selfcalib::{LogBearing, LogOptions, SelfCalibratorOptions, WheelMotion, calibrate_log};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [odometry, bearings, wheel_base_m] = arguments.as_slice() else {
        return Err("calibrate ODOMETRY.csv BEARINGS.csv WHEEL_BASE_M".into());
    };
    let mut motions = Vec::new();
    for (place, [step, left_m, right_m]) in rows(odometry)?.iter().enumerate() {
        if step.parse::<usize>()? != place {
            return Err(format!("{odometry}: step {step} in row {place}, expected steps 0, 1, 2 and so on").into());
        }
        motions.push(WheelMotion { left_m: left_m.parse()?, right_m: right_m.parse()? });
    }
    let mut seen = Vec::new();
    for [step, landmark, bearing_rad] in rows(bearings)? {
        seen.push(LogBearing { step: step.parse()?, landmark: landmark.parse()?, bearing_rad: bearing_rad.parse()? });
    }

    let wheel_base_m = f64::from_str(wheel_base_m)?;
    let filter = SelfCalibratorOptions { wheel_base_m, ..SelfCalibratorOptions::default() };
    let found = calibrate_log(&LogOptions { filter, ..LogOptions::default() }, &motions, None, &seen)?;
    let at = found.estimate.mounting;
    println!("x {:.3} m, y {:.3} m, yaw {:.2} degrees", at.x_m, at.y_m, at.yaw_rad.to_degrees());
    println!("{found}");
    if found.reliable() { Ok(()) } else { Err("this answer is not to be relied upon".into()) }
}

/// The rows of a table of three columns, without its header.
fn rows(path: &str) -> Result<Vec<[String; 3]>, Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(path)?;
    let row = |line: &str| {
        let cells: Vec<String> = line.split(',').map(|cell| cell.trim().to_owned()).collect();
        <[String; 3]>::try_from(cells).map_err(|_| format!("{path}: {line:?}, expected three columns").into())
    };
    text.lines().skip(1).map(row).collect()
}
