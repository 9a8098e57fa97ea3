//! `cargo xtask peers`: comparison of the same scenes with Mitsuba 3.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::project::{build_program, output_folder, root, shown, step, succeed};
use crate::venv::{self, Installation};

/// Version of Mitsuba, which renders and reads the images.
const MITSUBA: &str = "3.9.1";

/// Options of the comparison.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Amount of rendering
    #[arg(long, default_value = "full")]
    size: RenderSize,
    /// Only the scene of this name
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
}

/// Amount of rendering.
#[derive(clap::ValueEnum, Clone, Copy)]
pub(crate) enum RenderSize {
    /// 64 pixels wide, seconds
    Small,
    /// 320 pixels wide and converged, minutes
    Full,
}

/// Installs the packages and compares.
///
/// # Errors
/// If something cannot be installed, or the images differ.
pub(crate) fn run(args: &Args) -> Result<()> {
    let python = match step("installing Mitsuba", prepare)? {
        Installation::Python(python) => python,
        Installation::Missing(reason) => bail!("{reason}"),
    };
    compare(&python, &build_program()?, args.size, args.scene.as_deref())
}

/// Creates a virtual environment with Mitsuba in the target folder.
///
/// # Errors
/// If the target folder cannot be found.
pub(crate) fn prepare() -> Result<Installation> {
    let package = format!("mitsuba=={MITSUBA}");
    let probe = format!("import numpy, mitsuba; assert mitsuba.__version__ == '{MITSUBA}'");
    venv::prepare("peers-venv", &[&package, "numpy"], &probe)
}

/// Renders with both and compares.
///
/// # Errors
/// If the images differ, or one cannot be rendered.
pub(crate) fn compare(
    python: &Path,
    program: &Path,
    size: RenderSize,
    scene: Option<&str>,
) -> Result<()> {
    let [mut images, mut alpha] = scripts(|| Command::new(python), program, size)?;
    succeed(images.args(scene.iter().flat_map(|name| ["--scene", name])))?;
    // Scenes with alpha are compared together.
    if scene.is_some() { Ok(()) } else { succeed(&mut alpha) }
}

/// Compares small images at a low priority. Returns the table, and true if the images agree.
///
/// # Errors
/// If a script cannot be started.
pub(crate) fn compare_in_background(python: &Path, program: &Path) -> Result<(String, bool)> {
    let niced = || {
        if cfg!(windows) {
            return Command::new(python);
        }
        let mut command = Command::new("nice");
        command.args(["-n", "19"]).arg(python);
        command
    };
    let mut table = String::new();
    for mut script in scripts(niced, program, RenderSize::Small)? {
        let output = script.output().with_context(|| shown(&script))?;
        table += &String::from_utf8_lossy(&output.stdout);
        table += &String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Ok((table, false));
        }
    }
    Ok((table, true))
}

/// The comparisons of images and of alpha, by this Python.
fn scripts(python: impl Fn() -> Command, program: &Path, size: RenderSize) -> Result<[Command; 2]> {
    let output = output_folder("peers")?;
    let size = match size {
        RenderSize::Small => "small",
        RenderSize::Full => "full",
    };
    let scripts = [("peers.py", "scenes/mitsuba"), ("alpha.py", "scenes/alpha")];
    Ok(scripts.map(|(script, scenes)| {
        let mut command = python();
        command.arg(root().join("crates/xtask/python").join(script));
        command.arg("--program").arg(program);
        command.arg("--scenes").arg(root().join(scenes));
        command.arg("--output").arg(&output);
        command.args(["--size", size]);
        command
    }))
}
