//! How far the wheels, the clock and the image centre are from what is assumed, by the score of the solution with each of them free.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, FreeParameters};
use crate::selfcalib::model::{BearingLoss, OUTLIER_SIGMAS};

/// What is assumed and may be otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Assumed {
    Imbalance,
    WheelBase,
    TimeOffset,
    Centre,
}

/// What one of them would be if it were free.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Deviation {
    pub(crate) of: Assumed,
    /// How far it is off: of the wheel base the logarithm, of the centre the distance.
    pub(crate) value: f64,
    /// The same in standard deviations.
    pub(crate) sigmas: f64,
    /// How far the mounting would move, in its standard deviations.
    pub(crate) shift: f64,
}

impl BundleProblem {
    /// The deviations of the imbalance, of the logarithm of the wheel base, of the time offset and of the image centre from what is
    /// assumed, each as if it alone were free too; none of what is free anyway. `covariance` is that of the mounting.
    ///
    /// Of the time offset it is the more significant one of early and of late bearings.
    pub(crate) fn deviations(&self, covariance: &Matrix3<f64>) -> Vec<Deviation> {
        let mut problem = self.with_free(FreeParameters::ALL);
        problem.as_wheels_read = !self.free.offset;
        // What outliers pull is no deviation.
        problem.loss = BearingLoss::Truncated(OUTLIER_SIGMAS);
        let mut found = self.deviations_of(&problem, covariance);
        if !self.free.offset {
            problem.late = true;
            let late = self.deviations_of(&problem, covariance).into_iter();
            found.extend(late.filter(|deviation| deviation.of == Assumed::TimeOffset));
        }
        found
    }

    /// The deviations where `problem` is this one with everything free.
    fn deviations_of(&self, problem: &Self, covariance: &Matrix3<f64>) -> Vec<Deviation> {
        let Some(system) = problem.eliminate_poses(self.keyframes.len() - 1, false, 0.0) else { return Vec::new() };
        let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        let (offset, centre) = (problem.free.offset_at(), problem.free.centre_at());
        let all = [
            (Assumed::Imbalance, 3..4, self.free.wheels),
            (Assumed::WheelBase, 4..5, self.free.wheels),
            (Assumed::TimeOffset, offset..offset + 1, self.free.offset),
            (Assumed::Centre, centre..centre + 2, self.free.centre),
        ];
        let one = |k: usize| {
            let (of, own, is_free) = &all[k];
            let others = all.iter().enumerate().filter(|(other, (_, _, is_free))| *other != k && !is_free);
            let drop: Vec<usize> = others.flat_map(|(_, (_, columns, _))| columns.clone()).collect();
            let at = own.start - drop.iter().filter(|column| **column < own.start).count();
            let left = system.equations.information.clone().remove_rows_at(&drop).remove_columns_at(&drop);
            let factor = (!is_free).then(|| CholeskyFactor::regularised(left)).flatten()?;
            let step = factor.solve(&system.equations.rhs.clone().remove_rows_at(&drop))?;
            let mut variances = DMatrix::zeros(own.len(), own.len());
            for column in 0..own.len() {
                let mut unit = DVector::zeros(step.len());
                unit[at + column] = 1.0;
                variances.set_column(column, &factor.solve(&unit)?.rows(at, own.len()));
            }
            let value = step.rows(at, own.len()).into_owned();
            let sigmas = value.dot(&(variances.try_inverse()? * &value)).max(0.0).sqrt();
            let moved: Vector3<f64> = step.fixed_rows::<3>(0).into();
            let shift = moved.dot(&(information * moved)).max(0.0).sqrt();
            Some(Deviation { of: *of, value: if value.len() == 1 { value[0] } else { value.norm() }, sigmas, shift })
        };
        (0..all.len()).filter_map(one).collect()
    }
}
