//! `cargo xtask soak`: long campaigns against what the renderer promises (docs/guarantees.md). A short form of each
//! is among the tests.

mod bits;
mod eta;
mod kills;

use anyhow::Result;

use crate::project::{build_program, step};

/// How long.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Times that a render is killed
    #[arg(long, value_name = "N", default_value_t = 1000)]
    kills: u32,
    /// Of the random instants and damages
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Runs the campaigns.
///
/// # Errors
/// If a promise is broken.
pub(crate) fn run(args: &Args) -> Result<()> {
    let program = step("building", build_program)?;
    step("comparing bits", || bits::run(&program))?;
    step("foreseeing ends", || eta::run(&program))?;
    step("killing renders", || kills::run(&program, args))
}
