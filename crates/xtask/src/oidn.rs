//! Installation of Intel Open Image Denoise, which the tests of denoising open.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::venv::{self, Installation};

/// Python package with the library.
const PACKAGE: &str = "pyoidn";
const VERSION: &str = "2.5.1.0";

/// Environment variable with the path of the library.
pub(crate) const VARIABLE: &str = "PATHTRACER_OIDN";

/// Creates a virtual environment with the library in the target folder, and returns the folder of
/// its packages, or the reason why it is missing.
///
/// # Errors
/// If the target folder cannot be found, or Python does not run.
pub(crate) fn prepare() -> Result<Result<PathBuf, String>> {
    let package = format!("{PACKAGE}=={VERSION}");
    let probe =
        format!("import importlib.metadata as m; assert m.version('{PACKAGE}') == '{VERSION}'");
    // Only the library: the dependencies of the Python package are not needed.
    let python = match venv::prepare("oidn-venv", &["--no-deps", &package], &probe)? {
        Installation::Python(python) => python,
        Installation::Missing(reason) => return Ok(Err(reason)),
    };
    let script = "import sysconfig; print(sysconfig.get_path('platlib'))";
    let output = Command::new(&python)
        .args(["-c", script])
        .output()
        .with_context(|| format!("{} does not run", python.display()))?;
    ensure!(output.status.success(), "{} does not know its packages", python.display());
    let folder = String::from_utf8(output.stdout).context("the folder has a name in UTF-8")?;
    Ok(Ok(PathBuf::from(folder.trim())))
}
