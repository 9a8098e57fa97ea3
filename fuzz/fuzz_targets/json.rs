//! Scene files in the native format.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pathtracer_fuzz::scene(bytes, "json"));

libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, most: usize, seed: u32| {
    pathtracer_fuzz::mutate(data, size, most, seed)
});
