//! See [`tiltvp_fuzz::log`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::log(data));
