//! Coverage-guided fuzzing of each reader of files by libFuzzer, with files of the project as
//! seeds.
//!
//! Each target of `fuzz/` is named after the extension of its seeds. Inputs that increase coverage
//! are kept in the target folder, from which the next campaign continues.

mod seeds;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

use crate::project::{output_folder, root, shown, succeed, target};

/// Version of cargo-fuzz that is installed.
const VERSION: &str = "0.13.2";
/// Maximum number of seconds for one input.
const TIMEOUT: u32 = 10;
/// Maximum memory of a target, in MiB, including that of the address sanitizer.
const MEMORY: u32 = 2048;
/// Threads of the readers: enough to test parallel code.
const THREADS: &str = "2";

/// Result of one target.
struct FuzzResult {
    target: String,
    seconds: f64,
    /// Number of inputs that were tried.
    executions: u64,
    /// Number of edges of the program that the seeds reach, and that all inputs reach at the end.
    coverage: [u64; 2],
    /// Files with the inputs that cause failures.
    findings: Vec<PathBuf>,
    log: PathBuf,
}

/// Runs the targets, as many at a time as there are processors.
///
/// # Errors
/// If one finds an input that causes a failure, or a required tool is not available.
pub(super) fn run(minutes: f64, only: &[String]) -> Result<()> {
    let tool = Tool::prepare()?;
    let all = tool.targets()?;
    for name in only {
        ensure!(all.contains(name), "there is no fuzz target {name}; there are {}", all.join(", "));
    }
    let wanted: Vec<_> =
        all.into_iter().filter(|name| only.is_empty() || only.contains(name)).collect();
    succeed(&mut tool.command("build", &[]))?;
    let folder = output_folder("soak/fuzz")?;
    let outcomes = wanted
        .into_par_iter()
        .with_max_len(1)
        .map(|name| fuzz(&tool, &folder, name, minutes))
        .collect::<Result<Vec<_>>>()?;
    let findings: Vec<_> =
        outcomes.iter().flat_map(|o| &o.findings).map(|f| f.display().to_string()).collect();
    ensure!(findings.is_empty(), "inputs that do harm:\n{}", findings.join("\n"));
    Ok(())
}

/// cargo-fuzz with the nightly toolchain.
struct Tool {
    program: PathBuf,
    build: PathBuf,
}

impl Tool {
    /// Installs it if it is missing.
    fn prepare() -> Result<Self> {
        let nightly =
            Command::new("rustup").args(["run", "nightly", "rustc", "--version"]).output();
        ensure!(
            nightly.is_ok_and(|output| output.status.success()),
            "fuzzing needs the nightly toolchain, which is missing: rustup toolchain install nightly"
        );
        let folder = target()?.join("cargo-fuzz");
        let program =
            folder.join("bin").join(format!("cargo-fuzz{}", std::env::consts::EXE_SUFFIX));
        if !program.is_file() {
            println!("installing cargo-fuzz {VERSION}");
            let mut install =
                crate::project::cargo(&["install", "cargo-fuzz", "--version", VERSION]);
            install.args(["--locked", "--root"]).arg(&folder);
            succeed(&mut install).context("fuzzing needs cargo-fuzz, which cannot be installed")?;
        }
        Ok(Self { program, build: target()?.join("fuzz") })
    }

    /// Command of cargo-fuzz on the crate of the targets.
    fn command(&self, what: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new("rustup");
        command.args(["run", "nightly"]).arg(&self.program).arg(what);
        command.arg("--fuzz-dir").arg(root().join("fuzz"));
        if what != "list" {
            command.arg("--target-dir").arg(&self.build).args(["--features", "libfuzzer"]);
            // Three dozen programs are linked.
            command.env("CARGO_PROFILE_RELEASE_LTO", "false");
            command.env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
        }
        // The variables of the cargo that runs this program would select its toolchain.
        command
            .args(arguments)
            .current_dir(root())
            .env_remove("CARGO")
            .env_remove("RUSTUP_TOOLCHAIN");
        command
    }

