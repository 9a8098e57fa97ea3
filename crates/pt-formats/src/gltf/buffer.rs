//! Buffers: bytes in files, in data URIs, and in binary files.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use super::item::Item;
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::mesh_file::{percent_decoded, percent_decoded_bytes};
use crate::shared::names::quote;

/// Maximum number of bytes in all buffers of a scene.
const MAX_BYTES: usize = 1 << 32;

/// The bytes of all buffers of a file.
pub(super) struct Buffers<'b> {
    /// Bytes by buffer index; `None` for a buffer that cannot be read, which was reported.
    bytes: Vec<Option<Cow<'b, [u8]>>>,
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct BufferView<'b> {
    pub(super) bytes: &'b [u8],
    /// Bytes from one element to the next; `None` if they are tightly packed.
    pub(super) stride: Option<usize>,
}

impl<'b> Buffers<'b> {
    /// Reads all buffers. `binary` is the binary chunk of a .glb file.
    pub(super) fn read(
        root: &Item<'_>,
        binary: Option<&'b [u8]>,
        file: &Path,
        context: &LoadContext,
    ) -> Result<Self, LoadError> {
        let mut bytes: Vec<Option<Cow<'b, [u8]>>> = Vec::new();
        let mut total = 0_usize;
        for (i, buffer) in root.children("buffers")?.iter().enumerate() {
            let found = one(buffer, binary.filter(|_| i == 0), file, context);
            let found = context.ok_or_report(found)?;
            total = total.saturating_add(found.as_ref().map_or(0, |bytes| bytes.len()));
            if total > MAX_BYTES {
                let message = format!("the buffers exceed {MAX_BYTES} bytes");
                return Err(LoadContext::exceeded(buffer.span(), message));
            }
            bytes.push(found);
        }
        Ok(Self { bytes })
    }

    /// Returns the buffer view with an index to which field `by` of `from` refers.
    pub(super) fn view(
        &self,
        root: &Item<'_>,
        index: usize,
        from: &Item<'_>,
        by: &str,
    ) -> Result<BufferView<'_>, LoadError> {
        let view = root.member("bufferViews", index, from, by)?;
        if meshopt_of(&view)?.is_some() {
            // It cannot be decoded.
            return Err(LoadError::AlreadyReported);
        }
        let bytes = self.part(root, &view)?;
        let stride = view.whole("byteStride")?;
        if stride.is_some_and(|stride| !(4..=252).contains(&stride)) {
            return Err(view.refuse("byteStride", "expected a number of bytes from 4 to 252"));
        }
        Ok(BufferView { bytes, stride })
    }

    /// Returns the bytes to which the fields `buffer`, `byteOffset` and `byteLength` of an item
    /// refer.
    pub(super) fn part(&self, root: &Item<'_>, item: &Item<'_>) -> Result<&[u8], LoadError> {
        let number = item.needed("buffer")?;
        root.member("buffers", number, item, "buffer")?;
        let buffer = self.bytes[number].as_ref().ok_or(LoadError::AlreadyReported)?;
        let offset = item.whole("byteOffset")?.unwrap_or(0);
        let length = item.needed("byteLength")?;
        let part = offset.checked_add(length).and_then(|end| buffer.get(offset..end));
        part.ok_or_else(|| {
            let count = buffer.len();
            item.error(format!(
                "{length} bytes from byte {offset} exceed buffer {number} of {count} bytes"
            ))
        })
    }

    /// Adds a buffer and returns its index.
    pub(super) fn push(&mut self, bytes: Vec<u8>) -> usize {
        self.bytes.push(Some(Cow::Owned(bytes)));
        self.bytes.len() - 1
    }
}

