//! See [`tiltvp_fuzz::training`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::training(data));
