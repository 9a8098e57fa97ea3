//! Expansions of the macros of `codec.rs`: types are here twice, with the macros and with the code
//! that these make, and both read, write and describe the same.

use std::path::Path;

use super::super::attached::Attachments;
use super::super::context::{JsonReader, JsonWriter};
use super::super::node::{JsonDocument, JsonNode, parse};
use super::super::schema;
use super::JsonCodec;
use crate::LoadOptions;
use crate::shared::context::LoadContext;

mod by_macro {
    use super::super::{Plain, json_enum, json_struct, json_unit_enum};

    pub(super) struct Extent {
        width: u32,
        height: u32,
    }
    json_struct! { Extent { width: Plain, height: Plain => 1 } }

    pub(super) enum Axis {
        X,
        MinusX,
    }
    json_unit_enum! { Axis { X, MinusX } }

    pub(super) enum Shape {
        Empty,
        Box(Extent),
        Named(String),
        Round(Round),
        Rod { radius: u32, axis: Axis },
    }
    json_enum! {
        Shape {
            Empty(),
            Box(Extent),
            Named[name: Plain],
            Round(..Round),
            Rod { radius: Plain, axis: Plain => Axis::X },
        }
    }

    pub(super) enum Round {
        Ball(u32),
        Egg,
    }
    json_enum! { Round { Ball[radius: Plain], Egg() } }
}

mod by_hand {
    use super::super::super::context::{JsonReader, JsonWriter};
    use super::super::super::former_names::current_type;
    use super::super::super::node::{JsonNode, ObjectKeys, TYPE};
    use super::super::super::printer::{Entries, Out};
    use super::super::super::schema::{Properties, Schemas};
    use super::super::{JsonCodec, Plain, StructCodec, put};
    use crate::LoadError;

    pub(super) struct Extent {
        width: u32,
        height: u32,
    }

    impl StructCodec for Extent {
        const IS_TAGGED: bool = false;

        fn read_fields(
            keys: &mut ObjectKeys<'_>,
            cx: &mut JsonReader<'_>,
        ) -> Result<Self, LoadError> {
            Ok(Self {
                width: keys.read("width", &Plain, None, cx)?,
                height: keys.read("height", &Plain, Some(1), cx)?,
            })
        }

        fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
            put(out, "width", &Plain, &self.width, None, cx)?;
            put(out, "height", &Plain, &self.height, Some(1), cx)?;
            Ok(())
        }

