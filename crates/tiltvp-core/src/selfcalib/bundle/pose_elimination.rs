//! The normal equations of one pose, coupled to its neighbours and to shared parameters, and its elimination (Schur complement).

use nalgebra::{Cholesky, Matrix3, Matrix3x2, Vector3};
use tiltvp_kernels::vectorised;

use super::linearisation::{BearingRow, MotionBlocks, NormalEquations};

/// The block that couples a pose to shared parameters: three rows, one after the other.
pub(crate) struct Coupling {
    values: Vec<f64>,
}

impl Coupling {
    fn new(width: usize) -> Self {
        Self { values: vec![0.0; 3 * width] }
    }

    fn width(&self) -> usize {
        self.values.len() / 3
    }

    pub(crate) fn rows(&self) -> [&[f64]; 3] {
        let (first, rest) = self.values.split_at(self.width());
        let (second, third) = rest.split_at(first.len());
        [first, second, third]
    }

    fn rows_mut(&mut self) -> [&mut [f64]; 3] {
        let width = self.width();
        let (first, rest) = self.values.split_at_mut(width);
        let (second, third) = rest.split_at_mut(width);
        [first, second, third]
    }

    /// Subtracts `factor other` in the first `reach` columns.
    pub(crate) fn subtract_product(&mut self, factor: &Matrix3<f64>, other: &Self, reach: usize) {
        let factor = [0, 1, 2].map(|r| [factor[(r, 0)], factor[(r, 1)], factor[(r, 2)]]);
        subtract_product(self.rows_mut(), factor, other.rows(), reach);
    }
}

/// An eliminated pose. Back substitution: `pose = inverse (rhs - coupling shared - before pose_before - next pose_after)`.
pub(crate) struct EliminatedPose {
    pub(crate) inverse: Matrix3<f64>,
    pub(crate) coupling: Coupling,
    pub(crate) before: Matrix3<f64>,
    pub(crate) next: Matrix3<f64>,
    pub(crate) rhs: Vector3<f64>,
}

impl EliminatedPose {
    /// The predicted reduction of the cost by a step of this pose alone.
    pub(crate) fn predicted_reduction(&self) -> f64 {
        0.5 * self.rhs.dot(&(self.inverse * self.rhs))
    }
}

/// Normal equations of a pose: its own block, its coupling and its right-hand side.
pub(crate) struct PoseEquations {
    pub(crate) own: Matrix3<f64>,
    pub(crate) coupling: Coupling,
    pub(crate) rhs: Vector3<f64>,
}

impl PoseEquations {
    pub(crate) fn new(width: usize) -> Self {
        Self { own: Matrix3::zeros(), coupling: Coupling::new(width), rhs: Vector3::zeros() }
    }

    /// The number of shared parameters that it is coupled to.
    pub(crate) fn width(&self) -> usize {
        self.coupling.width()
    }

    /// Adds a bearing with this derivative by the pose, whose landmark is at `at` in the coupling.
    pub(crate) fn add_row(&mut self, row: &BearingRow, by_pose: &Vector3<f64>, at: usize, calibration_width: usize) {
        self.own += by_pose * by_pose.transpose() * row.weight;
        self.rhs -= by_pose * (row.weight * row.residual);
        for (k, values) in self.coupling.rows_mut().into_iter().enumerate() {
            let scale = by_pose[k] * row.weight;
            for (value, by) in values[..calibration_width].iter_mut().zip(&row.by_calibration) {
                *value += by * scale;
            }
            values[at] += row.by_landmark[0] * scale;
            values[at + 1] += row.by_landmark[1] * scale;
        }
    }

    /// The part of a motion in the equations of the pose that it leads to.
    pub(crate) fn after(motion: &MotionBlocks, width: usize, wheels: bool) -> Self {
        let mut at = Self::new(width);
        at.own = motion.after;
        at.rhs = motion.after_rhs;
        if wheels {
            at.add_wheels(&motion.after_wheels);
        }
        at
    }

    /// Adds the part of a motion that starts here.
    pub(crate) fn add_motion(&mut self, motion: &MotionBlocks, wheels: bool) {
        self.own += motion.before;
        self.rhs += motion.before_rhs;
        if wheels {
            self.add_wheels(&motion.before_wheels);
        }
    }

    fn add_wheels(&mut self, block: &Matrix3x2<f64>) {
        for (k, values) in self.coupling.rows_mut().into_iter().enumerate() {
            values[3] += block[(k, 0)];
            values[4] += block[(k, 1)];
        }
    }

