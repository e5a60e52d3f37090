//! What couples a keyframe to the next one in the normal equations.

use nalgebra::Matrix3;

use super::linearisation::NormalEquations;
use super::pose_elimination::PoseEquations;
use super::problem::BundleProblem;
use crate::selfcalib::model::{FitSummary, HomogeneousLandmark};

impl BundleProblem {
    /// What couples a pose to the next one: the motion, and the bearings that depend on both. Adds its part to the equations of the pose at
    /// its start and to the shared ones; returns the block across, and the equations of the pose at its end, with the bearings that depend
    /// on that alone.
    pub(crate) fn link(
        &self,
        from: usize,
        points: &[HomogeneousLandmark],
        places: &[usize],
        start: &mut PoseEquations,
        shared: &mut NormalEquations,
        fit: &mut FitSummary,
    ) -> (Matrix3<f64>, PoseEquations) {
        let (calibration_width, wheels) = (self.free.width(), self.free.wheels);
        let motion = self.motion_blocks(from, shared);
        fit.cost += motion.cost;
        start.add_motion(&motion, wheels);
        let mut end = PoseEquations::after(&motion, start.width(), wheels);
        let mut across = motion.across;
        for at in [from, from + 1] {
            let neighbour = self.neighbour(at);
            // Others are of the link before or of the next one.
            if at == from && neighbour != Some(from + 1) || at > from && neighbour == Some(at + 1) {
                continue;
            }
            self.for_each_bearing_row(at, points, |row| {
                fit.add(row.residual, self.loss);
                let place = places[(row.at - calibration_width) / 2];
                row.add_to(shared, place, calibration_width);
                if neighbour.is_none() {
                    end.add_row(row, &row.by_pose, place, calibration_width);
                    return;
                }
                let (by_start, by_end) =
                    if at == from { (&row.by_pose, &row.by_neighbour) } else { (&row.by_neighbour, &row.by_pose) };
                start.add_row(row, by_start, place, calibration_width);
                end.add_row(row, by_end, place, calibration_width);
                across += by_start * by_end.transpose() * row.weight;
            });
        }
        (across, end)
    }
}
