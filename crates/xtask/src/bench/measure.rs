//! Measurements of one run of the program.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::project::{output_folder, succeed};

/// Summary of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RunSummary {
    pub(crate) triangles: f64,
    pub(crate) samples: f64,
    pub(crate) rays: f64,
    /// Wall-clock time of rendering in seconds.
    pub(crate) seconds: f64,
    /// Processor time of rendering in seconds; the wall-clock time if the system does not report
    /// it.
    pub(crate) cpu_seconds: f64,
    pub(crate) peak_bytes: f64,
}

/// Renders a scene with arguments separated by spaces.
///
/// # Errors
/// If it cannot be rendered.
pub(crate) fn measure(program: &Path, args: &str, scene: &Path) -> Result<RunSummary> {
    let folder = output_folder("bench")?;
    let summary = folder.join("summary.json");
    let mut command = Command::new(program);
    command.arg("-q").args(args.split_whitespace()).arg(scene);
    command.arg("-f").arg(folder.join("image.png")).arg("--summary-json").arg(&summary);
    succeed(&mut command)?;
    read_summary(&summary)
}

/// Parses the file written by `--summary-json`.
///
/// # Errors
/// If it cannot be read, or lacks a number.
pub(crate) fn read_summary(summary: &Path) -> Result<RunSummary> {
    let text = std::fs::read(summary).with_context(|| summary.display().to_string())?;
    let json: Value = serde_json::from_slice(&text).context("the summary is no JSON")?;
    let number = |key: &str| {
        json.get(key).and_then(Value::as_f64).with_context(|| format!("{key} is not known"))
    };
    let seconds = number("render_seconds")?;
    Ok(RunSummary {
        triangles: number("triangles")?,
        samples: number("samples")?,
        rays: number("rays")?,
        seconds,
        cpu_seconds: number("render_cpu_seconds").unwrap_or(seconds),
        peak_bytes: number("peak_bytes")?,
    })
}

/// Minimum and median of some numbers.
pub(crate) fn least_and_median(mut numbers: Vec<f64>) -> [f64; 2] {
    numbers.sort_by(f64::total_cmp);
    let at = |i: usize| numbers.get(i).copied().unwrap_or(f64::NAN);
    [at(0), at(numbers.len() / 2)]
}

/// Prints the load of the machine, if the system reports it: times are unreliable on a busy
/// machine.
pub(crate) fn print_busyness() {
    if let Ok(text) = std::fs::read_to_string("/proc/loadavg") {
        let load = text.split_whitespace().next().unwrap_or_default();
        println!("load average before the start: {load}");
    }
}

/// Returns `ok` or `MISSED`.
pub(crate) fn verdict(reached: bool) -> &'static str {
    if reached { "ok" } else { "MISSED" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_and_median_of_three() {
        assert_eq!(least_and_median(vec![3.0, 1.0, 2.0]), [1.0, 2.0]);
        assert!(least_and_median(Vec::new())[0].is_nan());
    }
}
