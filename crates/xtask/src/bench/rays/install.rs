//! Installation of Embree: the shared library inside a Python package.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::venv::{self, Installation};

/// Python package with Embree 4.4.0.
const PACKAGE: &str = "embreex==4.4.0.post1";
const PROBE: &str =
    "from importlib.metadata import version; assert version('embreex') == '4.4.0.post1'";
/// Python program that prints the folder of installed packages.
const SITE: &str = "import sysconfig; print(sysconfig.get_path('platlib'))";

/// Installs the package in the target folder, and finds the library in it.
///
/// # Errors
/// If the processor is of another kind, or the package cannot be installed.
pub(super) fn library() -> Result<PathBuf> {
    ensure!(cfg!(target_arch = "x86_64"), "Embree's package is for x86-64 processors only");
    // Without the dependencies of the package: only its library is used.
    let python = match venv::prepare("embree-venv", &["--no-deps", PACKAGE], PROBE)? {
        Installation::Python(python) => python,
        Installation::Missing(reason) => bail!("Embree cannot be installed: {reason}"),
    };
    let output = Command::new(&python).args(["-c", SITE]).output();
    let output = output.with_context(|| format!("{} does not run", python.display()))?;
    let site = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    // Locations used by the tools that bundle libraries into packages, on each system.
    let folders = ["embreex.libs", "embreex/.dylibs", "embreex"].map(|name| site.join(name));
    let found = folders.iter().find_map(|folder| find(folder));
    found.with_context(|| format!("{PACKAGE} in {} has no Embree library", site.display()))
}

/// Library file in `folder`.
fn find(folder: &Path) -> Option<PathBuf> {
    let files = std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    files
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.trim_start_matches("lib").starts_with("embree4")
                && [".so", ".dylib", ".dll"].iter().any(|ending| name.contains(ending))
        })
        .min()
}
