//! Paths of the project, and commands.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};

/// Folder of the workspace.
pub(crate) fn root() -> &'static Path {
    // crates/xtask is two folders below it.
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here)
}

/// Cargo's target folder: this program is `<target>/<profile>/xtask`.
///
/// # Errors
/// If the system does not report the path of this program.
pub(crate) fn target() -> Result<PathBuf> {
    let program = std::env::current_exe().context("where is this program?")?;
    let target = program.ancestors().nth(2).context("this program is in no target folder")?;
    Ok(target.to_owned())
}

/// Folder of files that are not part of the project, beside the workspace; `None` if it does not
/// exist.
pub(crate) fn shared() -> Option<PathBuf> {
    let path = root().parent()?.join("shared");
    path.is_dir().then_some(path)
}

/// Modes in which scenes of the university course are rendered: name and option.
pub(crate) const COURSE_MODES: [(&str, Option<&str>); 2] =
    [("default", None), ("cs184", Some("--cs184"))];

/// Path of a scene of the university course; `None` if it is missing.
pub(crate) fn course_scene(name: &str) -> Option<PathBuf> {
    let path = shared()?.join("scenes/dae").join(name);
    path.is_file().then_some(path)
}

/// Cargo command in the workspace.
pub(crate) fn cargo(args: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(args).current_dir(root());
    command
}

/// Runs a command, which must succeed.
///
/// # Errors
/// If it cannot be started or fails.
pub(crate) fn succeed(command: &mut Command) -> Result<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    let status = command.status().with_context(|| format!("{name} cannot be started"))?;
    ensure!(status.success(), "{} failed: {status}", shown(command));
    Ok(())
}

/// A command as it would be typed.
pub(crate) fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|w| w.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Builds the program as its users do.
///
/// # Errors
/// If it does not build.
pub(crate) fn build_program() -> Result<PathBuf> {
    succeed(&mut cargo(&["build", "--quiet", "--release", "--package", "pt-cli"]))?;
    built("release")
}

/// Builds the program with overflow checks, reusing all but the linking from the tests.
///
/// # Errors
/// If it does not build.
pub(crate) fn build_checked_program() -> Result<PathBuf> {
    // Builds the whole workspace, so that no crate is rebuilt with fewer features.
    succeed(&mut cargo(&["build", "--quiet", "--workspace", "--bins"]))?;
    built("debug")
}

fn built(profile: &str) -> Result<PathBuf> {
    let program =
        target()?.join(profile).join(format!("pathtracer{}", std::env::consts::EXE_SUFFIX));
    ensure!(program.is_file(), "{} is missing after the build", program.display());
    Ok(program)
}

/// Path of a folder below cargo's target folder, created if necessary.
///
/// # Errors
/// If it cannot be created.
pub(crate) fn output_folder(name: &str) -> Result<PathBuf> {
    let folder = target()?.join(name);
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// Prints a heading, does the work, and prints the time taken.
///
/// # Errors
/// Any error of the work.
pub(crate) fn step<T>(heading: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    println!("\n== {heading}");
    let start = Instant::now();
    let done = work();
    let end = if done.is_ok() { "done" } else { "FAILED" };
    println!("== {heading}: {end} after {:.1} s", start.elapsed().as_secs_f64());
    done
}
