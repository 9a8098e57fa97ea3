//! Checksums, as `sha256sum` writes and checks them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use super::names::{CHECKSUMS, files};

/// Writes the SHA-256 checksums of the files of a folder.
///
/// # Errors
/// If a file cannot be read, or that of the checksums not be written.
pub(super) fn write(folder: &Path) -> Result<()> {
    let mut text = String::new();
    for path in files(folder)? {
        let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        writeln!(text, "{}", line(&bytes, &name))?;
    }
    let path = folder.join(CHECKSUMS);
    fs::write(&path, text).with_context(|| path.display().to_string())
}

fn line(bytes: &[u8], name: &str) -> String {
    let mut line = String::new();
    for byte in Sha256::digest(bytes) {
        // Writing to a string succeeds.
        let _ = write!(line, "{byte:02x}");
    }
    line + "  " + name
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of FIPS 180-4 for the message "abc".
    #[test]
    fn lines_are_those_of_sha256sum() {
        let wanted = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a.txt";
        assert_eq!(line(b"abc", "a.txt"), wanted);
    }
}
