//! Feeds `surfelshop_fuzz::sog`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::sog(bytes));
