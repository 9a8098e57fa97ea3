//! Statements of MTL materials. [Wavefront Technologies, "MTL material format (.mtl)", 1995; with
//! the statements for physically based materials of Exocortex Clara.io, 2014]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pt_image::PixelEncoding;
use pt_scene::Span;

use super::library::{self, Described};
use super::map::Map;
use super::notes::Notes;
use crate::LoadError;
use crate::shared::context::{Context, Folder};
use crate::shared::line::Line;
use crate::shared::mesh_file;
use crate::shared::names::{quote, suggestions};

/// Type of the value of a statement.
#[derive(Clone, Copy)]
enum Kind {
    /// A reflectance or transmittance.
    Share,
    /// An unbounded colour.
    Light,
    /// A number in a range.
    Number(f32, f32),
    /// An image.
    Map,
    /// Ignored without a warning: ambient light, or only the filtering of texels.
    Silent,
    /// Ignored with a warning, which describes the consequence.
    PassedOver(&'static str),
}

/// Statements by their first words, which are case-insensitive.
const STATEMENTS: [(&str, Kind); 44] = [
    ("Kd", Kind::Share),
    ("Ks", Kind::Share),
    ("Tf", Kind::Share),
    ("Ke", Kind::Light),
    ("Ns", Kind::Number(f32::MIN, f32::MAX)),
    ("Ni", Kind::Number(0.0, f32::MAX)),
    ("d", Kind::Number(0.0, 1.0)),
    ("Tr", Kind::Number(0.0, 1.0)),
    ("illum", Kind::Number(0.0, 10.0)),
    ("Pr", Kind::Number(0.0, 1.0)),
    ("Pm", Kind::Number(0.0, 1.0)),
    ("Ps", Kind::Number(0.0, 1.0)),
    ("Pc", Kind::Number(0.0, 1.0)),
    ("Pcr", Kind::Number(0.0, 1.0)),
    ("aniso", Kind::Number(0.0, 1.0)),
    ("anisor", Kind::Number(f32::MIN, f32::MAX)),
    ("map_Kd", Kind::Map),
    ("map_Ks", Kind::Map),
    ("map_Ke", Kind::Map),
    ("map_d", Kind::Map),
    ("map_Pr", Kind::Map),
    ("map_Pm", Kind::Map),
    ("map_bump", Kind::Map),
    ("bump", Kind::Map),
    ("norm", Kind::Map),
    ("Ka", Kind::Silent),
    ("map_Ka", Kind::Silent),
    ("sharpness", Kind::Silent),
    ("map_aat", Kind::Silent),
    ("map_Ns", Kind::PassedOver("the gloss is constant (\"Ns\")")),
    ("map_Tr", Kind::PassedOver("use \"map_d\"")),
    ("map_Tf", Kind::PassedOver("the colour of transmission is constant (\"Tf\")")),
    ("map_Ps", Kind::PassedOver("the sheen is constant")),
    ("map_Pc", Kind::PassedOver("the coat is constant")),
    ("map_Pcr", Kind::PassedOver("the coat is constant")),
    ("map_aniso", Kind::PassedOver("highlights are isotropic")),
    ("map_anisor", Kind::PassedOver("highlights are isotropic")),
    ("refl", Kind::PassedOver("reflections are those of the scene")),
    ("map_refl", Kind::PassedOver("reflections are those of the scene")),
    ("disp", Kind::PassedOver("displacement is not supported")),
    ("map_disp", Kind::PassedOver("displacement is not supported")),
    ("decal", Kind::PassedOver("decals are not supported")),
    ("map_decal", Kind::PassedOver("decals are not supported")),
    ("map_RMA", Kind::PassedOver("use \"map_Pr\" and \"map_Pm\"")),
];

/// Value of a statement.
enum Value {
    Color([f32; 3]),
    Number(f32),
    Map(Map),
}

/// Values of a material: of several statements with the same word, the last one.
#[derive(Default)]
pub(super) struct Values(HashMap<&'static str, (Value, Span)>);

impl Values {
    /// Reads all statements; errors are recorded in the context.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(super) fn read(
        described: &Described,
        context: &Context,
        notes: &mut Notes,
    ) -> Result<Self, LoadError> {
        let mut values = Self::default();
        for (number, text) in &described.lines {
            let line = Line { path: &described.path, number: *number, text };
            if let Some(Some((word, value))) = context.ok_or_report(statement(line, notes))? {
                values.0.insert(word, (value, line.at(line.keyword())));
            }
        }
        Ok(values)
    }

    pub(super) fn color(&self, word: &str) -> Option<[f32; 3]> {
        match self.0.get(word)? {
            (Value::Color(color), _) => Some(*color),
            _ => None,
        }
    }

    pub(super) fn number(&self, word: &str) -> Option<f32> {
        match self.0.get(word)? {
            (Value::Number(number), _) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn map(&self, word: &str) -> Option<&Map> {
        match self.0.get(word)? {
            (Value::Map(map), _) => Some(map),
            _ => None,
        }
    }

    /// Returns the location of a statement.
    pub(super) fn at(&self, word: &str) -> Option<Span> {
        self.0.get(word).map(|(_, at)| at.clone())
    }

    /// Returns true if there is such a statement.
    pub(super) fn has(&self, word: &str) -> bool {
        self.0.contains_key(word)
    }
}

/// Reads the statement of a line; `None` if it is ignored.
fn statement(line: Line, notes: &mut Notes) -> Result<Option<(&'static str, Value)>, LoadError> {
    let keyword = line.keyword();
    let Some((word, kind)) = STATEMENTS.iter().find(|(word, _)| word.eq_ignore_ascii_case(keyword))
    else {
        let near = suggestions(keyword, STATEMENTS.iter().map(|(word, _)| *word));
        let hint =
            near.first().map_or(String::new(), |near| format!("; did you mean {}?", quote(near)));
        let message =
            format!("unknown statement {}; such statements are ignored{hint}", quote(keyword));
        notes.add(line.at(keyword), message);
        return Ok(None);
    };
    let value = match kind {
        Kind::Share => color(line, notes)?.map(|color| {
            if color.iter().any(|c| *c > 1.0) {
                let message = format!(
                    "{}: found a component above 1, expected at most 1; it is clamped",
                    quote(keyword)
                );
                notes.add(line.at(keyword), message);
            }
            Value::Color(color.map(|c| c.min(1.0)))
        }),
        Kind::Light => color(line, notes)?.map(Value::Color),
        Kind::Number(least, most) => Some(Value::Number(number(line, *least, *most, notes)?)),
        Kind::Map => Map::parse(line, notes)?.map(Value::Map),
        Kind::Silent => None,
        Kind::PassedOver(meaning) => {
            notes.add(line.at(keyword), format!("{} is ignored: {meaning}", quote(keyword)));
            None
        }
    };
    Ok(value.map(|value| (*word, value)))
}

/// Reads one number for all channels, or three; `None`, with a warning, for other notations.
fn color(line: Line, notes: &mut Notes) -> Result<Option<[f32; 3]>, LoadError> {
    let mut words = line.text.split_ascii_whitespace().skip(1).peekable();
    if let Some(kind @ ("spectral" | "xyz")) = words.peek().copied() {
        let message =
            format!("colours by {} are ignored; expected red, green and blue", quote(kind));
        notes.add(line.at(kind), message);
        return Ok(None);
    }
    let color = if line.text.split_ascii_whitespace().count() == 2 {
        line.numbers(words).map(|[grey]| [grey; 3])?
    } else {
        line.numbers(words)?
    };
    if let Some(bad) = color.iter().find(|c| **c < 0.0) {
        return Err(
            line.error(line.text.trim_start(), format!("expected numbers from 0 up, found {bad}"))
        );
    }
    Ok(Some(color))
}

/// Reads the number of a line, after the option `-halo`, which is ignored with a warning.
fn number(line: Line, least: f32, most: f32, notes: &mut Notes) -> Result<f32, LoadError> {
    let mut words = line.text.split_ascii_whitespace().skip(1).peekable();
    if let Some(halo) = words.next_if_eq(&"-halo") {
        notes.add(line.at(halo), "\"-halo\" is ignored".to_owned());
    }
    let word = words.peek().copied().unwrap_or(line.text.trim_start());
    let [number] = line.numbers(words)?;
    if (least..=most).contains(&number) {
        return Ok(number);
    }
    let range = if most == f32::MAX { format!("{least} up") } else { format!("{least} to {most}") };
    Err(line.error(word, format!("expected a number from {range}, found {number}")))
}

/// Returns the images of materials.
pub(super) fn pictures<'a>(
    described: impl Iterator<Item = &'a Described>,
    folder: &Folder,
) -> Vec<(PathBuf, PixelEncoding)> {
    let map = |path: &Path, (number, text): &(u32, String)| {
        let line = Line { path, number: *number, text };
        let is = |word: &&(&str, Kind)| word.0.eq_ignore_ascii_case(line.keyword());
        let (word, Kind::Map) = STATEMENTS.iter().find(is)? else { return None };
        let map = Map::parse(line, &mut Notes::default()).ok()??;
        let is_raw = !matches!(*word, "map_Kd" | "map_Ks" | "map_Ke");
        Some((library::file(folder, &map.file), PixelEncoding::of_raw(is_raw)))
    };
    described.flat_map(|d| d.lines.iter().filter_map(|line| map(&d.path, line))).collect()
}

/// Returns the first line of a material, for warnings about the whole of it.
pub(super) fn place(described: &Described) -> Span {
    let line = described.lines.first().map_or(0, |(number, _)| *number);
    mesh_file::place(&described.path, line)
}
