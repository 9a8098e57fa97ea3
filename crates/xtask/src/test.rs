//! `cargo xtask test`: all checks that a change must pass.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Args as Arguments;

use crate::peers;
use crate::project::{build_checked_program, cargo, shared, shown, step, succeed, target};
use crate::venv::Installation;
use crate::{features, guide, imports, oidn, python, style};

/// Options of `cargo xtask test`.
#[derive(Arguments)]
pub(crate) struct Args {
    /// Continue without packages that cannot be installed: Open Image Denoise, Mitsuba, those of
    /// the Python module
    #[arg(long)]
    allow_skips: bool,
}

/// Checks that passed, and checks that were skipped.
#[derive(Default)]
struct Report {
    passed: Vec<&'static str>,
    skipped: Vec<String>,
    failed: Vec<&'static str>,
}

/// Packages that some checks need.
struct Packages {
    /// Folder of Open Image Denoise, or the reason why it is missing.
    oidn: Result<PathBuf, String>,
    /// A Python with Mitsuba, or the reason why it is missing.
    mitsuba: Installation,
    /// Tools that test the Python module, or the reason why they are missing.
    python: Result<python::Environment, String>,
}

/// Runs every check until one fails.
///
/// # Errors
/// If a check fails, or its requirements cannot be installed.
pub(crate) fn run(args: &Args) -> Result<()> {
    let mut report = Report::default();
    let done = steps(args, &mut report);
    report.print();
    done
}

fn steps(args: &Args, report: &mut Report) -> Result<()> {
    report.step("tools", |_| {
        need("rustfmt", &["fmt", "--version"])?;
        need("clippy", &["clippy", "--version"])
    })?;
    let packages = std::thread::scope(|scope| {
        // They are loaded while the compiler works.
        let packages = scope.spawn(Packages::install);
        check_sources(report)?;
        report.step("packages", |skipped| {
            let packages = packages.join().map_err(|_| anyhow!("the installation panicked"))??;
            packages.require(args.allow_skips, skipped)?;
            Ok(packages)
        })
    })?;
    let program = report.step("building the tests", |_| {
        succeed(&mut cargo(&["test", "--workspace", "--tests", "--examples", "--no-run"]))?;
        build_checked_program()
    })?;
    std::thread::scope(|scope| {
        // At a low priority: it uses the time for which the tests wait.
        let comparison = packages
            .mitsuba
            .python()
            .map(|python| scope.spawn(|| peers::compare_in_background(python, &program)));
        let tested = run_tests(&packages, report);
        let Some(comparison) = comparison else { return tested };
        // It ends anyway, and is reported after a failure, too.
        let compared = report.step("comparison with Mitsuba, small", |_| {
            let (table, agree) =
                comparison.join().map_err(|_| anyhow!("the comparison panicked"))??;
            print!("{table}");
            ensure!(agree, "the comparison with Mitsuba failed");
            Ok(())
        });
        tested.and(compared)
    })
}

/// Checks the sources and the documentation.
fn check_sources(report: &mut Report) -> Result<()> {
    report.step("format", |_| succeed(&mut cargo(&["fmt", "--all", "--check"])))?;
    report.step("style", |_| style::check())?;
    report.step("imports", |_| imports::check())?;
    report.step("features of crates", |_| features::check())?;
    report.step("guide", |_| guide::check())?;
    report.step("lints", |_| lints())?;
    report.step("documentation", |_| {
        let mut doc = cargo(&["doc", "--workspace", "--no-deps"]);
        succeed(doc.env("RUSTDOCFLAGS", "-D warnings"))
    })
}

/// Runs the tests, which have been built.
fn run_tests(packages: &Packages, report: &mut Report) -> Result<()> {
    let with_oidn = |mut command: Command| {
        command.envs(packages.oidn.iter().map(|folder| (oidn::VARIABLE, folder)));
        command
    };
    report.step("unit and integration tests", |skipped| {
        let kinds = ["--tests", "--examples"];
        tests(with_oidn(cargo(&[&["test", "--workspace"][..], &kinds, SHOW].concat())), skipped)
    })?;
    if shared().is_some() {
        report.step("tests on scenes of others", |skipped| {
            let only =
                ["--tests", "--no-fail-fast", "--", "--ignored", "--skip", LONG, "--show-output"];
            tests(with_oidn(cargo(&[&["test", "--workspace"][..], &only].concat())), skipped)
        })?;
    }
    if cfg!(target_arch = "x86_64") {
        report.step("ray queries without AVX2", portable_queries)?;
    }
    report.step("tests in the documentation", |skipped| {
        tests(cargo(&[&["test", "--workspace", "--doc"][..], SHOW].concat()), skipped)
    })?;
    match &packages.python {
        Ok(environment) => report.step("Python module", |_| python::check(environment)),
        Err(_) => Ok(()),
    }
}

impl Packages {
    fn install() -> Result<Self> {
        Ok(Self { oidn: oidn::prepare()?, mitsuba: peers::prepare()?, python: python::prepare()? })
    }

