//! A borrowed 8-bit grey image with any row stride.

use crate::error::{Error, Result};

/// Refuses an image of another size (width, height) than the camera's.
pub(crate) fn check_size(of_image: (usize, usize), of_camera: (usize, usize)) -> Result<()> {
    if of_image == of_camera {
        return Ok(());
    }
    let [(width, height), (expected_width, expected_height)] = [of_image, of_camera];
    let expected = format!("{expected_height} x {expected_width} (rows x columns), as the camera's images");
    Err(Error::argument("image", format!("{height} x {width} pixels"), expected))
}

/// Rows of 8-bit grey levels borrowed from the caller; pixel `(u, v)` is column `u` of row `v`.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    data: &'a [u8],
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a> ImageView<'a> {
    /// `height` rows of `width` bytes, `stride` bytes from one row to the next.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if a side is zero, the stride is shorter than a row, or the data end too early.
    pub fn new(data: &'a [u8], width: usize, height: usize, stride: usize) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::argument("image", format!("{width} x {height} pixels"), "at least one pixel"));
        }
        let needed = (height - 1).checked_mul(stride).and_then(|n| n.checked_add(width));
        if stride < width || needed.is_none_or(|n| n > data.len()) {
            return Err(Error::argument(
                "image",
                format!("{} bytes with a stride of {stride}", data.len()),
                format!("{height} rows of {width} bytes"),
            ));
        }
        // Of a single row the stride says nothing, and may be anything: places below it must not overflow.
        let stride = if height == 1 { width } else { stride };
        Ok(Self { data, width, height, stride })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All levels, row after row; what lies between rows may be anything.
    pub(crate) fn data(&self) -> &'a [u8] {
        self.data
    }

    /// From the begin of a row to that of the next.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Row `v`, or an empty slice below the image.
    pub fn row(&self, v: usize) -> &'a [u8] {
        if v >= self.height {
            return &[];
        }
        let start = v * self.stride;
        self.data.get(start..start + self.width).unwrap_or(&[])
    }

    /// The levels of the pixels `(u, v)`, `(u + 1, v)`, `(u, v + 1)`, `(u + 1, v + 1)`, if all are in the image.
    #[inline]
    pub(crate) fn quad(&self, u: usize, v: usize) -> Option<[u8; 4]> {
        if u + 1 >= self.width || v + 1 >= self.height {
            return None;
        }
        let at = v * self.stride + u;
        let (above, below) = (self.data.get(at..at + 2)?, self.data.get(at + self.stride..at + self.stride + 2)?);
        Some([above[0], above[1], below[0], below[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stride_of_a_single_row_is_its_width() {
        for stride in [4, 5, usize::MAX] {
            let view = ImageView::new(&[1, 2, 3, 4], 4, 1, stride).unwrap();
            assert_eq!((view.stride(), view.row(0), view.row(1)), (4, &[1, 2, 3, 4][..], &[][..]));
        }
        assert!(ImageView::new(&[0; 8], 4, 2, usize::MAX).is_err());
    }
}