    /// Adds equations whose coupling has the given columns of this one.
    pub(crate) fn add(&mut self, other: &Self, columns: &[usize]) {
        self.own += other.own;
        self.rhs += other.rhs;
        for (values, others) in self.coupling.rows_mut().into_iter().zip(other.coupling.rows()) {
            for (c, value) in columns.iter().zip(others) {
                values[*c] += value;
            }
        }
    }
}

/// Eliminates a pose from the equations of the next one, to which `across` couples it, and from those of the shared parameters.
/// Its coupling is zero from the column `reach` on. `None` if its block is not positive definite.
pub(crate) fn eliminate_pose(
    at: PoseEquations,
    across: Matrix3<f64>,
    damping: f64,
    next: &mut PoseEquations,
    reach: usize,
    reduced: &mut NormalEquations,
) -> Option<EliminatedPose> {
    let PoseEquations { mut own, coupling, rhs } = at;
    for k in 0..3 {
        own[(k, k)] *= 1.0 + damping;
    }
    let inverse = Cholesky::new(own)?.inverse();
    let height = reduced.information.nrows();
    let factors = [0, 1, 2].map(|c| [inverse[(0, c)], inverse[(1, c)], inverse[(2, c)]]);
    subtract_outer(reduced.information.as_mut_slice(), height, factors, coupling.rows(), reach);
    let y = inverse * rhs;
    let [b0, b1, b2] = coupling.rows();
    for (c, value) in reduced.rhs.as_mut_slice()[..reach].iter_mut().enumerate() {
        *value -= b0[c] * y.x + b1[c] * y.y + b2[c] * y.z;
    }
    let onto = across.transpose() * inverse;
    next.coupling.subtract_product(&onto, &coupling, reach);
    next.own -= onto * across;
    next.rhs -= onto * rhs;
    Some(EliminatedPose { inverse, coupling, before: Matrix3::zeros(), next: across, rhs })
}

vectorised! {
    /// `into -= factor coupling` in the first `reach` columns.
    fn subtract_product(into: [&mut [f64]; 3], factor: [[f64; 3]; 3], coupling: [&[f64]; 3], reach: usize) {
        let [b0, b1, b2] = coupling.map(|b| &b[..reach]);
        for (values, [a, b, d]) in into.into_iter().zip(factor) {
            for (((value, b0), b1), b2) in values[..reach].iter_mut().zip(b0).zip(b1).zip(b2) {
                *value -= a * b0 + b * b1 + d * b2;
            }
        }
    }
}

vectorised! {
    /// `information -= coupling^T inverse coupling` in the upper triangle of the first `reach` rows and columns of a matrix with
    /// columns of this height.
    fn subtract_outer(information: &mut [f64], height: usize, inverse: [[f64; 3]; 3], coupling: [&[f64]; 3], reach: usize) {
        let [b0, b1, b2] = coupling.map(|b| &b[..reach]);
        let [f0, f1, f2] = inverse;
        for (c, column) in information.chunks_exact_mut(height).take(reach).enumerate() {
            let (x, y, z) = (b0[c], b1[c], b2[c]);
            if x == 0.0 && y == 0.0 && z == 0.0 {
                continue;
            }
            let p = f0[0] * x + f1[0] * y + f2[0] * z;
            let q = f0[1] * x + f1[1] * y + f2[1] * z;
            let r = f0[2] * x + f1[2] * y + f2[2] * z;
            for (((value, b0), b1), b2) in column[..=c].iter_mut().zip(b0).zip(b1).zip(b2) {
                *value -= b0 * p + b1 * q + b2 * r;
            }
        }
    }
}

/// The normal equations of a pose and the shared parameters together.
pub(crate) fn join(pose: &PoseEquations, shared: &NormalEquations) -> NormalEquations {
    let width = shared.rhs.len();
    let mut whole = NormalEquations::zeros(width + 3);
    let information = &mut whole.information;
    information.view_mut((3, 3), (width, width)).copy_from(&shared.information);
    information.fixed_view_mut::<3, 3>(0, 0).copy_from(&pose.own);
    for (k, values) in pose.coupling.rows().into_iter().enumerate() {
        for (c, value) in values.iter().enumerate() {
            information[(k, 3 + c)] = *value;
            information[(3 + c, k)] = *value;
        }
    }
    whole.rhs.rows_mut(3, width).copy_from(&shared.rhs);
    whole.rhs.fixed_rows_mut::<3>(0).copy_from(&pose.rhs);
    whole
}
