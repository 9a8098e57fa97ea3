//! Objects placed in the world.

use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::{Geometry, Mesh, Motion, Object, Points, Sides};
use serde_json::json;

use super::codec::{FieldCodec, JsonCodec, Plain, StructCodec, put};
use super::context::{JsonReader, JsonWriter};
use super::mesh::{SHAPES, shape_named};
use super::node::{ObjectKeys, TYPE};
use super::number::{ABOVE_0, NOT_0};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::Numbered;
use crate::LoadError;

impl StructCodec for Object {
    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let geometry = Geometry::read_fields(keys, cx)?;
        Ok(Self {
            name: keys.read("name", &Plain, Some(String::new()), cx)?,
            to_world: keys.read("to_world", &Plain, Some(DAffine3::IDENTITY), cx)?,
            motion: keys.read("motion", &Plain, Some(None), cx)?,
            materials: materials(keys, slots(&geometry), cx)?,
            geometry,
            media: keys.read("media", &Plain, Some(None), cx)?,
            at: keys.node.span(),
        })
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        put(out, "name", &Plain, &self.name, Some(String::new()), cx)?;
        self.geometry.write_fields(out, cx)?;
        put(out, "to_world", &Plain, &self.to_world, Some(DAffine3::IDENTITY), cx)?;
        put(out, "motion", &Plain, &self.motion, Some(None), cx)?;
        write_materials(&self.materials, slots(&self.geometry), out, cx)?;
        put(out, "media", &Plain, &self.media, Some(None), cx)
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        let material = json!({"type": ["string", "null"]});
        let common = Properties::default()
            .with("name", &Plain, |o: &Self| &o.name, Some(String::new()), schemas)
            .with("to_world", &Plain, |o: &Self| &o.to_world, Some(DAffine3::IDENTITY), schemas)
            .with_schema("motion", Option::<Arc<Motion>>::schema(schemas), false)
            .with_schema("media", Option::<Sides>::schema(schemas), false)
            .with_schema("materials", json!({"type": "array", "items": material}), false)
            .with_schema("material", material, false);
        Properties::each_with(Geometry::properties(schemas), &common)
    }
}

impl StructCodec for Geometry {
    const IS_TAGGED: bool = true;

    fn read_fields(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let tag = keys.tag()?;
        let name = tag.text().ok_or_else(|| tag.unexpected("a name"))?;
        match name {
            "sphere" => Ok(Self::Sphere { radius: keys.read("radius", &NOT_0, Some(1.0), cx)? }),
            "mesh" => keys.read("mesh", &Plain, None, cx).map(Self::Mesh),
            "points" => Ok(Self::Points {
                points: keys.read("points", &Plain, None, cx)?,
                radius: keys.take("radius").map(|node| ABOVE_0.number(&node)).transpose()?,
            }),
            _ => {
                let found = SHAPES.iter().find(|(shape, _)| *shape == name);
                let known = ["sphere", "mesh", "points"]
                    .into_iter()
                    .chain(SHAPES.iter().map(|(name, _)| *name));
                let (shape, make) = found.ok_or_else(|| tag.unknown("type", name, known))?;
                Ok(Self::Mesh(shape_named(shape, *make, None, cx)))
            }
        }
    }

    fn write_fields(&self, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
        match self {
            Self::Sphere { radius } => {
                out.push((TYPE.to_owned(), Out::text("sphere")));
                put(out, "radius", &NOT_0, radius, Some(1.0), cx)
            }
            Self::Mesh(mesh) => {
                out.push((TYPE.to_owned(), Out::text("mesh")));
                put(out, "mesh", &Plain, mesh, None, cx)
            }
            Self::Points { points, radius } => {
                out.push((TYPE.to_owned(), Out::text("points")));
                put(out, "points", &Plain, points, None, cx)?;
                match radius {
                    Some(radius) => put(out, "radius", &ABOVE_0, radius, None, cx),
                    None => Ok(()),
                }
            }
        }
    }

    fn properties(schemas: &mut Schemas) -> Vec<Properties> {
        let radius = json!({"type": "number", "not": {"const": 0}, "default": 1});
        let mesh = Arc::<Mesh>::schema(schemas);
        let mut all = vec![
            Properties::tag("sphere").with_schema("radius", radius, false),
            Properties::tag("mesh").with_schema("mesh", mesh, true),
            Properties::tag("points")
                .with_schema("points", Arc::<Points>::schema(schemas), true)
                .with_schema("radius", json!({"type": "number", "exclusiveMinimum": 0}), false),
        ];
        all.extend(SHAPES.iter().map(|(name, _)| Properties::tag(name)));
        all
    }
}

/// Returns the number of material slots.
fn slots(geometry: &Geometry) -> usize {
    match geometry {
        Geometry::Sphere { .. } | Geometry::Points { .. } => 1,
        Geometry::Mesh(mesh) => {
            mesh.submeshes.iter().map(|part| part.slot as usize + 1).max().unwrap_or(1)
        }
    }
}

/// Reads `material` for all slots, or `materials` for each.
fn materials(
    keys: &mut ObjectKeys<'_>,
    slots: usize,
    cx: &mut JsonReader<'_>,
) -> Result<Vec<Option<u32>>, LoadError> {
    let (one, each) = (keys.take("material"), keys.take("materials"));
    match (one, each) {
        (Some(one), None) => Ok(vec![Numbered::Material.read(&one, cx)?; slots]),
        (None, None) => Ok(vec![None; slots]),
        (Some(_), Some(each)) => {
            Err(each.error("expected \"material\" or \"materials\", found both"))
        }
        (None, Some(each)) => {
            let names = each.list("a list of materials")?;
            if names.len() < slots {
                let count = names.len();
                return Err(each.error(format!(
                    "found {count} materials, expected {slots}, one for each slot of the mesh"
                )));
            }
            names.iter().map(|name| Numbered::Material.read(name, cx)).collect()
        }
    }
}

fn write_materials(
    materials: &[Option<u32>],
    slots: usize,
    out: &mut Entries,
    cx: &mut JsonWriter<'_>,
) -> Result<(), String> {
    let is_one = materials.len() == slots && materials.windows(2).all(|pair| pair[0] == pair[1]);
    match materials {
        [None, ..] if is_one => Ok(()),
        [one, ..] if is_one => put(out, "material", &Numbered::Material, one, None, cx),
        _ => {
            let names = materials.iter().map(|name| Numbered::Material.write(name, cx));
            let names = names.collect::<Result<_, _>>()?;
            out.push(("materials".to_owned(), Out::List(names)));
            Ok(())
        }
    }
}
