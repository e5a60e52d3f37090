//! Random signs, by which a problem is moved to estimate a trace (Hutchinson 1990).

/// Marsaglia's xorshift64 (2003) from a fixed seed: the same signs at every call and on every machine.
pub(crate) struct RandomSigns(u64);

impl RandomSigns {
    pub(crate) fn new() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        if self.0 >> 63 == 0 { 1.0 } else { -1.0 }
    }
}
