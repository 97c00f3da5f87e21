//! Feeds `surfelshop_fuzz::ptx`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::ptx(bytes));
