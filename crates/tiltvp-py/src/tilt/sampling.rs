//! The options of the sampling loop by keyword: a word, or whether, for each.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use tiltvp_core::robust::{LocalOptimization, SampleOrder, Sampling, Score, Verification};

use crate::call::invalid;

/// Sets one of `sampling`, `local_optimization`, `score` and `verification`.
pub(super) fn set(sampling: &mut Sampling, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let word = value.extract::<String>().ok();
    let refused = |expected: &str| -> PyResult<()> {
        let got = value.repr().map_or_else(|_| String::new(), |text| text.to_string());
        Err(invalid(format!("option {key} = {got}, expected {expected}")))
    };
    match (key, word.as_deref()) {
        ("sampling", Some("uniform")) => sampling.order = SampleOrder::Uniform,
        ("sampling", Some("progressive")) => sampling.order = SampleOrder::progressive(),
        ("sampling", Some("prosac")) => sampling.order = SampleOrder::prosac(),
        ("sampling", _) => return refused("\"uniform\", \"progressive\" or \"prosac\""),
        ("score", Some("count")) => sampling.score = Score::Count,
        ("score", Some("msac")) => sampling.score = Score::Msac,
        ("score", Some("magsac")) => sampling.score = Score::magsac(),
        ("score", _) => return refused("\"count\", \"msac\" or \"magsac\""),
        ("verification", Some("full")) => sampling.verification = Verification::Full,
        ("verification", Some("sprt")) => sampling.verification = Verification::sprt(),
        ("verification", _) => return refused("\"full\" or \"sprt\""),
        _ => match value.extract::<bool>() {
            Ok(chosen) => sampling.local_optimization = chosen.then(LocalOptimization::default),
            Err(_) => return refused("True or False"),
        },
    }
    Ok(())
}

/// Writes the four under their names.
pub(super) fn in_force(dict: &Bound<'_, PyDict>, sampling: &Sampling) -> PyResult<()> {
    let order = match sampling.order {
        SampleOrder::Uniform => "uniform",
        SampleOrder::Progressive { chance_share: None, .. } => "progressive",
        SampleOrder::Progressive { chance_share: Some(_), .. } => "prosac",
    };
    let score = match sampling.score {
        Score::Count => "count",
        Score::Msac => "msac",
        Score::Magsac { .. } => "magsac",
    };
    let verification = match sampling.verification {
        Verification::Full => "full",
        Verification::Sprt { .. } => "sprt",
    };
    dict.set_item("sampling", order)?;
    dict.set_item("local_optimization", sampling.local_optimization.is_some())?;
    dict.set_item("score", score)?;
    dict.set_item("verification", verification)
}
