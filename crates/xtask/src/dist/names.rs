//! Architectures of the distribution, and names of its files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::ValueEnum;

/// Version of the distribution: that of the workspace.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Oldest platform of the wheels: the GNU C library 2.17, of 2012.
pub(super) const MANYLINUX: &str = "manylinux2014";

/// File of the checksums.
pub(super) const CHECKSUMS: &str = "SHA256SUMS";

/// Processor architecture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Arch {
    #[value(name = "x86_64")]
    X86_64,
    #[value(name = "aarch64")]
    Aarch64,
}

impl Arch {
    pub(super) const ALL: [Self; 2] = [Self::X86_64, Self::Aarch64];

    /// Rust target of the static program.
    pub(super) fn static_target(self) -> &'static str {
        match self {
            Self::X86_64 => "x86_64-unknown-linux-musl",
            Self::Aarch64 => "aarch64-unknown-linux-musl",
        }
    }

    /// Rust target of the wheel.
    pub(super) fn gnu_target(self) -> &'static str {
        match self {
            Self::X86_64 => "x86_64-unknown-linux-gnu",
            Self::Aarch64 => "aarch64-unknown-linux-gnu",
        }
    }
}

/// Name of the archive of a program without its ending, which is also its only folder.
pub(super) fn archive(target: &str) -> String {
    format!("pathtracer-{VERSION}-{target}")
}

/// Name of the bill of materials of the program.
pub(super) fn bill_of_materials() -> String {
    format!("pathtracer-{VERSION}.cdx.json")
}

/// Files of a folder, in order.
///
/// # Errors
/// If the folder cannot be read.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.retain(|path| path.is_file());
    paths.sort();
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::root;

    /// Value of a key in the metadata of cargo-binstall.
    fn binstall(key: &str) -> String {
        let text = fs::read_to_string(root().join("crates/pt-cli/Cargo.toml")).unwrap();
        let (_, table) = text.split_once("[package.metadata.binstall]").unwrap();
        let table = table.split("\n[").next().unwrap();
        let line = table.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).unwrap();
        line.trim_matches('"').to_owned()
    }

    /// A template of cargo-binstall with its variables replaced.
    fn rendered(template: &str, target: &str) -> String {
        let variables = [
            ("{ repo }", "https://example.org/pathtracer"),
            ("{ version }", VERSION),
            ("{ target }", target),
            ("{ bin }", "pathtracer"),
            ("{ binary-ext }", ""),
            ("{ archive-suffix }", ".tar.gz"),
        ];
        variables.iter().fold(template.to_owned(), |text, (from, to)| text.replace(from, to))
    }

    #[test]
    fn binstall_finds_the_archives_and_the_program_in_them() {
        assert_eq!(binstall("pkg-fmt"), "tgz");
        for arch in Arch::ALL {
            let target = arch.static_target();
            let stem = archive(target);
            let url = rendered(&binstall("pkg-url"), target);
            assert!(url.ends_with(&format!("/v{VERSION}/{stem}.tar.gz")), "{url}");
            assert_eq!(
                rendered(&binstall("bin-dir"), target),
                format!("{stem}/{}", super::super::program::NAME)
            );
        }
    }

    #[test]
    fn the_container_file_has_the_version() {
        let text = fs::read_to_string(root().join("Containerfile")).unwrap();
        assert!(text.contains(&format!("ARG VERSION={VERSION}\n")), "{text}");
    }

    #[test]
    fn the_workflow_of_releases_packs_the_same_names() {
        let workflow = root().join(".github/workflows/release.yml");
        let text = fs::read_to_string(workflow).unwrap();
        assert!(text.contains("pathtracer-$VERSION-${{ matrix.target }}"), "{text}");
        assert!(text.contains(CHECKSUMS), "{text}");
    }
}
