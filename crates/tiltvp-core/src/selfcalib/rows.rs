//! What motions and bearings say of the unknowns: their rows, linearised and whitened.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x2, Vector3};

use super::graph::{Graph, Node};
use super::measurement::{Landmark, Ray, Viewpoint};
use super::odometry::between;

/// The part of a motion in the normal equations.
pub(super) struct LegBlocks {
    pub(super) cost: f64,
    pub(super) before: Matrix3<f64>,
    pub(super) across: Matrix3<f64>,
    pub(super) after: Matrix3<f64>,
    pub(super) before_side: Vector3<f64>,
    pub(super) after_side: Vector3<f64>,
    pub(super) before_wheels: Matrix3x2<f64>,
    pub(super) after_wheels: Matrix3x2<f64>,
}

/// A bearing's whitened residual, its derivatives, and its weight.
pub(super) struct Row {
    pub(super) by_pose: Vector3<f64>,
    pub(super) by_fixed: [f64; 6],
    /// Where its landmark is in the dense block.
    pub(super) at: usize,
    pub(super) by_landmark: [f64; 2],
    pub(super) residual: f64,
    pub(super) weight: f64,
}

impl Row {
    /// Adds to the upper triangle, the landmark being at `at`.
    pub(super) fn add_dense(&self, dense: &mut DMatrix<f64>, rhs: &mut DVector<f64>, at: usize, fixed: usize) {
        let w = self.weight;
        for c in 0..fixed {
            for r in 0..=c {
                dense[(r, c)] += self.by_fixed[r] * self.by_fixed[c] * w;
            }
            rhs[c] -= self.by_fixed[c] * self.residual * w;
        }
        for (k, by) in self.by_landmark.iter().enumerate() {
            let c = at + k;
            for r in 0..fixed {
                dense[(r, c)] += self.by_fixed[r] * by * w;
            }
            for j in 0..=k {
                dense[(at + j, c)] += self.by_landmark[j] * by * w;
            }
            rhs[c] -= by * self.residual * w;
        }
    }
}

impl Graph {
    /// The landmarks as predictions take them.
    pub(super) fn rays(&self) -> Vec<Ray> {
        self.landmarks.iter().map(Landmark::ray).collect()
    }

    /// The part of the motion that follows a node; what it says of the wheels alone is added to the dense block.
    pub(super) fn leg_blocks(&self, from: usize, dense: &mut DMatrix<f64>, rhs: &mut DVector<f64>) -> LegBlocks {
        let (node, after) = (&self.nodes[from], &self.nodes[from + 1]);
        let b = between(&node.pose, &after.pose);
        let (sin, cos) = node.pose.z.sin_cos();
        let by_after = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        let by_before = Matrix3::new(-cos, -sin, b.y, sin, -cos, -b.x, 0.0, 0.0, -1.0);
        let r = b - after.leg.motion;
        let squared = r.dot(&(after.information * r));
        let information = after.information * self.slip.weight(squared);
        let (wb, wa, wr) = (information * by_before, information * by_after, information * r);
        let mut blocks = LegBlocks {
            cost: self.slip.cost(squared),
            before: by_before.transpose() * wb,
            across: by_before.transpose() * wa,
            after: by_after.transpose() * wa,
            before_side: -(by_before.transpose() * wr),
            after_side: -(by_after.transpose() * wr),
            before_wheels: Matrix3x2::zeros(),
            after_wheels: Matrix3x2::zeros(),
        };
        if self.free.wheels {
            let j = -after.leg.by_wheels;
            let own = j.transpose() * information * j;
            let side = j.transpose() * wr;
            for a in 0..2 {
                for b in 0..=a {
                    dense[(3 + b, 3 + a)] += own[(b, a)];
                }
                rhs[3 + a] -= side[a];
            }
            blocks.before_wheels = wb.transpose() * j;
            blocks.after_wheels = wa.transpose() * j;
        }
        blocks
    }

    /// Gives `each` the rows of a node's bearings of landmarks at the ends of such rays.
    #[inline]
    pub(super) fn linearised(&self, node: &Node, rays: &[Ray], mut each: impl FnMut(&Row)) {
        let (pose, moved) = self.pose_of_sights(node);
        let view = Viewpoint::new(&pose, &self.mounting);
        let fixed = self.free.width();
        for sight in &node.sights {
            let ray = &rays[sight.landmark];
            let p = view.slopes(ray);
            let s = 1.0 / (self.bearing_sigma * self.spreads[sight.landmark]);
            let residual = view.past(ray, &sight.along) * s;
            let mut by_fixed = [0.0; 6];
            by_fixed[..3].copy_from_slice((p.by_mounting * s).as_slice());
            let mut by_pose = p.by_pose * s;
            if let Some((first, by_offset)) = &moved {
                if self.free.offset {
                    by_fixed[self.free.offset_at()] = by_pose.dot(by_offset);
                }
                by_pose = first.transpose() * by_pose;
            }
            each(&Row {
                by_pose,
                by_fixed,
                at: fixed + 2 * sight.landmark,
                by_landmark: [p.by_landmark.x * s, p.by_landmark.y * s],
                residual,
                weight: self.loss.weight(residual),
            });
        }
    }
}
