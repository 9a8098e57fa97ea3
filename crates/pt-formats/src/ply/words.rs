//! Sequential readers of the numbers of a row, in text and binary files.

use super::layout::{NumberType, PlyProperty, PropertyKind, PropertyRole, SLOTS};
use crate::shared::decimal::{leading_f32, leading_f64, leading_whole, next};
use crate::shared::names::quote;

/// Error of reading a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum WordError {
    /// The row ends.
    Missing,
    /// The number is invalid for its type.
    NoNumber,
}

/// Sequential reader of the numbers of a row.
pub(super) trait RowWords {
    /// Reads the next number as a real number.
    fn real(&mut self, kind: NumberType) -> Result<f32, WordError>;
    /// Reads the next number as an integer.
    fn whole(&mut self, kind: NumberType) -> Result<i64, WordError>;
    /// Returns the row for messages.
    fn shown(&self) -> String;
}

/// A line of a text.
pub(super) struct Text<'a> {
    line: &'a [u8],
    rest: &'a [u8],
}

impl<'a> Text<'a> {
    pub(super) fn new(line: &'a [u8]) -> Self {
        Self { line, rest: line }
    }

    /// Reads the next number: by `quick`, or if that fails, by the standard library.
    fn number<T: std::str::FromStr>(
        &mut self,
        quick: impl Fn(&[u8]) -> Option<(T, &[u8])>,
    ) -> Result<T, WordError> {
        let rest = self.rest.trim_ascii_start();
        if rest.is_empty() {
            return Err(WordError::Missing);
        }
        let (number, rest) = next(rest, quick).ok_or(WordError::NoNumber)?;
        self.rest = rest;
        Ok(number)
    }
}

impl RowWords for Text<'_> {
    fn real(&mut self, kind: NumberType) -> Result<f32, WordError> {
        match kind {
            NumberType::Float => self.number(leading_f32),
            NumberType::Double => self.number(leading_f64).map(|x| x as f32),
            _ => self.whole(kind).map(|x| x as f32),
        }
    }

    fn whole(&mut self, _: NumberType) -> Result<i64, WordError> {
        self.number(|text| {
            let (number, rest) = leading_whole(text)?;
            Some((i64::try_from(number).ok()?, rest))
        })
    }

    fn shown(&self) -> String {
        String::from_utf8_lossy(self.line.trim_ascii()).into_owned()
    }
}

/// Bytes of a row, big-endian if `BIG`.
pub(super) struct BinaryWords<'a, const BIG: bool> {
    pub(super) rest: &'a [u8],
}

impl<const BIG: bool> BinaryWords<'_, BIG> {
    /// Reads the next bytes, and returns them in little-endian order.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], WordError> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(WordError::Missing)?;
        self.rest = rest;
        Ok(in_order::<N, BIG>(*bytes))
    }
}

/// Returns bytes in little-endian order.
pub(super) fn in_order<const N: usize, const BIG: bool>(mut bytes: [u8; N]) -> [u8; N] {
    if BIG {
        bytes.reverse();
    }
    bytes
}

impl<const BIG: bool> RowWords for BinaryWords<'_, BIG> {
    fn real(&mut self, kind: NumberType) -> Result<f32, WordError> {
        match kind {
            NumberType::Float => self.take().map(f32::from_le_bytes),
            NumberType::Double => self.take().map(|x| f64::from_le_bytes(x) as f32),
            _ => self.whole(kind).map(|x| x as f32),
        }
    }

    fn whole(&mut self, kind: NumberType) -> Result<i64, WordError> {
        match kind {
            NumberType::Char => self.take().map(|x| i8::from_le_bytes(x).into()),
            NumberType::UChar => self.take().map(|x| u8::from_le_bytes(x).into()),
            NumberType::Short => self.take().map(|x| i16::from_le_bytes(x).into()),
            NumberType::UShort => self.take().map(|x| u16::from_le_bytes(x).into()),
            NumberType::Int => self.take().map(|x| i32::from_le_bytes(x).into()),
            NumberType::UInt => self.take().map(|x| u32::from_le_bytes(x).into()),
            NumberType::Float | NumberType::Double => Err(WordError::NoNumber),
        }
    }

    fn shown(&self) -> String {
        "the row has no numbers of this type".to_owned()
    }
}

/// Content of a row.
#[derive(Default)]
pub(super) struct ElementRow {
    pub(super) numbers: [f32; SLOTS],
    pub(super) corners: Vec<i64>,
    /// Texture coordinates, two numbers per corner.
    pub(super) coordinates: Vec<f32>,
}

impl ElementRow {
    /// Reads the numbers of a row; slots without a property are unchanged.
    ///
    /// # Errors
    /// Returns a message about the first invalid number.
    pub(super) fn read(
        &mut self,
        fields: &[PlyProperty],
        words: &mut impl RowWords,
    ) -> Result<(), String> {
        for PlyProperty { kind, role } in fields {
            match (*kind, *role) {
                (PropertyKind::Scalar(number), role) => {
                    let read = words.real(number);
                    let value = read.map_err(|fault| explain(fault, *kind, words))?;
                    if let PropertyRole::Slot { slot, levels } = role {
                        self.numbers[slot] = value / levels;
                    }
                }
                (PropertyKind::List(count, number), role) => {
                    let read = words.whole(count);
                    let count = read.map_err(|fault| explain(fault, *kind, words))?;
                    self.read_list(count, number, role, words)?;
                }
            }
        }
        Ok(())
    }

    fn read_list(
        &mut self,
        count: i64,
        number: NumberType,
        role: PropertyRole,
        words: &mut impl RowWords,
    ) -> Result<(), String> {
        if count < 0 {
            return Err("List length cannot be negative".to_owned());
        }
        match role {
            PropertyRole::Corners => self.corners.clear(),
            PropertyRole::Coordinates => self.coordinates.clear(),
            PropertyRole::Nothing | PropertyRole::Slot { .. } => {}
        }
        for i in 0..count {
            let read = match role {
                PropertyRole::Corners => {
                    words.whole(number).map(|corner| self.corners.push(corner))
                }
                PropertyRole::Coordinates => words.real(number).map(|x| self.coordinates.push(x)),
                PropertyRole::Nothing | PropertyRole::Slot { .. } => words.real(number).map(drop),
            };
            read.map_err(|fault| match fault {
                WordError::Missing => format!("Expected {count} list elements, but found only {i}"),
                WordError::NoNumber => no_number(words),
            })?;
        }
        Ok(())
    }
}

fn explain(fault: WordError, kind: PropertyKind, words: &impl RowWords) -> String {
    match fault {
        WordError::Missing => format!("Expected element of type '{kind:?}', but found nothing"),
        WordError::NoNumber => no_number(words),
    }
}

fn no_number(words: &impl RowWords) -> String {
    format!("Couldn't parse element line: {}", quote(&words.shown()))
}