        fn properties(schemas: &mut Schemas) -> Vec<Properties> {
            let own = Properties::default();
            let own = own.with::<_, _, Self>("width", &Plain, |made| &made.width, None, schemas);
            let own =
                own.with::<_, _, Self>("height", &Plain, |made| &made.height, Some(1), schemas);
            vec![own]
        }
    }

    pub(super) enum Axis {
        X,
        MinusX,
    }

    impl JsonCodec for Axis {
        fn read(node: &JsonNode<'_>, _: &mut JsonReader<'_>) -> Result<Self, LoadError> {
            let name = node.text().ok_or_else(|| node.unexpected("a name"))?;
            match current_type(name) {
                "x" => Ok(Self::X),
                "minus_x" => Ok(Self::MinusX),
                name => Err(node.unknown("name", name, ["x", "minus_x"].into_iter())),
            }
        }

        fn write(&self, _: &mut JsonWriter<'_>) -> Result<Out, String> {
            Ok(match self {
                Self::X => Out::text("x"),
                Self::MinusX => Out::text("minus_x"),
            })
        }

        fn schema(_: &mut Schemas) -> serde_json::Value {
            serde_json::json!({"enum": ["x", "minus_x"]})
        }
    }

    pub(super) enum Shape {
        Empty,
        Box(Extent),
        Named(String),
        Round(Round),
        Rod { radius: u32, axis: Axis },
    }

    pub(super) enum Round {
        Ball(u32),
        Egg,
    }

    impl StructCodec for Shape {
        const IS_TAGGED: bool = true;

        fn read_fields(
            keys: &mut ObjectKeys<'_>,
            cx: &mut JsonReader<'_>,
        ) -> Result<Self, LoadError> {
            let tag = keys.tag()?;
            let name = tag.text().ok_or_else(|| tag.unexpected("a name"))?;
            match current_type(name) {
                "empty" => Ok(Self::Empty),
                "box" => Ok(Self::Box(Extent::read_fields(keys, cx)?)),
                "named" => Ok(Self::Named(keys.read("name", &Plain, None, cx)?)),
                "ball" => Ok(Self::Round(Round::Ball(keys.read("radius", &Plain, None, cx)?))),
                "egg" => Ok(Self::Round(Round::Egg)),
                "rod" => Ok(Self::Rod {
                    radius: keys.read("radius", &Plain, None, cx)?,
                    axis: keys.read("axis", &Plain, Some(Axis::X), cx)?,
                }),
                name => {
                    let known = ["empty", "box", "named", "ball", "egg", "rod"];
                    Err(tag.unknown("type", name, known.into_iter()))
                }
            }
        }

        fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
            let mut tag = |name: &str| out.push((TYPE.to_owned(), Out::text(name)));
            match self {
                Self::Empty => tag("empty"),
                Self::Box(extent) => {
                    tag("box");
                    extent.write_fields(out, cx)?;
                }
                Self::Named(name) => {
                    tag("named");
                    put(out, "name", &Plain, name, None, cx)?;
                }
                Self::Round(Round::Ball(radius)) => {
                    tag("ball");
                    put(out, "radius", &Plain, radius, None, cx)?;
                }
                Self::Round(Round::Egg) => tag("egg"),
                Self::Rod { radius, axis } => {
                    tag("rod");
                    put(out, "radius", &Plain, radius, None, cx)?;
                    put(out, "axis", &Plain, axis, Some(Axis::X), cx)?;
                }
            }
            Ok(())
        }

        fn properties(schemas: &mut Schemas) -> Vec<Properties> {
            let empty = Properties::tag("empty");
            let named = Properties::tag("named").with_schema("name", String::schema(schemas), true);
            let ball = Properties::tag("ball").with_schema("radius", u32::schema(schemas), true);
            let egg = Properties::tag("egg");
            let rod = Properties::tag("rod").with_schema("radius", u32::schema(schemas), true);
            let mut axis = Axis::schema(schemas);
            axis["default"] = "x".into();
            let rod = rod.with_schema("axis", axis, false);
            let boxes = Properties::each_with(Extent::properties(schemas), &Properties::tag("box"));
            [vec![empty], boxes, vec![named, ball, egg, rod]].concat()
        }
    }
}

/// Reads a value and writes it, or returns the message of the error.
fn rewritten<T: JsonCodec>(text: &str) -> String {
    let file = Path::new("scene.json");
    let value = parse(text, file).expect("it is JSON");
    let document = JsonDocument::new(text, file, Attachments::default());
    let context = LoadContext::new(file, &LoadOptions::default());
    let mut reader = JsonReader::new(Path::new(""), &context);
    match T::read(&JsonNode::root(&value, &document), &mut reader) {
        Ok(value) => value.write(&mut JsonWriter::default()).expect("it can be written").print(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn types_by_macro_and_by_hand_read_and_write_the_same() {
    let texts = [
        r#"{"type": "empty"}"#,
        r#""empty""#,
        r#"{"type": "box", "width": 3}"#,
        r#"{"type": "box", "width": 3, "height": 4}"#,
        r#"{"type": "box", "height": 4}"#,
        r#"{"type": "named", "name": "A"}"#,
        r#"{"type": "named"}"#,
        r#"{"type": "ball", "radius": 2}"#,
        r#"{"type": "ball", "name": "A"}"#,
        r#""egg""#,
        r#"{"type": "round"}"#,
        r#"{"type": "rod", "radius": 2}"#,
        r#"{"type": "rod", "radius": 2, "axis": "x"}"#,
        r#"{"type": "rod", "radius": 2, "axis": "minus_x"}"#,
        r#"{"type": "rod", "radius": 2, "axis": "plus_x"}"#,
        r#"{"type": "rod", "radius": -2}"#,
        r#"{"type": "rode", "radius": 2}"#,
        r#"{"width": 2}"#,
        "7",
    ];
    for text in texts {
        assert_eq!(rewritten::<by_macro::Shape>(text), rewritten::<by_hand::Shape>(text), "{text}");
    }
}

#[test]
fn types_by_macro_and_by_hand_have_the_same_schema() {
    assert_eq!(schema::of(by_macro::Shape::schema), schema::of(by_hand::Shape::schema));
}
