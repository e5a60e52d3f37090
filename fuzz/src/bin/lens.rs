//! See [`tiltvp_fuzz::lens`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::lens(data));
