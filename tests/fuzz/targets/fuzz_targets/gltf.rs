//! Feeds `surfelshop_fuzz::gltf`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfelshop_fuzz::gltf(bytes));
