//! How types are described once, so that they can be read, written, and told in a schema.
//!
//! A struct is a `json_struct!` of its fields, an enum is `json_enum!` (an object whose "type" says
//! which variant it is) or made of `json_unit_enum!`. Each field has a [`FieldCodec`] and perhaps a
//! default; what has its default is not written.

use super::node::{Keys, Node};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::{JsonReader, JsonWriter};
use crate::LoadError;

/// How a field is read and written.
pub(super) trait FieldCodec<T> {
    /// True if it stands in files.
    const IS_WRITTEN: bool = true;
    /// True if it has to be there if the field has no default.
    const IS_NEEDED: bool = true;

    fn read(&self, node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<T, LoadError>;
    fn write(&self, value: &T, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value;

    /// What it is in an object that does not say, if the field has no default.
    fn missing(&self, _object: &Node<'_>, _cx: &JsonReader<'_>) -> Option<T> {
        None
    }

    /// Returns true if it would be the same if it were missing.
    fn is_understood(&self, _value: &T, _cx: &JsonWriter<'_>) -> bool {
        false
    }
}

/// Types that are read and written in one way only.
pub(super) trait JsonCodec: Sized {
    fn read(node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError>;
    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema(schemas: &mut Schemas) -> serde_json::Value;
}

/// The kind of fields whose type says it all.
pub(super) struct Plain;

impl<T: JsonCodec> FieldCodec<T> for Plain {
    fn read(&self, node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<T, LoadError> {
        T::read(node, cx)
    }

    fn write(&self, value: &T, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        value.write(cx)
    }

    fn schema(&self, schemas: &mut Schemas) -> serde_json::Value {
        T::schema(schemas)
    }
}

/// What is an object, or some keys of one.
pub(super) trait StructCodec: Sized {
    /// True if a text stands for an object with nothing but that as its "type".
    const IS_TAGGED: bool = false;

    fn read_fields(keys: &mut Keys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError>;
    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String>;
    /// The keys that it may have: one set of them, or several of which one is chosen.
    fn properties(schemas: &mut Schemas) -> Vec<Properties>;
}

impl<T: StructCodec> JsonCodec for T {
    fn read(node: &Node<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
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
        // A box has the schema of what is in it.
        let name = path.rsplit("::").next().unwrap_or(path).trim_end_matches('>');
        schemas.define(name, |schemas| Properties::any_of(&T::properties(schemas), T::IS_TAGGED))
    }
}

impl<T: StructCodec> StructCodec for Box<T> {
    const IS_TAGGED: bool = T::IS_TAGGED;

    fn read_fields(keys: &mut Keys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        T::read_fields(keys, cx).map(Box::new)
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        T::write_fields(self, out, cx)
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        T::properties(schemas)
    }
}

/// Writes a field, unless it has its default.
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

/// The name of a variant in files: `linear_spot` for `LinearSpot`.
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

/// Former names of types and of enum values, each with its current name.
const FORMER_TYPES: [(&str, &str); 8] = [
    ("matte", "diffuse"),
    ("sided", "two_sided"),
    ("embossed", "surface_detail"),
    ("cubes", "checkerboard3d"),
    ("facing", "abs_normal_dot"),
    ("root", "sqrt"),
    ("between", "pixel_centers"),
    ("from_pole_to_pole", "endpoints_at_poles"),
];

/// Former keys, each with its current name.
const FORMER_KEYS: [(&str, &str); 3] =
    [("saturates", "nonlinear"), ("film_offset", "principal_point_offset"), ("share", "amount")];

/// Returns the former name of a key, if it had one.
pub(super) fn former_key(name: &str) -> Option<&'static str> {
    FORMER_KEYS.iter().find(|(_, current)| *current == name).map(|(former, _)| *former)
}

/// Returns the current name of a type or enum value; files may have its former one.
pub(super) fn current_type(name: &str) -> &str {
    let renamed = FORMER_TYPES.iter().find(|(former, _)| *former == name);
    renamed.map_or(name, |(_, current)| current)
}

/// A default, or none.
macro_rules! default_of {
    () => {
        None
    };
    ($default:expr) => {
        Some($default)
    };
}
pub(super) use default_of;

/// `json_struct! { Type { field: kind => default, field: kind } + flattened: Type; check }`, where
/// `+` says that the keys of a field stand among those of the record, and `check` refuses what does
/// not fit together.
macro_rules! json_struct {
    ($type:ident { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? } $(+ $flat:ident: $flat_type:ty)? $(; $check:ident)?) => {
        impl $crate::format::json::codec::StructCodec for $type {
            const IS_TAGGED: bool = false $(|| <$flat_type as $crate::format::json::codec::StructCodec>::IS_TAGGED)?;

            fn read_fields(
                keys: &mut $crate::format::json::node::Keys<'_>,
                cx: &mut $crate::format::json::shared::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                let _ = (&keys, &cx);
                let made = Self {
                    $($flat: <$flat_type>::read_fields(keys, cx)?,)?
                    $($field: keys.read(
                        stringify!($field),
                        &$kind,
                        $crate::format::json::codec::default_of!($($default)?),
                        cx,
                    )?),*
                };
                $($check(&made).map_err(|message| keys.node.error(message))?;)?
                Ok(made)
            }

            fn write_fields(
                &self,
                out: &mut $crate::format::json::printer::Entries,
                cx: &mut $crate::format::json::shared::JsonWriter<'_>,
            ) -> Result<(), String> {
                let _ = (&out, &cx);
                $(self.$flat.write_fields(out, cx)?;)?
                $($crate::format::json::codec::put(
                    out,
                    stringify!($field),
                    &$kind,
                    &self.$field,
                    $crate::format::json::codec::default_of!($($default)?),
                    cx,
                )?;)*
                Ok(())
            }

            fn properties(
                schemas: &mut $crate::format::json::schema::Schemas,
            ) -> Vec<$crate::format::json::schema::Properties> {
                let own = $crate::format::json::schema::Properties::default();
                $(let own = own.with::<_, _, Self>(
                    stringify!($field),
                    &$kind,
                    |made| &made.$field,
                    $crate::format::json::codec::default_of!($($default)?),
                    schemas,
                );)*
                let _ = &schemas;
                let all = vec![own];
                $(let all = $crate::format::json::schema::Properties::each_with(
                    <$flat_type>::properties(schemas), &all[0]);)?
                all
            }
        }
    };
}
pub(super) use json_struct;

/// The variants of an enum: `Variant { field: kind = default }`, `Variant(Record)`, `Variant[key:
/// kind]` for a single field without a name, and `Variant()`.
macro_rules! json_enum {
    ($type:ident { $($variant:ident $body:tt),* $(,)? }) => {
        impl $crate::format::json::codec::StructCodec for $type {
            const IS_TAGGED: bool = true;

            fn read_fields(
                keys: &mut $crate::format::json::node::Keys<'_>,
                cx: &mut $crate::format::json::shared::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                use $crate::format::json::codec::{current_type, read_variant, snake};
                let _ = &cx;
                let tag = keys.tag()?;
                let name = tag.text().ok_or_else(|| tag.unexpected("a name"))?;
                let name = current_type(name);
                $(if name == snake(stringify!($variant)) {
                    return Ok(read_variant!($type, $variant, $body, keys, cx));
                })*
                let known = [$(snake(stringify!($variant))),*];
                Err(tag.unknown("type", name, known.iter().map(String::as_str)))
            }

            fn write_fields(
                &self,
                out: &mut $crate::format::json::printer::Entries,
                cx: &mut $crate::format::json::shared::JsonWriter<'_>,
            ) -> Result<(), String> {
                use $crate::format::json::codec::{variant_pattern, write_variant, snake};
                use $crate::format::json::{node::TYPE, printer::Out};
                let _ = &cx;
                match self {
                    $(variant_pattern!(inner, $type, $variant, $body) => {
                        out.push((TYPE.to_owned(), Out::text(snake(stringify!($variant)))));
                        write_variant!(inner, $body, out, cx);
                    })*
                }
                Ok(())
            }

            fn properties(
                schemas: &mut $crate::format::json::schema::Schemas,
            ) -> Vec<$crate::format::json::schema::Properties> {
                use $crate::format::json::codec::{describe_variant, snake};
                use $crate::format::json::schema::Properties;
                let _ = &schemas;
                let mut all = Vec::new();
                $(let tag = Properties::tag(&snake(stringify!($variant)));
                all.extend(describe_variant!($type, $variant, $body, tag, schemas));)*
                all
            }
        }
    };
}
pub(super) use json_enum;

macro_rules! read_variant {
    ($type:ident, $variant:ident, (), $keys:ident, $cx:ident) => {
        $type::$variant
    };
    ($type:ident, $variant:ident, ($record:ty), $keys:ident, $cx:ident) => {
        $type::$variant(<$record as $crate::format::json::codec::StructCodec>::read_fields($keys, $cx)?)
    };
    ($type:ident, $variant:ident, [$key:ident: $kind:expr], $keys:ident, $cx:ident) => {
        $type::$variant($keys.read(stringify!($key), &$kind, None, $cx)?)
    };
    ($type:ident, $variant:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }, $keys:ident, $cx:ident) => {
        $type::$variant {
            $($field: $keys.read(
                stringify!($field),
                &$kind,
                $crate::format::json::codec::default_of!($($default)?),
                $cx,
            )?),*
        }
    };
}
pub(super) use read_variant;

macro_rules! variant_pattern {
    ($inner:ident, $type:ident, $variant:ident, ()) => {
        $type::$variant
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
    ($inner:ident, (), $out:ident, $cx:ident) => {};
    ($inner:ident, ($record:ty), $out:ident, $cx:ident) => {
        $crate::format::json::codec::StructCodec::write_fields($inner, $out, $cx)?
    };
    ($inner:ident, [$key:ident: $kind:expr], $out:ident, $cx:ident) => {
        $crate::format::json::codec::put($out, stringify!($key), &$kind, $inner, None, $cx)?
    };
    ($inner:ident, { $($field:ident: $kind:expr $(=> $default:expr)?),* $(,)? }, $out:ident, $cx:ident) => {
        $($crate::format::json::codec::put(
            $out,
            stringify!($field),
            &$kind,
            $field,
            $crate::format::json::codec::default_of!($($default)?),
            $cx,
        )?;)*
    };
}
pub(super) use write_variant;

macro_rules! describe_variant {
    ($type:ident, $variant:ident, (), $tag:ident, $schemas:ident) => {
        vec![$tag]
    };
    ($type:ident, $variant:ident, ($record:ty), $tag:ident, $schemas:ident) => {
        Properties::each_with(
            <$record as $crate::format::json::codec::StructCodec>::properties($schemas),
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
            $crate::format::json::codec::default_of!($($default)?),
            $schemas,
        );)*
        vec![$tag]
    }};
}
pub(super) use describe_variant;

/// An enum of names.
macro_rules! json_unit_enum {
    ($type:ident { $($variant:ident),* $(,)? }) => {
        impl $crate::format::json::codec::JsonCodec for $type {
            fn read(
                node: &$crate::format::json::node::Node<'_>,
                _: &mut $crate::format::json::shared::JsonReader<'_>,
            ) -> Result<Self, $crate::LoadError> {
                use $crate::format::json::codec::{current_type, snake};
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
                _: &mut $crate::format::json::shared::JsonWriter<'_>,
            ) -> Result<$crate::format::json::printer::Out, String> {
                use $crate::format::json::codec::snake;
                use $crate::format::json::printer::Out;
                Ok(match self {
                    $(Self::$variant => Out::text(snake(stringify!($variant)))),*
                })
            }

            fn schema(_: &mut $crate::format::json::schema::Schemas) -> serde_json::Value {
                use $crate::format::json::codec::snake;
                serde_json::json!({"enum": [$(snake(stringify!($variant))),*]})
            }
        }
    };
}
pub(super) use json_unit_enum;
