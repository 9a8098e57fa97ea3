//! Chores of the project: `cargo xtask --help`.
//!
//! Images are rendered by the program, built and run as its users do. Only `bench rays` and
//! `bench load` link parts of it, because they compare these parts with those of others.

mod bench;
mod blender;
mod dist;
mod features;
mod figures;
mod guide;
mod imports;
mod oidn;
mod pbrt;
mod peers;
mod project;
mod python;
mod soak;
mod style;
mod test;
mod venv;

use std::process::ExitCode;

use clap::Parser;

/// Chores of the pathtracer project
#[derive(Parser)]
#[command(name = "cargo xtask", max_term_width = 100)]
enum Chore {
    /// Check everything: format, lints, documentation, all tests, and a small comparison with
    /// Mitsuba
    Test(test::Args),
    /// Check prose, the glossary, imports and the guide in seconds, as a part of test; builds the
    /// guide into target/guide
    Style,
    /// Build the wheel of the Python module, install it outside of the source tree, and test it
    /// there, as a part of test
    Python,
    /// Compare the scenes of scenes/mitsuba with what Mitsuba 3 renders of them
    Peers(peers::Args),
    /// Compare the scenes of scenes/gltf with what Blender's Cycles renders of them
    Blender(blender::Args),
    /// Compare scenes of pbrt-v4 with the pictures that it made of them
    Pbrt(pbrt::Args),
    /// Render the figures of the report on the university course's program into target/figures
    Figures(figures::Args),
    /// Long campaigns against the guarantees: renders that are killed a thousand times, files that
    /// cause failures
    Soak(soak::Args),
    /// Build the distribution into target/dist (static programs, wheels, bill of materials,
    /// checksums), and check it
    Dist(dist::Args),
    /// Measure speed and memory
    #[command(subcommand)]
    Bench(bench::Bench),
}

fn main() -> ExitCode {
    let done = match Chore::parse() {
        Chore::Test(args) => test::run(&args),
        Chore::Style => {
            style::check().and_then(|()| imports::check()).and_then(|()| guide::check())
        }
        Chore::Python => python::run(),
        Chore::Peers(args) => peers::run(&args),
        Chore::Blender(args) => blender::run(&args),
        Chore::Pbrt(args) => pbrt::run(&args),
        Chore::Figures(args) => figures::run(&args),
        Chore::Soak(args) => soak::run(&args),
        Chore::Dist(args) => dist::run(&args),
        Chore::Bench(bench) => bench::run(&bench),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}
