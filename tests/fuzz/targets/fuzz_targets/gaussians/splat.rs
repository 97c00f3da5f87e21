//! Feeds `surfelshop_fuzz::splat`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::splat(bytes));
