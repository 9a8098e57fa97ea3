//! `cargo xtask blender`: comparison of glTF scenes with Blender's Cycles.

use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::project::{build_program, output_folder, root, step};
use crate::venv::{self, Installation};

/// Scenes of `scenes/gltf` that are compared. `lights` is excluded, since the falloff of its spot
/// light differs in Blender.
const SCENES: [&str; 5] = ["glass", "instances", "materials", "skin", "textures"];

/// Options of the comparison.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only the scene of this name
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
}

/// Installs Blender and compares.
///
/// # Errors
/// If it cannot be installed, or the images differ.
pub(crate) fn run(args: &Args) -> Result<()> {
    let python = match step("installing Blender", prepare)? {
        Installation::Python(python) => python,
        Installation::Missing(reason) => bail!("{reason}"),
    };
    let mut command = Command::new(&python);
    command.arg(root().join("crates/xtask/python/blender.py"));
    command.arg("--program").arg(build_program()?);
    command.arg("--scenes").arg(root().join("scenes/gltf"));
    command.arg("--output").arg(output_folder("blender")?);
    match &args.scene {
        Some(name) => command.arg(name),
        None => command.args(SCENES),
    };
    let status = command.status().with_context(|| format!("{} does not run", python.display()))?;
    ensure!(status.success(), "the comparison with Blender failed");
    Ok(())
}

/// Creates a virtual environment with Blender in the target folder. There is only a package for
/// Python 3.11, which depends on NumPy.
///
/// # Errors
/// If the target folder cannot be found.
pub(crate) fn prepare() -> Result<Installation> {
    let probe = "import numpy, bpy; from importlib.metadata import version; assert version('bpy') == '5.0.1'";
    venv::prepare_by("python3.11", "cycles-venv", &["bpy==5.0.1"], probe)
}
