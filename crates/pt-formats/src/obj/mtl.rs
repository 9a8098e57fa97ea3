//! Statements of MTL materials. [Wavefront Technologies, "MTL material format (.mtl)", 1995; with
//! the statements for physically based materials of Exocortex Clara.io, 2014]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pt_image::PixelEncoding;
use pt_scene::Span;

use super::library::{self, Described};
use super::map::TextureMap;
use super::notes::MaterialNotes;
use crate::LoadError;
use crate::shared::context::{Folder, LoadContext};
use crate::shared::line::Line;
use crate::shared::mesh_file;
use crate::shared::names::{quote, suggestions};

/// Type of the value of a statement.
#[derive(Clone, Copy)]
enum StatementKind {
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
const STATEMENTS: [(&str, StatementKind); 44] = [
    ("Kd", StatementKind::Share),
    ("Ks", StatementKind::Share),
    ("Tf", StatementKind::Share),
    ("Ke", StatementKind::Light),
    ("Ns", StatementKind::Number(f32::MIN, f32::MAX)),
    ("Ni", StatementKind::Number(0.0, f32::MAX)),
    ("d", StatementKind::Number(0.0, 1.0)),
    ("Tr", StatementKind::Number(0.0, 1.0)),
    ("illum", StatementKind::Number(0.0, 10.0)),
    ("Pr", StatementKind::Number(0.0, 1.0)),
    ("Pm", StatementKind::Number(0.0, 1.0)),
    ("Ps", StatementKind::Number(0.0, 1.0)),
    ("Pc", StatementKind::Number(0.0, 1.0)),
    ("Pcr", StatementKind::Number(0.0, 1.0)),
    ("aniso", StatementKind::Number(0.0, 1.0)),
    ("anisor", StatementKind::Number(f32::MIN, f32::MAX)),
    ("map_Kd", StatementKind::Map),
    ("map_Ks", StatementKind::Map),
    ("map_Ke", StatementKind::Map),
    ("map_d", StatementKind::Map),
    ("map_Pr", StatementKind::Map),
    ("map_Pm", StatementKind::Map),
    ("map_bump", StatementKind::Map),
    ("bump", StatementKind::Map),
    ("norm", StatementKind::Map),
    ("Ka", StatementKind::Silent),
    ("map_Ka", StatementKind::Silent),
    ("sharpness", StatementKind::Silent),
    ("map_aat", StatementKind::Silent),
    ("map_Ns", StatementKind::PassedOver("the gloss is constant (\"Ns\")")),
    ("map_Tr", StatementKind::PassedOver("use \"map_d\"")),
    ("map_Tf", StatementKind::PassedOver("the colour of transmission is constant (\"Tf\")")),
    ("map_Ps", StatementKind::PassedOver("the sheen is constant")),
    ("map_Pc", StatementKind::PassedOver("the coat is constant")),
    ("map_Pcr", StatementKind::PassedOver("the coat is constant")),
    ("map_aniso", StatementKind::PassedOver("highlights are isotropic")),
    ("map_anisor", StatementKind::PassedOver("highlights are isotropic")),
    ("refl", StatementKind::PassedOver("reflections are those of the scene")),
    ("map_refl", StatementKind::PassedOver("reflections are those of the scene")),
    ("disp", StatementKind::PassedOver("displacement is not supported")),
    ("map_disp", StatementKind::PassedOver("displacement is not supported")),
    ("decal", StatementKind::PassedOver("decals are not supported")),
    ("map_decal", StatementKind::PassedOver("decals are not supported")),
    ("map_RMA", StatementKind::PassedOver("use \"map_Pr\" and \"map_Pm\"")),
];

/// Value of a statement.
enum StatementValue {
    Color([f32; 3]),
    Number(f32),
    Map(TextureMap),
}

/// Values of a material: of several statements with the same word, the last one.
#[derive(Default)]
pub(super) struct StatementValues(HashMap<&'static str, (StatementValue, Span)>);

impl StatementValues {
    /// Reads all statements; errors are recorded in the context.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(super) fn read(
        described: &Described,
        context: &LoadContext,
        notes: &mut MaterialNotes,
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
            (StatementValue::Color(color), _) => Some(*color),
            _ => None,
        }
    }

    pub(super) fn number(&self, word: &str) -> Option<f32> {
        match self.0.get(word)? {
            (StatementValue::Number(number), _) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn map(&self, word: &str) -> Option<&TextureMap> {
        match self.0.get(word)? {
            (StatementValue::Map(map), _) => Some(map),
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
fn statement(
    line: Line,
    notes: &mut MaterialNotes,
) -> Result<Option<(&'static str, StatementValue)>, LoadError> {
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
        StatementKind::Share => color(line, notes)?.map(|color| {
            if color.iter().any(|c| *c > 1.0) {
                let message = format!(
                    "{}: found a component above 1, expected at most 1; it is clamped",
                    quote(keyword)
                );
                notes.add(line.at(keyword), message);
            }
            StatementValue::Color(color.map(|c| c.min(1.0)))
        }),
        StatementKind::Light => color(line, notes)?.map(StatementValue::Color),
        StatementKind::Number(least, most) => {
            Some(StatementValue::Number(number(line, *least, *most, notes)?))
        }
        StatementKind::Map => TextureMap::parse(line, notes)?.map(StatementValue::Map),
        StatementKind::Silent => None,
        StatementKind::PassedOver(meaning) => {
            notes.add(line.at(keyword), format!("{} is ignored: {meaning}", quote(keyword)));
            None
        }
    };
    Ok(value.map(|value| (*word, value)))
}

/// Reads one number for all channels, or three; `None`, with a warning, for other notations.
fn color(line: Line, notes: &mut MaterialNotes) -> Result<Option<[f32; 3]>, LoadError> {
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
fn number(line: Line, least: f32, most: f32, notes: &mut MaterialNotes) -> Result<f32, LoadError> {
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
        let is = |word: &&(&str, StatementKind)| word.0.eq_ignore_ascii_case(line.keyword());
        let (word, StatementKind::Map) = STATEMENTS.iter().find(is)? else { return None };
        let map = TextureMap::parse(line, &mut MaterialNotes::default()).ok()??;
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
