//! Any values for any options: what is accepted is told again as it was given, and what is told is accepted.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use tiltvp_core::corner::{CornerMethod, DetectorOptions, EstimatorOptions};
use tiltvp_core::filter::ComplementaryOptions;
use tiltvp_core::lines::{LineMethod, LineOptions, MatchOptions, TrackerOptions};
use tiltvp_core::options::{Options, Value};
use tiltvp_core::segments::SegmentDetectorOptions;
use tiltvp_core::selfcalib::{LogOptions, SelfCalibratorOptions};
use tiltvp_core::tilt::{CommonDirectionOptions, METHODS, TiltFilterOptions, TiltOptions};
use tiltvp_fuzz::{Choice, set};

#[derive(Debug, Arbitrary)]
struct Input {
    of: u8,
    method: u8,
    choices: Vec<Choice>,
    /// A name that there may be.
    name: String,
}

fn check<T: Options + Default>(mut options: T, input: &Input, fresh: impl FnOnce() -> T) {
    set(&mut options, &input.choices);
    let _ = options.set(&input.name, &Value::Float(1.0));
    let told: Vec<(String, Value)> =
        options.fields().into_iter().map(|field| (field.name.into_owned(), field.value)).collect();
    if options.validate().is_err() {
        return;
    }
    let mut again = fresh();
    assert_eq!(again.set_all(told.clone()), Ok(()), "what is told is refused");
    assert_eq!(again.validate(), Ok(()));
    for (name, value) in told {
        assert_eq!(again.get(&name).as_ref(), Some(&value), "{name} is told otherwise");
    }
}

fuzz_target!(|input: Input| {
    let method = |names: &[&'static str]| names[usize::from(input.method) % names.len()];
    match input.of % 10 {
        0 => {
            let fresh = || TiltOptions::for_method(method(&METHODS)).unwrap_or_default();
            check(fresh(), &input, fresh);
        }
        1 => {
            let fresh = || LineOptions::for_method(method(LineMethod::NAMES)).unwrap_or_default();
            check(fresh(), &input, fresh);
        }
        2 => {
            let fresh = || DetectorOptions::for_method(method(CornerMethod::NAMES)).unwrap_or_default();
            check(fresh(), &input, fresh);
        }
        3 => check(EstimatorOptions::default(), &input, EstimatorOptions::default),
        4 => check(SegmentDetectorOptions::default(), &input, SegmentDetectorOptions::default),
        5 => check(SelfCalibratorOptions::default(), &input, SelfCalibratorOptions::default),
        6 => check(LogOptions::default(), &input, LogOptions::default),
        7 => check(TiltFilterOptions::default(), &input, TiltFilterOptions::default),
        8 => {
            check(TrackerOptions::default(), &input, TrackerOptions::default);
            check(MatchOptions::default(), &input, MatchOptions::default);
        }
        _ => {
            check(CommonDirectionOptions::default(), &input, CommonDirectionOptions::default);
            check(ComplementaryOptions::default(), &input, ComplementaryOptions::default);
        }
    }
});
