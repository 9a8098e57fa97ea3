//! Descriptions of types, from which reader, writer and schema are derived.
//!
//! A struct is a `json_struct!` of its fields; an enum is a `json_enum!` (an object with the
//! variant as its "type") or a `json_unit_enum!`. Each field has a [`FieldCodec`] and perhaps a
//! default; fields with their default value are not written. The module `expansion` has what each
//! of the macros makes of a small type, written out.

#[cfg(test)]
mod expansion;

use super::context::{JsonReader, JsonWriter};
use super::node::{JsonNode, ObjectKeys};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use crate::LoadError;

/// Reader, writer and schema of a field.
pub(super) trait FieldCodec<T> {
    /// True if the field is written to files.
    const IS_WRITTEN: bool = true;
    /// True if the field is required unless it has a default.
    const IS_NEEDED: bool = true;

    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<T, LoadError>;
    fn write(&self, value: &T, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value;

    /// Returns the value for an object without the field, if the field has no default.
    fn missing(&self, _object: &JsonNode<'_>, _cx: &JsonReader<'_>) -> Option<T> {
        None
    }

    /// Returns true if a missing field would have this value, so that it need not be written.
    fn is_understood(&self, _value: &T, _cx: &JsonWriter<'_>) -> bool {
        false
    }
}

/// Types with a single representation.
pub(super) trait JsonCodec: Sized {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError>;
    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema(schemas: &mut Schemas) -> serde_json::Value;
}

/// Codec of fields whose type implements [`JsonCodec`].
pub(super) struct Plain;

impl<T: JsonCodec> FieldCodec<T> for Plain {
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<T, LoadError> {
        T::read(node, cx)
    }

    fn write(&self, value: &T, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        value.write(cx)
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        T::schema(schemas)
    }
}

/// Types that are represented by an object, or by some keys of one.
pub(super) trait StructCodec: Sized {
    /// True if a string represents an object with only that value as its "type".
    const IS_TAGGED: bool = false;

    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError>;
    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String>;
    /// Returns the possible keys: one set, or alternative sets.
    fn properties(schemas: &mut Schemas) -> Vec<Properties>;
}

/// Enums whose variants are distinguished by the key "type".
pub(super) trait EnumCodec: StructCodec {
    /// Returns the names of all types.
    fn names() -> Vec<String>;
    /// Reads the value of the type `name`; `None` if there is no such type.
    fn read_type(
        name: &str,
        keys: &mut ObjectKeys<'_>,
        cx: &mut JsonReader<'_>,
    ) -> Result<Option<Self>, LoadError>;
}

impl<T: StructCodec> JsonCodec for T {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let is_word = T::IS_TAGGED && node.text().is_some();
        let mut keys = if is_word { node.word() } else { node.keys()? };
        let read = T::read_fields(&mut keys, cx)?;
        keys.finish()?;
        Ok(read)
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let mut out = Entries::new();
        self.write_fields(&mut out, cx)?;
        Ok(match out.as_mut_slice() {
            [(_, tag)] if T::IS_TAGGED => std::mem::replace(tag, Out::Null),
            _ => Out::Object(out),
        })
    }

    fn schema(schemas: &mut Schemas) -> serde_json::Value {
        let path = std::any::type_name::<T>();
        // A box has the schema of its content.
        let name = path.rsplit("::").next().unwrap_or(path).trim_end_matches('>');
        schemas.define(name, |schemas| Properties::any_of(&T::properties(schemas), T::IS_TAGGED))
    }
}

impl ObjectKeys<'_> {
    /// Reads the value of a key, or returns the default; without a default, the key is required.
    pub(super) fn read<T, K: FieldCodec<T>>(
        &mut self,
        name: &'static str,
        kind: &K,
        default: Option<T>,
        cx: &mut JsonReader<'_>,
    ) -> Result<T, LoadError> {
        let found = if K::IS_WRITTEN { self.take(name) } else { None };
        match found {
            Some(node) => kind.read(&node, cx),
            None => default
                .or_else(|| kind.missing(&self.node, cx))
                .ok_or_else(|| self.node.error(format!("missing {}", quote(name)))),
        }
    }
}

impl Properties {
    /// Adds a field of a struct; `_field` determines the type only.
    pub(super) fn with<T, K: FieldCodec<T>, S>(
        self,
        name: &str,
        kind: &K,
        _field: fn(&S) -> &T,
        default: Option<T>,
        schemas: &mut Schemas,
    ) -> Self {
        if !K::IS_WRITTEN {
            return self;
        }
        let mut schema = kind.schema(schemas);
        let is_required = default.is_none() && K::IS_NEEDED;
        let written = default.and_then(|value| kind.write(&value, &mut JsonWriter::default()).ok());
        if let Some(default) = written.filter(|default| *default != Out::Null) {
            schema["default"] = serde_json::from_str(&default.print()).unwrap_or_default();
        }
        self.with_schema(name, schema, is_required)
    }
}

