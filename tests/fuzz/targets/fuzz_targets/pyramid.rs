//! Feeds `surfelshop_fuzz::pyramid`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::pyramid(bytes));
