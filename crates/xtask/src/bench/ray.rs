//! Renders on a Ray cluster on this machine: overhead of tasks, memory of the head, and the costs
//! from which larger clusters are estimated (`docs/cluster.md`).

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;

use crate::project::{output_folder, root, succeed};
use crate::python;

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Seconds of each render
    #[arg(long, default_value = "60", value_name = "SECONDS")]
    seconds: u32,
    /// Figure of the memory of the head [default: ray_head.svg in target/bench-ray-out]
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
}

/// Builds the wheel in release mode, installs it with Ray, and measures.
///
/// # Errors
/// If something cannot be installed, or a render fails.
pub(crate) fn run(args: &Args) -> Result<()> {
    let requirements = python::requirements().display().to_string();
    let packages = ["-r", &requirements, "numpy"];
    let python = python::with_release("bench-ray", &packages, "import ray, numpy")?;
    let default = || output_folder("bench-ray-out").map(|folder| folder.join("ray_head.svg"));
    let figure = args.figure.clone().map_or_else(default, Ok)?;
    let mut script = Command::new(python);
    script.arg(root().join("crates/xtask/src/bench/cluster_costs.py")).arg(root().join("scenes"));
    succeed(script.arg(args.seconds.to_string()).arg(&figure))
}
