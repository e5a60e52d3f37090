//! Pixels about places in another image: places interpolated over a patch, levels between four pixels, all in fixed point.

use multiversion::multiversion;

use crate::bilinear::quads;

/// Columns of a patch at most, which are worked on together.
pub const COLUMNS: usize = 8;

/// Bits behind the point of a place. Of them the first eight weigh levels; the others keep sums of steps exact to 1/1000 px.
const PLACE_BITS: u32 = 16;

/// Bits of a weight: a level moves by less than one from one weight to the next.
const WEIGHT_BITS: u32 = 8;

/// A few pixels of the new image, and where the first of each row and of each column is in the old one.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    /// Columns and rows, from 1 to [`COLUMNS`] columns.
    pub size: [usize; 2],
    /// Of the first pixel, of the one `reach` columns to its right, of the one `reach` rows below, and of the one after both:
    /// column and row in the old image, less those of `origin`; below 2^15.
    pub corners: [[f32; 2]; 4],
    /// Columns and rows between corners, at least 1.
    pub reach: [usize; 2],
    /// A pixel of the old image, above and left of all places: its place in the data in bytes.
    pub origin: u32,
}

type Lanes = [i32; COLUMNS];

impl Patch {
    /// Columns and rows of the places of a row of the patch, relative to the origin, with [`PLACE_BITS`] behind the point.
    #[inline(always)]
    fn row(&self, row: usize) -> [Lanes; 2] {
        let down = row as f32 / self.reach[1] as f32;
        let unit = (1 << PLACE_BITS) as f32;
        let half_weight = 1 << (PLACE_BITS - WEIGHT_BITS - 1);
        std::array::from_fn(|axis| {
            let [left_top, right_top, left_bottom, right_bottom] = self.corners.map(|corner| corner[axis]);
            let left = left_top + down * (left_bottom - left_top);
            let right = right_top + down * (right_bottom - right_top);
            let first = (left * unit).round_ties_even() as i32 + half_weight;
            let step = ((right - left) / self.reach[0] as f32 * unit) as i32;
            std::array::from_fn(|i| first + step * i.min(self.size[0] - 1) as i32)
        })
    }
}

/// The first bytes of the pixels at places, and the weights of their right and lower neighbours.
#[inline(always)]
fn places<const CHANNELS: usize>(patch: &Patch, row: usize, stride: usize) -> ([u32; COLUMNS], Lanes, Lanes) {
    let [u, v] = patch.row(row);
    let weight = |at: i32| (at >> (PLACE_BITS - WEIGHT_BITS)) & ((1 << WEIGHT_BITS) - 1);
    let first = std::array::from_fn(|i| {
        let (across, down) = ((u[i] >> PLACE_BITS) as u32, (v[i] >> PLACE_BITS) as u32);
        patch.origin.wrapping_add(down.wrapping_mul(stride as u32)).wrapping_add(across * CHANNELS as u32)
    });
    (first, u.map(weight), v.map(weight))
}

#[inline(always)]
fn blend([a, b, c, d]: [Lanes; 4], right: &Lanes, below: &Lanes) -> [u8; COLUMNS] {
    std::array::from_fn(|i| {
        let above = (a[i] << WEIGHT_BITS) + (b[i] - a[i]) * right[i];
        let under = (c[i] << WEIGHT_BITS) + (d[i] - c[i]) * right[i];
        let level = (above << WEIGHT_BITS) + (under - above) * below[i];
        ((level + (1 << (2 * WEIGHT_BITS - 1))) >> (2 * WEIGHT_BITS)) as u8
    })
}

/// Fills a patch of a grey image; `out` begins with its first pixel. Nothing tells where a place is outside the old image but
/// inside its data: the caller sees to it that places are in the image, with a neighbour to the right and below.
///
/// False where a place is outside the data; the patch is then filled in part.
///
/// # Panics
/// If a patch is wider than [`COLUMNS`], or `out` ends within it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2"))]
pub fn fill_gray(data: &[u8], stride: usize, patch: &Patch, out: &mut [u8], out_stride: usize) -> bool {
    let columns = patch.size[0];
    for row in 0..patch.size[1] {
        let (first, right, below) = places::<1>(patch, row, stride);
        let Some(quads) = quads(data, stride, &first) else { return false };
        let corners = [0, 8, 16, 24].map(|shift| quads.map(|quad| ((quad >> shift) & 255) as i32));
        out[row * out_stride..][..columns].copy_from_slice(&blend(corners, &right, &below)[..columns]);
    }
    true
}

/// The same for an image of three bytes a pixel; `stride` and `out_stride` are bytes.
///
/// # Panics
/// As [`fill_gray`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2"))]
pub fn fill_color(data: &[u8], stride: usize, patch: &Patch, out: &mut [u8], out_stride: usize) -> bool {
    let columns = patch.size[0];
    for row in 0..patch.size[1] {
        let (first, right, below) = places::<3>(patch, row, stride);
        let Some(corners) = neighbours(data, stride, &first) else { return false };
        let mut pixels = [0; 3 * COLUMNS];
        for channel in 0..3 {
            let levels = corners.map(|four| four.map(|bytes| ((bytes >> (8 * channel)) & 255) as i32));
            for (i, level) in blend(levels, &right, &below).into_iter().enumerate() {
                pixels[3 * i + channel] = level;
            }
        }
        out[row * out_stride..][..3 * columns].copy_from_slice(&pixels[..3 * columns]);
    }
    true
}

