//! What the sampling methods share: the memory of the sampling loop, and the order of promising edge pixels.

use crate::edges::EdgePixels;
use crate::error::Result;
use crate::options::{Field, Kind, OptionValue, Options, Value, assign};
use crate::robust::{RansacScratch, SampleOrder, Sampling, Score};

/// Pixels of one edge repeat one another: one in two to the power of this, scattered over the image, comes before the rest.
/// `just measure-sampling` shows what samples in this order are worth.
const SPREAD_BITS: u32 = 4;

/// A factor that puts a row behind all others: squared gradients of 8-bit images are at most `2 (16 * 255)^2 = 3.3e7`, and those
/// of whole grey levels at least 1.
const LATER: f32 = 1e-18;

/// The golden ratio as a fraction of 2^32: products with successive numbers are spread evenly (Knuth 1973, section 6.4).
const GOLDEN: u32 = 0x9e37_79b1;

/// The memory of random sampling, grown once.
#[derive(Debug, Clone, Default)]
pub(in crate::tilt) struct SamplingScratch {
    /// How promising each row is, where samples are drawn in that order.
    pub(super) quality: Vec<f32>,
    pub(super) ransac: RansacScratch,
}

impl SamplingScratch {
    /// Makes room for up to `capacity` rows, and rates the rows by their squared gradients if samples are drawn in that order.
    /// `places` are those of the rows among the edge pixels.
    pub(super) fn prepare(&mut self, sampling: &Sampling, edges: &EdgePixels, places: &[u32], capacity: usize) {
        self.quality.clear();
        self.ransac.reserve(sampling, capacity);
        if sampling.order == SampleOrder::Uniform {
            return;
        }
        self.quality.reserve(capacity);
        let (slots, gx, gy) = (edges.slot(), edges.gx(), edges.gy());
        let quality = |place: &u32| {
            let place = *place as usize;
            let first = slots[place].wrapping_mul(GOLDEN) >> (32 - SPREAD_BITS) == 0;
            (gx[place].powi(2) + gy[place].powi(2)) * if first { 1.0 } else { LATER }
        };
        self.quality.extend(places.iter().map(quality));
    }
}

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

impl OptionValue for Score {
    const KIND: Kind = Kind::Word(&["count", "msac"]);

    fn to_value(&self) -> Value {
        Value::Text(if *self == Self::Msac { "msac" } else { "count" }.to_owned())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(word) if word == "count" => Some(Self::Count),
            Value::Text(word) if word == "msac" => Some(Self::Msac),
            _ => None,
        }
    }
}

/// The choices by name; the numbers that belong to a choice are its defaults.
impl Options for Sampling {
    fn fields(&self) -> Vec<Field> {
        let field = |name: &'static str, doc: &'static str, kind: Kind, value: Value| Field {
            name: name.into(),
            doc: doc.into(),
            kind,
            value,
            expected: kind.to_string().into(),
        };
        vec![
            field(
                "sampling",
                "From which edge pixels samples are drawn: \"uniform\" from all alike, \"progressive\" from a growing pool of the \
                 strongest (PROSAC, Chum and Matas 2005).",
                SampleOrder::KIND,
                self.order.to_value(),
            ),
            field(
                "local_optimization",
                "Whether each new best model is improved by least squares before the next sample (LO-RANSAC, Chum, Matas and \
                 Kittler 2003).",
                bool::KIND,
                self.local_optimization.is_some().to_value(),
            ),
            field(
                "score",
                "What makes one model better than another: the \"count\" of inliers, or the truncated squares of \"msac\" (Torr \
                 and Zisserman 2000).",
                Score::KIND,
                self.score.to_value(),
            ),
        ]
    }

    fn try_set(&mut self, name: &str, value: &Value) -> Result<bool> {
        match name {
            "sampling" => assign(&mut self.order, "sampling", value)?,
            "local_optimization" => {
                let mut on = self.local_optimization.is_some();
                assign(&mut on, "local_optimization", value)?;
                self.local_optimization = on.then(|| self.local_optimization.unwrap_or_default());
            }
            "score" => assign(&mut self.score, "score", value)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn validate(&self) -> Result<()> {
        Self::validate(self)
    }
}
