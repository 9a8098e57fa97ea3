//! Commands whose output and errors are closed, full or slow, more often than in the ordinary
//! tests.

use anyhow::Result;

use super::Args;
use crate::project::{cargo, succeed};

/// Runs the tests of pipes.
///
/// # Errors
/// If a command hangs, or ends with an undocumented status.
pub(super) fn run(args: &Args) -> Result<()> {
    let mut tests = cargo(&["test", "--package", "pt-cli", "--test", "cli", "pipes"]);
    tests.env("PT_PIPES", args.pipes.to_string());
    succeed(&mut tests)
}
