//! Items in files beside a scene: images, grids, profiles of luminaires, and measurements of
//! materials.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use pt_image::{PixelEncoding, SaveOptions, encode};
use pt_scene::image::Image;
use pt_scene::light::IesProfile;
use pt_scene::measured::Measurements;
use pt_scene::medium::Grid;
use serde_json::{Value, json};

use super::super::{measured, vol};
use super::attached::Numbers;
use super::codec::{FieldCodec, JsonCodec};
use super::context::{EntryTables, JsonReader, JsonWriter};
use super::node::JsonNode;
use super::number::{ANY, Each, numbers, vector_schema};
use super::pixels;
use super::printer::Out;
use super::schema::{Properties, Schemas};
use super::shared::TableEntry;
use crate::LoadError;
use crate::shared::context::Unusable;
use crate::shared::placeholder;

/// Maximum number of values of an inline list.
pub(super) const MAX_INLINE: usize = 300;

/// `{"file": "a.png", "raw": true}`, or `{"pixels": [[[r, g, b], …], …]}`.
impl TableEntry for Image {
    const TABLE: (&'static str, &'static str) = ("images", "image");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.images
    }

    fn look_ahead(entries: &[(&str, JsonNode<'_>)], cx: &JsonReader<'_>) {
        cx.context.expect_pictures(entries.iter().filter_map(|(_, node)| {
            let entry = node.value().as_object()?;
            let is_raw = entry.get_boolean("raw").is_some_and(|raw| raw.value);
            let path = cx.folder.join(&*entry.get_string("file")?.value);
            Some((path, PixelEncoding::of_raw(is_raw)))
        }));
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let [file, pixels] = ["file", "pixels"].map(|key| keys.take(key));
        let is_raw = keys.take("raw").map_or(Ok(false), |raw| bool::read(&raw, cx))?;
        keys.finish()?;
        let file = match (file, pixels) {
            (Some(file), None) => file,
            (None, Some(pixels)) => return pixels::read(&pixels, is_raw, cx).map(Arc::new),
            (None, None) => return Err(node.error("missing \"file\" or \"pixels\"")),
            (Some(_), Some(pixels)) => {
                return Err(pixels.error("expected a \"file\" or \"pixels\", found both"));
            }
        };
        let path = cx.path(&file)?;
        let place = (path.clone(), is_raw);
        if let Some(known) = cx.files.images.get(&place) {
            return Ok(Arc::clone(known));
        }
        let image = match cx.context.picture(&path, PixelEncoding::of_raw(is_raw)) {
            Ok(decoded) => decoded.image,
            Err(why) => {
                cx.context.missing(file.span(), format!("{why}; {}", placeholder::INSTEAD));
                placeholder::light()
            }
        };
        cx.account(size_of_val(image.pixels.as_slice()), &file)?;
        let image = Arc::new(image);
        cx.files.images.insert(place, Arc::clone(&image));
        Ok(image)
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        if cx.is_in_memory() {
            return Ok(Out::Object(vec![("pixels".to_owned(), pixels::write(self, cx))]));
        }
        let name = cx.key.clone();
        let options = SaveOptions::default();
        let bytes = encode(self, "image.exr".as_ref(), &options).map_err(|e| e.to_string())?;
        Ok(Out::Object(vec![("file".to_owned(), cx.file(&name, "exr", bytes))]))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Image", |_| {
            let raw = json!({"type": "boolean", "default": false});
            let one = |key: &str, value: Value| {
                Properties::default().with_schema(key, value, true).with_schema(
                    "raw",
                    raw.clone(),
                    false,
                )
            };
            let file = one("file", json!({"type": "string"}));
            Properties::any_of(&[file, one("pixels", pixels::schema())], false)
        })
    }
}

/// `{"file": "a.vol"}`, or `{"resolution": [x, y, z], "channels": 1, "values": […]}`.
impl TableEntry for Grid {
    const TABLE: (&'static str, &'static str) = ("grids", "grid");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.grids
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let Some(file) = keys.take("file") else {
            let resolution = keys.take("resolution");
            let channels = keys.take("channels");
            let values = keys.take("values");
            keys.finish()?;
            let missing = || node.error("missing \"file\", or \"resolution\" and \"values\"");
            let (resolution, values) = resolution.zip(values).ok_or_else(missing)?;
            let channels = channels.map_or(Ok(1), |node| u32::read(&node, cx))?;
            return inline_grid(node, &resolution, channels, &values, cx).map(Arc::new);
        };
        keys.finish()?;
        let path = cx.path(&file)?;
        if let Some(known) = cx.files.grids.get(&path) {
            return Ok(Arc::clone(known));
        }
        let bytes = cx.read(&path, &file)?;
        let grid = vol::parse(&bytes).map_err(|e| file.error(e))?.grid;
        cx.account(size_of_val(grid.values.as_slice()), &file)?;
        let grid = Arc::new(grid);
        cx.files.grids.insert(path, Arc::clone(&grid));
        Ok(grid)
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        if !cx.is_in_memory() && self.values.len() > MAX_INLINE {
            let name = cx.key.clone();
            let bytes = vol::write(self)?;
            return Ok(Out::Object(vec![("file".to_owned(), cx.file(&name, "vol", bytes))]));
        }
        let values = if cx.is_in_memory() {
            cx.array(
                &shape_of(self.resolution, self.channels),
                Numbers::Reals(self.values.clone().into()),
            )
        } else {
            numbers(&self.values)?
        };
        Ok(Out::Object(vec![
            ("resolution".to_owned(), self.resolution.write(cx)?),
            ("channels".to_owned(), self.channels.write(cx)?),
            ("values".to_owned(), values),
        ]))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Grid", |_| {
            let file = Properties::default().with_schema("file", json!({"type": "string"}), true);
            let whole = json!({"type": "integer", "minimum": 1});
            let values = json!({"type": "array", "items": {"type": "number"}});
            let inline = Properties::default()
                .with_schema("resolution", vector_schema(&whole, 3), true)
                .with_schema("channels", json!({"enum": [1, 3, 6], "default": 1}), false)
                .with_schema("values", values, true);
            Properties::any_of(&[file, inline], false)
        })
    }
}

