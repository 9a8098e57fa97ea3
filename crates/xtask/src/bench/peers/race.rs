//! Measurement of one renderer on one scene.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::Args;
use super::install::LLVM;
use super::scene::SceneFiles;
use crate::bench::measure::read_summary;
use crate::bench::peers::install::PeerPackage;
use crate::project::{root, succeed};

/// Maximum number of surfaces of a path, including the lamp: Mitsuba's depth.
const DEPTH: u32 = 6;

/// A renderer in one of its modes.
pub(super) struct PeerRenderer {
    pub(super) name: &'static str,
    pub(super) kind: PeerPackage,
    arguments: &'static [&'static str],
}

const LLVM_MODE: &str = "llvm_ad_rgb";

/// All measured peers.
pub(super) const PEERS: [PeerRenderer; 7] = [
    peer(
        "mitsuba-scalar",
        PeerPackage::Mitsuba,
        &["--variant", "scalar_rgb", "--sampler", "independent"],
    ),
    peer(
        "mitsuba-llvm",
        PeerPackage::MitsubaLlvm,
        &["--variant", LLVM_MODE, "--sampler", "independent"],
    ),
    peer(
        "mitsuba-multijitter",
        PeerPackage::MitsubaLlvm,
        &["--variant", LLVM_MODE, "--sampler", "multijitter"],
    ),
    peer(
        "mitsuba-ldsampler",
        PeerPackage::MitsubaLlvm,
        &["--variant", LLVM_MODE, "--sampler", "ldsampler"],
    ),
    peer("cycles", PeerPackage::Cycles, &[]),
    peer("cycles-no-light-tree", PeerPackage::Cycles, &["--no-light-tree"]),
    peer("luxcore", PeerPackage::LuxCore, &[]),
];

const fn peer(
    name: &'static str,
    kind: PeerPackage,
    arguments: &'static [&'static str],
) -> PeerRenderer {
    PeerRenderer { name, kind, arguments }
}

/// Resources that a renderer used for an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ResourceUse {
    /// Wall-clock seconds of rendering, the minimum of all repeats.
    pub(super) wall: f64,
    /// Processor seconds of rendering per thread, the minimum of all repeats: the wall-clock time
    /// on an otherwise idle machine.
    pub(super) cpu: f64,
    /// Seconds from the start of the process to the first sample.
    pub(super) start: f64,
    /// Part of these seconds that is spent loading the program and its libraries.
    pub(super) imports: f64,
    /// Peak memory of the process.
    pub(super) peak_bytes: f64,
}

impl ResourceUse {
    /// Converts to JSON for storage.
    pub(super) fn to_json(self) -> Value {
        let Self { wall, cpu, start, imports, peak_bytes } = self;
        json!({"wall": wall, "cpu": cpu, "start": start, "imports": imports, "peak_bytes": peak_bytes})
    }

    /// Parses stored JSON.
    ///
    /// # Errors
    /// If a number is missing.
    pub(super) fn from_json(json: &Value) -> Result<Self> {
        let number = |key: &str| {
            json.get(key).and_then(Value::as_f64).with_context(|| format!("{key} is not known"))
        };
        Ok(Self {
            wall: number("wall")?,
            cpu: number("cpu")?,
            start: number("start")?,
            imports: number("imports")?,
            peak_bytes: number("peak_bytes")?,
        })
    }
}

impl PeerPackage {
    fn script(self) -> PathBuf {
        let name = match self {
            Self::Mitsuba | Self::MitsubaLlvm => "mitsuba",
            Self::Cycles => "cycles",
            Self::LuxCore => "luxcore",
        };
        root().join(format!("crates/xtask/python/bench_{name}.py"))
    }

    /// Command line of the peer for a scene, with a Python that has the peer.
    fn command(self, python: &Path, files: &SceneFiles, args: &Args) -> Command {
        let scene = if self.script() == Self::Mitsuba.script() { &files.xml } else { &files.json };
        let mut command = Command::new(python);
        command.args(["-W", "ignore"]).arg(self.script()).arg("--scene").arg(scene);
        for (name, value) in [("--res", args.res), ("--threads", args.threads), ("--depth", DEPTH)]
        {
            command.args([name, &value.to_string()]);
        }
        if let (Self::MitsubaLlvm, Ok(library)) = (self, super::install::llvm()) {
            command.env(LLVM, library);
        }
        command
    }
}

