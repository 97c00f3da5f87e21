//! Feeds `surfelshop_fuzz::shader`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::shader(bytes));
