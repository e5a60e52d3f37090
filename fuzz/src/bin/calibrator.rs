//! See [`tiltvp_fuzz::calibrator`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::calibrator(data));
