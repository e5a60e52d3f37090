//! What the targets share: options of any value, and small images.

use arbitrary::Arbitrary;
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::options::{Kind, Options, Value};

/// An option by its place, and a value for it.
#[derive(Debug, Arbitrary)]
pub struct Choice {
    place: u8,
    value: Any,
}

/// A value of the option's kind, or of any.
#[derive(Debug, Arbitrary)]
enum Any {
    Fitting(f64),
    Other(Other),
}

#[derive(Debug, Arbitrary)]
enum Other {
    None,
    Truth(bool),
    Whole(i64),
    Text(String),
    Numbers(Vec<f64>),
    Matrix(u8, u8, Vec<f64>),
    Mask(u8, u8, Vec<bool>),
}

/// Sets options one after the other; some are refused.
pub fn set(options: &mut dyn Options, choices: &[Choice]) {
    for Choice { place, value } in choices.iter().take(8) {
        let fields = options.fields();
        let Some(field) = fields.get(usize::from(*place) % fields.len().max(1)) else { return };
        let value = match value {
            Any::Fitting(number) => fitting(field.kind, *number),
            Any::Other(other) => of(other),
        };
        let _ = options.set(&field.name, &value);
    }
}

/// A value of a kind, from a number.
fn fitting(kind: Kind, number: f64) -> Value {
    match kind {
        Kind::Maybe(kind) => fitting(*kind, number),
        Kind::Bool => Value::Bool(number > 0.0),
        // Draws without end are asked for on purpose, not by a slip.
        Kind::Int(_) => Value::Int(i128::from((number.abs() % 300.0) as i64)),
        Kind::Word(words) => Value::Text(words[(number.abs() % words.len() as f64) as usize % words.len()].to_owned()),
        Kind::Array(shape) => {
            let shape: Vec<usize> = shape.iter().map(|n| if *n == 0 { 4 } else { *n }).collect();
            let count = shape.iter().product();
            Value::Array(shape, (0..count).map(|i| number / (i + 1) as f64).collect())
        }
        _ => Value::Float(number),
    }
}

fn of(other: &Other) -> Value {
    match other {
        Other::None => Value::None,
        Other::Truth(truth) => Value::Bool(*truth),
        // Above the domain of a count that is worked off, below or within that of a seed.
        Other::Whole(whole) => Value::Int(i128::from(*whole)),
        Other::Text(text) => Value::Text(text.clone()),
        Other::Numbers(numbers) => Value::Array(vec![numbers.len()], numbers.clone()),
        Other::Matrix(rows, columns, numbers) => {
            let shape = [*rows, *columns].map(|n| usize::from(n % 6)).to_vec();
            let count = shape.iter().product();
            Value::Array(shape, numbers.iter().copied().chain(std::iter::repeat(0.5)).take(count).collect())
        }
        Other::Mask(rows, columns, shows) => {
            let shape = [*rows, *columns].map(|n| usize::from(n % 70)).to_vec();
            let count = shape.iter().product();
            Value::Mask(shape, shows.iter().copied().chain(std::iter::repeat(true)).take(count).collect())
        }
    }
}

/// The same without counts that are worked off: for what is then made of the options.
pub fn set_cheap(options: &mut dyn Options, choices: &[Choice]) {
    let before: Vec<(String, Value)> =
        options.fields().into_iter().map(|field| (field.name.into_owned(), field.value)).collect();
    set(options, choices);
    for field in options.fields() {
        if matches!(field.value, Value::Int(count) if count > 300)
            && let Some((name, value)) = before.iter().find(|(name, _)| *name == field.name)
        {
            let _ = options.set(name, value);
        }
    }
}

/// A picture: bars and noise in rows of any stride.
#[derive(Debug, Arbitrary)]
pub struct Picture {
    width: u8,
    height: u8,
    stride: u8,
    focal: u8,
    off: [i8; 2],
    /// From which column, and from which on leaning by how much, a level.
    bars: Vec<(u8, i8, u8)>,
    noise: Vec<u8>,
}

impl Picture {
    /// Columns and rows: enough for edges, few enough for hundreds of images a second.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height].map(|n| 1 + usize::from(n) % 64)
    }

    /// From the begin of a row to that of the next.
    pub fn stride(&self) -> usize {
        self.size()[0] + usize::from(self.stride % 5)
    }

    /// A fisheye over it.
    pub fn camera(&self) -> Option<Camera> {
        let [width, height] = self.size();
        let center = [width, height].map(|n| (n as f64 - 1.0) / 2.0);
        let focal = 2.0 + f64::from(self.focal) / 4.0;
        let [cx, cy] = [0, 1].map(|i| center[i] + f64::from(self.off[i]) / 16.0);
        Camera::new(width as u32, height as u32, Model::Equidistant(Equidistant::new(focal, cx, cy).ok()?)).ok()
    }

    /// Its levels; no more than the last row needs.
    pub fn levels(&self) -> Vec<u8> {
        let ([width, height], stride) = (self.size(), self.stride());
        let mut levels = vec![90u8; stride * (height - 1) + width];
        for (column, lean, level) in self.bars.iter().take(16) {
            for (v, row) in levels.chunks_mut(stride).enumerate() {
                let from = i64::from(*column) % width as i64 + i64::from(*lean) * v as i64 / 64;
                row[(from.max(0) as usize).min(row.len())..].fill(*level);
            }
        }
        for (pixel, byte) in levels.iter_mut().rev().zip(&self.noise) {
            *pixel = *byte;
        }
        levels
    }
}
