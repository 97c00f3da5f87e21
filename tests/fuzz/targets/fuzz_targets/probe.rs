//! Feeds `surfelshop_fuzz::probe`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::probe(bytes));
