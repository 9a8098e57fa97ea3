//! qemu-user, which runs aarch64 programs.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

/// Names of the program, as distributions call it.
const NAMES: [&str; 2] = ["qemu-aarch64-static", "qemu-aarch64"];

/// Emulator of an aarch64 processor.
#[derive(Clone)]
pub(super) struct Emulator {
    path: PathBuf,
}

impl Emulator {
    /// Searches the folders of `PATH`.
    ///
    /// # Errors
    /// If it is not installed.
    pub(super) fn find() -> Result<Self> {
        let folders = std::env::var_os("PATH").unwrap_or_default();
        Self::find_in(&folders)
    }

    fn find_in(folders: &OsString) -> Result<Self> {
        let mut files =
            std::env::split_paths(folders).flat_map(|folder| NAMES.map(|name| folder.join(name)));
        let path = files.find(|file| file.is_file()).with_context(|| {
            format!(
                "found no {} in PATH, expected one of them to run aarch64 programs; install it \
                 (Debian: apt-get install qemu-user-static), or build without tests (--no-tests) \
                 or only for this architecture (--target x86_64)",
                NAMES.join(" or ")
            )
        })?;
        Ok(Self { path })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Command that runs an aarch64 program.
    pub(super) fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(&self.path);
        command.arg(program);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_emulator_the_message_says_how_to_install_it() {
        let error = Emulator::find_in(&"/nowhere:/nothing".into()).err().unwrap().to_string();
        assert!(error.contains("apt-get install qemu-user-static"), "{error}");
        assert!(error.contains("--no-tests"), "{error}");
    }
}
