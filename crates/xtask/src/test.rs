//! `cargo xtask test`: all that has to hold before a change is good.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::oidn;
use crate::peers::{self, Size};
use crate::project::{cargo, shown, step, succeed, target};
use crate::venv::Prepared;

/// What was passed and what was not looked at.
#[derive(Default)]
struct Report {
    passed: Vec<&'static str>,
    skipped: Vec<String>,
    failed: Option<&'static str>,
}

/// Runs every check until one fails.
///
/// # Errors
/// If a check fails, or what it needs cannot be installed.
pub(crate) fn run() -> Result<()> {
    let mut report = Report::default();
    let done = steps(&mut report);
    report.print();
    done
}

fn steps(report: &mut Report) -> Result<()> {
    report.step("tools", |_| {
        need("rustfmt", &["fmt", "--version"])?;
        need("clippy", &["clippy", "--version"])
    })?;
    report.step("format", |_| {
        succeed(&mut cargo(&["fmt", "--all", "--check"]))?;
        FUZZ.iter().try_for_each(|manifest| {
            succeed(&mut cargo(&["fmt", "--manifest-path", manifest, "--check"]))
        })
    })?;
    report.step("lints", |_| {
        succeed(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))
    })?;
    report.step("documentation", |_| {
        let mut doc = cargo(&["doc", "--workspace", "--no-deps"]);
        succeed(doc.env("RUSTDOCFLAGS", "-D warnings"))
    })?;
    report.step("unit and integration tests", |skipped| {
        let kinds = ["--lib", "--bins", "--tests", "--examples"];
        let mut command = cargo(&[&["test", "--workspace"][..], &kinds, SHOW].concat());
        match oidn::prepare()? {
            Ok(packages) => drop(command.env(oidn::VARIABLE, packages)),
            // The tests that open the library say that they are skipped.
            Err(reason) => println!("Open Image Denoise cannot be had: {reason}"),
        }
        tests(command, skipped)
    })?;
    if cfg!(target_arch = "x86_64") {
        report.step("ray queries without AVX2", portable_queries)?;
    }
    report.step("tests in the documentation", |skipped| {
        tests(cargo(&[&["test", "--workspace", "--doc"][..], SHOW].concat()), skipped)
    })?;
    report.step("comparison with Mitsuba, small", |skipped| match peers::prepare()? {
        Prepared::Python(python) => peers::compare(&python, Size::Small, None),
        Prepared::Missing(reason) => {
            println!("skipped: {reason}");
            skipped.push(format!("comparison with Mitsuba: {reason}"));
            Ok(())
        }
    })
}

/// The vectors of processors that are not of the kind that the workspace is built for, such as ARM.
fn portable_queries(skipped: &mut Vec<String>) -> Result<()> {
    let mut command = cargo(&[&["test", "--package", "pt-bvh", "--lib"][..], SHOW].concat());
    command.env("RUSTFLAGS", "-C target-cpu=x86-64");
    command.env("CARGO_TARGET_DIR", target()?.join("portable"));
    tests(command, skipped)
}

/// Workspaces of their own, which need the nightly toolchain: only their format is checked.
const FUZZ: [&str; 2] = ["fuzz/Cargo.toml", "crates/pt-bvh/fuzz/Cargo.toml"];

/// Tests that skip something print a line that begins with this.
const SKIPPED: &str = "skipped: ";

/// Makes tests that pass show what they print.
const SHOW: &[&str] = &["--", "--show-output"];

/// Runs tests, and collects what they say they skip.
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

/// Installs a component of the toolchain where it is missing.
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
    fn step(
        &mut self,
        name: &'static str,
        check: impl FnOnce(&mut Vec<String>) -> Result<()>,
    ) -> Result<()> {
        let done = step(name, || check(&mut self.skipped));
        match &done {
            Ok(()) => self.passed.push(name),
            Err(_) => self.failed = Some(name),
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
        match self.failed {
            Some(name) => println!("FAILED   {name}; later checks did not run"),
            None if self.skipped.is_empty() => println!("nothing was skipped"),
            None => {}
        }
    }
}
