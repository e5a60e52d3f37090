//! An image as a detector of corners takes it.

use crate::image::{ColorView, ImageView};

/// An image of the kind that the detector wants.
#[derive(Debug, Clone, Copy)]
pub enum Frame<'a> {
    /// For the general front end.
    Gray(ImageView<'a>),
    /// For the coloured cuboid.
    Color(ColorView<'a>),
}

impl Frame<'_> {
    /// Width and height.
    pub(super) fn size(&self) -> (usize, usize) {
        match self {
            Self::Gray(image) => (image.width(), image.height()),
            Self::Color(image) => (image.width(), image.height()),
        }
    }
}
