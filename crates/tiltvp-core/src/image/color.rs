//! A borrowed 8-bit colour image, three bytes to a pixel in the order blue, green, red.

use super::view::ImageView;
use crate::error::{Error, Result};

/// Rows of pixels of three bytes, blue first, borrowed from the caller; pixel `(u, v)` is column `u` of row `v`.
#[derive(Debug, Clone, Copy)]
pub struct ColorView<'a> {
    bytes: ImageView<'a>,
    width: usize,
}

impl<'a> ColorView<'a> {
    /// `height` rows of `width` pixels, `stride` bytes from one row to the next.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if a side is zero, the stride is shorter than a row, or the data end too early.
    pub fn new(data: &'a [u8], width: usize, height: usize, stride: usize) -> Result<Self> {
        let Some(row) = width.checked_mul(3) else {
            return Err(Error::argument("image", format!("{width} pixels to a row"), "rows that fit into memory"));
        };
        Ok(Self { bytes: ImageView::new(data, row, height, stride)?, width })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.bytes.height()
    }

    /// The bytes of row `v`, or an empty slice below the image.
    pub fn row(&self, v: usize) -> &'a [u8] {
        self.bytes.row(v)
    }
}
