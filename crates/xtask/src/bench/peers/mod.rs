//! `cargo xtask bench peers`: whole images against Mitsuba 3, Cycles and LuxCore, of the same
//! scenes, with the same filter, depth and number of threads, compared with one converged image of
//! each scene.

mod compare;
mod cornell;
mod environment;
mod install;
mod interior;
mod lights;
mod race;
mod report;
mod scene;
mod shapes;
mod sky;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use self::install::PeerPackage;
use self::race::{PEERS, PeerRenderer, ResourceUse};
use self::report::ReportRow;
use self::scene::{PeerScene, SceneFiles};
use crate::project::{build_program, output_folder, shared, step};
use crate::venv::Installation;

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only these scenes, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    scenes: Vec<String>,
    /// Only these peers, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    peers: Vec<String>,
    /// Width and height of the images
    #[arg(long, default_value_t = 512)]
    res: u32,
    /// Samples per pixel
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Samples per pixel of the reference, which is kept for later
    #[arg(long, default_value_t = 4096)]
    reference_spp: u32,
    /// Threads of each renderer
    #[arg(long, default_value_t = 2)]
    threads: u32,
    /// Renders that are timed, of which the fastest counts
    #[arg(long, default_value_t = 3)]
    repeats: u32,
    /// Reuse the times of peers that an earlier call with the same sizes has stored
    #[arg(long)]
    keep: bool,
}

/// Name of a scene, and the function that creates it.
type SceneSource = (&'static str, fn() -> PeerScene);

/// All scenes.
const SCENES: [SceneSource; 4] = [
    ("cornell_blob", cornell::scene),
    ("glossy_interior", interior::scene),
    ("sky", sky::scene),
    ("many_lights", lights::scene),
];

/// Measures and prints.
///
/// # Errors
/// If a name is unknown, our program or Mitsuba for the reference is not available, or a render of
/// ours fails. Missing peers are printed.
pub(crate) fn run(args: &Args) -> Result<()> {
    let scenes = chosen(&args.scenes, &SCENES, |s| s.0, "scene")?;
    let peers = chosen(&args.peers, &PEERS, |p| p.name, "peer")?;
    let program = build_program()?;
    let pythons = install(&peers)?;
    let Installation::Python(mitsuba) = install::prepare(PeerPackage::Mitsuba)? else {
        bail!("Mitsuba, which renders the references, cannot be installed");
    };
    let folder = output_folder("bench-peers")?;
    println!(
        "{} x {} pixels, {} samples per pixel, {} threads, box filter, 5 interactions; times are \
         processor seconds over threads",
        args.res, args.res, args.spp, args.threads
    );
    for &(name, make) in scenes {
        let scene = make();
        println!("\n{name}: {} triangles", scene.triangles());
        let files = scene.write(&folder.join(name))?;
        let bench = BenchScene { name, files, folder: &folder, args };
        let reference = bench.reference(&mitsuba)?;
        let ours = report::OURS.iter().map(|&way| bench.ours(&program, way, &reference));
        let ours = ours.collect::<Result<Vec<_>>>()?;
        let mut rows = Vec::new();
        for &peer in &peers {
            let Some(python) = pythons.get(peer.name) else { continue };
            match bench.peer(peer, python, &reference) {
                Ok(row) => rows.push(row),
                Err(error) => println!("  {} FAILED: {error:#}", peer.name),
            }
        }
        report::print(&ours, &rows);
    }
    Ok(())
}

/// Selects the items with the given names; all, if there are no names.
fn chosen<'a, T>(
    asked: &[String],
    all: &'a [T],
    name: fn(&T) -> &'static str,
    what: &str,
) -> Result<Vec<&'a T>> {
    if let Some(unknown) = asked.iter().find(|a| all.iter().all(|t| name(t) != *a)) {
        let known: Vec<_> = all.iter().map(name).collect();
        bail!("there is no {what} {unknown}, but {}", known.join(", "));
    }
    Ok(all.iter().filter(|t| asked.is_empty() || asked.iter().any(|a| a == name(t))).collect())
}

