//! `cargo xtask bench render`: samples and rays per second on one core, and memory.

use anyhow::Result;

use super::measure::{RunSummary, least_and_median, measure, verdict};
use super::mesh;
use crate::project::{COURSE_MODES, build_program, course_scene, output_folder};

/// Options of the measurement.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Renders of each scene in each mode
    #[arg(long, default_value_t = 3)]
    repeats: usize,
}

/// Scene with its requirements.
struct Case {
    scene: &'static str,
    /// Million camera samples and million rays per second on a core, of the course's program.
    course: [Option<f64>; 2],
    /// The same rates as required of ours.
    asked: [Option<f64>; 2],
}

const CASES: [Case; 2] = [
    Case {
        scene: "sky/CBspheres_lambertian.dae",
        course: [Some(0.9), Some(4.5)],
        asked: [Some(2.0), None],
    },
    Case { scene: "sky/CBbunny.dae", course: [None, Some(1.45)], asked: [None, Some(4.0 * 1.45)] },
];

const COMMAND: &str = "-r 480 360 -s 64 -l 1 -m 5 -t 1";
/// Options in the mode of the course's program, so that it takes all samples.
const ALL_SAMPLES: &str = "-a 64 0";
/// Maximum number of bytes of memory per triangle of a large mesh.
const MAX_BYTES: f64 = 500.0;

/// Measures and prints.
///
/// # Errors
/// If something cannot be rendered.
pub(crate) fn run(args: &Args) -> Result<()> {
    let program = build_program()?;
    println!("{COMMAND}: per second of processor time, best of {}", args.repeats);
    for case in CASES {
        let Some(scene) = course_scene(case.scene) else {
            println!("skipped: ../shared/scenes/dae/{} not found", case.scene);
            continue;
        };
        println!("\n{}", case.scene);
        for (mode, option) in COURSE_MODES {
            let flags = option.map_or(String::new(), |option| format!("{option} {ALL_SAMPLES}"));
            let run = |_| measure(&program, &format!("{COMMAND} {flags}"), &scene);
            let runs = (0..args.repeats.max(1)).map(run).collect::<Result<Vec<_>>>()?;
            case.print(mode, &runs);
        }
    }
    let scene = output_folder("bench")?.join("large.ply");
    mesh::write_waves(&scene)?;
    let large = measure(&program, "-r 64 48 -s 1 --integrator normals", &scene)?;
    let bytes = large.peak_bytes / large.triangles;
    println!(
        "\n{:.0} triangles: at most {:.0} MB, {bytes:.0} bytes a triangle, asked {MAX_BYTES}: {}",
        large.triangles,
        large.peak_bytes * 1e-6,
        verdict(bytes <= MAX_BYTES)
    );
    Ok(())
}

impl Case {
    fn print(&self, mode: &str, runs: &[RunSummary]) {
        let [cpu, _] = least_and_median(runs.iter().map(|m| m.cpu_seconds).collect());
        let [wall, _] = least_and_median(runs.iter().map(|m| m.seconds).collect());
        let Some(any) = runs.first() else { return };
        let rates = [any.samples, any.rays].map(|n| n / cpu * 1e-6);
        println!(
            "  {mode:<8} {:.2} million samples/s, {:.2} million rays/s, {:.0} MB; {cpu:.2} s of \
             processor time, {wall:.2} s in all",
            rates[0],
            rates[1],
            any.peak_bytes * 1e-6
        );
        for (i, what) in ["samples", "rays"].iter().enumerate() {
            if let Some(course) = self.course[i] {
                let asked = self.asked[i].map_or(String::new(), |asked| {
                    format!(", asked {asked:.2}: {}", verdict(rates[i] >= asked))
                });
                let times = rates[i] / course;
                println!("           {what}: {times:.2} times the course's {course}{asked}");
            }
        }
    }
}
