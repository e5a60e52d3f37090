//! Pixels about places in another image: places interpolated over a patch, levels between four pixels, all in fixed point.

use crate::bilinear::quads;
use crate::vectorised;

/// Columns of a patch at most, which are worked on together.
pub const COLUMNS: usize = 8;

/// Bits behind the point of a place. Of them the first eight weigh levels; the others keep sums of steps exact to 1/1000 px.
const PLACE_BITS: u32 = 16;

/// Bits of a weight: a level moves by less than one from one weight to the next.
const WEIGHT_BITS: u32 = 8;
const WEIGHT_MAX: i32 = (1 << WEIGHT_BITS) - 1;

/// A few pixels of the new image, and where they are in the old one.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    /// Columns and rows, from 1 to [`COLUMNS`] columns.
    pub size: [usize; 2],
    /// Column and row in the old image, less those of `origin`, of the pixel in column i and row j: sums of these times
    /// 1, i, j, i j, i^2, j^2, i^2 j, i j^2; from 0 to below 2^15.
    pub places: [[f32; 8]; 2],
    /// A pixel of the old image, above and left of all places: its place in the data in bytes.
    pub origin: u32,
}

type Lanes = [i32; COLUMNS];

/// Places over a patch along an axis, with [`PLACE_BITS`] behind the point: parabolas, so that sums lead from a row to the next.
struct Axis {
    /// Of the pixels of the row.
    row: Lanes,
    /// From a row to the next.
    down: Lanes,
    /// By how much that grows with each row.
    bend: Lanes,
}

/// The places of a row of a patch: first bytes of pixels, and the weights of their right and lower neighbours.
struct Row {
    first: [u32; COLUMNS],
    right: Lanes,
    below: Lanes,
}

// Plain loops here and below: closures and adaptors over arrays are compiled without the vector instructions of their caller.

/// The places along an axis, relative to the origin.
#[inline(always)]
fn axis(terms: &[f32; 8], columns: usize) -> Axis {
    const UNIT: f32 = (1 << PLACE_BITS) as f32;
    // Half a weight more, for weights are cut off.
    const HALF: i32 = 1 << (PLACE_BITS - WEIGHT_BITS - 1);
    let [one, i, j, ij, ii, jj, iij, ijj] = *terms;
    let mut places = Axis { row: [0; COLUMNS], down: [0; COLUMNS], bend: [0; COLUMNS] };
    for k in 0..COLUMNS {
        let column = k.min(columns - 1) as f32;
        let bend = jj + ijj * column;
        places.row[k] = ((one + (i + ii * column) * column) * UNIT) as i32 + HALF;
        places.down[k] = ((j + (ij + iij * column) * column + bend) * UNIT) as i32;
        places.bend[k] = (2.0 * bend * UNIT) as i32;
    }
    places
}

/// The places of the present row, after which both axes are those of the next.
#[inline(always)]
fn places<const CHANNELS: usize>(u: &mut Axis, v: &mut Axis, origin: u32, stride: usize) -> Row {
    let mut found = Row { first: [0; COLUMNS], right: [0; COLUMNS], below: [0; COLUMNS] };
    for i in 0..COLUMNS {
        let (across, down) = ((u.row[i] >> PLACE_BITS) as u32, (v.row[i] >> PLACE_BITS) as u32);
        let from_origin = down.wrapping_mul(stride as u32).wrapping_add(across.wrapping_mul(CHANNELS as u32));
        found.first[i] = origin.wrapping_add(from_origin);
    }
    for i in 0..COLUMNS {
        found.right[i] = (u.row[i] >> (PLACE_BITS - WEIGHT_BITS)) & WEIGHT_MAX;
        found.below[i] = (v.row[i] >> (PLACE_BITS - WEIGHT_BITS)) & WEIGHT_MAX;
    }
    for i in 0..COLUMNS {
        u.row[i] = u.row[i].wrapping_add(u.down[i]);
        v.row[i] = v.row[i].wrapping_add(v.down[i]);
    }
    for i in 0..COLUMNS {
        u.down[i] = u.down[i].wrapping_add(u.bend[i]);
        v.down[i] = v.down[i].wrapping_add(v.bend[i]);
    }
    found
}

/// The levels between the bytes at `shifts` of four words, which are those of the four pixels.
#[inline(always)]
fn blend(words: &[[u32; COLUMNS]; 4], shifts: [u32; 4], row: &Row, out: &mut [u8; COLUMNS]) {
    for i in 0..COLUMNS {
        let a = ((words[0][i] >> shifts[0]) & 255) as i32;
        let b = ((words[1][i] >> shifts[1]) & 255) as i32;
        let c = ((words[2][i] >> shifts[2]) & 255) as i32;
        let d = ((words[3][i] >> shifts[3]) & 255) as i32;
        let above = (a << WEIGHT_BITS) + (b - a) * row.right[i];
        let under = (c << WEIGHT_BITS) + (d - c) * row.right[i];
        let level = (above << WEIGHT_BITS) + (under - above) * row.below[i];
        out[i] = ((level + (1 << (2 * WEIGHT_BITS - 1))) >> (2 * WEIGHT_BITS)) as u8;
    }
}

