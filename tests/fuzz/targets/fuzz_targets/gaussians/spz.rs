//! Feeds `surfelshop_fuzz::spz`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::spz(bytes));
