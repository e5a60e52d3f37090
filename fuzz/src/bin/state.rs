//! See [`tiltvp_fuzz::state`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::state(data));