/// Renders with a peer, by a Python that has it. Its output is not shown.
///
/// # Errors
/// If it fails: the last line of its output.
pub(super) fn render(
    peer: &PeerRenderer,
    python: &Path,
    files: &SceneFiles,
    args: &Args,
    image: &Path,
) -> Result<ResourceUse> {
    let result = image.with_extension("json");
    let mut command = peer.kind.command(python, files, args);
    command.args(["--spp", &args.spp.to_string(), "--repeats", &args.repeats.to_string()]);
    command.args(peer.arguments).arg("--output").arg(image).arg("--result").arg(&result);
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).context("the clock is wrong")?;
    command.args(["--started", &since_epoch.as_secs_f64().to_string()]);
    let output = command.output().with_context(|| format!("{} does not run", python.display()))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|l| !l.trim().is_empty()).unwrap_or("no message");
    ensure!(output.status.success(), "{}: {last}", output.status);
    ResourceUse::from_json(&read(&result)?)
}

/// Renders a converged image with Mitsuba, and returns the relative mean squared error of that
/// image, estimated from its two halves.
///
/// # Errors
/// If it fails.
pub(super) fn reference(
    python: &Path,
    files: &SceneFiles,
    args: &Args,
    image: &Path,
) -> Result<f64> {
    let result = image.with_extension("json");
    if !(image.is_file() && result.is_file()) {
        let is_fast = super::install::llvm().is_ok();
        let (kind, variant) = if is_fast {
            (PeerPackage::MitsubaLlvm, LLVM_MODE)
        } else {
            (PeerPackage::Mitsuba, "scalar_rgb")
        };
        let mut command = kind.command(python, files, args);
        command.args(["--variant", variant, "--sampler", "multijitter"]);
        command.args(["--reference", "--spp", &args.reference_spp.to_string()]);
        command.arg("--output").arg(image).arg("--result").arg(&result);
        succeed(&mut command)?;
    }
    read(&result)?.get("relative_mse").and_then(Value::as_f64).context("its noise is not known")
}

/// Renders with our program, as users call it.
///
/// # Errors
/// If it fails.
pub(super) fn render_ours(
    program: &Path,
    reuse: u32,
    files: &SceneFiles,
    args: &Args,
    image: &Path,
) -> Result<ResourceUse> {
    let summary = image.with_extension("json");
    let mut taken = ResourceUse {
        wall: f64::INFINITY,
        cpu: f64::INFINITY,
        start: f64::INFINITY,
        imports: 0.0,
        peak_bytes: 0.0,
    };
    for _ in 0..args.repeats.max(1) {
        let mut command = Command::new(program);
        let [res, spp, threads] = [args.res, args.spp, args.threads].map(|n| n.to_string());
        // Mitsuba's depth counts the lamp, and ours does not.
        let depth = (DEPTH - 1).to_string();
        command.args(["-q", "-r", &res, &res, "-s", &spp, "-t", &threads, "-m", &depth]);
        command.args(["--path-reuse", &reuse.to_string()]);
        command.arg(&files.xml).arg("-f").arg(image).arg("--summary-json").arg(&summary);
        let clock = Instant::now();
        succeed(&mut command)?;
        let whole = clock.elapsed().as_secs_f64();
        let run = read_summary(&summary)?;
        taken.wall = taken.wall.min(run.seconds);
        taken.cpu = taken.cpu.min(run.cpu_seconds / f64::from(args.threads));
        // Includes the time to write the image, which is not counted for peers.
        taken.start = taken.start.min(whole - run.seconds);
        taken.peak_bytes = taken.peak_bytes.max(run.peak_bytes);
    }
    Ok(taken)
}

fn read(path: &Path) -> Result<Value> {
    let text = std::fs::read(path).with_context(|| path.display().to_string())?;
    serde_json::from_slice(&text).with_context(|| format!("{} is no JSON", path.display()))
}
