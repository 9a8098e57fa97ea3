//! Features of crates: `cargo xtask test` builds each crate once if this program, the tests and the
//! Python module use it with the same features.

use std::collections::BTreeSet;

use anyhow::{Context, Result, ensure};

use crate::project::{cargo, shown};

/// Packages that are built alone, with the arguments that select them.
const ALONE: [(&str, &[&str]); 2] = [
    ("xtask", &["--package", "xtask"]),
    ("pathtracer-python", &["--package", "pathtracer-python", "--features", "as-in-tests"]),
];

/// Compares the features of all crates with those of the tests.
///
/// # Errors
/// If a crate has other features in the tests, and is thus built twice.
pub(crate) fn check() -> Result<()> {
    let tests = crates(&["--workspace", "--edges", "normal,build,dev"])?;
    for (package, selection) in ALONE {
        let own = crates(&[selection, &["--edges", "normal,build"]].concat())?;
        let differ = own.difference(&tests).filter(|name| !name.starts_with(package));
        let differ: Vec<_> = differ.map(String::as_str).collect();
        ensure!(
            differ.is_empty(),
            "the tests use other features of these crates than {package}, so that they and all \
             that depends on them are built twice: {}; expected the same, add the missing ones to \
             its Cargo.toml (cargo tree --workspace --edges features --invert NAME shows them)",
            differ.join("; ")
        );
    }
    Ok(())
}

/// Crates of a selection of packages, with their versions and features.
fn crates(selection: &[&str]) -> Result<BTreeSet<String>> {
    let format = ["tree", "--prefix", "none", "--format", "{p} {f}"];
    let mut tree = cargo(&[&format[..], selection].concat());
    let output = tree.output().with_context(|| shown(&tree))?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} failed: {errors}", shown(&tree));
    let text = String::from_utf8(output.stdout).context("the tree of crates is no text")?;
    // A repeated crate has a mark in place of its dependencies.
    Ok(text.lines().map(|line| line.trim_end_matches(" (*)").to_owned()).collect())
}
