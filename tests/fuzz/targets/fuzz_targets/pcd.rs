//! Feeds `surfelshop_fuzz::pcd`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::pcd(bytes));