vectorised! {
    /// Fills a patch of a grey image; `out` begins with its first pixel. Nothing tells where a place is outside the old image but
    /// inside its data: the caller sees to it that places are in the image, with a neighbour to the right and below.
    ///
    /// False where a place is outside the data; the patch is then filled in part.
    ///
    /// # Panics
    /// If a patch is wider than [`COLUMNS`], or `out` ends within it.
    pub fn fill_gray(data: &[u8], stride: usize, patch: &Patch, out: &mut [u8], out_stride: usize) -> bool {
        let columns = patch.size[0];
        let (mut u, mut v) = (axis(&patch.places[0], columns), axis(&patch.places[1], columns));
        let mut levels = [0; COLUMNS];
        for number in 0..patch.size[1] {
            let row = places::<1>(&mut u, &mut v, patch.origin, stride);
            let Some(quads) = quads(data, stride, &row.first) else { return false };
            blend(&[quads; 4], [0, 8, 16, 24], &row, &mut levels);
            let into = &mut out[number * out_stride..][..columns];
            if columns == COLUMNS {
                into.copy_from_slice(&levels);
            } else {
                into.copy_from_slice(&levels[..columns]);
            }
        }
        true
    }
}

vectorised! {
    /// The same for an image of three bytes a pixel; `stride` and `out_stride` are bytes.
    ///
    /// # Panics
    /// As [`fill_gray`].
    pub fn fill_color(data: &[u8], stride: usize, patch: &Patch, out: &mut [u8], out_stride: usize) -> bool {
        let columns = patch.size[0];
        let (mut u, mut v) = (axis(&patch.places[0], columns), axis(&patch.places[1], columns));
        for number in 0..patch.size[1] {
            let row = places::<3>(&mut u, &mut v, patch.origin, stride);
            let Some(words) = neighbours(data, stride, &row.first) else { return false };
            let [mut blue, mut green, mut red] = [[0; COLUMNS]; 3];
            blend(&words, [0; 4], &row, &mut blue);
            blend(&words, [8; 4], &row, &mut green);
            blend(&words, [16; 4], &row, &mut red);
            let mut pixels = [0; 3 * COLUMNS];
            for i in 0..COLUMNS {
                pixels[3 * i] = blue[i];
                pixels[3 * i + 1] = green[i];
                pixels[3 * i + 2] = red[i];
            }
            let into = &mut out[number * out_stride..][..3 * columns];
            if columns == COLUMNS {
                into.copy_from_slice(&pixels);
            } else {
                into.copy_from_slice(&pixels[..3 * columns]);
            }
        }
        true
    }
}

/// Four bytes from each place on, from three bytes to its right, and from the places a stride farther; none unless all are in the
/// data.
#[inline(always)]
fn neighbours(data: &[u8], stride: usize, places: &[u32; COLUMNS]) -> Option<[[u32; COLUMNS]; 4]> {
    let mut last = 0;
    for place in places {
        last = last.max(*place);
    }
    if (last as usize).checked_add(stride)?.checked_add(7)? > data.len() {
        return None;
    }
    let mut found = [[0; COLUMNS]; 4];
    for i in 0..COLUMNS {
        // SAFETY: none is farther on than the last, after which seven bytes in the next row are in the data.
        unsafe {
            let above = data.as_ptr().add(places[i] as usize);
            let below = above.add(stride);
            found[0][i] = u32::from_le_bytes(above.cast::<[u8; 4]>().read());
            found[1][i] = u32::from_le_bytes(above.add(3).cast::<[u8; 4]>().read());
            found[2][i] = u32::from_le_bytes(below.cast::<[u8; 4]>().read());
            found[3][i] = u32::from_le_bytes(below.add(3).cast::<[u8; 4]>().read());
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
        let places =
            [[3.2, 1.4, -0.3, 0.02, 0.03, 0.01, 0.002, -0.001], [2.5, 0.3, 1.6, 0.01, -0.02, 0.02, -0.001, 0.002]];
        for size in [[8, 8], [5, 8], [1, 1], [8, 3]] {
            let patch = Patch { size, places, origin: (4 * WIDTH + 6) as u32 };
            let (mut grays, mut colors) = ([0; 9 * 8], [0; 25 * 8]);
            assert!(fill_gray(&gray, WIDTH, &patch, &mut grays, 9));
            let patch = Patch { origin: 3 * patch.origin, ..patch };
            assert!(fill_color(&color, 3 * WIDTH, &patch, &mut colors, 25));
            for (row, column) in (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| (row, column))) {
                let (i, j) = (column as f32, row as f32);
                let powers = [1.0, i, j, i * j, i * i, j * j, i * i * j, i * j * j];
                let place: [f32; 2] = std::array::from_fn(|axis| {
                    [6.0, 4.0][axis] + places[axis].iter().zip(powers).map(|(term, power)| term * power).sum::<f32>()
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
        let mut places = [[0.0; 8]; 2];
        (places[0][1], places[1][2]) = (1.0, 1.0);
        let patch = Patch { size: [8, 8], places, origin: 17 };
        let mut out = [0; 64];
        assert!(fill_gray(&data, 16, &patch, &mut out, 8));
        assert!((0..64).all(|k| usize::from(out[k]) == 17 + k / 8 * 16 + k % 8));
        assert!(!fill_gray(&data, 16, &Patch { origin: 150, ..patch }, &mut out, 8));
        assert!(!fill_gray(&data, 16, &Patch { origin: u32::MAX, ..patch }, &mut out, 8));
        assert!(!fill_color(&data, 16, &Patch { origin: 120, ..patch }, &mut out, 8));
        let back = places.map(|axis| axis.map(|term| -2.0 * term));
        assert!(!fill_gray(&data, 16, &Patch { places: back, origin: 17, ..patch }, &mut out, 8));
    }
}
