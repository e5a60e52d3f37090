//! See [`tiltvp_fuzz::corner`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| tiltvp_fuzz::corner(data));
