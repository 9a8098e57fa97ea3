//! The bytes of trees, changed, with a checksum that goes with the change.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    pt_bvh::fuzz::mutated(data);
});
