//! See [`tiltvp_fuzz::options`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::options(data));
