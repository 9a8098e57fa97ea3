//! The Python module against other modules: ray queries, the time of an import, and renders against
//! the program of the same wheel.

use std::process::Command;

use anyhow::Result;

use crate::project::{root, succeed};
use crate::python;

/// Modules that are measured. Open3D needs the system library libusb-1.0; without it, the others
/// are measured.
const PACKAGES: [&str; 6] = ["bpy", "embreex", "mitsuba", "numpy", "open3d", "trimesh"];

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Rays of each query
    #[arg(long, default_value = "1000000", value_name = "N")]
    rays: u32,
}

/// Builds the wheel in release mode, installs it beside the other modules, and measures.
///
/// # Errors
/// If something cannot be installed, or a measurement fails.
pub(crate) fn run(args: &Args) -> Result<()> {
    let python = python::with_release("bench-python", &PACKAGES, "import embreex, trimesh")?;
    let mut script = Command::new(python);
    script.arg(root().join("crates/xtask/src/bench/python_module.py"));
    succeed(script.arg(root().join("scenes")).arg(args.rays.to_string()))
}
