//! A cheap test of gradients, row by row, that spares most edge pixels of horizontal things the dear ones.

use std::sync::Arc;

use multiversion::multiversion;

use super::region::Region;

/// For each pixel of a region a vector `q`; a gradient `g` may belong to a vertical edge only if
/// `(q . g)^2 <= limit |g|^2`.
///
/// Screens are necessary conditions, a hair wider than the exact test that follows, so they change no answer.
#[derive(Debug, Clone)]
pub struct Screen {
    vectors: Arc<Vectors>,
    limit: f32,
}

#[derive(Debug)]
struct Vectors {
    x: Vec<f32>,
    y: Vec<f32>,
    /// The largest component of all.
    largest: f32,
}

/// How much wider than the exact test a screen is, for the rounding of single precision.
const HAIR: f64 = 1.0 + 5e-5;

impl Screen {
    /// One vector for each pixel of the region, in slot order, and the limit of `|q . g| / |g|`.
    pub(super) fn new(vectors: impl Iterator<Item = [f32; 2]>, limit: f64) -> Self {
        let (x, y): (Vec<f32>, Vec<f32>) = vectors.map(|[x, y]| (x, y)).unzip();
        let largest = x.iter().chain(&y).fold(0.0, |most: f32, x| most.max(x.abs()));
        Self { vectors: Arc::new(Vectors { x, y, largest }), limit: 0.0 }.with_limit(limit)
    }

    /// The same vectors, shared, with another limit.
    #[must_use]
    pub fn with_limit(&self, limit: f64) -> Self {
        // Both tests sum two products in single precision: for small limits what they round off is more than a hair.
        let wide = limit * HAIR + f64::from(4.0 * f32::EPSILON * self.vectors.largest);
        Self { vectors: Arc::clone(&self.vectors), limit: (wide * wide) as f32 }
    }

    /// Edges whose straight continuation passes within `offset_max_px` of a point, eq. 17.
    pub fn of_offsets(region: &Region, centre: (f64, f64), offset_max_px: f64) -> Self {
        let vector = |(u, v, _)| [(u as f64 - centre.0) as f32, (v as f64 - centre.1) as f32];
        Self::new(region.pixels().map(vector), offset_max_px)
    }

    /// Marks with a negative strength the gradients of the pixels from `slot` on that fail, and returns how many were strong.
    pub(super) fn apply(&self, slot: usize, gx: &[f32], gy: &[f32], strength: &mut [f32], threshold: f32) -> usize {
        let pixels = slot..slot + strength.len();
        match (self.vectors.x.get(pixels.clone()), self.vectors.y.get(pixels)) {
            (Some(x), Some(y)) => screen([x, y, gx, gy], strength, self.limit, threshold) as usize,
            _ => 0,
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn screen([x, y, gx, gy]: [&[f32]; 4], strength: &mut [f32], limit: f32, threshold: f32) -> u32 {
    let n = strength.len();
    let (x, y, gx, gy) = (&x[..n], &y[..n], &gx[..n], &gy[..n]);
    let mut strong = 0;
    for i in 0..n {
        let across = x[i] * gx[i] + y[i] * gy[i];
        strong += u32::from(strength[i] >= threshold);
        strength[i] = if across * across <= limit * strength[i] { strength[i] } else { -1.0 };
    }
    strong
}
