//! Container formats: JSON text, or a binary file with the JSON and a buffer.

use std::path::Path;

use pt_scene::Span;
use serde_json::Value;

use super::super::Limits;
use crate::LoadError;
use crate::shared::{mesh_file, text};

/// The first four bytes of a binary file, "glTF". [glTF 2.0, §4.4.2]
const MAGIC: u32 = 0x4654_6C67;
/// The type of a chunk with JSON.
const JSON: u32 = 0x4E4F_534A;
/// The type of a chunk with a buffer, "BIN\0".
const BINARY: u32 = 0x004E_4942;
/// Maximum number of JSON values, each of which takes about 64 bytes.
const MAX_VALUES: usize = 1 << 23;

/// Parses a file into its JSON and, for binary files, the optional buffer.
pub(super) fn open<'a>(
    bytes: &'a [u8],
    path: &Path,
    limits: &Limits,
) -> Result<(Value, Option<&'a [u8]>), LoadError> {
    let (json, binary) = if word(bytes, 0) == Some(MAGIC) {
        chunks(bytes).map_err(|message| mesh_file::error(path, 0, message))?
    } else {
        (bytes, None)
    };
    let json = &*text::lines(json, path)?;
    let json = without_trailing_zeros(json);
    let values = json.iter().filter(|byte| b",[{".contains(byte)).count();
    let most = limits.elements(MAX_VALUES);
    if values > most {
        let message = format!("the file has more than {most} values; split the scene");
        return Err(mesh_file::error(path, 0, message));
    }
    let parsed = serde_json::from_slice(json).map_err(|error| LoadError::Content {
        at: Span {
            file: path.to_owned(),
            line: u32::try_from(error.line()).unwrap_or(0),
            column: u32::try_from(error.column()).unwrap_or(0),
            element: String::new(),
        },
        message: format!("invalid JSON: {}", reason(&error)),
    })?;
    Ok((parsed, binary))
}

/// Removes trailing zeros, with which some writers pad instead of spaces.
fn without_trailing_zeros(bytes: &[u8]) -> &[u8] {
    let last = bytes.iter().rposition(|byte| *byte != 0);
    &bytes[..last.map_or(0, |last| last + 1)]
}

/// Message of a JSON error without the position, which is part of the location.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.split(" at line ").next().unwrap_or_default().to_owned()
}

/// Splits a binary file into its JSON chunk and its optional binary chunk. [glTF 2.0, §4.4.3]
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    match word(bytes, 4) {
        Some(2) => {}
        Some(other) => {
            return Err(format!("found version {other} of the binary file, expected 2"));
        }
        None => return Err("unexpected end of the binary file in its header".to_owned()),
    }
    let claimed = word(bytes, 8).ok_or("unexpected end of the binary file in its header")? as usize;
    let Some(content) = bytes.get(12..claimed.max(12)) else {
        return Err(format!(
            "the header declares a file of {claimed} bytes, but the file has {}; it may be \
             incomplete",
            bytes.len()
        ));
    };
    let mut rest = content;
    let json = chunk(&mut rest, JSON)?.ok_or("found no JSON chunk at the start of the file")?;
    Ok((json, chunk(&mut rest, BINARY)?))
}

/// Removes the first chunk and returns its content; `None` if it has another type or there is no
/// chunk.
fn chunk<'b>(rest: &mut &'b [u8], kind: u32) -> Result<Option<&'b [u8]>, String> {
    let (Some(length), Some(found)) = (word(rest, 0), word(rest, 4)) else { return Ok(None) };
    if found != kind {
        return Ok(None);
    }
    let bytes = &rest[8..];
    let Some((content, after)) = bytes.split_at_checked(length as usize) else {
        let left = bytes.len();
        return Err(format!("truncated chunk: found {left} bytes, expected {length}"));
    };
    *rest = after;
    Ok(Some(content))
}

/// Reads the little-endian 32-bit integer at an offset.
fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let word = bytes.get(offset..offset.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

/// Builds a binary file of JSON and a buffer, which may be empty.
///
/// # Errors
/// If the file would exceed 4 GiB, the limit of its header.
pub(super) fn pack(mut json: Vec<u8>, binary: &[u8]) -> Result<Vec<u8>, String> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let chunks = [(JSON, json.as_slice()), (BINARY, binary)];
    let chunks = || chunks.iter().filter(|(_, content)| !content.is_empty());
    let length = 12 + chunks().map(|(_, content)| 8 + content.len()).sum::<usize>();
    let total = u32::try_from(length).map_err(|_| {
        format!(
            "the file requires {length} bytes, expected at most 4294967295 for .glb; split the \
             scene"
        )
    })?;
    let mut bytes = Vec::with_capacity(length);
    bytes.extend([MAGIC, 2, total].into_iter().flat_map(u32::to_le_bytes));
    for (kind, content) in chunks() {
        bytes.extend([content.len() as u32, *kind].into_iter().flat_map(u32::to_le_bytes));
        bytes.extend_from_slice(content);
    }
    Ok(bytes)
}
