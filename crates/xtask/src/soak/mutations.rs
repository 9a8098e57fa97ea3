//! Good files of all formats with random damage, more often than in the ordinary tests, and with
//! another seed.

use anyhow::Result;

use super::Args;
use crate::project::{cargo, succeed};

/// Runs the tests of damaged files.
///
/// # Errors
/// If one of them fails.
pub(super) fn run(args: &Args) -> Result<()> {
    let mut tests = cargo(&["test", "--package", "pt-formats", "--tests", "damage"]);
    tests.env("PT_MUTATIONS", args.mutations.to_string());
    tests.env("PT_MUTATION_SEED", args.seed.to_string());
    succeed(&mut tests)
}
