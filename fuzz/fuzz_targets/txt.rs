//! Curves, referred to by Mitsuba scenes.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| pathtracer_fuzz::named(bytes, "txt"));
