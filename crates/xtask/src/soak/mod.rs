//! `cargo xtask soak`: long campaigns against what the renderer promises (docs/guarantees.md). A
//! short form of each is among the tests.

mod bits;
mod eta;
mod fuzz;
mod kills;
mod mutations;
mod pipes;
mod target;
mod wild;

use anyhow::Result;

use crate::project::{build_program, step};

/// What to do, and how long.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Which campaigns; without any, all of them
    #[arg(value_name = "CAMPAIGN")]
    campaigns: Vec<Campaign>,
    /// Times that a render is killed
    #[arg(long, value_name = "N", default_value_t = 1000)]
    kills: u32,
    /// Of the random instants and damages
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Times that each file is damaged
    #[arg(long, value_name = "N", default_value_t = 1000)]
    mutations: u32,
    /// Times that each command prints to what is closed, full or slow, each way
    #[arg(long, value_name = "N", default_value_t = 200)]
    pipes: u32,
    /// How long each fuzz target runs
    #[arg(long, value_name = "MINUTES", default_value_t = 10.0)]
    minutes: f64,
    /// Only this fuzz target, named as the ending of the files that it reads; may be given several
    /// times
    #[arg(long, value_name = "ENDING")]
    format: Vec<String>,
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
    /// Files with random damage
    Mutations,
    /// Commands that cannot print
    Pipes,
    /// Files that a fuzzer makes up; needs the nightly toolchain
    Fuzz,
    /// Files that packages of Python and npm ship; needs a network
    Wild,
}

/// Runs the campaigns.
///
/// # Errors
/// If a promise is broken.
pub(crate) fn run(args: &Args) -> Result<()> {
    let is_wanted = |campaign| args.campaigns.is_empty() || args.campaigns.contains(&campaign);
    if [Campaign::Bits, Campaign::Target, Campaign::Eta, Campaign::Kills].into_iter().any(is_wanted)
    {
        of_renders(args, is_wanted)?;
    }
    if is_wanted(Campaign::Mutations) {
        step("damaging files", || mutations::run(args))?;
    }
    if is_wanted(Campaign::Pipes) {
        step("closing pipes", || pipes::run(args))?;
    }
    if is_wanted(Campaign::Fuzz) {
        step("fuzzing", || fuzz::run(args.minutes, &args.format))?;
    }
    if is_wanted(Campaign::Wild) {
        let program = step("building", build_program)?;
        step("rendering files of others", || wild::run(&program))?;
    }
    Ok(())
}

/// Those that run the program.
fn of_renders(args: &Args, is_wanted: impl Fn(Campaign) -> bool) -> Result<()> {
    let program = step("building", build_program)?;
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
