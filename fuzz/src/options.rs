//! Options of any values under any names: refused by name, or told again as they were taken, and used.
//!
//! To tell options takes ten times what it takes to set one, and tables a thousand times: few executions do.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use nalgebra::Matrix3;
use tiltvp_core::Error;
use tiltvp_core::camera::Camera;
use tiltvp_core::corner::{CornerDetector, CornerPoseEstimator, DetectorOptions, EstimatorOptions};
use tiltvp_core::filter::ComplementaryFilter;
use tiltvp_core::lines::{LineExtractor, LineMethod, LineOptions, LineTracker, MatchOptions};
use tiltvp_core::options::{Field, Kind, Options, Value};
use tiltvp_core::segments::{SegmentDetector, SegmentDetectorOptions};
use tiltvp_core::selfcalib::{LogOptions, SelfCalibrator};
use tiltvp_core::tilt::{CommonDirectionOptions, METHODS, TiltEstimator, TiltFilter, TiltOptions};

use crate::bytes::Bytes;
use crate::image::estimate;
use crate::picture::{Picture, SMALL};

/// The options of one class, some of them set, and an object made of them.
pub fn options(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let kind = bytes.below(11);
    let choice = bytes.below(METHODS.len());
    let makes = bytes.byte() < 8;
    let camera = &SMALL[bytes.below(SMALL.len())];
    let bytes = &mut bytes;
    match kind {
        0 => {
            let mut given = TiltOptions::for_method(METHODS[choice]).expect("one of the methods");
            if set(&mut given, bytes) && makes {
                tilt(camera, given, bytes);
            }
        }
        1 => {
            let names = LineMethod::NAMES;
            let mut given = LineOptions::for_method(names[choice % names.len()]).expect("one of the methods");
            if set(&mut given, bytes) && makes {
                refusal(LineExtractor::new(camera.clone(), Matrix3::identity(), given));
            }
        }
        2 => {
            let names = ["coloured", "general", "paper"];
            let mut given = DetectorOptions::for_method(names[choice % 3]).expect("one of the methods");
            if set(&mut given, bytes) && makes {
                refusal(CornerDetector::new(camera.clone(), given, None));
            }
        }
        3 => {
            let mut given = SegmentDetectorOptions::default();
            if set(&mut given, bytes) && makes {
                refusal(SegmentDetector::new(camera.clone(), given));
            }
        }
        4 => made(bytes, SelfCalibrator::new),
        5 => made(bytes, TiltFilter::new),
        6 => made(bytes, LineTracker::new),
        7 => made(bytes, |given| ComplementaryFilter::new(given, &Matrix3::identity())),
        8 => {
            let mut given = EstimatorOptions::default();
            if set(&mut given, bytes) && makes {
                let detector = CornerDetector::new(camera.clone(), DetectorOptions::default(), None);
                refusal(detector.and_then(|detector| CornerPoseEstimator::new(detector, None, given)));
            }
        }
        9 => _ = (set(&mut LogOptions::default(), bytes), set(&mut MatchOptions::default(), bytes)),
        _ => _ = set(&mut CommonDirectionOptions::default(), bytes),
    }
}

thread_local! {
    /// The options of a class and its method, as they are before any is set: to list them takes a hundred times what it takes to set one.
    static FIELDS: RefCell<HashMap<(&'static str, Option<&'static str>), Rc<[Field]>>> = RefCell::default();
}

/// Sets some options; whether all were accepted.
fn set<O: Options + Clone + PartialEq + std::fmt::Debug>(options: &mut O, bytes: &mut Bytes<'_>) -> bool {
    let class = (std::any::type_name::<O>(), options.method());
    let fields = FIELDS.with_borrow_mut(|kept| kept.entry(class).or_insert_with(|| options.fields().into()).clone());
    for _ in 0..=bytes.byte() % 4 {
        let field = &fields[bytes.below(fields.len())];
        let (mut name, value) = (field.name.to_string(), value(&field.kind, bytes));
        if bytes.byte() > 250 {
            name.insert(0, char::from(bytes.byte() % 128));
        }
        match options.set(&name, &value) {
            Ok(()) => {}
            Err(error) => {
                assert!(matches!(error, Error::InvalidOption { .. } | Error::UnknownOption { .. }), "{error}");
                assert!(error.to_string().contains(&name), "{error} of {name}");
                return false;
            }
        }
    }
    if refusal(options.validate()).is_none() {
        return false;
    }
    if !bytes.byte().is_multiple_of(16) {
        return true;
    }
    let mut again = options.clone();
    let told = options.fields().into_iter().map(|field| (field.name.into_owned(), field.value)).collect();
    again.set_all(told).expect("what options tell they take");
    assert!(again == *options, "{again:?} told by {options:?}");
    true
}

/// Mostly of the right kind.
fn value(kind: &Kind, bytes: &mut Bytes<'_>) -> Value {
    if bytes.byte() > 240 {
        return match bytes.below(6) {
            0 => Value::None,
            1 => Value::Bool(bytes.flag()),
            2 => Value::Int(i128::from(bytes.long()) - i128::from(bytes.long())),
            3 => Value::Text(String::from_utf8_lossy(&bytes.long().to_le_bytes()).into_owned()),
            4 => Value::Array(vec![2, 2], (0..4).map(|_| bytes.number()).collect()),
            _ => Value::Mask(vec![1, 3], vec![true, false, bytes.flag()].into()),
        };
    }
    match kind {
        Kind::Bool => Value::Bool(bytes.flag()),
        Kind::Int(_) if bytes.flag() => Value::Int(i128::from(bytes.byte())),
        Kind::Int(_) => Value::Int(i128::from(bytes.long() >> bytes.below(64)) - i128::from(bytes.byte() / 250)),
        Kind::Float => Value::Float(bytes.number()),
        Kind::Word(words) => Value::Text(words[bytes.below(words.len())].to_owned()),
        Kind::Array(shape) => {
            let shape: Vec<_> = shape.iter().map(|n| if *n == 0 { bytes.below(9) } else { *n }).collect();
            let numbers = (0..shape.iter().product()).map(|_| bytes.number()).collect();
            Value::Array(shape, numbers)
        }
        Kind::Maybe(_) if bytes.byte() > 200 => Value::None,
        Kind::Maybe(kind) => value(kind, bytes),
        Kind::Object(_) if bytes.flag() => Value::Float(bytes.number()),
        _ => Value::Text("closed-form".to_owned()),
    }
}

/// The answer, if it is no refusal, of which every one has a name and words.
fn refusal<T>(made: tiltvp_core::Result<T>) -> Option<T> {
    match made {
        Ok(made) => Some(made),
        Err(error) => {
            let words = error.to_string();
            assert!(words.len() < 10_000 && words.contains("expected"), "{words}");
            None
        }
    }
}

/// A filter of options.
fn made<O, T>(bytes: &mut Bytes<'_>, new: impl Fn(O) -> tiltvp_core::Result<T>)
where
    O: Options + Default + Clone + PartialEq + std::fmt::Debug,
{
    let mut given = O::default();
    if set(&mut given, bytes) {
        refusal(new(given));
    }
}

fn tilt(camera: &Camera, given: TiltOptions, bytes: &mut Bytes<'_>) {
    let Some(estimator) = refusal(TiltEstimator::new(camera.clone(), Matrix3::identity(), given)) else { return };
    let picture = Picture::of(camera, 1, bytes);
    let found = estimator.estimate(&picture.view(), &mut estimator.scratch()).expect("an image of the camera");
    estimate(&found, estimator.region_pixels());
}
