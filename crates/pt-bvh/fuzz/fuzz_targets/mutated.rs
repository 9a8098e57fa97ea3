//! Fuzz target: modified bytes of trees, with a matching checksum.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    pt_bvh::fuzz::mutated(data);
});
