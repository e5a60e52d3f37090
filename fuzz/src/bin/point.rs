//! See [`tiltvp_fuzz::point`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::point(data));
