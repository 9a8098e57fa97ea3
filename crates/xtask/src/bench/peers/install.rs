//! Installation of the peers: Python packages of fixed versions.

use std::path::PathBuf;

use anyhow::Result;

use crate::venv::{self, Installation};

/// Returns a Python program that asserts the version of a package.
fn probe(module: &str, package: &str, version: &str) -> String {
    format!(
        "import {module}; from importlib.metadata import version; \
         assert version('{package}') == '{version}'"
    )
}

/// Installs a peer in the target folder, or returns the reason why it is missing.
///
/// # Errors
/// If the target folder cannot be found.
pub(super) fn prepare(kind: PeerPackage) -> Result<Installation> {
    match kind {
        PeerPackage::Mitsuba | PeerPackage::MitsubaLlvm => crate::peers::prepare(),
        PeerPackage::Cycles => crate::blender::prepare(),
        PeerPackage::LuxCore => {
            let probe = probe("numpy, pyluxcore", "pyluxcore", "2.11.2");
            venv::prepare("luxcore-venv", &["pyluxcore==2.11.2", "numpy"], &probe)
        }
    }
}

/// Environment variable with the path of LLVM for Mitsuba.
pub(super) const LLVM: &str = "DRJIT_LIBLLVM_PATH";

/// Minimum version of LLVM for the compiled modes of Mitsuba.
const MIN_LLVM: u32 = 17;

/// Shared library of LLVM: the one given by [`LLVM`], else the newest of those that Linux
/// distributions install.
pub(super) fn llvm() -> Result<PathBuf, String> {
    if let Some(path) = std::env::var_os(LLVM) {
        return Ok(path.into());
    }
    let folders =
        ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"];
    let files = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let versioned = files.filter_map(|file| {
        let path = file.ok()?.path();
        Some((llvm_version(path.file_name()?.to_str()?)?, path))
    });
    let newest = versioned.filter(|&(version, _)| version >= MIN_LLVM).max();
    newest.map(|(_, path)| path).ok_or_else(|| {
        format!(
            "no shared library of LLVM {MIN_LLVM} or later was found; install one (Debian: \
             apt-get install libllvm19), or name it in {LLVM}"
        )
    })
}

/// Parses the version in a name like `libLLVM.so.19.1` or `libLLVM-19.so`.
fn llvm_version(name: &str) -> Option<u32> {
    let rest = name.strip_prefix("libLLVM.so.").or_else(|| name.strip_prefix("libLLVM-"))?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Package of a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum PeerPackage {
    Mitsuba,
    /// Mitsuba with the modes that compile by LLVM.
    MitsubaLlvm,
    Cycles,
    LuxCore,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_llvm_report_its_version() {
        assert_eq!(llvm_version("libLLVM.so.19.1"), Some(19));
        assert_eq!(llvm_version("libLLVM-15.so.1"), Some(15));
        assert_eq!(llvm_version("libLLVMSupport.a"), None);
    }
}
