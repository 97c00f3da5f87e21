//! Feeds `surfelshop_fuzz::e57`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::e57(bytes));
