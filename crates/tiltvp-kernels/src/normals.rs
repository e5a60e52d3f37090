//! From gradients to unit normals of great circles, by one 3x2 matrix for each pixel.

use crate::vectorised;

/// Edge pixels that are lifted together: 3.5 KB, which the nearest cache holds. Only time depends on it.
pub const BLOCK: usize = 128;

/// Matrices of some pixels, the normals that they make of gradients, and the weights of those.
#[derive(Debug, Clone)]
pub struct Normals {
    /// Rows of the matrices, two numbers of 16 bits in a word, that of `gx` in the lower half.
    pub maps: [[u32; BLOCK]; 3],
    /// Components of the normals.
    pub rows: [[f32; BLOCK]; 3],
    /// Lengths before they were unit normals, in units; zero for normals too far from upright.
    pub weights: [f32; BLOCK],
}

impl Default for Normals {
    fn default() -> Self {
        Self { maps: [[0; BLOCK]; 3], rows: [[0.0; BLOCK]; 3], weights: [0.0; BLOCK] }
    }
}

vectorised! {
    /// Lifts gradients, at most [`BLOCK`]: weights are zero where `z^2 > limit` of the unit normal.
    pub fn lift(normals: &mut Normals, gx: &[f32], gy: &[f32], limit: f32, unit: f32) {
        lift_body(normals, gx, gy, limit, unit);
    }
}

#[inline(always)]
fn lift_body(normals: &mut Normals, gx: &[f32], gy: &[f32], limit: f32, unit: f32) {
    let n = gx.len();
    let [ab, cd, ef] = &normals.maps;
    let [x, y, z] = &mut normals.rows;
    let (ab, cd, ef) = (&ab[..n], &cd[..n], &ef[..n]);
    let (x, y, z, weights) = (&mut x[..n], &mut y[..n], &mut z[..n], &mut normals.weights[..n]);
    let gy = &gy[..n];
    for i in 0..n {
        let along = |pair: u32| ((pair << 16) as i32 >> 16) as f32 * gx[i] + (pair as i32 >> 16) as f32 * gy[i];
        let row = [along(ab[i]), along(cd[i]), along(ef[i])];
        let squared = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
        let root = squared.sqrt();
        let scale = 1.0 / root;
        (x[i], y[i], z[i]) = (row[0] * scale, row[1] * scale, row[2] * scale);
        // The length is zero where the gradient is.
        weights[i] = if row[2] * row[2] <= limit * squared { root * unit } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_those_of_the_plain_loop_to_the_last_bit() {
        let random = |i: usize| (i as u32).wrapping_mul(2_654_435_761).rotate_left(11).wrapping_mul(0x85eb_ca6b);
        let gradient = |k: usize| (0..BLOCK).map(|i| (random(i + k) >> 20) as f32 - 2048.0).collect::<Vec<_>>();
        let (gx, gy) = (gradient(1), gradient(500));
        let maps = [1000, 2000, 3000].map(|k| std::array::from_fn(|i| random(i + k)));
        let (mut found, mut plain) = (Normals { maps, ..Normals::default() }, Normals { maps, ..Normals::default() });
        lift(&mut found, &gx, &gy, 0.3, 0.01);
        lift_body(&mut plain, &gx, &gy, 0.3, 0.01);
        let bits = |normals: &Normals| {
            normals.rows.as_flattened().iter().chain(&normals.weights).map(|x| x.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(&found), bits(&plain));
        let kept = found.weights.iter().filter(|w| **w > 0.0).count();
        assert!(kept > 20 && kept < 120, "{kept}");
    }
}
