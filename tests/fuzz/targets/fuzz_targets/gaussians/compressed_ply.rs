//! Feeds `surfelshop_fuzz::compressed_ply`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::compressed_ply(bytes));