/// Shape of the array of the values of a grid.
fn shape_of([x, y, z]: [u32; 3], channels: u32) -> [usize; 4] {
    [z, y, x, channels].map(|count| count as usize)
}

fn inline_grid(
    node: &JsonNode<'_>,
    resolution: &JsonNode<'_>,
    channels: u32,
    values: &JsonNode<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<Grid, LoadError> {
    let resolution = <[u32; 3]>::read(resolution, cx)?;
    let values: Vec<f32> = match values.array() {
        Some((shape, numbers)) => {
            let whole = shape_of(resolution, channels);
            let is_right =
                shape.len() == 1 || shape == whole || channels == 1 && shape == whole[..3];
            if !is_right {
                let expected = format!("(n,) or {whole:?}, by z, y, x and channel");
                return Err(values.wrong_shape(&shape, &expected));
            }
            values.reals(numbers, 1)?.into_vec()
        }
        None => Each(ANY).read(values, cx)?,
    };
    let wanted =
        resolution.iter().try_fold(channels as usize, |all, n| all.checked_mul(*n as usize));
    if !matches!(channels, 1 | 3 | 6) || wanted != Some(values.len()) || values.is_empty() {
        let [x, y, z] = resolution;
        let count = values.len();
        return Err(node.error(format!(
            "found {count} values for {x} x {y} x {z} cells with {channels} channels, expected one, \
             three or six values for each cell, and cells along each axis"
        )));
    }
    Ok(Grid { resolution, channels, values })
}

/// `{"file": "a.ies"}`.
impl TableEntry for IesProfile {
    const TABLE: (&'static str, &'static str) = ("profiles", "profile");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.profiles
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let file = keys.take("file").ok_or_else(|| node.error("missing \"file\""))?;
        keys.finish()?;
        if let Some(bytes) = file.content() {
            let parsed = crate::ies::parse(&bytes, Path::new("profile.ies"));
            return parsed.map(Arc::new).map_err(|error| file.error(error.message()));
        }
        let path = cx.path(&file)?;
        if let Some(known) = cx.files.profiles.get(&path) {
            return Ok(Arc::clone(known));
        }
        let bytes = cx.read(&path, &file)?;
        let profile = Arc::new(crate::ies::parse(&bytes, &path)?);
        cx.files.profiles.insert(path, Arc::clone(&profile));
        Ok(profile)
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let name = cx.key.clone();
        let bytes = ies_text(self).into_bytes();
        Ok(Out::Object(vec![("file".to_owned(), cx.file(&name, "ies", bytes))]))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Profile", |_| {
            let file = Properties::default().with_schema("file", json!({"type": "string"}), true);
            Properties::any_of(&[file], false)
        })
    }
}

/// `{"file": "a.bsdf"}`.
impl TableEntry for Measurements {
    const TABLE: (&'static str, &'static str) = ("measurements", "measurement");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.measurements
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let file = keys.take("file").ok_or_else(|| node.error("missing \"file\""))?;
        keys.finish()?;
        if let Some(bytes) = file.content() {
            return measured::parse(&bytes).map(Arc::new).map_err(|error| file.error(error));
        }
        match cx.context.measurements(&cx.path(&file)?) {
            Ok(measurements) => Ok(measurements),
            Err(Unusable::Broken(why)) => Err(file.error(why)),
            Err(Unusable::Missing(why)) => {
                let message = format!("{why}; a magenta surface is shown instead");
                cx.context.missing(file.span(), message);
                Ok(Arc::new(placeholder::measurements()))
            }
        }
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let name = cx.key.clone();
        let bytes = measured::write(self);
        Ok(Out::Object(vec![("file".to_owned(), cx.file(&name, "bsdf", bytes))]))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Measurements", |_| {
            let file = Properties::default().with_schema("file", json!({"type": "string"}), true);
            Properties::any_of(&[file], false)
        })
    }

    fn name(&self) -> &str {
        &self.tables().description
    }
}

/// Encodes a profile as an IES file. Numbers have the digits of double precision, so that they are
/// read back exactly.
fn ies_text(profile: &IesProfile) -> String {
    let (vertical, horizontal, candela) = profile.table();
    let mut text = String::from("IESNA:LM-63-2002\n[TEST] written by pathtracer\nTILT=NONE\n");
    let _ = writeln!(text, "1 -1 1 {} {} 1 2 0 0 0\n1 1 0", vertical.len(), horizontal.len());
    for row in [vertical, horizontal].into_iter().chain(candela.chunks(vertical.len().max(1))) {
        for values in row.chunks(8) {
            let words: Vec<_> = values.iter().map(|x| f64::from(*x).to_string()).collect();
            let _ = writeln!(text, "{}", words.join(" "));
        }
    }
    text
}
