//! `cargo xtask bench load`: our readers of mesh files against those of others, alternating on the
//! same files.
//!
//! The measured time is that of one call that converts a file, which is in the system's cache, into
//! arrays of vertices and triangles: ours in this process, those of others each in a Python process
//! with the library already imported. Each reader reads every file once before it is timed.

mod files;
mod peer;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use pt_scene::Geometry;

use self::files::FileKind;
use self::peer::PeerReader;
use super::measure::{least_and_median, print_busyness, verdict};
use crate::project::{cargo, output_folder, succeed};

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Number of timed reads of each file by each reader
    #[arg(long, default_value_t = 7)]
    repeats: usize,
}

/// Required speed of the readers, relative to the fastest of the others.
const RATIO: f64 = 3.0;

/// Measures and prints.
///
/// # Errors
/// If a file cannot be written or read, or the peers' Python cannot be started.
pub(crate) fn run(args: &Args) -> Result<()> {
    if cfg!(debug_assertions) {
        // The readers are linked into this program, so it must have the optimisations of a release.
        let mut command = cargo(&["run", "--quiet", "--release", "--package", "xtask", "--"]);
        return succeed(command.args(std::env::args_os().skip(1)));
    }
    let folder = output_folder("bench/load")?;
    let mut peers = peer::start_all()?;
    print_busyness();
    println!("| file | MB | reader | least ms | median ms | MB/s | ratio to ours |");
    println!("|---|---|---|---|---|---|---|");
    let mut lines = Vec::new();
    for kind in files::KINDS {
        let path = folder.join(kind.name);
        (kind.write)(&path)?;
        lines.push(race(kind, &path, &mut peers, args.repeats)?);
    }
    println!();
    for line in lines {
        println!("{line}");
    }
    Ok(())
}

/// Reads a file with all readers in turn, prints the times, and returns the verdict on the speed.
fn race(kind: &FileKind, path: &Path, peers: &mut [PeerReader], repeats: usize) -> Result<String> {
    let mut ours = Vec::new();
    let mut theirs = vec![Vec::new(); peers.len()];
    for round in 0..=repeats {
        let seconds = load(path)?;
        if round > 0 {
            ours.push(seconds);
        }
        for (peer, times) in peers.iter_mut().zip(&mut theirs) {
            let seconds = peer.load(path)?;
            if round > 0 {
                times.extend(seconds);
            }
        }
    }
    let size = std::fs::metadata(path).context("the file is gone")?.len() as f64 / 1e6;
    let [least, _] = least_and_median(ours.clone());
    let mut fastest = f64::INFINITY;
    let named = peers.iter().map(|peer| peer.name).zip(theirs);
    for (name, times) in std::iter::once(("pathtracer", ours)).chain(named) {
        if times.is_empty() {
            println!("| {} | {size:.1} | {name} | cannot read it | | | |", kind.name);
            continue;
        }
        let [its_least, its_median] = least_and_median(times);
        let (ratio, speed) = (its_least / least, size / its_least);
        if name != "pathtracer" {
            fastest = fastest.min(ratio);
        }
        let [a, b] = [1000.0 * its_least, 1000.0 * its_median];
        println!(
            "| {} | {size:.1} | {name} | {a:.1} | {b:.1} | {speed:.0} | {ratio:.2} |",
            kind.name
        );
    }
    let speed = size / least;
    Ok(format!(
        "{}: {speed:.0} MB/s, wanted {} ({}); {fastest:.1} times the fastest of the others, wanted {RATIO} ({})",
        kind.name,
        kind.wanted,
        verdict(speed >= kind.wanted),
        verdict(fastest >= RATIO),
    ))
}

/// Time in seconds that our reader takes for a file.
fn load(path: &Path) -> Result<f64> {
    let start = Instant::now();
    let scene = pt_formats::load(path)?;
    let seconds = start.elapsed().as_secs_f64();
    let triangles: usize = scene
        .objects
        .iter()
        .map(|object| match &object.geometry {
            Geometry::Mesh(mesh) => mesh.triangles.len(),
            Geometry::Sphere { .. } | Geometry::Points { .. } => 0,
        })
        .sum();
    ensure!(triangles == files::TRIANGLES, "{}: {triangles} triangles", path.display());
    Ok(seconds)
}
