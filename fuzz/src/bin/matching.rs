//! See [`tiltvp_fuzz::matching`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::matching(data));
