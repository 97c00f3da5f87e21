//! Feeds `surfelshop_fuzz::las`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::las(bytes));