impl<T: StructCodec> StructCodec for Box<T> {
    const IS_TAGGED: bool = T::IS_TAGGED;

    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        T::read_fields(keys, cx).map(Box::new)
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        T::write_fields(self, out, cx)
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        T::properties(schemas)
    }
}

/// Writes a field, unless it has its default value.
pub(super) fn put<T, K: FieldCodec<T>>(
    out: &mut Entries,
    name: &str,
    kind: &K,
    value: &T,
    default: Option<T>,
    cx: &mut JsonWriter<'_>,
) -> Result<(), String> {
    if !K::IS_WRITTEN || kind.is_understood(value, cx) {
        return Ok(());
    }
    let written = kind.write(value, cx).map_err(|e| format!("{name}: {e}"))?;
    let default = default.map(|default| kind.write(&default, cx)).transpose()?;
    if default.as_ref() != Some(&written) {
        out.push((name.to_owned(), written));
    }
    Ok(())
}

/// Returns the name of a variant in files: `linear_spot` for `LinearSpot`.
pub(super) fn snake(name: &str) -> String {
    let mut snake = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(c.to_ascii_lowercase());
    }
    snake
}

/// An optional default.
macro_rules! default_of {
    () => {
        None
    };
    ($default:expr) => {
        Some($default)
    };
}
pub(super) use default_of;

/// `json_struct! { Type { field: kind => default, field: kind } + flattened: Type; check }`: the
/// keys of the field after `+` are among those of the struct itself, and `check` rejects
/// inconsistent values.
///
/// Implements [`StructCodec`], and thereby [`JsonCodec`]; see `Fog` in `expansion`.
macro_rules! json_struct {
    ($type:ident { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? } $(+ $flat:ident: $flat_type:ty)? $(; $check:ident)?) => {
        impl $crate::json::codec::StructCodec for $type {
            const IS_TAGGED: bool = false $(|| <$flat_type as $crate::json::codec::StructCodec>::IS_TAGGED)?;

            fn read_fields(
                keys: &mut $crate::json::node::ObjectKeys<'_>,
                cx: &mut $crate::json::context::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                let _ = (&keys, &cx);
                let made = Self {
                    $($flat: <$flat_type>::read_fields(keys, cx)?,)?
                    $($field: keys.read(
                        stringify!($field),
                        &$kind,
                        $crate::json::codec::default_of!($($default)?),
                        cx,
                    )?),*
                };
                $($check(&made).map_err(|message| keys.node.error(message))?;)?
                Ok(made)
            }

            fn write_fields(
                &self,
                out: &mut $crate::json::printer::Entries,
                cx: &mut $crate::json::context::JsonWriter<'_>,
            ) -> Result<(), String> {
                let _ = (&out, &cx);
                $(self.$flat.write_fields(out, cx)?;)?
                $($crate::json::codec::put(
                    out,
                    stringify!($field),
                    &$kind,
                    &self.$field,
                    $crate::json::codec::default_of!($($default)?),
                    cx,
                )?;)*
                Ok(())
            }

            fn properties(
                schemas: &mut $crate::json::schema::Schemas,
            ) -> Vec<$crate::json::schema::Properties> {
                let own = $crate::json::schema::Properties::default();
                $(let own = own.with::<_, _, Self>(
                    stringify!($field),
                    &$kind,
                    |made| &made.$field,
                    $crate::json::codec::default_of!($($default)?),
                    schemas,
                );)*
                let _ = &schemas;
                let all = vec![own];
                $(let all = $crate::json::schema::Properties::each_with(
                    <$flat_type>::properties(schemas), &all[0]);)?
                all
            }
        }
    };
}
pub(super) use json_struct;

