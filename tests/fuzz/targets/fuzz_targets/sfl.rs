//! Feeds `surfelshop_fuzz::sfl`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::sfl(bytes));
