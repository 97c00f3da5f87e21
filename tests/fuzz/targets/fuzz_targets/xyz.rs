//! Feeds `surfelshop_fuzz::xyz`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::xyz(bytes));
