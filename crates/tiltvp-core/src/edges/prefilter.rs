//! A cheap necessary condition on gradients, row by row, which rejects most edge pixels of horizontal things before the exact test.

use std::sync::Arc;

use tiltvp_kernels::gradient::Directions;

use super::region::{Region, Span};
use super::whole::whole;
use crate::parallel;

/// For each pixel of a region a vector `q`; a gradient `g` may belong to a vertical edge only if
/// `(q . g)^2 <= limit |g|^2`.
///
/// Prefilters are necessary conditions, a hair wider than the exact test that follows, so they change no answer.
#[derive(Debug, Clone)]
pub struct Prefilter {
    vectors: Arc<Source>,
    /// Squared, in units of the vectors.
    limit: f32,
}

/// Vectors in 16-bit integers.
#[derive(Debug)]
struct Source {
    shape: Shape,
    /// What one of them means.
    unit: f64,
}

#[derive(Debug)]
enum Shape {
    /// One for each pixel.
    Each(Vec<[i16; 2]>),
    /// The way from a point to the pixel, in so many parts of a pixel, in which the point is given too.
    From { centre: [i32; 2], parts: i16 },
}

/// How much wider than the exact test a prefilter is: a hundred times the rounding of its few operations in single precision, each 6e-8.
const HAIR: f64 = 1.0 + 5e-5;

/// What rounding both components of a vector adds at most to `|q . g| / |g|`, in units of the vectors: the length of half a unit in
/// each, and a little for the rounding of the product.
const ROUNDED: f64 = std::f64::consts::FRAC_1_SQRT_2 + 1e-3;

impl Prefilter {
    /// One vector for each pixel of the region, in slot order, none of whose components is above `largest`, and the limit of
    /// `|q . g| / |g|`.
    pub(super) fn new(len: usize, vector: impl Fn(usize) -> [f32; 2] + Sync, largest: f64, limit: f64) -> Self {
        let unit = largest / f64::from(i16::MAX);
        let shape = Shape::Each(parallel::table(len, |slot| vector(slot).map(|x| whole(f64::from(x) / unit))));
        Self { vectors: Arc::new(Source { shape, unit }), limit: 0.0 }.with_limit(limit)
    }

    /// The same vectors, shared, with another limit.
    #[must_use]
    pub fn with_limit(&self, limit: f64) -> Self {
        let wide = limit / self.vectors.unit * HAIR + ROUNDED;
        Self { vectors: Arc::clone(&self.vectors), limit: ((wide * wide) as f32).min(f32::MAX) }
    }

    /// Edges whose straight continuation passes within `offset_max_px` of a point, eq. 17.
    pub fn of_offsets(region: &Region, centre: (f64, f64), offset_max_px: f64) -> Self {
        let away = |(u, v): (usize, usize)| [u as f64 - centre.0, v as f64 - centre.1];
        let most = |place| away(place).into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let largest = region.places().map(most).fold(1.0, f64::max);
        let parts = ((f64::from(i16::MAX) - 1.0) / largest).floor();
        if parts < 8.0 {
            let vector = |slot| {
                let (u, v) = region.place(slot);
                away((u.into(), v.into())).map(|x| x as f32)
            };
            return Self::new(region.len(), vector, largest, offset_max_px);
        }
        let centre = [centre.0, centre.1].map(|x| (x * parts).round() as i32);
        let shape = Shape::From { centre, parts: parts as i16 };
        Self { vectors: Arc::new(Source { shape, unit: 1.0 / parts }), limit: 0.0 }.with_limit(offset_max_px)
    }

    /// What the kernels need of it: vectors and limit.
    pub(super) fn vectors(&self) -> (Directions<'_>, f32) {
        let vectors = match &self.vectors.shape {
            Shape::Each(vectors) => Directions::Each(vectors),
            Shape::From { centre, parts } => Directions::From { centre: *centre, parts: *parts },
        };
        (vectors, self.limit)
    }

    /// The vectors of the `n` pixels from a span's first on, in `room` where they are not all stored, and the limit. What is
    /// none of the span's may be anything.
    pub(super) fn of_span<'a>(&'a self, span: &Span, n: usize, room: &'a mut Vec<[i16; 2]>) -> (&'a [[i16; 2]], f32) {
        let (vectors, limit) = self.vectors();
        room.clear();
        match vectors {
            Directions::None => {}
            Directions::Each(each) => match each.get(span.slot..span.slot + n) {
                Some(own) => return (own, limit),
                None => room.extend_from_slice(each.get(span.slot..).unwrap_or(&[])),
            },
            Directions::From { centre: [u, v], parts } => {
                let away = |x: usize, centre: i32| (x as i32 * i32::from(parts)).wrapping_sub(centre) as i16;
                room.extend((span.first..span.end).map(|x| [away(x, u), away(span.v, v)]));
            }
        }
        room.resize(n, [0; 2]);
        (room, limit)
    }
}
