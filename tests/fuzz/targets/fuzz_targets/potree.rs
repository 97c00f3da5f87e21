//! Feeds `surfelshop_fuzz::potree`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::potree(bytes));
