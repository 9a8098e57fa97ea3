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
    /// Record what Mitsuba renders as the references of `cargo xtask test`, for scenes that have
    /// none, or one of other files or another version of Mitsuba
    #[arg(long, conflicts_with = "size")]
    record: bool,
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
    let scene = args.scene.iter().flat_map(|name| ["--scene", name]);
    if args.record {
        let mut record = images(Command::new(&python), Path::new(""), RenderSize::Small)?;
        return succeed(with_references(&mut record).arg("--record").args(scene));
    }
    let program = build_program()?;
    succeed(images(Command::new(&python), &program, args.size)?.args(scene))?;
    // Scenes with alpha are compared together.
    if args.scene.is_some() {
        return Ok(());
    }
    succeed(&mut alpha(Command::new(&python), &program, args.size)?)
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

/// Compares small images with the references of Mitsuba, at a low priority. Returns the table, and
/// true if the images agree.
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
    let mut images = images(niced(), program, RenderSize::Small)?;
    with_references(&mut images);
    for mut script in [images, alpha(niced(), program, RenderSize::Small)?] {
        let output = script.output().with_context(|| shown(&script))?;
        table += &String::from_utf8_lossy(&output.stdout);
        table += &String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Ok((table, false));
        }
    }
    Ok((table, true))
}

/// The comparison of images, by this Python.
fn images(python: Command, program: &Path, size: RenderSize) -> Result<Command> {
    script(python, "peers.py", program, "scenes/mitsuba", size)
}

/// The comparison of alpha, by this Python.
fn alpha(python: Command, program: &Path, size: RenderSize) -> Result<Command> {
    script(python, "alpha.py", program, "scenes/alpha", size)
}

/// The comparison of images with references that were recorded.
fn with_references(images: &mut Command) -> &mut Command {
    images.arg("--references").arg(root().join("crates/xtask/python/mitsuba_references.json"))
}

fn script(
    mut python: Command,
    file: &str,
    program: &Path,
    scenes: &str,
    size: RenderSize,
) -> Result<Command> {
    let size = match size {
        RenderSize::Small => "small",
        RenderSize::Full => "full",
    };
    python.arg(root().join("crates/xtask/python").join(file));
    python.arg("--program").arg(program);
    python.arg("--scenes").arg(root().join(scenes));
    python.arg("--output").arg(output_folder("peers")?);
    python.args(["--size", size]);
    Ok(python)
}
