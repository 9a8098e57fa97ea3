//! Numbers, colours, strings, and lists of them.

use pt_scene::Shared;
use pt_scene::texture::Input;
use serde_json::{Value, json};

use super::codec::{FieldCodec, JsonCodec, Plain};
use super::context::{JsonReader, JsonWriter};
use super::node::JsonNode;
use super::printer::Out;
use super::schema::Schemas;
use crate::LoadError;

/// Codec of finite numbers in a range.
#[derive(Clone, Copy)]
pub(super) struct Within {
    least: f64,
    /// True if `least` is excluded from the range.
    is_open: bool,
    /// False if 0 is excluded from a range around it.
    has_zero: bool,
    most: f64,
    expected: &'static str,
}

/// Any finite number.
pub(super) const ANY: Within = Within {
    least: f64::MIN,
    is_open: false,
    has_zero: true,
    most: f64::MAX,
    expected: "a finite number",
};
/// Any finite number but 0.
pub(super) const NOT_0: Within =
    Within { has_zero: false, expected: "a number that is not 0", ..ANY };
/// Numbers of at least 0.
pub(super) const FROM_0: Within =
    Within { least: 0.0, expected: "a number that is not negative", ..ANY };
/// Numbers of at least 1.
pub(super) const FROM_1: Within = Within { least: 1.0, expected: "a number of at least 1", ..ANY };
/// Numbers above 0.
pub(super) const ABOVE_0: Within =
    Within { least: 0.0, is_open: true, expected: "a number above 0", ..ANY };
/// Numbers from 0 to 1.
pub(super) const SHARE: Within = Within { most: 1.0, expected: "a number from 0 to 1", ..FROM_0 };
/// Numbers from 0 to 2.
pub(super) const TO_2: Within = Within { most: 2.0, expected: "a number from 0 to 2", ..FROM_0 };
/// Angles above 0° and up to 180°.
pub(super) const ANGLE: Within =
    Within { most: 180.0, expected: "an angle above 0 and up to 180 degrees", ..ABOVE_0 };
/// Angles from 0° to 90°.
pub(super) const HALF_ANGLE: Within =
    Within { most: 90.0, expected: "an angle from 0 to 90 degrees", ..FROM_0 };

/// Angles from −45° to 45°.
pub(super) const TILT: Within =
    Within { least: -45.0, most: 45.0, expected: "an angle from -45 to 45 degrees", ..ANY };

impl Within {
    fn has(&self, x: f64) -> bool {
        let is_above = if self.is_open { x > self.least } else { x >= self.least };
        is_above && x <= self.most && (self.has_zero || x != 0.0)
    }

    /// Reads a number in the range.
    pub(super) fn number<T: Real>(&self, node: &JsonNode<'_>) -> Result<T, LoadError> {
        let read = node.digits().and_then(T::of_digits);
        read.filter(|x| self.has((*x).into())).ok_or_else(|| node.unexpected(self.expected))
    }

    fn schema(&self) -> Value {
        let mut schema = json!({"type": "number"});
        if self.least > f64::MIN {
            let key = if self.is_open { "exclusiveMinimum" } else { "minimum" };
            schema[key] = self.least.into();
        }
        if self.most < f64::MAX {
            schema["maximum"] = self.most.into();
        }
        if !self.has_zero {
            schema["not"] = json!({"const": 0});
        }
        schema
    }
}

/// Floating-point types, which are read and written exactly.
pub(super) trait Real: Copy + Into<f64> + std::fmt::Debug {
    fn of_digits(digits: &str) -> Option<Self>;
}

impl Real for f32 {
    fn of_digits(digits: &str) -> Option<Self> {
        digits.parse().ok()
    }
}

impl Real for f64 {
    fn of_digits(digits: &str) -> Option<Self> {
        digits.parse().ok()
    }
}

/// Returns the shortest digits that represent a number.
pub(super) fn digits<T: Real>(x: T) -> Result<Out, String> {
    if !x.into().is_finite() {
        return Err(format!("found {x:?}, expected a finite number"));
    }
    let digits = format!("{x:?}");
    Ok(Out::Number(digits.strip_suffix(".0").map_or(digits.clone(), str::to_owned)))
}

impl FieldCodec<f32> for Within {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<f32, LoadError> {
        self.number(node)
    }

    fn write(&self, value: &f32, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        digits(*value)
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        Within::schema(self)
    }
}

impl FieldCodec<f64> for Within {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<f64, LoadError> {
        self.number(node)
    }