/// Four bytes from each place on, from three bytes to its right, and from the places a stride farther; none unless all are in the
/// data.
#[inline(always)]
fn neighbours(data: &[u8], stride: usize, places: &[u32; COLUMNS]) -> Option<[[u32; COLUMNS]; 4]> {
    let last = places.iter().fold(0, |last, place| *place.max(&last)) as usize;
    if last.checked_add(stride)?.checked_add(7)? > data.len() {
        return None;
    }
    let mut found = [[0; COLUMNS]; 4];
    for (i, place) in places.iter().enumerate() {
        // SAFETY: none is farther on than the last, after which seven bytes in the next row are in the data.
        unsafe {
            let above = data.as_ptr().add(*place as usize);
            let below = above.add(stride);
            for (into, from) in found.iter_mut().zip([above, above.add(3), below, below.add(3)]) {
                into[i] = u32::from_le_bytes(from.cast::<[u8; 4]>().read());
            }
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 40;

    fn level(data: &[u8], channels: usize, place: [f32; 2], channel: usize) -> f32 {
        let at = |u: usize, v: usize| f32::from(data[(v * WIDTH + u) * channels + channel]);
        let (u, v) = (place[0] as usize, place[1] as usize);
        let (right, below) = (place[0] - u as f32, place[1] - v as f32);
        let row = |v: usize| at(u, v) * (1.0 - right) + at(u + 1, v) * right;
        row(v) * (1.0 - below) + row(v + 1) * below
    }

    #[test]
    fn patches_are_what_interpolation_of_places_and_levels_says() {
        let gray: Vec<u8> = (0..40 * 40).map(|k| ((k * 7 + k / WIDTH * 31) % 251) as u8).collect();
        let color: Vec<u8> = (0..3 * 40 * 40).map(|k| ((k * 13 + k / 120 * 17) % 253) as u8).collect();
        let corners = [[3.2, 2.5], [14.7, 5.1], [1.1, 13.9], [13.3, 17.4]];
        for size in [[8, 8], [5, 8], [1, 1], [8, 3]] {
            let reach = size.map(|n: usize| n.max(2) - 1);
            let patch = Patch { size, corners, reach, origin: (4 * WIDTH + 6) as u32 };
            let (mut grays, mut colors) = ([0; 9 * 8], [0; 25 * 8]);
            assert!(fill_gray(&gray, WIDTH, &patch, &mut grays, 9));
            let patch = Patch { origin: 3 * patch.origin, ..patch };
            assert!(fill_color(&color, 3 * WIDTH, &patch, &mut colors, 25));
            for (row, column) in (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (row, column))) {
                let (t, s) = (row as f32 / reach[1] as f32, column as f32 / reach[0] as f32);
                let place: [f32; 2] = std::array::from_fn(|k| {
                    let [a, b, c, d] = corners.map(|corner| corner[k]);
                    let origin = [6.0, 4.0][k];
                    origin + (a + (b - a) * s) * (1.0 - t) + (c + (d - c) * s) * t
                });
                // A weight is rounded to 1/256 on either axis, and neighbours differ by at most 253 levels.
                let near =
                    |got: u8, expected: f32| assert!((f32::from(got) - expected).abs() < 1.6, "{got} {expected}");
                near(grays[row * 9 + column], level(&gray, 1, place, 0));
                for channel in 0..3 {
                    near(colors[row * 25 + 3 * column + channel], level(&color, 3, place, channel));
                }
            }
            assert_eq!(grays[size[0]], 0);
        }
    }

    #[test]
    fn whole_places_are_copied_and_places_outside_the_data_are_told() {
        let data: Vec<u8> = (0..=255).collect();
        let corners = [[0.0, 0.0], [7.0, 0.0], [0.0, 7.0], [7.0, 7.0]];
        let patch = Patch { size: [8, 8], corners, reach: [7, 7], origin: 17 };
        let mut out = [0; 64];
        assert!(fill_gray(&data, 16, &patch, &mut out, 8));
        assert!((0..64).all(|k| usize::from(out[k]) == 17 + k / 8 * 16 + k % 8));
        assert!(!fill_gray(&data, 16, &Patch { origin: 150, ..patch }, &mut out, 8));
        assert!(!fill_gray(&data, 16, &Patch { origin: u32::MAX, ..patch }, &mut out, 8));
        assert!(!fill_color(&data, 16, &Patch { origin: 120, ..patch }, &mut out, 8));
        let back = corners.map(|corner| corner.map(|c| -2.0 * c));
        assert!(!fill_gray(&data, 16, &Patch { corners: back, origin: 17, ..patch }, &mut out, 8));
    }
}
