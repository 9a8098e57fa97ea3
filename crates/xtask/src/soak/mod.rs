//! `cargo xtask soak`: long campaigns against what the renderer promises (docs/guarantees.md). A short form of each
//! is among the tests.

mod bits;
mod eta;
mod kills;
mod target;

use anyhow::Result;

use crate::project::{build_program, step};

/// What to do, and how long.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only this campaign
    #[arg(long, value_name = "CAMPAIGN")]
    only: Option<Campaign>,
    /// Times that a render is killed
    #[arg(long, value_name = "N", default_value_t = 1000)]
    kills: u32,
    /// Of the random instants and damages
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// What is put to the test.
#[derive(clap::ValueEnum, Clone, Copy, PartialEq, Eq)]
enum Campaign {
    /// The same bits in many ways
    Bits,
    /// Errors against their targets
    Target,
    /// When renders end
    Eta,
    /// Renders that are killed
    Kills,
}

/// Runs the campaigns.
///
/// # Errors
/// If a promise is broken.
pub(crate) fn run(args: &Args) -> Result<()> {
    let program = step("building", build_program)?;
    let is_wanted = |campaign| args.only.is_none_or(|only| only == campaign);
    if is_wanted(Campaign::Bits) {
        step("comparing bits", || bits::run(&program))?;
    }
    if is_wanted(Campaign::Target) {
        step("comparing errors with their targets", || target::run(&program))?;
    }
    if is_wanted(Campaign::Eta) {
        step("foreseeing ends", || eta::run(&program))?;
    }
    if is_wanted(Campaign::Kills) {
        step("killing renders", || kills::run(&program, args))?;
    }
    Ok(())
}