    fn write(&self, value: &f64, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        digits(*value)
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        Within::schema(self)
    }
}

/// A colour; a single number is a grey.
impl FieldCodec<[f32; 3]> for Within {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<[f32; 3], LoadError> {
        if node.digits().is_some() {
            return self.number(node).map(|grey| [grey; 3]);
        }
        vector(node, self, "a number or [red, green, blue]")
    }

    fn write(&self, value: &[f32; 3], _: &mut JsonWriter<'_>) -> Result<Out, String> {
        let [r, g, b] = value.map(f32::to_bits);
        if r == g && g == b { digits(value[0]) } else { numbers(value) }
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"anyOf": [Within::schema(self), vector_schema(&Within::schema(self), 3)]})
    }
}

/// A value or a texture.
impl<T> FieldCodec<Input<T>> for Within
where
    Within: FieldCodec<T>,
{
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Input<T>, LoadError> {
        if node.text().is_some() || node.value().as_object().is_some() {
            return Plain.read(node, cx).map(Input::Texture);
        }
        FieldCodec::<T>::read(self, node, cx).map(Input::Value)
    }

    fn write(&self, value: &Input<T>, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        match value {
            Input::Value(value) => FieldCodec::<T>::write(self, value, cx),
            Input::Texture(texture) => texture.write(cx),
        }
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        let value = FieldCodec::<T>::schema(self, schemas);
        json!({"anyOf": [value, std::sync::Arc::<pt_scene::Texture>::schema(schemas)]})
    }
}

/// Codec of a list of numbers in a range.
pub(super) struct Each(pub(super) Within);

impl<T: Real, const N: usize> FieldCodec<[T; N]> for Each {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<[T; N], LoadError> {
        vector(node, &self.0, &format!("a list of {N} numbers"))
    }

    fn write(&self, value: &[T; N], _: &mut JsonWriter<'_>) -> Result<Out, String> {
        numbers(value)
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        vector_schema(&self.0.schema(), N)
    }
}

impl FieldCodec<Vec<f32>> for Each {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Vec<f32>, LoadError> {
        let Some((shape, numbers)) = node.array() else {
            return node
                .list("a list of numbers")?
                .iter()
                .map(|item| self.0.number(item))
                .collect();
        };
        if shape.len() != 1 {
            return Err(node.wrong_shape(&shape, "(n,)"));
        }
        let numbers = node.reals(numbers, 1)?.into_vec();
        match numbers.iter().position(|x| !self.0.has(f64::from(*x))) {
            None => Ok(numbers),
            Some(at) => {
                let (found, expected) = (numbers[at], self.0.expected);
                Err(node.error(format!("expected {expected}, found {found} in place {at}")))
            }
        }
    }

    fn write(&self, value: &Vec<f32>, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        numbers(value)
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": "array", "items": self.0.schema()})
    }
}

/// Reads a list of N numbers.
pub(super) fn vector<T: Real, const N: usize>(
    node: &JsonNode<'_>,
    range: &Within,
    expected: &str,
) -> Result<[T; N], LoadError> {
    let list = node.list(expected)?;
    let read: Vec<T> = list.iter().map(|item| range.number(item)).collect::<Result<_, _>>()?;
    read.try_into().map_err(|_| node.unexpected(expected))
}

/// Writes a list of numbers.
pub(super) fn numbers<T: Real>(values: &[T]) -> Result<Out, String> {
    values.iter().map(|x| digits(*x)).collect::<Result<_, _>>().map(Out::List)
}

pub(super) fn vector_schema(item: &Value, count: usize) -> Value {
    json!({"type": "array", "items": item, "minItems": count, "maxItems": count})
}

/// Codec of a number that may be infinite, in which case it is omitted.
pub(super) struct PerhapsInfinite;

impl FieldCodec<f64> for PerhapsInfinite {
    const IS_NEEDED: bool = false;

    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<f64, LoadError> {
        ABOVE_0.number(node)
    }

    fn write(&self, value: &f64, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        digits(*value)
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        ABOVE_0.schema()
    }

    fn missing(&self, _: &JsonNode<'_>, _: &JsonReader<'_>) -> Option<f64> {
        Some(f64::INFINITY)
    }

    fn is_understood(&self, value: &f64, _: &JsonWriter<'_>) -> bool {
        *value == f64::INFINITY
    }
}

impl JsonCodec for u32 {
    fn read(node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let read = node.digits().and_then(|digits| digits.parse().ok());
        read.ok_or_else(|| node.unexpected("a whole number from 0 to 4294967295"))
    }

