//! See [`tiltvp_fuzz::image`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::image(data));
