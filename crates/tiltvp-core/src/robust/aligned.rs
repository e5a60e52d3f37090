//! Numbers in memory that begins where the widest vectors like it.

/// Numbers of a line.
const LINE: usize = 16;

/// Sixteen numbers on a boundary of 64 bytes.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
struct Line<T>([T; LINE]);

/// A vector of numbers, as long as a whole number of lines.
#[derive(Debug, Clone, Default)]
pub(super) struct Aligned<T> {
    lines: Vec<Line<T>>,
}

/// Numbers of which a line has no gaps.
pub(super) trait Dense: Copy + Default {}
impl Dense for f32 {}
impl Dense for f64 {}

impl<T: Dense> Aligned<T> {
    /// Zeros, at least `length` of them.
    pub(super) fn zeros(length: usize) -> Self {
        Self { lines: vec![Line::default(); length.div_ceil(LINE)] }
    }

    /// Grows to at least `length` numbers, the new ones zeros.
    pub(super) fn grow(&mut self, length: usize) {
        if self.len() < length {
            self.lines.resize(length.div_ceil(LINE), Line::default());
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        LINE * self.lines.len()
    }

    /// All of them.
    pub(super) fn as_slice(&self) -> &[T] {
        // SAFETY: a line is sixteen numbers without gaps, for its size is a multiple of its alignment.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.len()) }
    }

    /// All of them.
    pub(super) fn as_mut_slice(&mut self) -> &mut [T] {
        let length = self.len();
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), length) }
    }
}

const _: () =
    assert!(size_of::<Line<f32>>() == LINE * size_of::<f32>() && size_of::<Line<f64>>() == LINE * size_of::<f64>());
