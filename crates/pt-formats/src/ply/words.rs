//! Sequential readers of the numbers of a row, in text and binary files.

use super::layout::{Field, Kind, Number, Role, SLOTS};
use crate::shared::decimal::{leading_f32, leading_f64, leading_whole, next};
use crate::shared::names::quote;

/// Error of reading a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fault {
    /// The row ends.
    Missing,
    /// The number is invalid for its type.
    NoNumber,
}

/// Sequential reader of the numbers of a row.
pub(super) trait Words {
    /// Reads the next number as a real number.
    fn real(&mut self, kind: Number) -> Result<f32, Fault>;
    /// Reads the next number as an integer.
    fn whole(&mut self, kind: Number) -> Result<i64, Fault>;
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
    ) -> Result<T, Fault> {
        let rest = self.rest.trim_ascii_start();
        if rest.is_empty() {
            return Err(Fault::Missing);
        }
        let (number, rest) = next(rest, quick).ok_or(Fault::NoNumber)?;
        self.rest = rest;
        Ok(number)
    }
}

impl Words for Text<'_> {
    fn real(&mut self, kind: Number) -> Result<f32, Fault> {
        match kind {
            Number::Float => self.number(leading_f32),
            Number::Double => self.number(leading_f64).map(|x| x as f32),
            _ => self.whole(kind).map(|x| x as f32),
        }
    }

    fn whole(&mut self, _: Number) -> Result<i64, Fault> {
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
pub(super) struct Binary<'a, const BIG: bool> {
    pub(super) rest: &'a [u8],
}

impl<const BIG: bool> Binary<'_, BIG> {
    /// Reads the next bytes, and returns them in little-endian order.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(Fault::Missing)?;
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

impl<const BIG: bool> Words for Binary<'_, BIG> {
    fn real(&mut self, kind: Number) -> Result<f32, Fault> {
        match kind {
            Number::Float => self.take().map(f32::from_le_bytes),
            Number::Double => self.take().map(|x| f64::from_le_bytes(x) as f32),
            _ => self.whole(kind).map(|x| x as f32),
        }
    }

    fn whole(&mut self, kind: Number) -> Result<i64, Fault> {
        match kind {
            Number::Char => self.take().map(|x| i8::from_le_bytes(x).into()),
            Number::UChar => self.take().map(|x| u8::from_le_bytes(x).into()),
            Number::Short => self.take().map(|x| i16::from_le_bytes(x).into()),
            Number::UShort => self.take().map(|x| u16::from_le_bytes(x).into()),
            Number::Int => self.take().map(|x| i32::from_le_bytes(x).into()),
            Number::UInt => self.take().map(|x| u32::from_le_bytes(x).into()),
            Number::Float | Number::Double => Err(Fault::NoNumber),
        }
    }

    fn shown(&self) -> String {
        "the row has no numbers of this type".to_owned()
    }
}

/// Content of a row.
#[derive(Default)]
pub(super) struct Row {
    pub(super) numbers: [f32; SLOTS],
    pub(super) corners: Vec<i64>,
    /// Texture coordinates, two numbers per corner.
    pub(super) coordinates: Vec<f32>,
}

impl Row {
    /// Reads the numbers of a row; slots without a property are unchanged.
    ///
    /// # Errors
    /// Returns a message about the first invalid number.
    pub(super) fn read(&mut self, fields: &[Field], words: &mut impl Words) -> Result<(), String> {
        for Field { kind, role } in fields {
            match (*kind, *role) {
                (Kind::Scalar(number), role) => {
                    let read = words.real(number);
                    let value = read.map_err(|fault| explain(fault, *kind, words))?;
                    if let Role::Slot { slot, levels } = role {
                        self.numbers[slot] = value / levels;
                    }
                }
                (Kind::List(count, number), role) => {
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
        number: Number,
        role: Role,
        words: &mut impl Words,
    ) -> Result<(), String> {
        if count < 0 {
            return Err("List length cannot be negative".to_owned());
        }
        match role {
            Role::Corners => self.corners.clear(),
            Role::Coordinates => self.coordinates.clear(),
            Role::Nothing | Role::Slot { .. } => {}
        }
        for i in 0..count {
            let read = match role {
                Role::Corners => words.whole(number).map(|corner| self.corners.push(corner)),
                Role::Coordinates => words.real(number).map(|x| self.coordinates.push(x)),
                Role::Nothing | Role::Slot { .. } => words.real(number).map(drop),
            };
            read.map_err(|fault| match fault {
                Fault::Missing => format!("Expected {count} list elements, but found only {i}"),
                Fault::NoNumber => no_number(words),
            })?;
        }
        Ok(())
    }
}

fn explain(fault: Fault, kind: Kind, words: &impl Words) -> String {
    match fault {
        Fault::Missing => format!("Expected element of type '{kind:?}', but found nothing"),
        Fault::NoNumber => no_number(words),
    }
}

fn no_number(words: &impl Words) -> String {
    format!("Couldn't parse element line: {}", quote(&words.shown()))
}
