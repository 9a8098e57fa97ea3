//! Sets of Python packages, each in its own virtual environment in the target folder.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::project::{shown, target};

/// Result of the installation of packages.
pub(crate) enum Installation {
    /// A Python with all packages.
    Python(PathBuf),
    /// Reason why they are not available.
    Missing(String),
}

impl Installation {
    /// The Python, if the packages are available.
    pub(crate) fn python(&self) -> Option<&Path> {
        match self {
            Self::Python(python) => Some(python),
            Self::Missing(_) => None,
        }
    }

    /// Reason why the packages are not available, or `None` if they are.
    pub(crate) fn missing(&self) -> Option<&String> {
        match self {
            Self::Python(_) => None,
            Self::Missing(reason) => Some(reason),
        }
    }
}

/// Creates the virtual environment `name` in the target folder with `install`, the arguments of
/// pip, unless it exists and the Python program `probe` succeeds in it.
///
/// # Errors
/// If the target folder cannot be found.
pub(crate) fn prepare(name: &str, install: &[&str], probe: &str) -> Result<Installation> {
    prepare_by("python3", name, install, probe)
}

/// [`prepare`] with a given `interpreter`, for packages that need a certain version of Python.
///
/// # Errors
/// If the target folder cannot be found.
pub(crate) fn prepare_by(
    interpreter: &str,
    name: &str,
    install: &[&str],
    probe: &str,
) -> Result<Installation> {
    let folder = target()?.join(name);
    let python = python_of(&folder);
    if succeeds(&python, probe) {
        return Ok(Installation::Python(python));
    }
    let mut make = Command::new(interpreter);
    make.args(["-m", "venv"]).arg(&folder);
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(install);
    for command in [&mut make, &mut pip] {
        if let Err(reason) = try_to(command) {
            return Ok(Installation::Missing(reason));
        }
    }
    if succeeds(&python, probe) {
        Ok(Installation::Python(python))
    } else {
        Ok(Installation::Missing(format!("{} fails in {}", install.join(" "), python.display())))
    }
}

/// Python of a virtual environment.
pub(crate) fn python_of(environment: &Path) -> PathBuf {
    environment.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" })
}

fn succeeds(python: &Path, probe: &str) -> bool {
    let output = Command::new(python).args(["-c", probe]).output();
    output.is_ok_and(|o| o.status.success())
}

/// Runs a command without its output; the error is one line.
///
/// # Errors
/// If it cannot be started, or fails: the last line that it wrote.
pub(crate) fn try_to(command: &mut Command) -> Result<(), String> {
    let shown = shown(command);
    let output = command.output().map_err(|e| format!("{shown}: {e}"))?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let last = text.lines().rfind(|l| !l.trim().is_empty()).unwrap_or("no message");
    Err(format!("{shown}: {}", last.trim()))
}
