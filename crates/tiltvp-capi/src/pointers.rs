//! From the caller's pointers to what they point to: all that is asked of a caller without a check is asked here.

use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::image::ImageView;

use crate::border::{Outcome, given, refused};

/// An 8-bit grey image of the caller's, row after row from the top.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// The first pixel of the first row.
    pub data: *const u8,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Bytes from the begin of a row to that of the next, at least `width`.
    pub stride: usize,
}

impl Image {
    /// The image as the core sees it.
    ///
    /// # Safety
    /// `data` is NULL or points to the rows that the sizes tell, which nobody changes meanwhile.
    pub(crate) unsafe fn view(&self, name: &str) -> Outcome<ImageView<'_>> {
        let Self { data, width, height, stride } = *self;
        let bytes = (height.saturating_sub(1)).checked_mul(stride).and_then(|n| n.checked_add(width));
        let Some(bytes) = bytes.filter(|_| stride >= width) else {
            let got = format!("{width} x {height} pixels with a stride of {stride}");
            return refused(name, &got, "rows of pixels in memory");
        };
        // SAFETY: the caller's promise.
        let rows = unsafe { slice(data, bytes, name) }?;
        Ok(ImageView::new(rows, width, height, stride)?)
    }
}

/// A text that ends in a zero.
///
/// # Safety
/// `text` is NULL or points to such a text, which nobody changes meanwhile.
pub(crate) unsafe fn text<'a>(text: *const c_char, name: &str) -> Outcome<&'a str> {
    // SAFETY: the caller's promise.
    match unsafe { maybe_text(text, name) }? {
        Some(text) => Ok(text),
        None => given(None, name),
    }
}

/// A text that ends in a zero, none for NULL.
///
/// # Safety
/// That of [`text`].
pub(crate) unsafe fn maybe_text<'a>(text: *const c_char, name: &str) -> Outcome<Option<&'a str>> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(Some).or_else(|error| refused(name, &error.to_string(), "a text in UTF-8"))
}

/// Some values in a row.
///
/// # Safety
/// `data` is NULL or points to so many values, which nobody changes meanwhile.
pub(crate) unsafe fn slice<'a, T>(data: *const T, count: usize, name: &str) -> Outcome<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    check_row(data, count, name)?;
    // SAFETY: the caller's promise; the rest was checked.
    Ok(unsafe { std::slice::from_raw_parts(data, count) })
}

/// Room for some values in a row.
///
/// # Safety
/// `data` is NULL or points to so much room, which nobody else uses meanwhile.
pub(crate) unsafe fn room<'a, T>(data: *mut T, count: usize, name: &str) -> Outcome<&'a mut [MaybeUninit<T>]> {
    if count == 0 {
        return Ok(&mut []);
    }
    check_row(data, count, name)?;
    // SAFETY: the caller's promise; the rest was checked. Nothing is said of what the room holds.
    Ok(unsafe { std::slice::from_raw_parts_mut(data.cast(), count) })
}

/// What can be told of a row of values by its pointer and its count.
fn check_row<T>(data: *const T, count: usize, name: &str) -> Outcome<()> {
    given((!data.is_null()).then_some(()), name)?;
    if !data.is_aligned() {
        return refused(name, "an odd address", "values where the compiler puts them");
    }
    let bytes = count.checked_mul(size_of::<T>());
    if bytes.is_none_or(|bytes| isize::try_from(bytes).is_err()) {
        return refused(name, &format!("{count} values"), "as many as memory can hold");
    }
    Ok(())
}

/// The rotation of nine numbers in row order, none for NULL. Whether it is one, the core checks.
///
/// # Safety
/// `rotation` is NULL or points to nine numbers.
pub(crate) unsafe fn rotation(rotation: *const f64) -> Outcome<Option<Matrix3<f64>>> {
    if rotation.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe { slice(rotation, 9, "robot_from_camera") }.map(|rows| Some(Matrix3::from_row_slice(rows)))
}

/// The vector of three numbers, none for NULL.
///
/// # Safety
/// `vector` is NULL or points to three numbers.
pub(crate) unsafe fn vector(vector: *const f64, name: &str) -> Outcome<Option<Vector3<f64>>> {
    if vector.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    unsafe { slice(vector, 3, name) }.map(|numbers| Some(Vector3::from_row_slice(numbers)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_sizes_that_make_no_sense_are_refused() {
        let data = [7u8; 12];
        let image = |data: *const u8, width, height, stride| Image { data, width, height, stride };
        let huge = usize::MAX / 2;
        for (image, expected) in [
            (image(std::ptr::null(), 4, 3, 4), "image: got NULL, expected a pointer"),
            (image(data.as_ptr(), 4, 3, 3), "image: got 4 x 3 pixels with a stride of 3"),
            (image(data.as_ptr(), 0, 3, 4), "image: got 0 x 3 pixels, expected at least one pixel"),
            (image(data.as_ptr(), 4, 0, 4), "image: got 4 x 0 pixels, expected at least one pixel"),
            (image(data.as_ptr(), 4, usize::MAX, 4), "rows of pixels in memory"),
            (image(data.as_ptr(), huge, 2, huge), "as many as memory can hold"),
        ] {
            // SAFETY: sizes beyond the data are refused before they are looked at.
            let why = unsafe { image.view("image") }.unwrap_err().1;
            assert!(why.contains(expected), "{why}");
        }
        let narrow = image(data.as_ptr(), 2, 3, 4);
        // SAFETY: the data has three rows of four.
        assert_eq!(unsafe { narrow.view("image") }.unwrap().row(2), [7, 7]);
    }

    #[test]
    fn texts_and_rows_that_make_no_sense_are_refused() {
        // SAFETY: each pointer is NULL or points to what it says.
        unsafe {
            assert_eq!(text(std::ptr::null(), "path").unwrap_err().1, "path: got NULL, expected a pointer");
            assert!(text(c"\xff".as_ptr(), "path").unwrap_err().1.contains("expected a text in UTF-8"));
            assert_eq!(text(c"a".as_ptr(), "path").unwrap(), "a");
            let numbers = [0.0f64; 2];
            let odd = numbers.as_ptr().wrapping_byte_add(1);
            assert!(slice(odd, 1, "row").unwrap_err().1.contains("an odd address"));
            assert!(slice(numbers.as_ptr(), usize::MAX / 4, "row").unwrap_err().1.contains("memory"));
            assert!(slice::<f64>(std::ptr::null(), 0, "row").unwrap().is_empty());
        }
    }
}
