//! Options of the sampling loop: the order of samples, local optimisation and score.

use crate::error::{Error, Result};
use crate::options::{Kind, OptionValue, Value};
use crate::{options, words};

options! {
    /// How samples are drawn, improved and scored. The default is plain RANSAC, as Fleer 2017 uses it.
    #[derive(Copy)]
    pub struct Sampling {
        /// From which observations samples are drawn: "uniform" from all alike, "progressive" from a growing pool of the best,
        /// the strongest edge pixels (PROSAC, Chum and Matas 2005).
        [as "sampling"] order: SampleOrder = SampleOrder::Uniform;
        /// Whether each new best model is improved by least squares before the next sample (LO-RANSAC, Chum, Matas and Kittler
        /// 2003).
        local_optimization: Option<LocalOptimization> = None;
        /// What makes one model better than another: the "count" of inliers, or the truncated squares of "msac" (Torr and
        /// Zisserman 2000).
        score: Score = Score::Count;
    }
    check numbers_are_possible
}

/// From which observations samples are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SampleOrder {
    /// From all, alike.
    #[default]
    Uniform,
    /// From a pool of the best observations by [`Problem::quality`](super::Problem::quality) that grows with the trials, as
    /// PROSAC draws them (Chum and Matas 2005), but stopped as uniform sampling is: edge pixels repeat one another, and the few
    /// best may all lie on one wrong structure.
    Progressive {
        /// Trials after which the samples are those of uniform sampling, `T_N`. Default 200 000.
        uniform_after: u32,
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

words! {
    /// What makes one model better than another. Every score is a sum over observations of a gain between 0 and 1.
    #[derive(Default)]
    pub enum Score {
        /// The number of inliers.
        #[default]
        Count = "count",
        /// MSAC (Torr and Zisserman 2000), the truncated quadratic: inliers gain `1 - r^2 / threshold^2`.
        Msac = "msac",
    }
}

/// By name; the growth is that of PROSAC's authors.
impl OptionValue for SampleOrder {
    const KIND: Kind = Kind::Word(&["uniform", "progressive"]);

    fn to_value(&self) -> Value {
        Value::Text(if *self == Self::Uniform { "uniform" } else { "progressive" }.to_owned())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(word) if word == "uniform" => Some(Self::Uniform),
            Value::Text(word) if word == "progressive" => Some(Self::progressive()),
            _ => None,
        }
    }
}

/// On or off; the numbers are the defaults.
impl OptionValue for Option<LocalOptimization> {
    const KIND: Kind = bool::KIND;

    fn to_value(&self) -> Value {
        Value::Bool(self.is_some())
    }

    fn from_value(value: &Value) -> Option<Self> {
        bool::from_value(value).map(|on| on.then(LocalOptimization::default))
    }
}

impl SampleOrder {
    /// Progressive samples with the growth of PROSAC's authors.
    pub fn progressive() -> Self {
        Self::Progressive { uniform_after: 200_000 }
    }
}

impl Default for LocalOptimization {
    fn default() -> Self {
        Self { iterations: 4, widening: 2.0 }
    }
}

impl Score {
    /// The gain of one residual.
    pub fn gain(self, residual: f64, threshold: f64) -> f64 {
        let part = residual.abs() / threshold;
        match self {
            Self::Count => f64::from(u8::from(part <= 1.0)),
            Self::Msac => (1.0 - part * part).max(0.0),
        }
    }
}

fn numbers_are_possible(sampling: &Sampling) -> Result<()> {
    if let SampleOrder::Progressive { uniform_after: 0 } = sampling.order {
        return Err(Error::option("uniform_after", 0, "at least 1"));
    }
    if let Some(LocalOptimization { iterations, widening }) = sampling.local_optimization {
        if !(1..=1000).contains(&iterations) {
            return Err(Error::option("iterations", iterations, "from 1 to 1000"));
        }
        if !(widening >= 1.0 && widening.is_finite()) {
            return Err(Error::option("widening", widening, "a factor of at least 1"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_values_are_refused_by_name() {
        let order = Sampling { order: SampleOrder::Progressive { uniform_after: 0 }, ..Sampling::default() };
        let local = |iterations, widening| Sampling {
            local_optimization: Some(LocalOptimization { iterations, widening }),
            ..Sampling::default()
        };
        for (name, sampling) in [
            ("uniform_after", order),
            ("iterations", local(0, 2.0)),
            ("widening", local(4, 0.9)),
            ("widening", local(4, f64::NAN)),
        ] {
            let error = sampling.validate().unwrap_err().to_string();
            assert!(error.contains(name), "{name}: {error}");
        }
        let all = Sampling {
            order: SampleOrder::progressive(),
            local_optimization: Some(LocalOptimization::default()),
            score: Score::Msac,
        };
        all.validate().unwrap();
        Sampling::default().validate().unwrap();
    }

    #[test]
    fn gains_fall_from_one_to_nothing() {
        for score in [Score::Count, Score::Msac] {
            let gains: Vec<f64> = (0..300).map(|i| score.gain(-0.01 * f64::from(i), 2.0)).collect();
            assert!(gains[0] > 0.99 && gains.windows(2).all(|pair| pair[0] >= pair[1]), "{score:?}");
            assert!(gains[201..].iter().all(|gain| *gain == 0.0), "{score:?}");
        }
    }
}
