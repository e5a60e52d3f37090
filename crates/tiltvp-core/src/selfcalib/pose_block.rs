//! The normal equations of one pose, coupled to columns of the dense block and to its neighbours, and its elimination.

use multiversion::multiversion;
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix3x2, Vector3};

use super::rows::{LegBlocks, Row};

/// What couples the three numbers of a pose to the columns of a dense block: three rows, one after the other.
pub(super) struct Coupling {
    values: Vec<f64>,
}

impl Coupling {
    fn new(width: usize) -> Self {
        Self { values: vec![0.0; 3 * width] }
    }

    /// The rows.
    pub(super) fn rows(&self) -> [&[f64]; 3] {
        let (first, rest) = self.values.split_at(self.values.len() / 3);
        let (second, third) = rest.split_at(first.len());
        [first, second, third]
    }

    fn rows_mut(&mut self) -> [&mut [f64]; 3] {
        let width = self.values.len() / 3;
        let (first, rest) = self.values.split_at_mut(width);
        let (second, third) = rest.split_at_mut(width);
        [first, second, third]
    }

    /// Subtracts `factor other` in the first `reach` columns.
    pub(super) fn subtract_product(&mut self, factor: &Matrix3<f64>, other: &Self, reach: usize) {
        let factor = [0, 1, 2].map(|r| [factor[(r, 0)], factor[(r, 1)], factor[(r, 2)]]);
        subtract_product(self.rows_mut(), factor, other.rows(), reach);
    }
}

/// A pose that has been eliminated: `inverse (rhs - coupling dense - before pose_before - next pose_after)` gives it back.
pub(super) struct Link {
    pub(super) inverse: Matrix3<f64>,
    pub(super) coupling: Coupling,
    pub(super) before: Matrix3<f64>,
    pub(super) next: Matrix3<f64>,
    pub(super) rhs: Vector3<f64>,
}

impl Link {
    /// By how much the cost falls, were it quadratic, as this pose moves, all that it was eliminated from standing still.
    pub(super) fn fall(&self) -> f64 {
        0.5 * self.rhs.dot(&(self.inverse * self.rhs))
    }
}

/// Normal equations of a pose as they are gathered: its own block, its couplings, its side.
pub(super) struct Gathered {
    pub(super) own: Matrix3<f64>,
    pub(super) coupling: Coupling,
    pub(super) side: Vector3<f64>,
}

impl Gathered {
    pub(super) fn new(width: usize) -> Self {
        Self { own: Matrix3::zeros(), coupling: Coupling::new(width), side: Vector3::zeros() }
    }

    /// Adds a bearing taken here; `at` is where its landmark's columns are in the couplings.
    pub(super) fn add_row(&mut self, row: &Row, at: usize, fixed: usize) {
        self.own += row.by_pose * row.by_pose.transpose() * row.weight;
        self.side -= row.by_pose * (row.weight * row.residual);
        for (k, values) in self.coupling.rows_mut().into_iter().enumerate() {
            let scale = row.by_pose[k] * row.weight;
            for (value, by) in values[..fixed].iter_mut().zip(&row.by_fixed) {
                *value += by * scale;
            }
            values[at] += row.by_landmark[0] * scale;
            values[at + 1] += row.by_landmark[1] * scale;
        }
    }

    pub(super) fn add_wheels(&mut self, block: &Matrix3x2<f64>) {
        for (k, values) in self.coupling.rows_mut().into_iter().enumerate() {
            values[3] += block[(k, 0)];
            values[4] += block[(k, 1)];
        }
    }

    /// Adds another's couplings, whose columns are named.
    pub(super) fn add(&mut self, other: &Self, columns: &[usize]) {
        self.own += other.own;
        self.side += other.side;
        for (values, others) in self.coupling.rows_mut().into_iter().zip(other.coupling.rows()) {
            for (c, value) in columns.iter().zip(others) {
                values[*c] += value;
            }
        }
    }
}

/// Eliminates a pose from the next one, to which `across` couples it, and from the dense block, whose columns from `reach` on
/// it does not touch.
pub(super) fn eliminate_pose(
    at: Gathered,
    across: Matrix3<f64>,
    damping: f64,
    next: &mut Gathered,
    reach: usize,
    dense: &mut DMatrix<f64>,
    rhs: &mut DVector<f64>,
) -> Option<Link> {
    let Gathered { mut own, coupling, side } = at;
    for k in 0..3 {
        own[(k, k)] *= 1.0 + damping;
    }
    let inverse = Cholesky::new(own)?.inverse();
    let height = dense.nrows();
    let factors = [0, 1, 2].map(|c| [inverse[(0, c)], inverse[(1, c)], inverse[(2, c)]]);
    subtract_outer(dense.as_mut_slice(), height, factors, coupling.rows(), reach);
    let y = inverse * side;
    let [b0, b1, b2] = coupling.rows();
    for (c, value) in rhs.as_mut_slice()[..reach].iter_mut().enumerate() {
        *value -= b0[c] * y.x + b1[c] * y.y + b2[c] * y.z;
    }
    let onto = across.transpose() * inverse;
    next.coupling.subtract_product(&onto, &coupling, reach);
    next.own -= onto * across;
    next.side -= onto * side;
    Some(Link { inverse, coupling, before: Matrix3::zeros(), next: across, rhs: side })
}

/// `into -= factor coupling` in the first `reach` columns.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn subtract_product(into: [&mut [f64]; 3], factor: [[f64; 3]; 3], coupling: [&[f64]; 3], reach: usize) {
    let [b0, b1, b2] = coupling.map(|b| &b[..reach]);
    for (values, [a, b, d]) in into.into_iter().zip(factor) {
        for (((value, b0), b1), b2) in values[..reach].iter_mut().zip(b0).zip(b1).zip(b2) {
            *value -= a * b0 + b * b1 + d * b2;
        }
    }
}

/// `dense -= coupling^T inverse coupling` in the upper triangle of the first `reach` rows and columns of a matrix whose columns
/// are so high.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn subtract_outer(dense: &mut [f64], height: usize, inverse: [[f64; 3]; 3], coupling: [&[f64]; 3], reach: usize) {
    let [b0, b1, b2] = coupling.map(|b| &b[..reach]);
    let [f0, f1, f2] = inverse;
    for (c, column) in dense.chunks_exact_mut(height).take(reach).enumerate() {
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

/// The normal equations of a pose and the dense block together.
pub(super) fn joined(pose: &Gathered, dense: &DMatrix<f64>, rhs: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let width = dense.nrows();
    let mut whole = DMatrix::zeros(width + 3, width + 3);
    whole.view_mut((3, 3), (width, width)).copy_from(dense);
    whole.fixed_view_mut::<3, 3>(0, 0).copy_from(&pose.own);
    for (k, values) in pose.coupling.rows().into_iter().enumerate() {
        for (c, value) in values.iter().enumerate() {
            whole[(k, 3 + c)] = *value;
            whole[(3 + c, k)] = *value;
        }
    }
    let mut whole_rhs = DVector::zeros(width + 3);
    whole_rhs.rows_mut(3, width).copy_from(rhs);
    whole_rhs.fixed_rows_mut::<3>(0).copy_from(&pose.side);
    (whole, whole_rhs)
}

/// What a motion says of the pose that it leads to.
pub(super) fn after_leg(leg: &LegBlocks, width: usize, wheels: bool) -> Gathered {
    let mut at = Gathered::new(width);
    at.own = leg.after;
    at.side = leg.after_side;
    if wheels {
        at.add_wheels(&leg.after_wheels);
    }
    at
}
