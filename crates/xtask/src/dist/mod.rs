//! `cargo xtask dist`: static programs, wheels, a bill of materials and checksums, each checked.

mod bare;
mod checksums;
mod emulator;
mod films;
mod names;
mod program;
mod sbom;
mod tests_on_arm;
mod tools;
mod wheel;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args as Arguments;

use self::emulator::Emulator;
use self::films::Program;
use self::names::Arch;
use self::tools::Tools;
use crate::project::{step, target};

/// Options of `cargo xtask dist`.
#[derive(Arguments)]
pub(crate) struct Args {
    /// Architecture to build for (default: all)
    #[arg(long = "target", value_name = "ARCH")]
    targets: Vec<Arch>,
    /// Folder of the distribution (default: target/dist)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Build only: no comparison of films, no tests of aarch64, which need qemu-aarch64-static
    #[arg(long)]
    no_tests: bool,
    /// Install the wheel of the distribution into a bare Debian and a new virtual environment, and
    /// measure the time until the first image; builds nothing, and needs root and debootstrap
    #[arg(long, conflicts_with_all = ["targets", "no_tests"])]
    try_bare: bool,
}

/// Builds the distribution and checks it.
///
/// # Errors
/// If a requirement is missing, or a build or check fails.
pub(crate) fn run(args: &Args) -> Result<()> {
    let out =
        args.out.clone().map_or_else(|| Ok(target()?.join("dist")), Ok::<_, anyhow::Error>)?;
    if args.try_bare {
        return bare::run(&out);
    }
    ensure!(
        cfg!(all(target_os = "linux", target_arch = "x86_64")),
        "found {} {}, expected Linux on x86-64, on which distributions are built; \
         .github/workflows/release.yml has builds for other systems",
        std::env::consts::OS,
        std::env::consts::ARCH,
    );
    let archs = if args.targets.is_empty() { &Arch::ALL[..] } else { &args.targets };
    // Checked first: the builds take long.
    let needs_emulator = !args.no_tests && archs.contains(&Arch::Aarch64);
    let emulator = needs_emulator.then(Emulator::find).transpose()?;
    let tools = step("tools", || Tools::prepare(archs))?;
    let staging = Staging::new(&out)?;
    let mut programs = Vec::new();
    for &arch in archs {
        programs.extend(build(arch, &tools, &staging, emulator.as_ref())?);
    }
    step("bill of materials", || sbom::write(&tools, &staging.path))?;
    if !args.no_tests {
        step("films", || films::compare(&programs))?;
    }
    if let Some(emulator) = &emulator {
        step("tests on aarch64", || tests_on_arm::run(emulator))?;
    }
    let files = staging.publish(&out)?;
    println!("\n{}:", out.display());
    for (name, bytes) in files {
        println!("{:>9.2} MB  {name}", bytes as f64 / 1e6);
    }
    Ok(())
}

/// Builds the archive and the wheel for an architecture; returns the programs whose films are
/// compared.
fn build(
    arch: Arch,
    tools: &Tools,
    staging: &Staging,
    emulator: Option<&Emulator>,
) -> Result<Vec<Program>> {
    let name = arch.static_target();
    let built = step(name, || program::build(arch))?;
    step(&format!("archive for {name}"), || program::pack(arch, &built, &staging.path))?;
    let wheel = step(&format!("wheel for {}", arch.gnu_target()), || {
        wheel::build(arch, tools, &staging.path)
    })?;
    let runner = (arch == Arch::Aarch64).then_some(emulator).flatten();
    let mut programs = Vec::new();
    if arch == Arch::X86_64 {
        program::check_denoising(&built)?;
        programs.push(Program::native(name, built));
        programs.push(Program::native("wheel", wheel::install(&wheel)?));
    } else if let Some(runner) = runner {
        programs.push(Program::emulated(name, built, runner));
    }
    Ok(programs)
}

/// Folder of unfinished files, beside the distribution and removed at the end.
struct Staging {
    path: PathBuf,
}

impl Staging {
    fn new(out: &Path) -> Result<Self> {
        let mut name = out.file_name().context("--out is no folder")?.to_owned();
        name.push(format!(".{}.part", std::process::id()));
        let path = out.with_file_name(name);
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Self { path })
    }

    /// Writes the checksums, and moves all files into the distribution, where they replace those of
    /// the same names; returns names and sizes.
    fn publish(&self, out: &Path) -> Result<Vec<(String, u64)>> {
        checksums::write(&self.path)?;
        fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        let mut files = Vec::new();
        for path in names::files(&self.path)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let published = out.join(&name);
            files.push((name, fs::metadata(&path)?.len()));
            fs::rename(&path, &published).with_context(|| published.display().to_string())?;
        }
        Ok(files)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // What remains is without use.
        let _ = fs::remove_dir_all(&self.path);
    }
}