/// Reads a buffer. `binary` is the binary chunk of a .glb file, for its first buffer. A missing
/// file is reported.
fn one<'b>(
    buffer: &Item<'_>,
    binary: Option<&'b [u8]>,
    file: &Path,
    context: &LoadContext,
) -> Result<Cow<'b, [u8]>, LoadError> {
    let length = buffer.needed("byteLength")?;
    if let Some(meshopt) = meshopt_of(buffer)?
        && meshopt.flag("fallback")?
    {
        // Its views have the same bytes in compressed form.
        return Ok(Cow::Borrowed(&[]));
    }
    let found = match (buffer.text("uri")?, binary) {
        (Some(uri), _) if uri.starts_with("data:") => {
            Cow::Owned(resource(uri, file, context).map_err(|why| buffer.refuse("uri", why))?)
        }
        (Some(uri), _) => match resource(uri, file, context) {
            Ok(bytes) => Cow::Owned(bytes),
            Err(why) => {
                let message = format!(
                    "{why}; meshes in it are replaced by magenta and black boxes, or omitted where \
                     their size is unknown"
                );
                context.missing(buffer.span_of("uri"), message);
                return Err(LoadError::AlreadyReported);
            }
        },
        (None, Some(binary)) => Cow::Borrowed(binary),
        (None, None) => {
            let message = "missing \"uri\"; only the first buffer of a binary file may omit it";
            return Err(buffer.error(message));
        }
    };
    if found.len() < length {
        let message = format!("found {} bytes in the buffer, expected {length}", found.len());
        return Err(buffer.refuse("byteLength", message));
    }
    Ok(found)
}

/// Reads the resource of a URI: embedded data, or the content of a file. The error is a message
/// without a location.
pub(super) fn resource(uri: &str, file: &Path, context: &LoadContext) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        return decoded(data);
    }
    context.read(&path_of(uri, file)?)
}

/// Returns the path of the file of a URI, which is relative to the folder of the scene.
fn path_of(uri: &str, file: &Path) -> Result<PathBuf, String> {
    let scheme = uri.split_once("://").map(|(scheme, _)| scheme);
    let text = match scheme {
        None => uri,
        Some("file") => uri.strip_prefix("file://").unwrap_or(uri),
        Some(_) => {
            return Err(format!(
                "found {}, expected data or a path relative to the scene folder",
                quote(uri)
            ));
        }
    };
    let folder = file.parent().unwrap_or(Path::new(""));
    let as_written = folder.join(text);
    // Many exporters do not percent-encode file names.
    Ok(if as_written.is_file() { as_written } else { folder.join(percent_decoded(text)) })
}

/// Decodes the data of a URI after `data:`. [RFC 2397]
fn decoded(data: &str) -> Result<Vec<u8>, String> {
    let (kind, content) = data
        .split_once(',')
        .ok_or("found a data URI without a comma, expected one before the data")?;
    if !kind.ends_with(";base64") {
        return Ok(percent_decoded_bytes(content));
    }
    base64(content).map_err(|(place, byte)| {
        format!(
            "byte {place} of the base64 data is {}, expected a base64 character",
            quote(&char::from(byte).to_string())
        )
    })
}

/// Decodes base64 in either alphabet. [RFC 4648, §4 and §5] White space and missing padding are
/// accepted. The error is the position and value of an invalid byte.
fn base64(text: &str) -> Result<Vec<u8>, (usize, u8)> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0_u32, 0);
    for (place, letter) in text.bytes().enumerate() {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b' ' | b'\t' | b'\r' | b'\n' => continue,
            _ => return Err((place, letter)),
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Ok(bytes)
}

/// Names of the extension for compressed buffer views.
pub(super) const MESHOPT: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Returns the compression extension of a buffer view, if it has one.
pub(super) fn meshopt_of<'a>(view: &Item<'a>) -> Result<Option<Item<'a>>, LoadError> {
    for name in MESHOPT {
        if let Some(found) = view.extension(name)? {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648, §10, and the characters in which the alphabets differ.
    #[test]
    fn base64_is_that_of_its_standard() {
        let examples =
            ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy", "Zm9v\nYmFy"];
        for (i, text) in examples.into_iter().enumerate() {
            assert_eq!(base64(text).as_deref(), Ok(&b"foobar"[..i.min(6)]), "{text}");
        }
        assert_eq!(base64("+/-_"), Ok(vec![0xFB, 0xFF, 0xBF]));
        assert_eq!(base64("Zg=!"), Err((3, b'!')));
    }
}
