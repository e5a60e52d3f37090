//! Options of the sampling loop beyond the paper's: the order of samples, local optimisation, score and verification.

use crate::error::{Error, Result};

/// How samples are drawn, improved, scored and verified. The default is plain RANSAC, as paper 000 uses it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sampling {
    /// From which observations samples are drawn. Default uniformly from all.
    pub order: SampleOrder,
    /// Whether each new best model is improved before the next sample. Default no.
    pub local_optimization: Option<LocalOptimization>,
    /// What makes one model better than another. Default its number of inliers.
    pub score: Score,
    /// Whether a model is scored at once or has to pass a test first. Default at once.
    pub verification: Verification,
}

/// From which observations samples are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SampleOrder {
    /// From all, alike.
    #[default]
    Uniform,
    /// From a pool of the best observations by [`Problem::quality`](super::Problem::quality) that grows with the trials, as
    /// PROSAC draws them (Chum and Matas 2005).
    Progressive {
        /// Trials after which the samples are those of uniform sampling, `T_N`. Default 200 000.
        uniform_after: u32,
        /// PROSAC's own stop, for observations whose errors are independent: sampling also ends when any beginning of the
        /// order holds enough inliers, more than this share, `beta` in (0, 1), of chance agreement explains. Default none:
        /// edge pixels repeat one another, and the few best may all lie on one wrong structure.
        chance_share: Option<f64>,
    },
}

/// Iterated least squares on the consensus set of each new best model: LO-RANSAC (Chum, Matas and Kittler 2003, their
/// method 3) with the falling threshold and the limits of Lebeda, Matas and Chum 2012.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalOptimization {
    /// Least-squares fits for each new best model. Default 4.
    pub iterations: u32,
    /// Factor on the threshold in the first of them, from which it falls to 1 in the last. Default 2.
    pub widening: f64,
}

/// What makes one model better than another. Every score is a sum over observations of a gain between 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Score {
    /// The number of inliers.
    #[default]
    Count,
    /// MSAC (Torr and Zisserman 2000), the truncated quadratic: inliers gain `1 - r^2 / threshold^2`.
    Msac,
    /// MAGSAC++ (Barath et al. 2020) for residuals of one degree of freedom: the gain is marginalised over noise of any
    /// scale from zero to the one of which 99 % lies within the threshold.
    Magsac {
        /// Most rounds of sigma-consensus++, which refits the best model with the marginal weights; with 0 it is refitted
        /// to its consensus set, as with the other scores. Default 10.
        refits: u32,
    },
}

/// Whether a model is scored at once or has to pass a test first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Verification {
    /// Every model is scored.
    #[default]
    Full,
    /// Wald's sequential probability ratio test on observations in random order (Matas and Chum 2005): a model is given up
    /// as soon as it is likely to be a bad one. The shares are first guesses: the loop raises the one and learns the other.
    Sprt {
        /// Least share of observations that agree with a good model, `epsilon`, in (0, 1). Default 0.1.
        inlier_share: f64,
        /// Share that agrees with a bad one, `delta`, in (0, 1) and below `inlier_share`. Default 0.05.
        chance_share: f64,
        /// Time of drawing and fitting a sample, in verifications of one observation, `t_M`. Default 100.
        model_cost: f64,
    },
}

impl SampleOrder {
    /// The samples of PROSAC, stopped as uniform ones are.
    pub fn progressive() -> Self {
        Self::Progressive { uniform_after: 200_000, chance_share: None }
    }

    /// PROSAC with its own stop and the constants of its authors.
    pub fn prosac() -> Self {
        Self::Progressive { uniform_after: 200_000, chance_share: Some(0.05) }
    }
}

impl Default for LocalOptimization {
    fn default() -> Self {
        Self { iterations: 4, widening: 2.0 }
    }
}

impl Score {
    /// MAGSAC++ with its final refits.
    pub fn magsac() -> Self {
        Self::Magsac { refits: 10 }
    }
}

impl Verification {
    /// The sequential test with its usual first guesses.
    pub fn sprt() -> Self {
        Self::Sprt { inlier_share: 0.1, chance_share: 0.05, model_cost: 100.0 }
    }
}

impl Sampling {
    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] with the name of the field.
    pub fn validate(&self) -> Result<()> {
        let share = |name, value: f64| {
            let valid = value > 0.0 && value < 1.0;
            if valid { Ok(()) } else { Err(Error::option(name, value, "a share strictly between 0 and 1")) }
        };
        if let SampleOrder::Progressive { uniform_after, chance_share } = self.order {
            if uniform_after == 0 {
                return Err(Error::option("uniform_after", uniform_after, "at least 1"));
            }
            chance_share.map_or(Ok(()), |value| share("chance_share", value))?;
        }
        if let Some(LocalOptimization { iterations, widening }) = self.local_optimization {
            if !(1..=1000).contains(&iterations) {
                return Err(Error::option("iterations", iterations, "from 1 to 1000"));
            }
            if !(widening >= 1.0 && widening.is_finite()) {
                return Err(Error::option("widening", widening, "a factor of at least 1"));
            }
        }
        if let Score::Magsac { refits } = self.score
            && refits > 1000
        {
            return Err(Error::option("refits", refits, "at most 1000"));
        }
        if let Verification::Sprt { inlier_share, chance_share, model_cost } = self.verification {
            share("inlier_share", inlier_share)?;
            share("chance_share", chance_share)?;
            if chance_share >= inlier_share {
                return Err(Error::option("chance_share", chance_share, "a share below inlier_share"));
            }
            if !(model_cost > 0.0 && model_cost.is_finite()) {
                return Err(Error::option("model_cost", model_cost, "a positive number of verifications"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_values_are_refused_by_name() {
        let order = |uniform_after, chance_share| Sampling {
            order: SampleOrder::Progressive { uniform_after, chance_share: Some(chance_share) },
            ..Sampling::default()
        };
        let local = |iterations, widening| Sampling {
            local_optimization: Some(LocalOptimization { iterations, widening }),
            ..Sampling::default()
        };
        let sprt = |inlier_share, chance_share, model_cost| Sampling {
            verification: Verification::Sprt { inlier_share, chance_share, model_cost },
            ..Sampling::default()
        };
        for (name, sampling) in [
            ("uniform_after", order(0, 0.05)),
            ("chance_share", order(10, 0.0)),
            ("iterations", local(0, 2.0)),
            ("widening", local(4, 0.9)),
            ("widening", local(4, f64::NAN)),
            ("refits", Sampling { score: Score::Magsac { refits: 1001 }, ..Sampling::default() }),
            ("inlier_share", sprt(1.0, 0.05, 100.0)),
            ("chance_share", sprt(0.1, f64::NAN, 100.0)),
            ("chance_share", sprt(0.1, 0.1, 100.0)),
            ("model_cost", sprt(0.1, 0.05, 0.0)),
        ] {
            let error = sampling.validate().unwrap_err().to_string();
            assert!(error.contains(name), "{name}: {error}");
        }
        let all = Sampling {
            order: SampleOrder::prosac(),
            local_optimization: Some(LocalOptimization::default()),
            score: Score::magsac(),
            verification: Verification::sprt(),
        };
        all.validate().unwrap();
        Sampling::default().validate().unwrap();
    }
}
