//! `cargo xtask bench seed`: speedup by a tree, for the two meshes of a report on the university
//! course's program.

use anyhow::Result;

use super::measure::{least_and_median, measure, verdict};
use crate::project::{build_program, course_scene};

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Renders with the tree
    #[arg(long, default_value_t = 9)]
    repeats: usize,
    /// Renders without a tree, which take long
    #[arg(long, default_value_t = 1)]
    repeats_without: usize,
}

/// Mesh with the results of others.
struct ReferenceMesh {
    scene: &'static str,
    /// Seconds without and with a tree, in the report.
    report: [f64; 2],
    /// Million rays per second on a core, of the course's program.
    course: f64,
}

const MESHES: [ReferenceMesh; 2] = [
    ReferenceMesh { scene: "meshedit/cow.dae", report: [36.0, 0.4], course: 4.7 },
    ReferenceMesh { scene: "meshedit/maxplanck.dae", report: [390.0, 0.58], course: 3.1 },
];

/// Required speedup by the tree, relative to that in the report.
const FACTOR: f64 = 3.0;
/// Maximum ratio of our time to theirs.
const SHARE: f64 = 0.1;
const COMMAND: &str = "-r 800 600 --integrator normals";
/// Samples per pixel: of the report, of the course's images and rates, and enough that the cost per
/// pixel apart from its rays is negligible.
const SPP: [u32; 3] = [1, 4, 64];
/// Index in [`SPP`] of the course's rates.
const COURSE: usize = 1;

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
        println!("\n{}", mesh.scene);
        let time = |what: &str, flags: &str, repeats: usize| -> Result<Time> {
            let run = |_| measure(&program, &format!("{COMMAND} {flags}"), &scene);
            let runs = (0..repeats.max(1)).map(run).collect::<Result<Vec<_>>>()?;
            let [least, median] = least_and_median(runs.iter().map(|m| m.seconds).collect());
            let time = Time { seconds: least, rate: runs[0].rays / least * 1e-6 };
            let times = time.rate / mesh.course;
            println!(
                "  {what:<24} {least:>9.4} ({median:.4}), {:>7.2} million rays/s, {times:.1} times \
                 the course's on a core",
                time.rate
            );
            Ok(time)
        };
        let mut one_core = Vec::new();
        for spp in SPP {
            let flags = |threads: u32| format!("-s {spp} -t {threads}");
            one_core.push(time(&format!("tree, -s {spp}, one core"), &flags(1), args.repeats)?);
            time(&format!("tree, -s {spp}, all cores"), &flags(0), args.repeats)?;
        }
        let without =
            time("no tree, -s 1, one core", "-s 1 -t 1 --bvh none", args.repeats_without)?;
        mesh.judge(&one_core, &without);
    }
    Ok(())
}

/// Time of a render.
struct Time {
    seconds: f64,
    /// Million rays per second.
    rate: f64,
}

impl ReferenceMesh {
    /// Compares measurements on one core with the results of others: times with each of [`SPP`],
    /// and one `without` a tree.
    fn judge(&self, with: &[Time], without: &Time) {
        let one = &with[0];
        let [slow, fast] = self.report;
        let ratio = without.seconds / one.seconds;
        let wanted = FACTOR * slow / fast;
        println!(
            "  without / with a tree {ratio:.0}; the report's {:.0}, asked {wanted:.0}: {}",
            slow / fast,
            verdict(ratio >= wanted)
        );
        println!(
            "  seconds {:.4}; the report's {fast}, asked a tenth: {}",
            one.seconds,
            verdict(one.seconds <= SHARE * fast)
        );
        let (spp, rate) = (SPP[COURSE], with[COURSE].rate);
        println!(
            "  million rays/s {rate:.2} at -s {spp}; the course's {}, asked ten times that: {}",
            self.course,
            verdict(rate * SHARE >= self.course)
        );
    }
}
