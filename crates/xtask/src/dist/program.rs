//! Static programs, and their archives.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, EntryType, Header};

use super::names::{Arch, archive};
use super::tools::{empty_libraries, remap};
use crate::project::{cargo, root, shown, succeed, target};

/// Name of the program.
pub(super) const NAME: &str = "pathtracer";

/// Cargo profile of distributed programs.
pub(super) const PROFILE: &str = "stripped";

/// Files of the project in the archive, with their names there.
const FILES: [(&str, &str); 5] = [
    ("README.md", "README.md"),
    ("CHANGELOG.md", "CHANGELOG.md"),
    ("LICENSE-APACHE", "LICENSE-APACHE"),
    ("LICENSE-MIT", "LICENSE-MIT"),
    ("crates/pt-core/data/LICENSE-hosek-wilkie", "LICENSE-hosek-wilkie"),
];

/// Files that the program prints, with its arguments.
const PRINTED: [(&str, &[&str]); 4] = [
    ("man/pathtracer.1", &["--man"]),
    ("completions/pathtracer.bash", &["--completions", "bash"]),
    ("completions/pathtracer.fish", &["--completions", "fish"]),
    ("completions/_pathtracer", &["--completions", "zsh"]),
];

/// Builds the static program with the linker of the Rust toolchain; returns its path.
///
/// # Errors
/// If it does not build, or is not static.
pub(super) fn build(arch: Arch) -> Result<PathBuf> {
    let triple = arch.static_target();
    let mut build = cargo(&["rustc", "--quiet", "--locked", "--package", "pt-cli"]);
    build.args(["--bin", NAME, "--profile", PROFILE, "--target", triple]);
    build.args(["--config", &format!("target.{triple}.linker=\"rust-lld\"")]).args(remap(triple)?);
    succeed(build.args(["--", "-L"]).arg(empty_libraries()?))?;
    let program = target()?.join(triple).join(PROFILE).join(NAME);
    let bytes = fs::read(&program).with_context(|| program.display().to_string())?;
    ensure!(
        !names_interpreter(&bytes),
        "{}: found a program that needs a dynamic linker, expected a static one",
        program.display()
    );
    Ok(program)
}

/// True if an ELF file of 64 bits has a program header of type `PT_INTERP`.
fn names_interpreter(elf: &[u8]) -> bool {
    let number = |at: usize, size: usize| {
        let bytes = elf.get(at..at + size).unwrap_or_default();
        bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | usize::from(byte))
    };
    let (start, size, count) = (number(32, 8), number(54, 2), number(56, 2));
    (0..count).any(|i| number(start + i * size, 4) == 3)
}

/// Packs a program with its documentation and licences; the archive depends on their bytes alone.
///
/// # Errors
/// If a file cannot be read, or the archive not be written.
pub(super) fn pack(arch: Arch, program: &Path, folder: &Path) -> Result<()> {
    let stem = archive(arch.static_target());
    let path = folder.join(format!("{stem}.tar.gz"));
    let file = File::create(&path).with_context(|| path.display().to_string())?;
    let mut tar = Builder::new(GzEncoder::new(file, Compression::best()));
    let mut add = |name: &str, bytes: &[u8], mode: u32| {
        let mut header = Header::new_gnu();
        header.set_entry_type(EntryType::Regular);
        header.set_size(bytes.len() as u64);
        header.set_mode(mode);
        tar.append_data(&mut header, format!("{stem}/{name}"), bytes)
    };
    add(NAME, &fs::read(program)?, 0o755)?;
    for (source, name) in FILES {
        let source = root().join(source);
        let bytes = fs::read(&source).with_context(|| source.display().to_string())?;
        add(name, &bytes, 0o644)?;
    }
    // Printed by the program for x86-64, which runs here: the texts are the same.
    let printer = match arch {
        Arch::X86_64 => program.to_owned(),
        Arch::Aarch64 => build(Arch::X86_64)?,
    };
    for (name, arguments) in PRINTED {
        add(name, &printed(&printer, arguments)?, 0o644)?;
    }
    tar.into_inner()?.finish()?.sync_all()?;
    Ok(())
}

/// Checks that a static program, which cannot load libraries, says how images are denoised.
///
/// # Errors
/// If it ends with another status or message.
pub(super) fn check_denoising(program: &Path) -> Result<()> {
    let mut command = Command::new(program);
    command.args(["--denoise", "--strict", "-q", "-r", "8", "8", "-s", "1"]);
    let output = command.output().with_context(|| shown(&command))?;
    let text = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.code() == Some(2) && text.contains("a static program cannot open"),
        "{}: found {} and the message {:?}, expected status 2 and the reason",
        shown(&command),
        output.status,
        text.trim()
    );
    Ok(())
}

fn printed(program: &Path, arguments: &[&str]) -> Result<Vec<u8>> {
    let mut command = Command::new(program);
    command.args(arguments);
    let output = command.output().with_context(|| shown(&command))?;
    ensure!(output.status.success(), "{} failed: {}", shown(&command), output.status);
    Ok(output.stdout)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_with_a_dynamic_linker_are_recognised() {
        let mut elf = vec![0; 64 + 2 * 56];
        elf[32] = 64; // e_phoff
        elf[54] = 56; // e_phentsize
        elf[56] = 2; // e_phnum
        elf[64] = 1; // PT_LOAD
        assert!(!names_interpreter(&elf));
        elf[64 + 56] = 3; // PT_INTERP
        assert!(names_interpreter(&elf));
        assert!(!names_interpreter(b"no program"));
    }

    #[test]
    fn packed_files_are_in_the_project() {
        for (source, _) in FILES {
            assert!(root().join(source).is_file(), "{source}");
        }
    }
}
