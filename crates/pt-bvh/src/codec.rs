//! Conversion of numbers to little-endian bytes and back, on every machine, and reasons for which
//! bytes are rejected.

use pt_math::{Bounds3, Vec3};
use thiserror::Error;

use crate::geometry::in_range;

/// Version of the format, to be incremented with every change.
pub(crate) const VERSION: u32 = 2;

/// Reason for which bytes are not a valid tree.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum ReadError {
    /// The mark of a tree is missing.
    #[error("these are not the bytes of a tree")]
    Mark,
    /// The tree was written by another version of this crate.
    #[error("the tree has version {found} of the form, but only {VERSION} can be read")]
    Version {
        /// Version of the bytes.
        found: u32,
    },
    /// The bytes end too soon.
    #[error("the tree is cut off")]
    Truncated,
    /// The bytes were damaged.
    #[error("the checksum of the tree is wrong")]
    Checksum,
    /// The checksum is right, but the tree is not safe for queries.
    #[error("the tree is not valid: {what}")]
    Invalid {
        /// Description of the problem.
        what: &'static str,
    },
}

/// Returns an error unless `holds` is true.
pub(crate) fn ensure(holds: bool, what: &'static str) -> Result<(), ReadError> {
    if holds { Ok(()) } else { Err(ReadError::Invalid { what }) }
}

/// FNV-1a over words of eight bytes, the last padded with zeros, and the number of bytes. [Fowler,
/// Noll & Vo 1991; RFC 9923]
pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0000_0100_0000_01B3);
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_le_bytes(word)
    });
    // Multiplication moves bits upward only; the rotation brings the upper ones down again.
    let hash = words.fold(0xCBF2_9CE4_8422_2325, |hash, word| mix(hash, word).rotate_right(29));
    mix(hash, bytes.len() as u64)
}

/// Buffer to which numbers are appended.
#[derive(Default)]
pub(crate) struct ByteWriter(pub(crate) Vec<u8>);

impl ByteWriter {
    pub(crate) fn u32(&mut self, x: u32) {
        self.0.extend(x.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, x: u64) {
        self.0.extend(x.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, x: f32) {
        self.u32(x.to_bits());
    }

    pub(crate) fn u32s(&mut self, numbers: &[u32]) {
        for &x in numbers {
            self.u32(x);
        }
    }

    pub(crate) fn f32s(&mut self, numbers: &[f32]) {
        for &x in numbers {
            self.f32(x);
        }
    }

    pub(crate) fn vector(&mut self, v: Vec3) {
        self.f32s(&v.to_array());
    }

    pub(crate) fn bounds(&mut self, b: &Bounds3) {
        self.vector(b.min);
        self.vector(b.max);
    }
}

/// Input from which numbers are read in order.
pub(crate) struct ByteReader<'a>(pub(crate) &'a [u8]);

impl ByteReader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let (first, rest) = self.0.split_first_chunk().ok_or(ReadError::Truncated)?;
        self.0 = rest;
        Ok(*first)
    }

    pub(crate) fn u32(&mut self) -> Result<u32, ReadError> {
        self.take().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, ReadError> {
        self.take().map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32, ReadError> {
        self.u32().map(f32::from_bits)
    }

    pub(crate) fn u32s<const N: usize>(&mut self) -> Result<[u32; N], ReadError> {
        let mut numbers = [0; N];
        for x in &mut numbers {
            *x = self.u32()?;
        }
        Ok(numbers)
    }

    pub(crate) fn f32s<const N: usize>(&mut self) -> Result<[f32; N], ReadError> {
        self.u32s().map(|bits| bits.map(f32::from_bits))
    }

    pub(crate) fn vector(&mut self) -> Result<Vec3, ReadError> {
        self.f32s().map(Vec3::from_array)
    }

    pub(crate) fn bounds(&mut self) -> Result<Bounds3, ReadError> {
        Ok(Bounds3 { min: self.vector()?, max: self.vector()? })
    }

    /// Reads the number of entries that follow, of at least `size` bytes each. Rejects counts that
    /// exceed the rest of the input, so that the result can be used as a capacity.
    pub(crate) fn count(&mut self, size: usize) -> Result<usize, ReadError> {
        let count = usize::try_from(self.u64()?).map_err(|_| ReadError::Truncated)?;
        if count > self.0.len() / size {
            return Err(ReadError::Truncated);
        }
        Ok(count)
    }
}

/// Tests that the box of a scene is finite and not empty.
pub(crate) fn ensure_scene(bounds: &Bounds3) -> Result<(), ReadError> {
    // Spheres extend as far again beyond the largest coordinate, and their boxes are rounded.
    let fits = in_range(bounds.min / 4.0) && in_range(bounds.max / 4.0);
    ensure(!bounds.is_empty() && fits, "a box of the scene that is none")
}
