//! Our own scene files.

mod common;
#[path = "json/round_trip.rs"]
mod round_trip;
