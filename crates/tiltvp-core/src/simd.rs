//! The widest vectors that this process uses.

use tiltvp_kernels::level;

use crate::error::{Error, Result};

/// The level of this process: `"fallback"`, `"sse4.2"`, `"avx2"`, `"avx512"` or `"neon"`. It is the widest of the machine, or what the
/// environment's `TILTVP_SIMD` names. Answers do not depend on it.
///
/// # Errors
/// [`Error::InvalidOption`] for a word that is none of the machine's, which means nothing elsewhere.
pub fn simd_level() -> Result<&'static str> {
    match level::checked() {
        Ok(level) => Ok(level.name()),
        Err(word) => Err(Error::option(level::VARIABLE, format!("{word:?}"), level::expected())),
    }
}

/// The levels of this machine, the widest last.
pub fn simd_levels() -> Vec<&'static str> {
    level::Level::available().map(level::Level::name).collect()
}
