//! Tests of the libraries on an emulated aarch64 processor.

use anyhow::Result;

use super::emulator::Emulator;
use super::names::Arch;
use super::tools::empty_libraries;
use crate::project::{cargo, succeed};

/// Packages whose tests run, the fastest first.
const PACKAGES: [&str; 7] =
    ["pt-math", "pt-memory", "pt-io", "pt-image", "pt-cpu", "pt-bvh", "pt-core"];

/// Runs the unit tests.
///
/// # Errors
/// If one fails.
pub(super) fn run(emulator: &Emulator) -> Result<()> {
    let target = Arch::Aarch64.static_target();
    let variable =
        |end: &str| format!("CARGO_TARGET_{}_{end}", target.replace('-', "_").to_ascii_uppercase());
    let mut test = cargo(&["test", "--quiet", "--locked", "--lib", "--target", target]);
    test.args(PACKAGES.iter().flat_map(|package| ["--package", package]));
    test.env(variable("LINKER"), "rust-lld").env(variable("RUNNER"), emulator.path());
    test.env(variable("RUSTFLAGS"), format!("-L{}", empty_libraries()?.display()));
    succeed(&mut test)
}
