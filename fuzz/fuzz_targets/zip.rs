//! ZIP archives with scenes.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pathtracer_fuzz::scene(bytes, "zip"));
