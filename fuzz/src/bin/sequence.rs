//! See [`tiltvp_fuzz::sequence`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::sequence(data));
