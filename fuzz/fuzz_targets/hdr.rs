//! Radiance HDR images.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pathtracer_fuzz::image(bytes, "hdr"));
