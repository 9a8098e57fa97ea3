//! `cargo xtask peers`: comparison of the same scenes with Mitsuba 3.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::project::{build_program, output_folder, root, step};
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
    let size = match size {
        RenderSize::Small => "small",
        RenderSize::Full => "full",
    };
    let run = |script: &str, scenes: &str, scene: Option<&str>| {
        let mut command = Command::new(python);
        command.arg(root().join("crates/xtask/python").join(script));
        command.arg("--program").arg(program);
        command.arg("--scenes").arg(root().join(scenes));
        command.arg("--output").arg(output_folder("peers")?);
        command.args(["--size", size]);
        command.args(scene.iter().flat_map(|name| ["--scene", name]));
        let status = command.status();
        let status = status.with_context(|| format!("{} does not run", python.display()))?;
        ensure!(status.success(), "the comparison with Mitsuba failed: {script}");
        Ok(())
    };
    run("peers.py", "scenes/mitsuba", scene)?;
    // Scenes with alpha are compared together.
    if scene.is_some() { Ok(()) } else { run("alpha.py", "scenes/alpha", None) }
}
