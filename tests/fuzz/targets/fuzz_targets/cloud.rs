//! Feeds `surfelshop_fuzz::cloud`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::cloud(bytes));