/// An enum with variants `Variant { field: kind = default }`, `Variant(Record)`,
/// `Variant[key: kind]` for a single unnamed field, and `Variant()`. The types of another enum,
/// `Variant(..Enum)`, are types of this one.
///
/// Implements [`EnumCodec`] and [`StructCodec`], and thereby [`JsonCodec`]; see `Shape` in
/// `expansion`.
macro_rules! json_enum {
    ($type:ident { $($variant:ident $body:tt),* $(,)? }) => {
        impl $crate::json::codec::EnumCodec for $type {
            fn names() -> Vec<String> {
                use $crate::json::codec::variant_names;
                [$(variant_names!($variant, $body)),*].concat()
            }

            fn read_type(
                name: &str,
                keys: &mut $crate::json::node::ObjectKeys<'_>,
                cx: &mut $crate::json::context::JsonReader<'_>,
            ) -> Result<Option<Self>, $crate::LoadError> {
                use $crate::json::codec::read_variant;
                let _ = (&keys, &cx);
                $(read_variant!($type, $variant, $body, name, keys, cx);)*
                Ok(None)
            }
        }

        impl $crate::json::codec::StructCodec for $type {
            const IS_TAGGED: bool = true;

            fn read_fields(
                keys: &mut $crate::json::node::ObjectKeys<'_>,
                cx: &mut $crate::json::context::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                use $crate::json::codec::EnumCodec; use $crate::json::former_names::current_type;
                let tag = keys.tag()?;
                let name = tag.text().ok_or_else(|| tag.unexpected("a name"))?;
                let name = current_type(name);
                Self::read_type(name, keys, cx)?.ok_or_else(|| {
                    let known = Self::names();
                    tag.unknown("type", name, known.iter().map(String::as_str))
                })
            }

            fn write_fields(
                &self,
                out: &mut $crate::json::printer::Entries,
                cx: &mut $crate::json::context::JsonWriter<'_>,
            ) -> Result<(), String> {
                use $crate::json::codec::{variant_pattern, write_variant};
                let _ = &cx;
                match self {
                    $(variant_pattern!(inner, $type, $variant, $body) => {
                        write_variant!(inner, $variant, $body, out, cx);
                    })*
                }
                Ok(())
            }

            fn properties(
                schemas: &mut $crate::json::schema::Schemas,
            ) -> Vec<$crate::json::schema::Properties> {
                use $crate::json::codec::describe_variant;
                let _ = &schemas;
                let mut all = Vec::new();
                $(all.extend(describe_variant!($type, $variant, $body, schemas));)*
                all
            }
        }
    };
}
pub(super) use json_enum;

macro_rules! variant_names {
    ($variant:ident, (..$types:ty)) => {
        <$types as $crate::json::codec::EnumCodec>::names()
    };
    ($variant:ident, $body:tt) => {
        vec![$crate::json::codec::snake(stringify!($variant))]
    };
}
pub(super) use variant_names;

/// Returns the variant from the function if its type has this name.
macro_rules! read_variant {
    ($type:ident, $variant:ident, (..$types:ty), $name:ident, $keys:ident, $cx:ident) => {
        let read = <$types as $crate::json::codec::EnumCodec>::read_type($name, $keys, $cx)?;
        if let Some(inner) = read {
            return Ok(Some($type::$variant(inner)));
        }
    };
    ($type:ident, $variant:ident, $body:tt, $name:ident, $keys:ident, $cx:ident) => {
        if $name == $crate::json::codec::snake(stringify!($variant)) {
            let read = $crate::json::codec::read_body!($type, $variant, $body, $keys, $cx);
            return Ok(Some(read));
        }
    };
}
pub(super) use read_variant;

macro_rules! read_body {
    ($type:ident, $variant:ident, (), $keys:ident, $cx:ident) => {
        $type::$variant
    };
    ($type:ident, $variant:ident, ($record:ty), $keys:ident, $cx:ident) => {
        $type::$variant(<$record as $crate::json::codec::StructCodec>::read_fields($keys, $cx)?)
    };
    ($type:ident, $variant:ident, [$key:ident: $kind:expr], $keys:ident, $cx:ident) => {
        $type::$variant($keys.read(stringify!($key), &$kind, None, $cx)?)
    };
    ($type:ident, $variant:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }, $keys:ident, $cx:ident) => {
        $type::$variant {
            $($field: $keys.read(
                stringify!($field),
                &$kind,
                $crate::json::codec::default_of!($($default)?),
                $cx,
            )?),*
        }
    };
}
pub(super) use read_body;

macro_rules! variant_pattern {
    ($inner:ident, $type:ident, $variant:ident, ()) => {
        $type::$variant
    };
    ($inner:ident, $type:ident, $variant:ident, (..$types:ty)) => {
        $type::$variant($inner)
    };
    ($inner:ident, $type:ident, $variant:ident, ($record:ty)) => {
        $type::$variant($inner)
    };
    ($inner:ident, $type:ident, $variant:ident, [$key:ident: $kind:expr]) => {
        $type::$variant($inner)
    };
    ($inner:ident, $type:ident, $variant:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }) => {
        $type::$variant { $($field),* }
    };
}
pub(super) use variant_pattern;

