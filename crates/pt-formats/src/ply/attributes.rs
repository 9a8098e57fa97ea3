//! Named attributes of vertices and faces, grouped and named as in Mitsuba 3.
//!
//! Consecutive properties with the same words before the last `_`, and after it `x y z`, `0 1 2`,
//! `1 2 3`, or `x`, `0` or `1` alone, are an attribute whose name is these words; with `r g b` or
//! `r` alone, `_color` is appended to the name. Attributes of two or four numbers are ignored.
//! [Measured with Mitsuba 3.9.1; its documentation, "PLY mesh loader"]

use std::collections::BTreeSet;
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, PropertyType};
use pt_scene::Attributes;

use crate::LoadError;
use crate::shared::{mesh_diagnostics, text};

/// Names of the requested attributes.
#[derive(Debug, Default)]
pub(in super::super) struct RequestedAttributes {
    pub(in super::super) vertices: BTreeSet<String>,
    pub(in super::super) faces: BTreeSet<String>,
}

/// Names of properties that are read in place of colours.
pub(super) struct ColorProperties {
    pub(super) vertices: Vec<String>,
    pub(super) faces: Vec<String>,
}

impl RequestedAttributes {
    pub(in super::super) fn is_empty(&self) -> bool {
        self.vertices.is_empty() && self.faces.is_empty()
    }
}

/// Reads the requested attributes of a file, except those that it lacks.
///
/// # Errors
/// Returns an error if the file cannot be read.
pub(in super::super) fn parse(
    bytes: &[u8],
    path: &Path,
    wanted: &RequestedAttributes,
) -> Result<Attributes, LoadError> {
    let mut attributes = Attributes::default();
    let bytes = text::unmarked(bytes, path)?;
    let lines = super::text_lines(&bytes);
    let header = Parser::<DefaultElement>::new().read_header(&mut Reader::new(&*lines));
    let Ok(header) = header else { return Ok(attributes) };
    let groups = |element| header.elements.get(element).map(groups).unwrap_or_default();
    let is_wanted = |names: &BTreeSet<String>, mut all: Vec<AttributeGroup>| {
        all.retain(|(name, _)| names.contains(name));
        all
    };
    let vertices = is_wanted(&wanted.vertices, groups("vertex"));
    let faces = is_wanted(&wanted.faces, groups("face"));
    for i in 0..vertices.len().max(faces.len()) {
        let properties =
            |groups: &[AttributeGroup]| groups.get(i).map_or(Vec::new(), |g| g.1.clone());
        let shown = ColorProperties { vertices: properties(&vertices), faces: properties(&faces) };
        let read = |faults: &mut _| {
            super::read(&bytes, path, faults, Some(&shown), super::RequestedContent::Faces)
        };
        let super::PlyContent { file, .. } = mesh_diagnostics::of_part(read)?;
        let colors = file.mesh.colors.map(|colors| colors.values);
        for (group, values, to) in [
            (vertices.get(i), colors, &mut attributes.vertices),
            (faces.get(i), file.mesh.face_colors, &mut attributes.faces),
        ] {
            let Some(((name, properties), mut values)) = group.zip(values) else { continue };
            if properties.len() == 1 {
                for value in &mut values {
                    *value = [value[0]; 3];
                }
            }
            to.insert(name.clone(), values);
        }
    }
    Ok(attributes)
}

/// Name of an attribute, and its properties.
type AttributeGroup = (String, Vec<String>);

/// Returns the attributes of an element.
fn groups(element: &ElementDef) -> Vec<AttributeGroup> {
    const ENDINGS: [[&str; 4]; 4] =
        [["x", "y", "z", "w"], ["r", "g", "b", "a"], ["0", "1", "2", "3"], ["1", "2", "3", "4"]];
    let mut groups: Vec<(&str, usize, Vec<String>)> = Vec::new();
    let mut follows = false; // true if the last property is of the last group
    for (name, property) in &element.properties {
        let is_number = matches!(property.data_type, PropertyType::Scalar(_));
        let Some((words, ending)) = name.rsplit_once('_').filter(|_| is_number) else {
            follows = false;
            continue;
        };
        if let Some((last, endings, all)) = groups.last_mut().filter(|_| follows)
            && *last == words
        {
            if ENDINGS[*endings].get(all.len()) == Some(&ending) {
                all.push(name.clone());
            }
            continue;
        }
        let first = ENDINGS.iter().position(|endings| endings[0] == ending);
        follows = match first {
            Some(endings) if !groups.iter().any(|(known, ..)| *known == words) => {
                groups.push((words, endings, vec![name.clone()]));
                true
            }
            _ => false,
        };
    }
    groups.retain(|(.., all)| matches!(all.len(), 1 | 3));
    let named = groups.into_iter().map(|(words, endings, all)| {
        let name = if ENDINGS[endings][0] == "r" { format!("{words}_color") } else { words.into() };
        (name, all)
    });
    named.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Output of `mitsuba.traverse` of 3.9.1 for such meshes.
    #[test]
    fn attributes_are_those_of_mitsuba() {
        for (properties, expected) in [
            ("rough_x", "rough: rough_x"),
            ("foo_0 foo_1 foo_2", "foo: foo_0 foo_1 foo_2"),
            ("foo_1 foo_2 foo_3", "foo: foo_1 foo_2 foo_3"),
            ("foo_r foo_g foo_b", "foo_color: foo_r foo_g foo_b"),
            ("foo_x foo_y foo_z bar_x", "foo: foo_x foo_y foo_z, bar: bar_x"),
            (
                "vertex_foo_r vertex_foo_g vertex_foo_b",
                "vertex_foo_color: vertex_foo_r vertex_foo_g vertex_foo_b",
            ),
            ("foo_x bar_x foo_y", "foo: foo_x, bar: bar_x"),
            ("foo_z foo_y foo_x", "foo: foo_x"),
            ("foo_x foo_y", ""),
            ("foo_x foo_y foo_z foo_w", ""),
            ("foo_a foo_g", ""),
            ("rough r g b nx", ""),
        ] {
            let lines = properties.split(' ').map(|name| format!("property float {name}\n"));
            let lines = lines.collect::<Vec<_>>().concat();
            let text = format!("ply\nformat ascii 1.0\nelement vertex 1\n{lines}end_header\n");
            let header = Parser::<DefaultElement>::new();
            let header = header.read_header(&mut Reader::new(text.as_bytes())).expect("a header");
            let found = groups(&header.elements["vertex"]);
            let found = found.iter().map(|(name, all)| format!("{name}: {}", all.join(" ")));
            assert_eq!(found.collect::<Vec<_>>().join(", "), expected, "{properties}");
        }
    }
}
