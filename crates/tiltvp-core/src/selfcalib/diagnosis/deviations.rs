//! How far the wheels and the clock are from what is assumed, by the score of the solution with each of them free.

use nalgebra::{Matrix3, Vector3};

use crate::selfcalib::bundle::{BundleProblem, CholeskyFactor, FreeParameters};

/// What one parameter would be if it were free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Deviation {
    /// The parameter, and its standard deviation.
    pub(crate) value: f64,
    pub(crate) sigma: f64,
    /// How far the mounting would move, in its standard deviations.
    pub(crate) shift: f64,
}

impl BundleProblem {
    /// The deviations of the imbalance, of the logarithm of the wheel base and of the time offset from what is assumed, each as
    /// if it alone were free too; `None` for what is free anyway. `covariance` is that of the mounting.
    ///
    /// Of the time offset it is the more significant one of early and of late bearings.
    pub(crate) fn deviations(&self, covariance: &Matrix3<f64>) -> [Option<Deviation>; 3] {
        let mut problem = self.with_free(FreeParameters { wheels: true, offset: true });
        problem.as_wheels_read = !self.free.offset;
        let early = self.deviations_of(&problem, covariance);
        if self.free.offset {
            return early;
        }
        problem.late = true;
        let late = self.deviations_of(&problem, covariance);
        let sigmas = |deviation: &Deviation| deviation.value.abs() / deviation.sigma;
        let offset = [early[2], late[2]].into_iter().flatten().max_by(|a, b| sigmas(a).total_cmp(&sigmas(b)));
        [early[0], early[1], offset]
    }

    /// The deviations where `problem` is this one with everything free.
    fn deviations_of(&self, problem: &Self, covariance: &Matrix3<f64>) -> [Option<Deviation>; 3] {
        let Some(system) = problem.eliminate_poses(self.keyframes.len() - 1, false, 0.0) else { return [None; 3] };
        let asked = [self.free.wheels, self.free.wheels, self.free.offset];
        let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        std::array::from_fn(|k| {
            let drop: Vec<usize> =
                (0..3).filter(|other| *other != k && !asked[*other]).map(|other| 3 + other).collect();
            let at = 3 + (0..k).filter(|other| asked[*other]).count();
            let left = system.equations.information.clone().remove_rows_at(&drop).remove_columns_at(&drop);
            let factor = (!asked[k]).then(|| CholeskyFactor::regularised(left)).flatten()?;
            let step = factor.solve(&system.equations.rhs.clone().remove_rows_at(&drop))?;
            let mut unit = step.clone();
            unit.fill(0.0);
            unit[at] = 1.0;
            let variance = factor.solve(&unit)?[at];
            let moved: Vector3<f64> = step.fixed_rows::<3>(0).into();
            let shift = moved.dot(&(information * moved)).max(0.0).sqrt();
            Some(Deviation { value: step[at], sigma: variance.max(0.0).sqrt(), shift })
        })
    }
}
