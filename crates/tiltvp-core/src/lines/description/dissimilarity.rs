//! How unlike descriptors and patches are: Euclidean distance (eq. 6), and SSD and ZNCC to compare with (eqs. 12 and 13).

use crate::error::{Error, Result};
use crate::interrupt::check;

/// How many rows of `width` values there are.
fn rows_of(name: &'static str, values: &[f32], width: usize) -> Result<usize> {
    if width == 0 || !values.len().is_multiple_of(width) {
        return Err(Error::argument(name, format!("{} values", values.len()), format!("whole rows of {width} values")));
    }
    Ok(values.len() / width)
}

/// A matrix in row order of what `pair` makes of each row of `a` and each row of `b`.
fn matrix(a: &[f32], b: &[f32], width: usize, pair: impl Fn(&[f32], &[f32]) -> f64, out: &mut Vec<f64>) -> Result<()> {
    let (n, m) = (rows_of("a", a, width)?, rows_of("b", b, width)?);
    out.clear();
    out.reserve(n * m);
    for a in a.chunks_exact(width) {
        check();
        out.extend(b.chunks_exact(width).map(|b| pair(a, b)));
    }
    Ok(())
}

fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for k in 0..8 {
            let difference = a[k] - b[k];
            sums[k] += difference * difference;
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b)).sum();
    sums.iter().sum::<f32>() + rest
}

/// Refuses what has no distance: profiles are NaN where the world is not seen.
pub(crate) fn check_finite(name: &'static str, descriptors: &[f32]) -> Result<()> {
    if descriptors.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(Error::argument(name, "values that are not finite", "descriptors of areas: profiles are for match_wide"))
}

/// Euclidean distance of two descriptors, eq. 6.
pub(crate) fn descriptor_distance(a: &[f32], b: &[f32]) -> f64 {
    f64::from(squared_distance(a, b)).sqrt()
}

/// Euclidean distances of descriptors of `width` values, eq. 6: `(N_A, N_B)` in row order.
///
/// # Errors
/// [`Error::InvalidArgument`] unless both hold whole rows of finite values.
pub fn descriptor_distances(a: &[f32], b: &[f32], width: usize, out: &mut Vec<f64>) -> Result<()> {
    check_finite("a", a)?;
    check_finite("b", b)?;
    matrix(a, b, width, descriptor_distance, out)
}

/// Means of the squared differences of patches of `width` samples, eq. 12, over the samples that both have: NaN where there
/// is none. `(N_A, N_B)` in row order.
///
/// # Errors
/// [`Error::InvalidArgument`] unless both hold whole rows.
pub fn ssd_matrix(a: &[f32], b: &[f32], width: usize) -> Result<Vec<f64>> {
    let mut out = Vec::new();
    let pair = |a: &[f32], b: &[f32]| {
        let (mut n, mut sum) = (0.0, 0.0);
        for (a, b) in a.iter().zip(b) {
            let difference = f64::from(a - b);
            if !difference.is_nan() {
                (n, sum) = (n + 1.0, sum + difference * difference);
            }
        }
        sum / n
    };
    matrix(a, b, width, pair, &mut out)?;
    Ok(out)
}

/// Zero-mean normalised cross-correlations of patches of `width` samples, eq. 13, over the samples that both have: 1 for
/// equal ones, NaN where there is none or no contrast. `(N_A, N_B)` in row order.
///
/// # Errors
/// [`Error::InvalidArgument`] unless both hold whole rows.
pub fn zncc_matrix(a: &[f32], b: &[f32], width: usize) -> Result<Vec<f64>> {
    let mut out = Vec::new();
    let pair = |a: &[f32], b: &[f32]| {
        let (mut n, mut sa, mut sb, mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            if !(a * b).is_nan() {
                n += 1.0;
                sa += a;
                sb += b;
                aa += a * a;
                bb += b * b;
                ab += a * b;
            }
        }
        let spread = ((aa - sa * sa / n) * (bb - sb * sb / n)).sqrt();
        if spread > 0.0 { (ab - sa * sb / n) / spread } else { f64::NAN }
    };
    matrix(a, b, width, pair, &mut out)?;
    Ok(out)
}
