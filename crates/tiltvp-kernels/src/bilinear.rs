//! Quads of neighbouring bytes, read in one go for interpolation between them.

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

#[cfg(test)]
mod tests {
    use super::*;

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
