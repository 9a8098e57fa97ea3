//! Fuzz target: arbitrary bytes, read as a tree.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| pt_bvh::fuzz::bytes(data));