    fn write(&self, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::Number(self.to_string()))
    }

    fn schema(_: &mut Schemas) -> Value {
        json!({"type": "integer", "minimum": 0, "maximum": u32::MAX})
    }
}

/// Codec of integers from 0 to this one.
pub(super) struct UpTo(pub(super) u32);

impl FieldCodec<u32> for UpTo {
    fn read(&self, node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<u32, LoadError> {
        let read = node.digits().and_then(|digits| digits.parse().ok());
        read.filter(|x| *x <= self.0)
            .ok_or_else(|| node.unexpected(&format!("a whole number from 0 to {}", self.0)))
    }

    fn write(&self, value: &u32, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::Number(value.to_string()))
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": "integer", "minimum": 0, "maximum": self.0})
    }
}

impl JsonCodec for bool {
    fn read(node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let flag = node.value().as_boolean_lit().map(|flag| flag.value);
        flag.ok_or_else(|| node.unexpected("true or false"))
    }

    fn write(&self, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::Flag(*self))
    }

    fn schema(_: &mut Schemas) -> Value {
        json!({"type": "boolean"})
    }
}

impl JsonCodec for String {
    fn read(node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        node.text().map(str::to_owned).ok_or_else(|| node.unexpected("a text"))
    }

    fn write(&self, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::text(self))
    }

    fn schema(_: &mut Schemas) -> Value {
        json!({"type": "string"})
    }
}

impl<T: JsonCodec> JsonCodec for Option<T> {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        if node.value().as_null_keyword().is_some() {
            return Ok(None);
        }
        T::read(node, cx).map(Some)
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        self.as_ref().map_or(Ok(Out::Null), |value| value.write(cx))
    }

    fn schema(schemas: &mut Schemas) -> Value {
        json!({"anyOf": [T::schema(schemas), {"type": "null"}]})
    }
}

impl<T: JsonCodec> JsonCodec for Vec<T> {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        node.list("a list […]")?.iter().map(|item| T::read(item, cx)).collect()
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        write_list(self, cx)
    }

    fn schema(schemas: &mut Schemas) -> Value {
        json!({"type": "array", "items": T::schema(schemas)})
    }
}

impl<T: JsonCodec> JsonCodec for Shared<T> {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        Vec::read(node, cx).map(Into::into)
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        write_list(self, cx)
    }

    fn schema(schemas: &mut Schemas) -> Value {
        Vec::<T>::schema(schemas)
    }
}

fn write_list<T: JsonCodec>(list: &[T], cx: &mut JsonWriter<'_>) -> Result<Out, String> {
    let write = |(i, item): (usize, &T)| item.write(cx).map_err(|e| format!("[{i}]: {e}"));
    list.iter().enumerate().map(write).collect::<Result<_, _>>().map(Out::List)
}

impl<T: JsonCodec, const N: usize> JsonCodec for [T; N] {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let wrong = || node.unexpected(&format!("a list of {N}"));
        Vec::read(node, cx)?.try_into().map_err(|_| wrong())
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        self.iter().map(|item| item.write(cx)).collect::<Result<_, _>>().map(Out::List)
    }

    fn schema(schemas: &mut Schemas) -> Value {
        vector_schema(&T::schema(schemas), N)
    }
}

/// Codec of a list of two values.
pub(super) struct Pair(pub(super) Within);

impl<T> FieldCodec<[T; 2]> for Pair
where
    Within: FieldCodec<T>,
{
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<[T; 2], LoadError> {
        match node.list("a list of two")?.as_slice() {
            [first, second] => Ok([self.0.read(first, cx)?, self.0.read(second, cx)?]),
            _ => Err(node.unexpected("a list of two")),
        }
    }

    fn write(&self, [first, second]: &[T; 2], cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::List(vec![self.0.write(first, cx)?, self.0.write(second, cx)?]))
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        vector_schema(&FieldCodec::<T>::schema(&self.0, schemas), 2)
    }
}

/// A boxed pair.
impl<T> FieldCodec<Box<[T; 2]>> for Pair
where
    Within: FieldCodec<T>,
{
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Box<[T; 2]>, LoadError> {
        FieldCodec::<[T; 2]>::read(self, node, cx).map(Box::new)
    }

    fn write(&self, value: &Box<[T; 2]>, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        FieldCodec::<[T; 2]>::write(self, value, cx)
    }

    fn schema(&self, schemas: &mut Schemas) -> Value {
        FieldCodec::<[T; 2]>::schema(self, schemas)
    }
}
