//! Quads of neighbouring bytes, read in one go for interpolation between them.

use crate::vectorised;

/// The bytes at places of an image's data, beside them, and below both, the first in the lowest eight bits; none unless all four bytes
/// of all places are in the data.
#[inline(always)]
pub fn quads<const N: usize>(data: &[u8], stride: usize, places: &[u32; N]) -> Option<[u32; N]> {
    let mut last = 0;
    for place in places {
        last = last.max(*place);
    }
    if (last as usize).checked_add(stride)?.checked_add(2)? > data.len() {
        return None;
    }
    let mut quads = [0; N];
    for (quad, place) in quads.iter_mut().zip(places) {
        // SAFETY: none is farther on than the last, whose two bytes in the next row are in the data.
        let [above, below] = unsafe {
            let above = data.as_ptr().add(*place as usize);
            [above.cast::<[u8; 2]>().read(), above.add(stride).cast::<[u8; 2]>().read()]
        };
        *quad = u32::from_le_bytes([above[0], above[1], below[0], below[1]]);
    }
    Some(quads)
}

/// Places of a line that are looked at together: those of a vector of 256 bits.
const TOGETHER: usize = 4;

vectorised! {
    /// Fills in what a table has for the bytes of an image, bilinear, at places one `step` apart (columns and rows) of which
    /// `middle` is the middle one; whether the four pixels around each are in the image. Where not, nothing is filled in.
    pub fn along_line(
        data: &[u8],
        [width, height, stride]: [usize; 3],
        table: &[f64; 256],
        middle: [f64; 2],
        step: [f64; 2],
        out: &mut [f64],
    ) -> bool {
        let half = (out.len() / 2) as f64;
        let (Some(last), Some(wide), Some(high)) =
            (out.len().checked_sub(1), width.checked_sub(1), height.checked_sub(1))
        else {
            return false;
        };
        let last = last as f64 - half;
        let inside = |away: f64| {
            let (x, y) = (middle[0] + step[0] * away, middle[1] + step[1] * away);
            x >= 0.0 && y >= 0.0 && x < wide as f64 && y < high as f64
        };
        // Rounding keeps the order of places along a line, so the first and the last are the outermost.
        let is_whole = high.checked_mul(stride).and_then(|rows| rows.checked_add(width)).is_some_and(|n| n <= data.len());
        let is_small = i32::try_from(wide.max(high)).is_ok();
        if !(is_whole && is_small && width <= stride && inside(-half) && inside(last)) {
            return false;
        }
        let mut away = [0.0; TOGETHER];
        for (k, away) in away.iter_mut().enumerate() {
            *away = k as f64 - half;
        }
        for out in out.chunks_mut(TOGETHER) {
            let (mut du, mut dv, mut at) = ([0.0; TOGETHER], [0.0; TOGETHER], [0; TOGETHER]);
            for k in 0..TOGETHER {
                // Beyond the last place it is read again.
                let along = if away[k] < last { away[k] } else { last };
                let (x, y) = (middle[0] + step[0] * along, middle[1] + step[1] * along);
                // SAFETY: from the first to the last place both are from 0 to the size of the image, which is within the type.
                let (column, row) = unsafe { (x.to_int_unchecked::<i32>(), y.to_int_unchecked::<i32>()) };
                (du[k], dv[k]) = (x - f64::from(column), y - f64::from(row));
                at[k] = row as usize * stride + column as usize;
                away[k] += TOGETHER as f64;
            }
            let (mut a, mut b, mut c, mut d) = ([0.0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER]);
            for k in 0..TOGETHER {
                // SAFETY: the pixel is above the last row of the image and to the left of the last column, and all rows are in the
                // data.
                let [above, below] = unsafe {
                    let above = data.as_ptr().add(at[k]);
                    [above.cast::<[u8; 2]>().read(), above.add(stride).cast::<[u8; 2]>().read()]
                };
                (a[k], b[k]) = (table[usize::from(above[0])], table[usize::from(above[1])]);
                (c[k], d[k]) = (table[usize::from(below[0])], table[usize::from(below[1])]);
            }
            for k in 0..TOGETHER {
                let (top, bottom) = (a[k] + (b[k] - a[k]) * du[k], c[k] + (d[k] - c[k]) * du[k]);
                a[k] = top + (bottom - top) * dv[k];
            }
            out.copy_from_slice(&a[..out.len()]);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_that_of_its_places_one_by_one_and_none_beyond_the_image() {
        let [width, height, stride] = [37, 29, 41];
        let data: Vec<u8> = (0..height * stride).map(|i| (i * i % 251) as u8).collect();
        let table: [f64; 256] = std::array::from_fn(|level| (level as f64).powf(1.3));
        let one = |x: f64, y: f64| {
            let (column, row) = (x as usize, y as usize);
            let at = |du: usize, dv: usize| table[usize::from(data[(row + dv) * stride + column + du])];
            let (du, dv) = (x - column as f64, y - row as f64);
            let (top, bottom) = (at(0, 0) + (at(1, 0) - at(0, 0)) * du, at(0, 1) + (at(1, 1) - at(0, 1)) * du);
            top + (bottom - top) * dv
        };
        let sizes = [width, height, stride];
        for count in [1, 4, 5, 15, 17, 25] {
            for turn in 0..60 {
                let (sin, cos) = (0.1 * f64::from(turn)).sin_cos();
                let middle = [13.0 + 12.0 * cos, 11.0 + 11.0 * sin];
                let mut line = vec![f64::NAN; count];
                let places: Vec<_> = (0..count)
                    .map(|i| i as f64 - (count / 2) as f64)
                    .map(|away| (middle[0] + sin * away, middle[1] + cos * away))
                    .collect();
                let inside = |(x, y): &(f64, f64)| *x >= 0.0 && *y >= 0.0 && *x < 36.0 && *y < 28.0;
                let is_inside = places.iter().all(inside);
                assert_eq!(along_line(&data, sizes, &table, middle, [sin, cos], &mut line), is_inside);
                if is_inside {
                    assert_eq!(line, places.iter().map(|(x, y)| one(*x, *y)).collect::<Vec<_>>());
                } else {
                    assert!(line.iter().all(|x| x.is_nan()));
                }
            }
        }
        let none = |data: &[u8], sizes, x: f64| along_line(data, sizes, &table, [x, 2.0], [0.5; 2], &mut [0.0; 3]);
        assert!(none(&data, sizes, 2.0));
        assert!(
            !none(&data[1..], [37, 29, 42], 2.0) && !none(&data, sizes, f64::NAN) && !none(&data, [42, 29, 41], 2.0)
        );
        assert!(!none(&[], [0, 0, 0], 0.0) && !along_line(&data, sizes, &table, [2.0; 2], [0.5; 2], &mut []));
    }

    #[test]
    fn quads_are_the_bytes_about_a_place_and_none_beyond_the_data() {
        let data: Vec<u8> = (0..60).collect();
        let places = [0, 7, 38, 48];
        let plain =
            |place: u32| u32::from_le_bytes([place, place + 1, place + 10, place + 11].map(|at| data[at as usize]));
        assert_eq!(quads(&data, 10, &places), Some(places.map(plain)));
        assert_eq!(quads(&data, 10, &[0, 49]), None);
        assert_eq!(quads(&data, usize::MAX, &[0]), None);
        assert_eq!(quads(&data, 10, &[u32::MAX]), None);
    }
}
