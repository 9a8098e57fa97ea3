//! Bill of materials of the program: its packages with versions, licences and checksums, as
//! CycloneDX.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use super::names::bill_of_materials;
use super::tools::Tools;
use crate::project::{root, succeed};

/// Package of the program.
const PACKAGE: &str = "crates/pt-cli";

/// Writes the bill of materials.
///
/// # Errors
/// If cargo-cyclonedx fails.
pub(super) fn write(tools: &Tools, folder: &Path) -> Result<()> {
    let name = bill_of_materials();
    let manifest = root().join(PACKAGE).join("Cargo.toml");
    let mut cyclonedx = Command::new(&tools.cyclonedx);
    cyclonedx.args(["cyclonedx", "--quiet", "--format", "json", "--spec-version", "1.5"]);
    cyclonedx.args(["--no-build-deps", "--target", "all", "--override-filename"]);
    cyclonedx.arg(name.trim_end_matches(".json")).arg("--manifest-path").arg(&manifest);
    succeed(&mut cyclonedx)?;
    let written = root().join(PACKAGE).join(&name);
    fs::rename(&written, folder.join(&name)).with_context(|| written.display().to_string())
}