    /// Requires all packages, or counts those that are missing as skips if `allow_skips` is true.
    fn require(&self, allow_skips: bool, skipped: &mut Vec<String>) -> Result<()> {
        let missing = [
            ("Open Image Denoise", self.oidn.as_ref().err()),
            ("Mitsuba", self.mitsuba.missing()),
            ("the tools of the Python module", self.python.as_ref().err()),
        ];
        for (name, reason) in missing.into_iter().filter_map(|(n, r)| Some((n, r?))) {
            if !allow_skips {
                bail!("{name} cannot be installed: {reason}; --allow-skips goes on without it");
            }
            skipped.push(format!("{name} cannot be installed: {reason}"));
        }
        Ok(())
    }
}

/// Checks all targets, those for fuzzing included.
fn lints() -> Result<()> {
    let features = "pathtracer-fuzz/libfuzzer,pt-bvh-fuzz/libfuzzer";
    let kinds = ["--workspace", "--all-targets", "--features", features];
    let mut clippy = cargo(&[&["clippy"][..], &kinds, &["--", "-D", "warnings"]].concat());
    // A given library is not built, so that no C++ compiler is needed.
    succeed(clippy.env("CUSTOM_LIBFUZZER_PATH", target()?.join("libFuzzer.a")))
}

/// Tests the portable vectors, as used on processors without the default features, such as ARM;
/// `cfg(portable)` leaves out the code for AVX-512.
fn portable_queries(skipped: &mut Vec<String>) -> Result<()> {
    let mut command = cargo(&[&["test", "--package", "pt-bvh", "--lib"][..], SHOW].concat());
    command.env("RUSTFLAGS", "-C target-cpu=x86-64 --cfg portable");
    command.env("CARGO_TARGET_DIR", target()?.join("portable"));
    tests(command, skipped)
}

/// Part of the name of a test that takes minutes, and needs no scenes of others.
const LONG: &str = "a_hundred_million_times";

/// Tests that skip something print a line that begins with this.
const SKIPPED: &str = "skipped: ";

/// Arguments that run all tests, and show the output of tests that pass.
const SHOW: &[&str] = &["--no-fail-fast", "--", "--show-output"];

/// Runs tests, and collects the skips that they report.
fn tests(mut command: Command, skipped: &mut Vec<String>) -> Result<()> {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("{} cannot be started", shown(&command)))?;
    let output = child.stdout.take().context("the tests have no output")?;
    let mut test = String::new();
    for line in BufReader::new(output).lines() {
        let line = line.context("the output of the tests cannot be read")?;
        println!("{line}");
        if let Some(name) = line.strip_prefix("---- ").and_then(|l| l.strip_suffix(" stdout ----"))
        {
            name.clone_into(&mut test);
        } else if let Some(reason) = line.strip_prefix(SKIPPED) {
            skipped.push(format!("{test}: {reason}"));
        }
    }
    let status = child.wait().context("the tests cannot be waited for")?;
    ensure!(status.success(), "{} failed: {status}", shown(&command));
    Ok(())
}

/// Installs a component of the toolchain if it is missing.
fn need(component: &str, probe: &[&str]) -> Result<()> {
    let found = cargo(probe).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if found.is_ok_and(|status| status.success()) {
        return Ok(());
    }
    println!("installing {component}");
    succeed(Command::new("rustup").args(["component", "add", component]))
        .with_context(|| format!("{component} is missing"))
}

impl Report {
    fn step<T>(
        &mut self,
        name: &'static str,
        check: impl FnOnce(&mut Vec<String>) -> Result<T>,
    ) -> Result<T> {
        let done = step(name, || check(&mut self.skipped));
        match &done {
            Ok(_) => self.passed.push(name),
            Err(_) => self.failed.push(name),
        }
        done
    }

    fn print(&self) {
        println!("\n== summary");
        for name in &self.passed {
            println!("passed   {name}");
        }
        for skipped in &self.skipped {
            println!("SKIPPED  {skipped}");
        }
        println!("{}", self.verdict());
    }

    /// Last line: the failure, the number of checks passed, and the names of those skipped.
    fn verdict(&self) -> String {
        let failed = match self.failed.as_slice() {
            [] => String::new(),
            names => {
                format!("FAILED {}, checks that are not listed did not run; ", names.join(", "))
            }
        };
        let skipped = match self.skipped.len() {
            0 => "nothing skipped".to_owned(),
            count => format!("{count} skipped: {}", self.skipped.join("; ")),
        };
        format!("{failed}{} checks passed, {skipped}", self.passed.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_counts_and_names_what_was_skipped() {
        let mut report = Report::default();
        report.step("one", |_| Ok(())).unwrap();
        assert_eq!(report.verdict(), "1 checks passed, nothing skipped");
        report
            .step("two", |skipped| {
                skipped.push("a: b".into());
                Ok(())
            })
            .unwrap();
        assert_eq!(report.verdict(), "2 checks passed, 1 skipped: a: b");
        assert!(report.step("three", |_| -> Result<()> { bail!("no") }).is_err());
        let wanted = "FAILED three, checks that are not listed did not run; 2 checks passed, 1 skipped: a: b";
        assert_eq!(report.verdict(), wanted);
    }
}
