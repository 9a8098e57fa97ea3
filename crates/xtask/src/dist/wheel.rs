//! Wheels for old and new Linux distributions.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use super::names::{Arch, MANYLINUX, files};
use super::program::PROFILE;
use super::tools::{Tools, remap};
use crate::project::{root, shown, succeed, target};
use crate::venv::python_of;

/// Maximum size of a wheel in bytes.
const MAX_BYTES: u64 = 20_000_000;

/// Builds the wheel with the C library of old systems, and checks platform and size; returns its
/// path.
///
/// # Errors
/// If it cannot be built, needs libraries or versions that its platform does not have, or is large.
pub(super) fn build(arch: Arch, tools: &Tools, folder: &Path) -> Result<PathBuf> {
    let triple = arch.gnu_target();
    let mut maturin = Command::new(&tools.python);
    maturin.args(["-m", "maturin", "build", "--quiet", "--locked", "--profile", PROFILE]);
    maturin.args(["--target", triple, "--zig", "--compatibility", MANYLINUX, "--out"]);
    maturin.arg(folder).args(remap(triple)?).current_dir(root());
    let before = files(folder)?;
    succeed(with_tools(&mut maturin, &tools.python)?)?;
    let wheel = files(folder)?.into_iter().find(|file| !before.contains(file));
    let wheel = wheel.with_context(|| format!("{}: expected a wheel", folder.display()))?;
    let bytes = fs::metadata(&wheel)?.len();
    ensure!(bytes <= MAX_BYTES, "{}: {bytes} bytes, at most {MAX_BYTES} expected", wheel.display());
    audit(&wheel, tools)?;
    Ok(wheel)
}

/// Puts the folder of the tools before the others in `PATH`.
fn with_tools<'a>(command: &'a mut Command, python: &Path) -> Result<&'a mut Command> {
    let folder = python.parent().context("Python is in no folder")?.to_owned();
    let others = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(folder).chain(std::env::split_paths(&others));
    Ok(command.env("PATH", std::env::join_paths(all)?))
}

/// Checks by auditwheel that the wheel conforms to the platform in its name.
fn audit(wheel: &Path, tools: &Tools) -> Result<()> {
    let mut show = Command::new(&tools.python);
    show.args(["-m", "auditwheel", "show"]).arg(wheel);
    let output = with_tools(&mut show, &tools.python)?.output().context("auditwheel")?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{}", text.trim());
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let found = platform(&words).with_context(|| format!("{} reports nothing", shown(&show)))?;
    let name = wheel.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !name.contains(found) {
        bail!("{name}: auditwheel finds {found}, expected the platform of the name");
    }
    Ok(())
}

/// Platform in the report of auditwheel, whose lines are joined.
fn platform(report: &str) -> Option<&str> {
    let (_, rest) = report.split_once("consistent with the following platform tag: \"")?;
    Some(rest.split_once('"')?.0)
}

/// Installs the wheel in a new virtual environment of the target folder; returns its program.
///
/// # Errors
/// If it cannot be installed.
pub(super) fn install(wheel: &Path) -> Result<PathBuf> {
    let environment = target()?.join("dist-installed");
    succeed(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&environment))?;
    let python = python_of(&environment);
    let mut pip = Command::new(&python);
    succeed(pip.args(["-m", "pip", "install", "--quiet"]).arg(wheel))?;
    Ok(python.with_file_name(super::program::NAME))
}
