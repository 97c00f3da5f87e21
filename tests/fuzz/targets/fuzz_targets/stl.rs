//! Feeds `surfelshop_fuzz::stl`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::stl(bytes));