/// Installs the peers, and prints which are missing. Returns the Pythons of the others.
fn install(peers: &[&PeerRenderer]) -> Result<HashMap<&'static str, PathBuf>> {
    let mut pythons = HashMap::new();
    step("installing peers", || {
        for peer in peers {
            let prepared = match (peer.kind, install::llvm()) {
                (PeerPackage::MitsubaLlvm, Err(reason)) => Installation::Missing(reason),
                _ => install::prepare(peer.kind)?,
            };
            match prepared {
                Installation::Python(python) => drop(pythons.insert(peer.name, python)),
                Installation::Missing(reason) => println!("left out {}: {reason}", peer.name),
            }
        }
        Ok(())
    })?;
    Ok(pythons)
}

/// Scene that is being measured.
struct BenchScene<'a> {
    name: &'static str,
    files: SceneFiles,
    folder: &'a Path,
    args: &'a Args,
}

impl BenchScene<'_> {
    /// Converged image, and an estimate of its own error.
    fn reference(&self, mitsuba: &Path) -> Result<(PathBuf, f64)> {
        let Args { res, reference_spp, .. } = *self.args;
        if let Some(path) = self.given() {
            println!("  reference: {}, whose own error is not known", path.display());
            return Ok((path, 0.0));
        }
        let mark = self.files.mark;
        let path = self
            .folder
            .join(format!("reference_{}_{res}_{reference_spp}_{mark:016x}.exr", self.name));
        let error = race::reference(mitsuba, &self.files, self.args, &path)?;
        println!(
            "  reference: Mitsuba's multijitter, {reference_spp} samples per pixel; its own relMSE, \
             {error:.2e}, is subtracted"
        );
        Ok((path, error))
    }

    /// The reference that was supplied with the first scene, if it has the requested size.
    fn given(&self) -> Option<PathBuf> {
        let Args { res, reference_spp, .. } = *self.args;
        let name = format!("bench/out/ref_{}_{res}_d6.exr", self.name);
        let path = shared()?.join(name);
        (reference_spp == 4096 && path.is_file()).then_some(path)
    }

    fn image(&self, renderer: &str) -> PathBuf {
        self.folder.join(format!("{}_{renderer}.exr", self.name))
    }

    fn ours(
        &self,
        program: &Path,
        (name, reuse): (&'static str, u32),
        reference: &(PathBuf, f64),
    ) -> Result<ReportRow> {
        let image = self.image(&name.replace(' ', "_"));
        let taken = race::render_ours(program, reuse, &self.files, self.args, &image)?;
        row(name, taken, &image, reference)
    }

    fn peer(
        &self,
        peer: &PeerRenderer,
        python: &Path,
        reference: &(PathBuf, f64),
    ) -> Result<ReportRow> {
        let Args { res, spp, threads, .. } = *self.args;
        let mark = self.files.mark;
        let image = self.image(&format!("{}_{res}_{spp}_{threads}_{mark:016x}", peer.name));
        let kept = image.with_extension("kept.json");
        let taken = if self.args.keep && kept.is_file() && image.is_file() {
            let text = std::fs::read(&kept).with_context(|| kept.display().to_string())?;
            ResourceUse::from_json(&serde_json::from_slice::<Value>(&text)?)?
        } else {
            let taken = race::render(peer, python, &self.files, self.args, &image)?;
            std::fs::write(&kept, taken.to_json().to_string())
                .with_context(|| kept.display().to_string())?;
            taken
        };
        row(peer.name, taken, &image, reference)
    }
}

/// Compares an image with the reference, and subtracts the reference's own error.
fn row(
    name: &'static str,
    taken: ResourceUse,
    image: &Path,
    (reference, error): &(PathBuf, f64),
) -> Result<ReportRow> {
    let mut difference = compare::compare(image, reference)?;
    difference.relative_mse -= error;
    difference.coarse_mse -= error / f64::from(compare::COARSE * compare::COARSE);
    Ok(ReportRow { name, taken, difference })
}
