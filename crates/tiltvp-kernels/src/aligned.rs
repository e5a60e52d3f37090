//! Numbers in memory that begins on a boundary of 64 bytes, a whole vector of the widest machines.

/// Numbers of single precision in 64 bytes.
const SIXTEEN: usize = 16;

/// Sixteen numbers on a boundary of 64 bytes.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
struct Sixteen<T>([T; SIXTEEN]);

/// A vector of numbers, as long as a whole number of sixteens.
#[derive(Debug, Clone, Default)]
pub struct Aligned<T> {
    sixteens: Vec<Sixteen<T>>,
}

/// Numbers of which a sixteen has no gaps: `f32` and `f64`.
pub trait Dense: sealed::Sealed + Copy + Default {}
impl Dense for f32 {}
impl Dense for f64 {}

mod sealed {
    /// Keeps other types out, on which the slices below rely.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl<T: Dense> Aligned<T> {
    /// Zeros, at least `length` of them.
    pub fn zeros(length: usize) -> Self {
        Self { sixteens: vec![Sixteen::default(); length.div_ceil(SIXTEEN)] }
    }

    /// Grows to at least `length` numbers, the new ones zeros.
    pub fn grow(&mut self, length: usize) {
        if self.len() < length {
            self.sixteens.resize(length.div_ceil(SIXTEEN), Sixteen::default());
        }
    }

    /// Whether there are none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.sixteens.is_empty()
    }

    /// How many there are.
    #[inline]
    pub fn len(&self) -> usize {
        SIXTEEN * self.sixteens.len()
    }

    /// All of them.
    #[inline]
    pub fn as_slice(&self) -> &[T] {
        // SAFETY: a sixteen is sixteen numbers without gaps, for its size is a multiple of its alignment.
        unsafe { std::slice::from_raw_parts(self.sixteens.as_ptr().cast(), self.len()) }
    }

    /// All of them.
    #[inline]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        let length = self.len();
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.sixteens.as_mut_ptr().cast(), length) }
    }
}

const _: () = assert!(
    size_of::<Sixteen<f32>>() == SIXTEEN * size_of::<f32>() && size_of::<Sixteen<f64>>() == SIXTEEN * size_of::<f64>()
);
