//! Accuracy of the predicted end of renders, on this machine with its current load.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::project::{output_folder, root};

/// Renders of some seconds.
const RENDERS: [(&str, &str); 6] = [
    ("cornell.dae", "-r 400 300 -s 300 -m 6"),
    ("cornell.dae", "-r 400 300 -s 800 -m 6 -a 32 0.05"),
    ("mitsuba/textures.xml", "-r 400 400 -s 400"),
    ("mitsuba/fog.xml", "-r 160 160 -s 100"),
    ("mitsuba/many_lights.xml", "-r 256 256 -s 200"),
    ("motion.xml", "-r 400 300 -s 300"),
];

/// Renders, and counts how often, from a tenth on, the end was in the predicted interval.
///
/// # Errors
/// If this is less than nine times of ten, or a render fails.
pub(super) fn run(program: &Path) -> Result<()> {
    let image = output_folder("soak")?.join("eta.exr");
    let (mut inside, mut all) = (0, 0);
    for (scene, options) in RENDERS {
        let mut command = Command::new(program);
        command.args(options.split(' ')).args([
            "-q",
            "--progress",
            "json",
            "--checkpoint-every",
            "0",
            "-f",
        ]);
        let output = command.arg(&image).arg(root().join("scenes").join(scene)).output()?;
        ensure!(output.status.success(), "{scene}: the render fails");
        let text = String::from_utf8(output.stdout)?;
        let lines = text.lines().map(serde_json::from_str).collect::<Result<Vec<Value>, _>>()?;
        let number = |line: &Value, name: &str| line[name].as_f64();
        let end = lines.last().and_then(|line| number(line, "seconds")).context("no line")?;
        let (mut right, mut reported, mut width) = (0, 0, 0.0);
        for line in &lines {
            let left = &line["seconds_left"];
            let (Some(now), Some(least), Some(most)) =
                (number(line, "seconds"), number(left, "least"), number(left, "most"))
            else {
                continue;
            };
            if line["state"] == "rendering"
                && number(line, "samples") >= number(line, "samples_in_all").map(|n| 0.1 * n)
            {
                reported += 1;
                right += usize::from((now + least..=now + most).contains(&end));
                width += (most - least) / end;
            }
        }
        println!(
            "{scene} {options}: {end:.1} s; {right} of {reported} times inside, {:.2} of the time wide",
            width / f64::from(reported.max(1))
        );
        (inside, all) = (inside + right, all + reported as usize);
    }
    println!("{inside} of {all} times the end lay in the reported interval");
    ensure!(inside * 10 >= all * 9, "less than nine times of ten");
    Ok(())
}
