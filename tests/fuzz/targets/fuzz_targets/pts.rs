//! Feeds `surfelshop_fuzz::pts`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::pts(bytes));
