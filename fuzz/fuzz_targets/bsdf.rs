//! Measured materials, referred to by scenes.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pathtracer_fuzz::named(bytes, "bsdf"));