macro_rules! write_variant {
    ($inner:ident, $variant:ident, (..$types:ty), $out:ident, $cx:ident) => {
        $crate::json::codec::StructCodec::write_fields($inner, $out, $cx)?
    };
    ($inner:ident, $variant:ident, $body:tt, $out:ident, $cx:ident) => {
        let name = $crate::json::codec::snake(stringify!($variant));
        $out.push(($crate::json::node::TYPE.to_owned(), $crate::json::printer::Out::text(name)));
        $crate::json::codec::write_body!($inner, $body, $out, $cx);
    };
}
pub(super) use write_variant;

macro_rules! write_body {
    ($inner:ident, (), $out:ident, $cx:ident) => {};
    ($inner:ident, ($record:ty), $out:ident, $cx:ident) => {
        $crate::json::codec::StructCodec::write_fields($inner, $out, $cx)?
    };
    ($inner:ident, [$key:ident: $kind:expr], $out:ident, $cx:ident) => {
        $crate::json::codec::put($out, stringify!($key), &$kind, $inner, None, $cx)?
    };
    ($inner:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }, $out:ident, $cx:ident) => {
        $($crate::json::codec::put(
            $out,
            stringify!($field),
            &$kind,
            $field,
            $crate::json::codec::default_of!($($default)?),
            $cx,
        )?;)*
    };
}
pub(super) use write_body;

macro_rules! describe_variant {
    ($type:ident, $variant:ident, (..$types:ty), $schemas:ident) => {
        <$types as $crate::json::codec::StructCodec>::properties($schemas)
    };
    ($type:ident, $variant:ident, $body:tt, $schemas:ident) => {{
        let name = $crate::json::codec::snake(stringify!($variant));
        let tag = $crate::json::schema::Properties::tag(&name);
        $crate::json::codec::describe_body!($type, $variant, $body, tag, $schemas)
    }};
}
pub(super) use describe_variant;

macro_rules! describe_body {
    ($type:ident, $variant:ident, (), $tag:ident, $schemas:ident) => {
        vec![$tag]
    };
    ($type:ident, $variant:ident, ($record:ty), $tag:ident, $schemas:ident) => {
        $crate::json::schema::Properties::each_with(
            <$record as $crate::json::codec::StructCodec>::properties($schemas),
            &$tag,
        )
    };
    ($type:ident, $variant:ident, [$key:ident: $kind:expr], $tag:ident, $schemas:ident) => {
        vec![$tag.with::<_, _, $type>(
            stringify!($key),
            &$kind,
            |made| match made {
                $type::$variant(inner) => inner,
                _ => unreachable!("it is of this variant"),
            },
            None,
            $schemas,
        )]
    };
    ($type:ident, $variant:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }, $tag:ident, $schemas:ident) => {{
        $(let $tag = $tag.with::<_, _, $type>(
            stringify!($field),
            &$kind,
            |made| match made {
                $type::$variant { $field, .. } => $field,
                _ => unreachable!("it is of this variant"),
            },
            $crate::json::codec::default_of!($($default)?),
            $schemas,
        );)*
        vec![$tag]
    }};
}
pub(super) use describe_body;

/// An enum of unit variants, represented by their names.
///
/// Implements [`JsonCodec`]; see `Axis` in `expansion`.
macro_rules! json_unit_enum {
    ($type:ident { $($variant:ident),* $(,)? }) => {
        impl $crate::json::codec::JsonCodec for $type {
            fn read(
                node: &$crate::json::node::JsonNode<'_>,
                _: &mut $crate::json::context::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                use $crate::json::codec::{snake}; use $crate::json::former_names::current_type;
                let name = node.text().ok_or_else(|| node.unexpected("a name"))?;
                let name = current_type(name);
                $(if name == snake(stringify!($variant)) {
                    return Ok(Self::$variant);
                })*
                let known = [$(snake(stringify!($variant))),*];
                Err(node.unknown("name", name, known.iter().map(String::as_str)))
            }

            fn write(
                &self,
                _: &mut $crate::json::context::JsonWriter<'_>,
            ) -> Result<$crate::json::printer::Out, String> {
                use $crate::json::codec::snake;
                use $crate::json::printer::Out;
                Ok(match self {
                    $(Self::$variant => Out::text(snake(stringify!($variant)))),*
                })
            }

            fn schema(_: &mut $crate::json::schema::Schemas) -> serde_json::Value {
                use $crate::json::codec::snake;
                serde_json::json!({"enum": [$(snake(stringify!($variant))),*]})
            }
        }
    };
}
pub(super) use json_unit_enum;

use crate::shared::names::quote;
