//! Numbers of every kind from the bytes that the fuzzer makes: the bytes that are missing are zeros.

use std::sync::LazyLock;

use tiltvp_core::cap_simd_level;

/// The bytes that are left.
pub(crate) struct Bytes<'a>(pub(crate) &'a [u8]);

/// The variable that caps the vectors, as in Python.
const SIMD_VARIABLE: &str = "TILTVP_SIMD";

/// The vectors of this process are those that are asked for.
static CAPPED: LazyLock<()> = LazyLock::new(|| {
    if let Ok(word) = std::env::var(SIMD_VARIABLE) {
        cap_simd_level(SIMD_VARIABLE, &word).expect("a level of this machine");
    }
});

/// Numbers at which formulas end.
const ODD: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MIN_POSITIVE,
    5e-324,
    1e-308,
    1e-160,
    1e-9,
    1e9,
    1e15,
    1e160,
    f64::MAX,
];

impl<'a> Bytes<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        LazyLock::force(&CAPPED);
        Self(data)
    }

    pub(crate) fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    pub(crate) fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    pub(crate) fn long(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    pub(crate) fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// One of so many.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    /// From 0 to 1, both included.
    pub(crate) fn share(&mut self) -> f64 {
        f64::from(self.word()) / 65535.0
    }

    /// From one number to another.
    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// Any number: tame ones, multiples of tame ones by powers of ten, odd ones, any bits.
    pub(crate) fn number(&mut self) -> f64 {
        match self.byte() {
            kind @ 0..=31 => ODD[usize::from(kind % 16)],
            32..=127 => self.within(-3.0, 3.0),
            128..=191 => self.within(-2000.0, 2000.0),
            192..=239 => self.within(-1.0, 1.0) * 10f64.powi(i32::from(self.byte() as i8) / 4),
            240..=255 => f64::from_bits(self.long()),
        }
    }

    /// Mostly a number from one to another, now and then any.
    pub(crate) fn mostly(&mut self, low: f64, high: f64) -> f64 {
        if self.byte() < 240 { self.within(low, high) } else { self.number() }
    }

    /// Whether there are none left.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
