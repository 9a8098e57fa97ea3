//! Tensor files: named arrays of numbers. [Dupuy & Jakob 2018, the files of "An Adaptive
//! Parameterization for Efficient Material Acquisition and Rendering"]
//!
//! ```text
//! "tensor_file\0" │ version 1, 0 │ fields: name, axes, number type, offset, sizes
//!     │ … numbers, each field at its offset
//! ```
//!
//! All is little-endian; the last axis runs fastest.

use std::fmt::Write as _;

use crate::shared::names::quote;

const IDENTIFIER: &[u8; 12] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];
/// Maximum number of fields of a file, and of axes of a field.
const MAX: usize = 64;
/// Codes of the supported number types, and names of all types.
const BYTE: u8 = 1;
const FLOAT32: u8 = 10;
const KINDS: [&str; 12] = [
    "no number",
    "uint8",
    "int8",
    "uint16",
    "int16",
    "uint32",
    "int32",
    "uint64",
    "int64",
    "float16",
    "float32",
    "float64",
];
/// Size in bytes of each number type.
const SIZES: [usize; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];

/// Fields of a file.
#[derive(Debug)]
pub(super) struct TensorFile<'a> {
    fields: Vec<TensorField<'a>>,
}

#[derive(Debug)]
struct TensorField<'a> {
    name: &'a str,
    kind: u8,
    shape: Vec<usize>,
    bytes: &'a [u8],
}

impl<'a> TensorFile<'a> {
    /// Parses the fields, and checks that their values are inside the file.
    ///
    /// # Errors
    /// Returns a message if the format is another one, or the file is truncated or invalid. The
    /// caller adds the location of the reference in the scene.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let mut rest = Cursor(bytes);
        if rest.take(IDENTIFIER.len())? != IDENTIFIER {
            return Err(
                "found no tensor file, expected one that begins with \"tensor_file\"".to_owned()
            );
        }
        let [major, minor] = [rest.byte()?, rest.byte()?];
        if [major, minor] != VERSION {
            return Err(format!("found version {major}.{minor}, expected 1.0"));
        }
        let count = rest.unsigned::<4>()?;
        if count > MAX as u64 {
            return Err(format!("found {count} fields in the header, expected at most {MAX}"));
        }
        let fields: Vec<_> =
            (0..count).map(|_| field(&mut rest, bytes)).collect::<Result<_, _>>()?;
        for (i, field) in fields.iter().enumerate() {
            if fields[..i].iter().any(|other| other.name == field.name) {
                return Err(format!("duplicate field {}", quote(field.name)));
            }
        }
        Ok(Self { fields })
    }

    /// Returns true if there is a field of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name == name)
    }

    /// Returns the sizes of N axes, and the 32-bit values.
    pub(super) fn floats<const N: usize>(
        &self,
        name: &str,
    ) -> Result<([usize; N], Vec<f32>), String> {
        let (shape, bytes) = self.numbers(name, FLOAT32)?;
        let numbers = bytes.as_chunks().0.iter().map(|&word| f32::from_le_bytes(word));
        Ok((shape, numbers.collect()))
    }

    /// Returns a list of bytes.
    pub(super) fn bytes(&self, name: &str) -> Result<&'a [u8], String> {
        let (_, bytes) = self.numbers::<1>(name, BYTE)?;
        Ok(bytes)
    }

    fn numbers<const N: usize>(
        &self,
        name: &str,
        kind: u8,
    ) -> Result<([usize; N], &'a [u8]), String> {
        let Some(field) = self.fields.iter().find(|field| field.name == name) else {
            let names: Vec<_> = self.fields.iter().map(|field| field.name).collect();
            return Err(format!(
                "missing field {}; fields of the file: {}",
                quote(name),
                names.join(", ")
            ));
        };
        let TensorField { shape, bytes, .. } = field;
        match <[usize; N]>::try_from(shape.as_slice()) {
            Ok(shape) if field.kind == kind => Ok((shape, bytes)),
            _ => Err(format!(
                "field {}: found {}, expected {N} {} of {}",
                quote(name),
                described(field),
                if N == 1 { "axis" } else { "axes" },
                KINDS[usize::from(kind)],
            )),
        }
    }
}

