//! The widest vectors that this process uses.

use tiltvp_kernels::level;

use crate::error::{Error, Result};

/// The level of this process: `"fallback"`, `"sse4.2"`, `"avx2"`, `"avx512"` or `"neon"`, the widest of the machine where
/// [`cap_simd_level`] was not called. Answers do not depend on it.
pub fn simd_level() -> &'static str {
    level::level().name()
}

/// Caps the level of this process, before anything else is asked of the crate; `option` is what messages call it.
///
/// # Errors
/// [`Error::InvalidOption`] for a word that is none of the machine's, and where another level is in use already.
pub fn cap_simd_level(option: &'static str, word: &str) -> Result<()> {
    if level::cap(word) {
        return Ok(());
    }
    Err(Error::option(option, format!("{word:?}"), level::expected()))
}

/// The levels of this machine, the widest last.
pub fn simd_levels() -> Vec<&'static str> {
    level::Level::available().map(level::Level::name).collect()
}
