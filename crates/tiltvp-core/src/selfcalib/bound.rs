//! The Cramer-Rao bound of a drive: how well any unbiased estimator could know the mounting, given the truth.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::dense::Factor;
use super::graph::{Node, Sight, information};
use super::loss::{Loss, Slip};
use super::measurement::{Landmark, camera};
use super::mounting::Mounting;
use super::odometry::{Leg, WheelMotion};
use super::options::SelfCalibratorOptions;
use super::recursive::Recursive;
use crate::error::{Error, Result};

/// Standard deviation of the logarithm of a distance that is not known.
const UNKNOWN: f64 = 100.0;

/// The smallest covariance of (x, y, yaw) that an unbiased estimator can have, what is known at the start included, if the
/// landmarks' places are unknown.
///
/// `readings` are the wheels' displacements of each step, `poses` the true poses of the robot after each step (from a true
/// pose at the start of (0, 0, 0)), `landmarks_m` the true places, and `sights` the landmarks (as places in `landmarks_m`)
/// seen after each step. The noise is that of the options; the linearisation is at the truth.
///
/// # Errors
/// [`Error::InvalidOption`] for options that make no sense, [`Error::InvalidArgument`] for lengths that differ, landmarks
/// that do not exist, or a drive that leaves the information singular.
pub fn cramer_rao_bound(
    options: &SelfCalibratorOptions,
    mounting: &Mounting,
    readings: &[WheelMotion],
    poses: &[Vector3<f64>],
    landmarks_m: &[Vector2<f64>],
    sights: &[Vec<usize>],
) -> Result<Matrix3<f64>> {
    options.validate()?;
    if poses.len() != readings.len() || sights.len() != readings.len() {
        let got = format!("{} poses and {} lists of sights", poses.len(), sights.len());
        return Err(Error::argument("poses", got, format!("one of each for {} steps", readings.len())));
    }
    let mut graph = Recursive::new(options)?.into_graph();
    let truth = mounting.vector();
    graph.mounting = truth;
    let mut slots = vec![None; landmarks_m.len()];
    for ((reading, pose), seen) in readings.iter().zip(poses).zip(sights) {
        let leg = Leg::from_wheels(reading, &graph.wheels, &graph.noise);
        let still = reading.left_m == 0.0 && reading.right_m == 0.0;
        if !still {
            match graph.nodes.last_mut() {
                Some(last) if last.sights.is_empty() && last.information != Matrix3::zeros() => {
                    last.leg = last.leg.then(&leg);
                    last.information = information(&last.leg.covariance);
                    last.pose = *pose;
                }
                _ => graph.nodes.push(Node {
                    pose: *pose,
                    leg,
                    information: information(&leg.covariance),
                    ..Node::anchor()
                }),
            }
        }
        for &landmark in seen {
            let Some(place) = landmarks_m.get(landmark) else {
                return Err(Error::argument("sights", landmark, format!("a place among {}", landmarks_m.len())));
            };
            let slot = if let Some(slot) = slots[landmark] {
                slot
            } else {
                let anchor = camera(pose, &truth);
                let ray = place - anchor;
                let seen_as = Landmark { anchor, direction: ray.y.atan2(ray.x), closeness: -ray.norm().ln() };
                let slot = graph.add_landmark(seen_as, seen_as.closeness, UNKNOWN);
                slots[landmark] = Some(slot);
                slot
            };
            if let Some(node) = graph.nodes.last_mut()
                && !node.sights.iter().any(|s| s.landmark == slot)
            {
                node.sights.push(Sight::new(slot, 0.0));
            }
        }
    }
    // The information of a bearing does not depend on its residual, but for its weight.
    graph.loss = Loss::Linear(f64::INFINITY);
    graph.slip = Slip::NEVER;
    let last = graph.nodes.len() - 1;
    let singular = || Error::argument("sights", "a drive that determines nothing", "bearings of landmarks");
    let whole =
        graph.eliminate(last, false, 0.0).and_then(|e| Factor::touched(e.information)).ok_or_else(singular)?.inverse();
    Ok(whole.fixed_view::<3, 3>(0, 0).into())
}
