//! Cameras and animations.

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::motion::Key;
use pt_scene::{Aperture, Camera, Fit, Geometry, Meter, Motion, Placement, Projection, Quantity};
use serde_json::{Value, json};

use super::codec::{JsonCodec, Plain, StructCodec, json_struct, json_unit_enum, put};
use super::context::{EntryTables, JsonReader, JsonWriter};
use super::node::{JsonNode, ObjectKeys, TYPE};
use super::number::{ABOVE_0, ANY, Each, FROM_0, PerhapsInfinite};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::{Numbered, TableEntry};
use crate::LoadError;

json_struct! {
    Camera {
        name: Plain => String::new(),
        to_world: Plain => DAffine3::IDENTITY,
        motion: Plain => None,
        shutter: Each(ANY) => [0.0; 2],
        near: ABOVE_0 => 1e-3,
        far: PerhapsInfinite,
        lens_radius: FROM_0 => 0.0,
        aperture: Plain => None,
        focal_distance: ABOVE_0 => 1.0,
        principal_point_offset: Each(ANY) => [0.0; 2],
        fit: Plain => Fit::default(),
        medium: Numbered::Medium => None,
        placement: Plain => Placement::Node,
        meter: Plain => None,
    } + projection: Projection; check
}

fn check(camera: &Camera) -> Result<(), String> {
    let Camera { near, far, shutter: [open, close], .. } = camera;
    if near >= far {
        return Err(format!("found \"near\" = {near} and \"far\" = {far}, expected near < far"));
    }
    if open > close {
        return Err(format!(
            "the shutter closes at {close}, before it opens at {open}; expected open <= close"
        ));
    }
    Ok(())
}

json_struct! {
    Meter { quantity: Plain, to_world: Plain => DAffine3::IDENTITY } + geometry: Geometry
}

json_unit_enum! { Quantity { Irradiance, Radiance } }

json_unit_enum! { Fit { Whole, Width, Height } }

json_unit_enum! { Placement { Node, Course, Fit } }

json_struct! { Aperture { blades: Plain, rotation: ANY => 0.0 } }

/// Names of the projections.
const PROJECTIONS: [&str; 3] = ["perspective", "orthographic", "panorama"];

impl StructCodec for Projection {
    const IS_TAGGED: bool = true;

    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let tag = keys.tag()?;
        let name = tag.text().ok_or_else(|| tag.unexpected("a name"))?;
        match name {
            "perspective" => {
                let [x_fov, y_fov] = sizes(keys, ["x_fov", "y_fov"], cx, |known, aspect| {
                    2.0 * libm::atan(aspect * libm::tan(0.5 * known.to_radians())).to_degrees()
                })?;
                let fits = |fov: f64| 0.0 < fov && fov < 180.0;
                if fits(x_fov) && fits(y_fov) {
                    return Ok(Self::Perspective { x_fov, y_fov });
                }
                Err(keys.node.error(
                    "found a field of view out of range, expected more than 0 and less than 180 \
                     degrees",
                ))
            }
            "orthographic" => {
                let names = ["half_width", "half_height"];
                let [half_width, half_height] =
                    sizes(keys, names, cx, |known, aspect| known * aspect)?;
                Ok(Self::Orthographic { half_width, half_height })
            }
            "panorama" => Ok(Self::Panorama),
            _ => Err(tag.unknown("type", name, PROJECTIONS.into_iter())),
        }
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        let (tag, sizes) = match self {
            Self::Perspective { x_fov, y_fov } => (0, vec![("x_fov", x_fov), ("y_fov", y_fov)]),
            Self::Orthographic { half_width, half_height } => {
                (1, vec![("half_width", half_width), ("half_height", half_height)])
            }
            Self::Panorama => (2, Vec::new()),
        };
        out.push((TYPE.to_owned(), Out::text(PROJECTIONS[tag])));
        sizes.into_iter().try_for_each(|(name, size)| put(out, name, &ABOVE_0, size, None, cx))
    }

    fn properties(_: &mut Schemas) -> Vec<Properties> {
        let [perspective, orthographic, panorama] = PROJECTIONS.map(Properties::tag);
        let fov = json!({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 180});
        let half = json!({"type": "number", "exclusiveMinimum": 0});
        let with = |all: Properties, [x, y]: [&str; 2], size: &Value| {
            let one = |all: &Properties, needed: &str, other: &str| {
                all.clone().with_schema(needed, size.clone(), true).with_schema(
                    other,
                    size.clone(),
                    false,
                )
            };
            [one(&all, x, y), one(&all, y, x)]
        };
        let mut all = vec![panorama];
        all.extend(with(perspective, ["x_fov", "y_fov"], &fov));
        all.extend(with(orthographic, ["half_width", "half_height"], &half));
        all
    }
}

/// Reads a horizontal and a vertical size, one of which may be missing: it is `other` of the given
/// one and the aspect ratio of the image.
fn sizes(
    keys: &mut ObjectKeys<'_>,
    [x, y]: [&'static str; 2],
    cx: &JsonReader<'_>,
    other: impl Fn(f64, f64) -> f64,
) -> Result<[f64; 2], LoadError> {
    let found = [x, y].map(|name| keys.take(name).map(|node| ABOVE_0.number(&node)).transpose());
    let [horizontal, vertical] = found;
    match (horizontal?, vertical?) {
        (Some(horizontal), Some(vertical)) => Ok([horizontal, vertical]),
        (Some(horizontal), None) => Ok([horizontal, other(horizontal, cx.aspect.recip())]),
        (None, Some(vertical)) => Ok([other(vertical, cx.aspect), vertical]),
        (None, None) => Err(keys.node.error(format!("missing \"{x}\" or \"{y}\""))),
    }
}

json_struct! { Key { time: ANY, to_world: Plain => DAffine3::IDENTITY } }

impl JsonCodec for Motion {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let keys = Vec::read(node, cx)?;
        Self::new(keys).map_err(|e| node.error(format!("key {}: {}", e.key, e.message)))
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        self.keys().iter().map(|key| key.write(cx)).collect::<Result<_, _>>().map(Out::List)
    }

    fn schema(schemas: &mut Schemas) -> Value {
        let key = Key::schema(schemas);
        json!({"type": "array", "items": key, "minItems": 2})
    }
}

impl TableEntry for Motion {
    const TABLE: (&'static str, &'static str) = ("motions", "motion");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.motions
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        Self::read(node, cx).map(Arc::new)
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        self.write(cx)
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        Self::schema(schemas)
    }
}