/// Describes a field, as in `float32 of 2 x 3`.
fn described(field: &TensorField<'_>) -> String {
    let mut text = KINDS[usize::from(field.kind)].to_owned();
    for (i, size) in field.shape.iter().enumerate() {
        let _ = write!(text, "{}{size}", if i == 0 { " of " } else { " x " });
    }
    text
}

/// Reads a field, whose values are somewhere in `file`.
fn field<'a>(rest: &mut Cursor<'a>, file: &'a [u8]) -> Result<TensorField<'a>, String> {
    let length = rest.unsigned::<2>()? as usize;
    let name = std::str::from_utf8(rest.take(length)?);
    let name = name.map_err(|_| "found a field name that is not text".to_owned())?;
    let axes = rest.unsigned::<2>()? as usize;
    if axes > MAX {
        return Err(format!(
            "found {axes} axes of the field {}, expected at most {MAX}",
            quote(name)
        ));
    }
    let kind = rest.byte()?;
    let size = SIZES.get(usize::from(kind)).copied().filter(|size| *size > 0).ok_or_else(|| {
        format!(
            "found the unknown number type {kind} in the field {}, expected 1 to 11",
            quote(name)
        )
    })?;
    let offset = rest.unsigned::<8>()?;
    let shape: Vec<u64> = (0..axes).map(|_| rest.unsigned::<8>()).collect::<Result<_, _>>()?;
    let bytes = shape.iter().try_fold(size as u64, |all, &n| all.checked_mul(n));
    let end = bytes.and_then(|bytes| offset.checked_add(bytes));
    let range = end.and_then(|end| Some(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
    let Some(bytes) = range.and_then(|range| file.get(range)) else {
        let sizes: Vec<_> = shape.iter().map(u64::to_string).collect();
        return Err(format!(
            "the field {} declares {} numbers of {size} bytes from byte {offset} on, but the file \
             has {} bytes; it may be incomplete",
            quote(name),
            sizes.join(" x "),
            file.len()
        ));
    };
    // They fit into the file; an empty field fits in any case.
    let shape = shape.into_iter().map(|n| usize::try_from(n).unwrap_or(usize::MAX)).collect();
    Ok(TensorField { name, kind, shape, bytes })
}

/// Rest of a file.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or("unexpected end of the file within its header; it may be incomplete")?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// Reads an integer of N bytes.
    fn unsigned<const N: usize>(&mut self) -> Result<u64, String> {
        let mut word = [0; 8];
        word[..N].copy_from_slice(self.take(N)?);
        Ok(u64::from_le_bytes(word))
    }
}

/// A field to write.
pub(super) struct OutField<'a> {
    name: &'a str,
    kind: u8,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl<'a> OutField<'a> {
    pub(super) fn floats(
        name: &'a str,
        shape: &[usize],
        values: impl Iterator<Item = f32>,
    ) -> Self {
        let bytes = values.flat_map(f32::to_le_bytes).collect();
        Self { name, kind: FLOAT32, shape: shape.to_vec(), bytes }
    }

    pub(super) fn bytes(name: &'a str, bytes: &[u8]) -> Self {
        Self { name, kind: BYTE, shape: vec![bytes.len()], bytes: bytes.to_vec() }
    }

    #[cfg(test)]
    pub(super) fn name(&self) -> &str {
        self.name
    }
}

/// Encodes fields as a file, with consecutive values.
pub(super) fn write(fields: &[OutField<'_>]) -> Vec<u8> {
    let of_field = |field: &OutField<'_>| 2 + field.name.len() + 2 + 1 + 8 + 8 * field.shape.len();
    let header = IDENTIFIER.len() + VERSION.len() + 4 + fields.iter().map(of_field).sum::<usize>();
    let mut out = IDENTIFIER.to_vec();
    out.extend(VERSION);
    out.extend((fields.len() as u32).to_le_bytes());
    let mut offset = header as u64;
    for OutField { name, kind, shape, bytes } in fields {
        out.extend((name.len() as u16).to_le_bytes());
        out.extend(name.as_bytes());
        out.extend((shape.len() as u16).to_le_bytes());
        out.push(*kind);
        out.extend(offset.to_le_bytes());
        out.extend(shape.iter().flat_map(|&n| (n as u64).to_le_bytes()));
        offset += bytes.len() as u64;
    }
    out.extend(fields.iter().flat_map(|field| &field.bytes));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Vec<u8> {
        let values = [0.5, -1.0, 2.0, 3.0, 4.0, 5.0];
        write(&[
            OutField::floats("a", &[2, 3], values.into_iter()),
            OutField::bytes("description", b"gold"),
            OutField::floats("empty", &[0, 7], std::iter::empty()),
        ])
    }

    /// Returns the file with one byte changed.
    fn damaged(at: usize, byte: u8) -> Vec<u8> {
        let mut bytes = file();
        bytes[at] = byte;
        bytes
    }

    #[test]
    fn what_is_written_is_read() {
        let bytes = file();
        let read = TensorFile::parse(&bytes).unwrap();
        let (shape, values) = read.floats("a").unwrap();
        assert_eq!((shape, values), ([2, 3], vec![0.5, -1.0, 2.0, 3.0, 4.0, 5.0]));
        assert_eq!(read.bytes("description").unwrap(), b"gold");
        assert_eq!(read.floats("empty").unwrap(), ([0, 7], vec![]));
        assert!(read.has("a") && !read.has("b"));
    }

    #[test]
    fn a_file_that_ends_early_is_refused() {
        let whole = file();
        for length in 0..whole.len() {
            let message = TensorFile::parse(&whole[..length]).unwrap_err();
            assert!(message.contains("may be incomplete"), "{length}: {message}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_reported() {
        // Bytes of the header: 12 identifier, 2 version, 4 count; then the length of the first
        // name, the name "a", the number of axes, the kind, the offset, and the sizes.
        let cases = [
            (damaged(0, b'T'), "begins with \"tensor_file\""),
            (damaged(12, 2), "version 2.0"),
            (damaged(15, 1), "259 fields in the header, expected at most 64"),
            (damaged(20, 0xFF), "not text"),
            (damaged(22, 1), "258 axes of the field \"a\", expected at most 64"),
            (damaged(23, 0), "unknown number type 0"),
            (damaged(23, 12), "unknown number type 12"),
            (damaged(31, 0x7F), "but the file has"),
            (damaged(39, 0xFF), "but the file has"),
            (damaged(38, 0x40), "but the file has"),
        ];
        for (bytes, want) in cases {
            let message = TensorFile::parse(&bytes).unwrap_err();
            assert!(message.contains(want), "{message}, expected {want}");
        }
        let twice = write(&[OutField::bytes("a", b"x"), OutField::bytes("a", b"y")]);
        let message = TensorFile::parse(&twice).unwrap_err();
        assert_eq!(message, "duplicate field \"a\"");
    }

    #[test]
    fn fields_of_other_kinds_are_reported() {
        let bytes = file();
        let read = TensorFile::parse(&bytes).unwrap();
        let cases = [
            (
                read.floats::<1>("a").unwrap_err(),
                "\"a\": found float32 of 2 x 3, expected 1 axis of float32",
            ),
            (
                read.bytes("a").unwrap_err(),
                "\"a\": found float32 of 2 x 3, expected 1 axis of uint8",
            ),
            (
                read.floats::<2>("b").unwrap_err(),
                "missing field \"b\"; fields of the file: a, description, empty",
            ),
        ];
        for (message, want) in cases {
            assert!(message.contains(want), "{message}");
        }
    }
}
