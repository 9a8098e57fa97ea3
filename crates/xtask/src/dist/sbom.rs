//! Bill of materials of the program: its packages with versions, licences and checksums, as
//! CycloneDX.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use super::names::bill_of_materials;
use super::tools::Tools;
use crate::project::{root, succeed};

/// Folder of the packages of the workspace, and that of the program in it.
const PACKAGES: &str = "crates";
const PROGRAM: &str = "pt-cli";

/// Writes the bill of materials, in which folders of this machine are replaced.
///
/// # Errors
/// If cargo-cyclonedx fails.
pub(super) fn write(tools: &Tools, folder: &Path) -> Result<()> {
    let name = bill_of_materials();
    let packages = root().join(PACKAGES);
    let mut cyclonedx = Command::new(&tools.cyclonedx);
    cyclonedx.args(["cyclonedx", "--quiet", "--format", "json", "--spec-version", "1.5"]);
    cyclonedx.args(["--no-build-deps", "--target", "all", "--override-filename"]);
    cyclonedx.arg(name.trim_end_matches(".json")).arg("--manifest-path");
    let done = succeed(cyclonedx.arg(packages.join(PROGRAM).join("Cargo.toml")));
    let text = fs::read_to_string(packages.join(PROGRAM).join(&name));
    remove(&packages, &name)?;
    done?;
    let text = text.with_context(|| format!("cargo-cyclonedx wrote no {name}"))?;
    let text = text.replace(&root().display().to_string(), "/pathtracer");
    let path = folder.join(name);
    fs::write(&path, text).with_context(|| path.display().to_string())
}

/// Removes the file that cargo-cyclonedx writes for each package of the workspace.
fn remove(packages: &Path, name: &str) -> Result<()> {
    for package in fs::read_dir(packages).with_context(|| packages.display().to_string())? {
        let file = package?.path().join(name);
        if file.is_file() {
            fs::remove_file(&file).with_context(|| file.display().to_string())?;
        }
    }
    Ok(())
}
