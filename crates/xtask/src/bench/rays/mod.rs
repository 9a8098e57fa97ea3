//! `cargo xtask bench rays`: our ray queries against Embree's, in the same process and on the same
//! rays.

mod check;
mod clock;
mod embree;
mod input;
mod install;
mod mesh;
mod race;
mod random;
mod referee;
mod report;
mod sets;
mod shapes;
mod structures;

use anyhow::Result;

use self::embree::Embree;
use self::input::TriangleMesh;
use self::mesh::MeshSource;
use self::race::{PreparedRays, QueryKind, Trees};
use self::report::MeshMeasurements;
use super::measure::print_busyness;
use crate::project::{cargo, succeed};

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Only these meshes, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    meshes: Vec<String>,
    /// 256 × 256 rays of each kind instead of 1024 × 1024, on a cow and a hall unless --meshes is
    /// given
    #[arg(long)]
    quick: bool,
    /// Passes over the rays and half of the builds, of which the fastest counts
    #[arg(long, default_value_t = 5)]
    repeats: usize,
}

/// The meshes of `--quick`.
const QUICK: [&str; 2] = ["cow", "hall"];

/// Measures and prints.
///
/// # Errors
/// If Embree is not available, a mesh is unknown or unreadable, or our own queries disagree.
pub(crate) fn run(args: &Args) -> Result<()> {
    let sources = sources(args)?;
    if cfg!(debug_assertions) {
        // The queries are linked into this program, so it must have the optimisations of a release.
        let mut command = cargo(&["run", "--quiet", "--release", "--package", "xtask", "--"]);
        return succeed(command.args(std::env::args_os().skip(1)));
    }
    let embree = Embree::open(&install::library()?)?;
    print_busyness();
    let mut outcomes = Vec::new();
    for source in sources {
        match source.load()? {
            Ok(mesh) => outcomes.push(measure(&embree, source, &mesh, args)?),
            Err(missing) => println!("skipped {}: {missing} not found", source.name),
        }
    }
    if !outcomes.is_empty() {
        report::print_summary(&outcomes);
    }
    Ok(())
}

/// Selected meshes.
fn sources(args: &Args) -> Result<Vec<&'static MeshSource>> {
    match (args.meshes.is_empty(), args.quick) {
        (false, _) => mesh::named(&args.meshes),
        (true, true) => mesh::named(&QUICK.map(String::from)),
        (true, false) => Ok(mesh::SOURCES.iter().collect()),
    }
}

fn measure(
    embree: &Embree,
    source: &MeshSource,
    mesh: &TriangleMesh,
    args: &Args,
) -> Result<MeshMeasurements> {
    println!("\n{}: {} triangles", source.name, mesh.triangles.len());
    let builds = race::builds(embree, mesh, 2 * args.repeats)?;
    report::print_builds(mesh, &builds);
    let trees = Trees::build(embree, mesh)?;
    println!("  Embree {}, default, robust, and high quality; ours: wide", trees.default.version());
    let resolution = if args.quick { 256 } else { 1024 };
    let mut rays = sets::all(mesh, &trees.ours, resolution);
    rays.retain(|set| !set.rays.is_empty());
    for set in &rays {
        let verdict = check::compare(mesh, &trees.ours, &trees.robust, &set.rays)?;
        println!("  {:<8} {} rays: {verdict}", set.kind.name(), set.rays.len());
    }
    report::print_heading();
    let mut rates = Vec::new();
    for set in &rays {
        let prepared = PreparedRays::new(set);
        let of = |query| prepared.race(&trees, query, args.repeats);
        let both = [of(QueryKind::Closest), of(QueryKind::Any)];
        report::print_rates(set.kind, &both);
        rates.push((set.kind, both));
    }
    Ok(MeshMeasurements { name: source.name, sets: rates, builds })
}
