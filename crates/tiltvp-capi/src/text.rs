//! Options in TOML: the caller's text to the core's options, none of which is named here; and sentences in fixed room.

use std::ffi::c_char;

use tiltvp_core::options::{Options, Value};

use crate::border::{Failure, Outcome, Status};

/// The most bytes of a text in TOML: what the Python package takes.
pub(crate) const LARGEST_TOML_BYTES: usize = 200_000;

/// Bytes of the room for a sentence of a result, with the zero at its end.
pub const TILTVP_REASON_BYTES: usize = 512;

/// The keys and values of a text in TOML.
pub(crate) fn table(text: &str, status: Status) -> Outcome<toml::Table> {
    if text.len() > LARGEST_TOML_BYTES {
        return Err(Failure(status, format!("{} bytes of TOML, expected at most {LARGEST_TOML_BYTES}", text.len())));
    }
    text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        Failure(status, format!("line {line}: {}, expected TOML", error.message()))
    })
}

/// Options with the caller's values, of which the text may be none. `of_method` makes the defaults of a method, or of none.
pub(crate) fn options<T: Options>(
    text: Option<&str>,
    of_method: impl FnOnce(Option<&str>) -> tiltvp_core::Result<T>,
) -> Outcome<T> {
    let wrong = |Failure(status, why)| Failure(status, format!("options: {why}"));
    let mut given = table(text.unwrap_or_default(), Status::InvalidOption).map_err(wrong)?;
    let method = given.remove("method").map(value);
    let mut options = match &method {
        Some(Value::Text(name)) => of_method(Some(name))?,
        Some(other) => return Err(tiltvp_core::Error::option("method", other, "a text").into()),
        None => of_method(None)?,
    };
    options.set_all(given.into_iter().map(|(name, one)| (name, value(one))).collect())?;
    Ok(options)
}

/// A value of TOML as plain data; what no option can be keeps only its look.
pub(crate) fn value(given: toml::Value) -> Value {
    match given {
        toml::Value::Boolean(truth) => Value::Bool(truth),
        toml::Value::Integer(whole) => Value::Int(whole.into()),
        toml::Value::Float(number) => Value::Float(number),
        toml::Value::String(word) => Value::Text(word),
        toml::Value::Array(ref rows) => array(rows).unwrap_or_else(|| Value::Other(given.to_string())),
        other => Value::Other(other.to_string()),
    }
}

/// Numbers, or rows of as many numbers each.
fn array(rows: &[toml::Value]) -> Option<Value> {
    if let Some(numbers) = rows.iter().map(number).collect::<Option<Vec<f64>>>() {
        return Some(Value::Array(vec![numbers.len()], numbers));
    }
    let rows: Vec<&Vec<toml::Value>> = rows.iter().map(toml::Value::as_array).collect::<Option<_>>()?;
    let columns = rows.first()?.len();
    let numbers = rows.iter().copied().flatten().map(number).collect::<Option<Vec<f64>>>()?;
    rows.iter().all(|row| row.len() == columns).then(|| Value::Array(vec![rows.len(), columns], numbers))
}

/// A number, whole or not.
pub(crate) fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// A sentence in room of the caller's: cut where it is too long.
pub(crate) fn sentence(text: &str) -> [c_char; TILTVP_REASON_BYTES] {
    let mut end = text.len().min(TILTVP_REASON_BYTES - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut room = [0; TILTVP_REASON_BYTES];
    for (place, byte) in room.iter_mut().zip(text.as_bytes()[..end].iter().filter(|byte| **byte != 0)) {
        *place = c_char::from_ne_bytes([*byte]);
    }
    room
}

#[cfg(test)]
mod tests {
    use tiltvp_core::selfcalib::SelfCalibratorOptions;
    use tiltvp_core::tilt::TiltOptions;

    use super::*;

    fn tilt(text: &str) -> Outcome<TiltOptions> {
        options(Some(text), |method| method.map_or_else(|| Ok(TiltOptions::default()), TiltOptions::for_method))
    }

    #[test]
    fn options_come_by_name_and_the_method_with_its_own() {
        let found = tilt("gradient_min = 20\nmethod = 'vector-consensus'\nseed = 7\ntilt_max_rad = 0.2").unwrap();
        assert_eq!((found.method.name(), found.seed, found.tilt_max_rad), ("vector-consensus", 7, Some(0.2)));
        assert_eq!(found.edges.gradient_min, 20.0);
        assert_eq!(options(None, |_| Ok(TiltOptions::default())).unwrap(), TiltOptions::default());
    }

    #[test]
    fn arrays_are_numbers_or_rows_of_them() {
        let text = "start = [0.1, 0, -1]\nstart_sigma = [[1, 0, 0], [0, 1, 0.5], [0, 0.5, 1]]";
        let found = options(Some(text), |_| Ok(SelfCalibratorOptions::default())).unwrap();
        assert_eq!((found.start.x_m, found.start.yaw_rad), (0.1, -1.0));
        assert_eq!(found.start_covariance[(1, 2)], 0.5);
        assert!(matches!(value(toml::Value::try_from(vec![vec![1], vec![1, 2]]).unwrap()), Value::Other(_)));
    }

    #[test]
    fn what_is_no_option_is_refused_in_words() {
        for (text, expected) in [
            ("gradient_mim = 3", "did you mean gradient_min?"),
            ("method = 'best'", "option method = \"best\", expected \"refined\", "),
            ("method = 3", "option method = 3, expected a text"),
            ("seed = [1, 'a']", "option seed = [1, \"a\"], expected a whole number"),
            ("seed = 1\nseed = 2", "options: line 2: duplicate key, expected TOML"),
            ("mask = 'robot.png'", "expected a (H, W) array of bool"),
        ] {
            let Failure(status, why) = tilt(text).unwrap_err();
            assert_eq!(status, Status::InvalidOption);
            assert!(why.contains(expected), "{why}");
        }
        let long = format!("seed = 1 #{}", " ".repeat(LARGEST_TOML_BYTES));
        assert!(tilt(&long).unwrap_err().1.contains("bytes of TOML, expected at most 200000"));
        let deep = "a = ".to_owned() + &"[".repeat(100_000);
        assert!(tilt(&deep).unwrap_err().1.contains("expected TOML"));
    }

    #[test]
    fn sentences_are_cut_between_letters() {
        let room = sentence(&"ä".repeat(400));
        let bytes: Vec<u8> = room.iter().map(|byte| *byte as u8).take_while(|byte| *byte != 0).collect();
        assert_eq!(String::from_utf8(bytes).unwrap().chars().count(), (TILTVP_REASON_BYTES - 1) / 2);
        assert_eq!(room[TILTVP_REASON_BYTES - 1], 0);
    }
}
