//! `cargo xtask bench seed`: what a tree brings, by the two meshes of a report on the university
//! course's program.

use anyhow::Result;

use super::measure::{least_and_median, measure, verdict};
use crate::project::{build_program, course_scene};

/// How to measure.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Renders with the tree
    #[arg(long, default_value_t = 9)]
    repeats: usize,
    /// Renders without a tree, which take long
    #[arg(long, default_value_t = 1)]
    repeats_without: usize,
}

/// A mesh, and what others reached with it.
struct Mesh {
    scene: &'static str,
    /// Seconds without and with a tree, in the report.
    report: [f64; 2],
    /// Million rays per second on a core, of the course's program.
    course: f64,
}

const MESHES: [Mesh; 2] = [
    Mesh { scene: "meshedit/cow.dae", report: [36.0, 0.4], course: 4.7 },
    Mesh { scene: "meshedit/maxplanck.dae", report: [390.0, 0.58], course: 3.1 },
];

/// Ours over theirs, at least.
const FACTOR: f64 = 3.0;
/// Our time over theirs, at most.
const SHARE: f64 = 0.1;
const COMMAND: &str = "-r 800 600 --integrator normals -s 1";

/// Measures and prints.
///
/// # Errors
/// If a mesh cannot be rendered.
pub(crate) fn run(args: &Args) -> Result<()> {
    let program = build_program()?;
    println!("{COMMAND}: seconds of rendering, least (median)");
    for mesh in MESHES {
        let Some(scene) = course_scene(mesh.scene) else {
            println!("skipped: ../shared/scenes/dae/{} not found", mesh.scene);
            continue;
        };
        let times = |flags: &str, repeats: usize| -> Result<_> {
            let run = |_| measure(&program, &format!("{COMMAND} {flags}"), &scene);
            (0..repeats.max(1)).map(run).collect::<Result<Vec<_>>>()
        };
        let with = times("-t 1", args.repeats)?;
        let all_cores = times("-t 0", args.repeats)?;
        let without = times("-t 1 --bvh none", args.repeats_without)?;
        let rays = with[0].rays;
        let seconds = |runs: &[super::measure::Measured]| {
            least_and_median(runs.iter().map(|m| m.seconds).collect())
        };
        mesh.print(seconds(&with), seconds(&all_cores), seconds(&without), rays);
    }
    Ok(())
}

impl Mesh {
    fn print(&self, with: [f64; 2], all_cores: [f64; 2], without: [f64; 2], rays: f64) {
        println!("\n{}", self.scene);
        let lines = [
            ("tree, one core", with),
            ("tree, all cores", all_cores),
            ("no tree, one core", without),
        ];
        for (what, [least, median]) in lines {
            let rate = rays / least * 1e-6;
            println!("  {what:<18} {least:>9.4} ({median:.4}), {rate:.2} million rays/s");
        }
        let [slow, fast] = self.report;
        let ratio = without[0] / with[0];
        let (theirs, wanted) = (slow / fast, FACTOR * slow / fast);
        println!(
            "  ratio              {ratio:>9.0}; the report's {theirs:.0}, asked {wanted:.0}: {}",
            verdict(ratio >= wanted)
        );
        let course = rays * 1e-6 / self.course;
        for (whose, theirs, ours) in [
            ("the report's, all cores", fast, all_cores[0]),
            ("the course's, one core", course, with[0]),
        ] {
            println!(
                "  time               {ours:>9.4}; {whose} {theirs:.4}, asked a tenth, {:.4}: {}",
                SHARE * theirs,
                verdict(ours <= SHARE * theirs)
            );
        }
    }
}
