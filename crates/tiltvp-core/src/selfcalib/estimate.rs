//! `MountingEstimate`: the mounting as it is known, its covariance, and whether it can be relied upon.

use std::fmt;

use nalgebra::Matrix3;

use super::diagnosis::{Contradictions, Deviation, Suspect};
use super::model::Mounting;
use super::observability::Observability;

/// The mounting as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingEstimate {
    /// The mounting; not finite if the method "paper" has diverged beyond numbers.
    pub mounting: Mounting,
    /// Covariance of (x, y, yaw).
    pub covariance_xy_yaw: Matrix3<f64>,
    /// Covariance of (phi, rho, psi); infinite at rho = 0.
    pub covariance_phi_rho_psi: Matrix3<f64>,
    /// What the drive so far has determined.
    pub observability: Observability,
    /// Mean normalised innovation squared per bearing over the last steps, 1 if all is as assumed; `None` before the
    /// first.
    pub mean_nis: Option<f64>,
    /// Whether the innovations of some steps in a row were ever too large: the mount was bumped, or an assumption is wrong.
    pub alarm: bool,
    /// How many motions and turns of the odometry the bearings contradict.
    pub contradictions: Contradictions,
    /// What is most likely wrong where the log does not fit.
    pub suspect: Option<Suspect>,
}

impl MountingEstimate {
    /// From the mounting and its covariance, and the covariance at the start.
    pub(crate) fn new(
        mounting: Mounting,
        covariance_xy_yaw: Matrix3<f64>,
        start: &Matrix3<f64>,
        mean_nis: Option<f64>,
        alarm: bool,
    ) -> Self {
        let j = mounting.polar_by_vector();
        let polar = j * covariance_xy_yaw * j.transpose();
        let finite = polar.iter().all(|x| x.is_finite());
        Self {
            mounting,
            covariance_xy_yaw,
            covariance_phi_rho_psi: if finite { polar } else { Matrix3::from_diagonal_element(f64::INFINITY) },
            observability: Observability::new(&mounting, &covariance_xy_yaw, start),
            mean_nis,
            alarm,
            contradictions: Contradictions::default(),
            suspect: None,
        }
    }

    /// This estimate with what its solution says of the log.
    pub(crate) fn judged(self, contradictions: Contradictions, suspect: Option<Suspect>) -> Self {
        Self { contradictions, suspect, ..self }
    }

    /// This estimate with what is doubted of the camera suspect, where its doubt alone is why not everything is determined: with the
    /// covariance `known` of one as told, and that at the start, everything is.
    pub(crate) fn doubting(
        self,
        doubted: Option<&Deviation>,
        known: impl FnOnce() -> Matrix3<f64>,
        start: &Matrix3<f64>,
    ) -> Self {
        let determined = || Observability::new(&self.mounting, &known(), start).complete();
        match doubted {
            Some(doubted) if self.suspect.is_none() && !self.observability.complete() && determined() => {
                Self { suspect: doubted.of_camera(), ..self }
            }
            _ => self,
        }
    }

    /// Whether the estimate can be relied upon: everything determined, no alarm, nothing suspected, finite.
    pub fn reliable(&self) -> bool {
        self.observability.complete()
            && !self.alarm
            && self.suspect.is_none()
            && self.mounting.vector().iter().all(|x| x.is_finite())
    }
}

/// A sentence: whether the estimate can be relied upon, what is determined, and whether there was an alarm.
impl fmt::Display for MountingEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.mounting.vector().iter().all(|x| x.is_finite()) {
            return write!(f, "the filter has diverged");
        }
        if !self.reliable() {
            write!(f, "not to be relied upon; ")?;
        }
        write!(f, "{}", self.observability)?;
        if self.alarm {
            write!(f, "; alarm: bearings disagree with the mounting, as after a bump (calibrate anew)")?;
        }
        if let Some(suspect) = self.suspect {
            write!(f, "; {suspect}")?;
        }
        let Contradictions { motions, contradicted_motions, turns, contradicted_turns } = self.contradictions;
        if contradicted_motions + contradicted_turns > 0 {
            write!(
                f,
                "; {contradicted_motions} of {motions} motions and {contradicted_turns} of {turns} turns contradicted"
            )?;
        }
        Ok(())
    }
}
