//! Content of files to which a scene refers.

use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;

use crate::shared::context::LoadContext;

/// Maximum size of an unpacked file in bytes.
const MAX_UNPACKED: u64 = 1 << 30;

/// Reads a file to which a scene refers; compressed files (`.gz`) are unpacked.
///
/// # Errors
/// If it cannot be read. The message is meant for the location of the reference.
pub(super) fn content(context: &LoadContext, path: &Path) -> Result<Vec<u8>, String> {
    let bytes = context.read(path)?;
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("gz")) {
        return Ok(bytes);
    }
    let mut unpacked = Vec::new();
    let message = |why: &str| format!("cannot unpack {}: {why}", path.display());
    let unpack = GzDecoder::new(bytes.as_slice()).take(MAX_UNPACKED).read_to_end(&mut unpacked);
    match unpack {
        Err(error) => Err(message(&error.to_string())),
        Ok(length) if length as u64 >= MAX_UNPACKED => {
            Err(message("the content exceeds the limit of 1 GiB"))
        }
        Ok(_) => Ok(unpacked),
    }
}