    /// Names of the targets.
    fn targets(&self) -> Result<Vec<String>> {
        let mut list = self.command("list", &[]);
        let output = list.output().with_context(|| shown(&list))?;
        ensure!(output.status.success(), "{} failed: {}", shown(&list), output.status);
        let names = String::from_utf8(output.stdout).context("the names are no text")?;
        Ok(names.lines().map(str::to_owned).collect())
    }
}

/// Runs one target, and returns its result.
fn fuzz(tool: &Tool, folder: &Path, name: String, minutes: f64) -> Result<FuzzResult> {
    let folder = folder.join(&name);
    let [corpus, findings, temporary] = ["corpus", "findings", "temporary"].map(|f| folder.join(f));
    for folder in [&corpus, &findings, &temporary] {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let seeds = seeds::prepare(&name, &folder)?;
    let before = files(&findings)?;
    let mut command = tool.command("run", &[&name]);
    command.arg(&corpus).arg(&seeds.folder).arg("--");
    if let Some(words) = &seeds.dictionary {
        command.arg(format!("-dict={}", words.display()));
    }
    command.arg(format!("-artifact_prefix={}/", findings.display()));
    command.args([format!("-timeout={TIMEOUT}"), format!("-rss_limit_mb={MEMORY}")]);
    command.arg(format!("-max_total_time={}", (minutes * 60.0).ceil()));
    command.arg("-print_final_stats=1");
    command.env("TMPDIR", &temporary).env("RAYON_NUM_THREADS", THREADS);
    let start = Instant::now();
    let output = command.output().with_context(|| shown(&command))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let log = folder.join("log");
    std::fs::write(&log, text.as_bytes()).with_context(|| log.display().to_string())?;
    std::fs::remove_dir_all(&temporary).with_context(|| temporary.display().to_string())?;
    let mut new = files(&findings)?;
    new.retain(|file| !before.contains(file));
    let outcome = FuzzResult::of(name, start.elapsed(), &text, new, log);
    outcome.print(seeds.count);
    ensure!(
        output.status.success() || !outcome.findings.is_empty(),
        "the target {} ends with {}: see {}",
        outcome.target,
        output.status,
        outcome.log.display()
    );
    Ok(outcome)
}

/// All files in a folder, in order.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut files = entries.map(|e| Ok(e?.path())).collect::<Result<Vec<_>>>()?;
    files.sort();
    Ok(files)
}

impl FuzzResult {
    /// Parses the output of libFuzzer.
    fn of(
        target: String,
        time: Duration,
        text: &str,
        findings: Vec<PathBuf>,
        log: PathBuf,
    ) -> Self {
        let covered = |line: &str| number_behind(line, "cov: ");
        let coverage = [
            text.lines().filter(|line| line.contains("INITED")).find_map(covered),
            text.lines().rev().filter(|line| line.starts_with('#')).find_map(covered),
        ];
        let executions = text
            .lines()
            .rev()
            .find_map(|line| number_behind(line, "stat::number_of_executed_units: "));
        Self {
            target,
            seconds: time.as_secs_f64(),
            executions: executions.unwrap_or(0),
            coverage: coverage.map(|edges| edges.unwrap_or(0)),
            findings,
            log,
        }
    }

    fn print(&self, seeds: usize) {
        let Self { target, seconds, executions, coverage: [before, after], findings, .. } = self;
        println!(
            "{target}: {executions} inputs in {seconds:.0} s from {seeds} seeds, {before} edges covered at \
             first and {after} at the end, {} findings",
            findings.len()
        );
    }
}

/// Number in a line after some words.
fn number_behind(line: &str, words: &str) -> Option<u64> {
    let rest = line.split_once(words)?.1.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..end].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_fuzzer_says_is_understood() {
        let text = "INFO: seed corpus: files: 9\n\
                    #10\tINITED cov: 120 ft: 300 corp: 9/2Kb exec/s: 0 rss: 50Mb\n\
                    #99\tNEW    cov: 345 ft: 900 corp: 20/9Kb lim: 4 exec/s: 0 rss: 60Mb\n\
                    Done 1234 runs in 3 second(s)\n\
                    stat::number_of_executed_units: 1234\n";
        let FuzzResult { executions, coverage, .. } =
            FuzzResult::of("ply".into(), Duration::ZERO, text, Vec::new(), PathBuf::new());
        assert_eq!((executions, coverage), (1234, [120, 345]));
    }
}
