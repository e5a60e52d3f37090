//! Motions and bearings linearised and whitened: rows of the Jacobian, and their part in the normal equations.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x2, Vector3};

use super::motion_residual::MotionResidual;
use super::problem::BundleProblem;
use crate::selfcalib::model::{HomogeneousLandmark, InverseDistanceLandmark, between_jacobians};

/// Normal equations: `information step = rhs`.
pub(crate) struct NormalEquations {
    pub(crate) information: DMatrix<f64>,
    pub(crate) rhs: DVector<f64>,
}

impl NormalEquations {
    pub(crate) fn zeros(width: usize) -> Self {
        Self { information: DMatrix::zeros(width, width), rhs: DVector::zeros(width) }
    }
}

/// The part of a motion in the normal equations: blocks of the poses before and after it and of the wheels.
pub(crate) struct MotionBlocks {
    pub(crate) cost: f64,
    pub(crate) before: Matrix3<f64>,
    pub(crate) across: Matrix3<f64>,
    pub(crate) after: Matrix3<f64>,
    pub(crate) before_rhs: Vector3<f64>,
    pub(crate) after_rhs: Vector3<f64>,
    pub(crate) before_wheels: Matrix3x2<f64>,
    pub(crate) after_wheels: Matrix3x2<f64>,
}

/// A row of the Jacobian: the whitened residual of a bearing, its derivatives, and its weight.
pub(crate) struct BearingRow {
    pub(crate) by_pose: Vector3<f64>,
    /// By the pose of the keyframe's [neighbour](BundleProblem::neighbour).
    pub(crate) by_neighbour: Vector3<f64>,
    pub(crate) by_calibration: [f64; 11],
    /// The place of its landmark among the shared parameters.
    pub(crate) at: usize,
    pub(crate) by_landmark: [f64; 2],
    pub(crate) residual: f64,
    pub(crate) weight: f64,
}

impl BearingRow {
    /// Adds the row to the upper triangle of normal equations in which its landmark is at `at`.
    pub(crate) fn add_to(&self, equations: &mut NormalEquations, at: usize, calibration_width: usize) {
        let NormalEquations { information, rhs } = equations;
        let w = self.weight;
        for c in 0..calibration_width {
            for r in 0..=c {
                information[(r, c)] += self.by_calibration[r] * self.by_calibration[c] * w;
            }
            rhs[c] -= self.by_calibration[c] * self.residual * w;
        }
        for (k, by) in self.by_landmark.iter().enumerate() {
            let c = at + k;
            for r in 0..calibration_width {
                information[(r, c)] += self.by_calibration[r] * by * w;
            }
            for j in 0..=k {
                information[(at + j, c)] += self.by_landmark[j] * by * w;
            }
            rhs[c] -= by * self.residual * w;
        }
    }
}

impl BundleProblem {
    /// The landmarks as predictions use them.
    pub(crate) fn homogeneous_landmarks(&self) -> Vec<HomogeneousLandmark> {
        self.landmarks.iter().map(InverseDistanceLandmark::homogeneous).collect()
    }

    /// The part of the motion that follows a keyframe. The block of the wheels alone is added to the normal equations.
    pub(crate) fn motion_blocks(&self, from: usize, equations: &mut NormalEquations) -> MotionBlocks {
        let (keyframe, after) = (&self.keyframes[from], &self.keyframes[from + 1]);
        let MotionResidual { motion, off: r, as_read } = self.motion_residual(from + 1);
        let (mut by_before, mut by_after) = between_jacobians(&keyframe.pose, &motion);
        if let Some((reading, _)) = &as_read {
            (by_before, by_after) = (reading * by_before, reading * by_after);
        }
        let squared = r.dot(&(after.information * r));
        let weighted = after.information * self.slip.weight(squared);
        let (wb, wa, wr) = (weighted * by_before, weighted * by_after, weighted * r);
        let mut blocks = MotionBlocks {
            cost: self.slip.cost(squared),
            before: by_before.transpose() * wb,
            across: by_before.transpose() * wa,
            after: by_after.transpose() * wa,
            before_rhs: -(by_before.transpose() * wr),
            after_rhs: -(by_after.transpose() * wr),
            before_wheels: Matrix3x2::zeros(),
            after_wheels: Matrix3x2::zeros(),
        };
        if self.free.wheels {
            let mut j = -after.odometry.by_wheels;
            if let Some((reading, by_base)) = &as_read {
                j = reading * j;
                j.set_column(1, &(j.column(1) + by_base));
            }
            let own = j.transpose() * weighted * j;
            let side = j.transpose() * wr;
            for a in 0..2 {
                for b in 0..=a {
                    equations.information[(3 + b, 3 + a)] += own[(b, a)];
                }
                equations.rhs[3 + a] -= side[a];
            }
            blocks.before_wheels = wb.transpose() * j;
            blocks.after_wheels = wa.transpose() * j;
        }
        blocks
    }

    /// Calls `each` with the row of every bearing of a keyframe.
    #[inline]
    pub(crate) fn for_each_bearing_row(
        &self,
        at: usize,
        points: &[HomogeneousLandmark],
        mut each: impl FnMut(&BearingRow),
    ) {
        let calibration_width = self.free.width();
        // The mounting is that at the last keyframe.
        let yet_to_creep = at as f64 / (self.keyframes.len() - 1).max(1) as f64 - 1.0;
        self.for_each_observation(at, |observation, view, by| {
            let point = &points[observation.landmark];
            let p = view.jacobians(point);
            let s = 1.0 / (self.bearing_sigma * self.scatters[observation.landmark]);
            let residual = view.residual(point, &observation.about(&self.centre).along) * s;
            let mut by_calibration = [0.0; 11];
            by_calibration[..3].copy_from_slice((p.by_mounting * s).as_slice());
            let (mut by_pose, mut by_neighbour) = (p.by_pose * s, Vector3::zeros());
            if let Some(by) = by {
                if self.free.offset {
                    by_calibration[self.free.offset_at()] = by_pose.dot(&by.offset);
                }
                if self.free.shutter {
                    let at = self.free.shutter_at();
                    let by_shutter = observation.along * by_pose.dot(&by.shutter);
                    by_calibration[at..at + 2].copy_from_slice(by_shutter.as_slice());
                }
                by_neighbour = by.neighbour.transpose() * by_pose;
                by_pose = by.pose.transpose() * by_pose;
            }
            if self.free.centre {
                let at = self.free.centre_at();
                by_calibration[at..at + 2].copy_from_slice((observation.by_centre() * s).as_slice());
            }
            if self.free.creep {
                by_calibration[self.free.creep_at()] = p.by_mounting.z * s * yet_to_creep;
            }
            each(&BearingRow {
                by_pose,
                by_neighbour,
                by_calibration,
                at: calibration_width + 2 * observation.landmark,
                by_landmark: [p.by_landmark.x * s, p.by_landmark.y * s],
                residual,
                weight: self.loss.weight(residual),
            });
        });
    }
}
