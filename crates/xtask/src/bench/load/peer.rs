//! Readers of other projects, each in a Python process that reads files on request.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result};

use crate::project::root;
use crate::venv::{self, Installation};

/// A library: its name in `python/bench_load.py`, and the function that installs its Python module.
type PeerLibrary = (&'static str, fn() -> Result<Installation>);

/// The package `assimp_py` contains assimp itself.
const LIBRARIES: [PeerLibrary; 3] = [
    ("assimp", || {
        let packages = ["assimp_py==1.1.0", "numpy"];
        venv::prepare("load-assimp-venv", &packages, "import numpy, assimp_py")
    }),
    ("mitsuba", crate::peers::prepare),
    ("trimesh", || {
        let packages = ["trimesh==5.2.0", "numpy"];
        venv::prepare("load-trimesh-venv", &packages, "import numpy, trimesh")
    }),
];

/// Process of a reader, which waits for file names.
pub(super) struct PeerReader {
    pub(super) name: &'static str,
    process: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

/// Starts all available readers, and prints which are missing and why.
///
/// # Errors
/// If a process cannot be started.
pub(super) fn start_all() -> Result<Vec<PeerReader>> {
    let mut peers = Vec::new();
    for (name, prepare) in LIBRARIES {
        match prepare()? {
            Installation::Missing(why) => println!("{name} cannot be had: {why}"),
            Installation::Python(python) => peers.push(PeerReader::start(name, &python)?),
        }
    }
    Ok(peers)
}

impl PeerReader {
    fn start(name: &'static str, python: &Path) -> Result<Self> {
        let mut command = Command::new(python);
        command.arg(root().join("crates/xtask/python/bench_load.py")).arg(name);
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let to = process.stdin.take().context("no input")?;
        let from = BufReader::new(process.stdout.take().context("no output")?);
        Ok(Self { name, process, to, from })
    }

    /// Time in seconds to read a file, or `None` if it cannot be read.
    ///
    /// # Errors
    /// If the process has ended.
    pub(super) fn load(&mut self, path: &Path) -> Result<Option<f64>> {
        writeln!(self.to, "{}", path.display())?;
        self.to.flush()?;
        let mut answer = String::new();
        self.from.read_line(&mut answer)?;
        let seconds: f64 =
            answer.trim().parse().with_context(|| format!("{} says {answer:?}", self.name))?;
        Ok(seconds.is_finite().then_some(seconds))
    }
}

impl Drop for PeerReader {
    fn drop(&mut self) {
        // The process ends with its input; a failure to kill it needs no action.
        self.process.kill().ok();
        self.process.wait().ok();
    }
}
