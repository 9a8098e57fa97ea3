//! Stanford polygon files (PLY), text and binary. [Turk 1994, "The PLY Polygon File Format"]
//!
//! Read are the properties `x y z`, `nx ny nz`, `u v` (also called `s t` and
//! `texture_u texture_v`) of the element `vertex`; the list `vertex_indices` (also called `vertex_index`)
//! of the elements `face` and `tristrips`; and `red green blue` (also called `r g b`) of `vertex` and `face`.
//! All else is passed over.
//!
//! Elements go one by one from the bytes of the file to the arrays of the mesh, which take
//! 12 bytes per vertex and per triangle.

use std::io::ErrorKind;
use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::mesh_file::{self, ColorLevels, MeshFile, Polygons};
use super::xml::quote;
use crate::shapes::single_part;
use crate::{Attribute, LoadError, Mesh, Scene, Warning};

/// Names of the properties of a texture coordinate.
const UV_NAMES: [[&str; 2]; 3] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]];
/// Names of the properties of a colour.
const COLOR_NAMES: [[&str; 3]; 2] = [["r", "g", "b"], ["red", "green", "blue"]];
/// Names of the list of the corners of a face.
const CORNER_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// A scene of one object.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    Ok(parse_mesh(bytes, path)?.into_scene(path))
}

/// The mesh of a file.
///
/// # Errors
/// If the content is no PLY, ends early, has no faces, or refers to vertices that do not exist.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| {
        let line = e.line().unwrap_or(0) as u32;
        mesh_file::error(path, line, format!("the header of the PLY is wrong: {}", explain(&e)))
    })?;
    let count = |name| header.elements.get(name).map_or(0, |e: &ElementDef| e.count);
    let vertices = count("vertex");
    if (count("face"), count("tristrips")) == (0, 0) || vertices == 0 {
        let message = "the file has no faces; expected the elements \"vertex\" and \"face\" (or \
                       \"tristrips\")";
        return Err(mesh_file::error(path, 0, message));
    }
    if u32::try_from(vertices).is_err() {
        let message = format!("{vertices} vertices are more than can be numbered with 32 bits");
        return Err(mesh_file::error(path, 0, message));
    }
    let (line, encoding) = (reader.line() as u32, header.encoding);
    let mut body = Body { path, encoding, line, rest: reader.into_inner() };
    let mut mesh = Mesh { name: mesh_file::name_of(path), ..Mesh::default() };
    let mut warnings = Vec::new();
    let mut levels = ColorLevels::default();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                levels.vertices = color_levels(element).unwrap_or(1.0);
                body.vertices(element, &mut mesh)?;
            }
            "face" => {
                levels.faces = color_levels(element).unwrap_or(1.0);
                body.faces(element, vertices as u32, &mut mesh, &mut warnings)?;
            }
            "tristrips" => body.strips(element, vertices as u32, &mut mesh)?,
            _ => body.skip(element)?,
        }
    }
    if mesh.triangles.is_empty() {
        return Err(mesh_file::error(path, 0, "no face has three corners"));
    }
    // Strips have no colours.
    mesh.face_colors = mesh.face_colors.filter(|colors| colors.len() == mesh.triangles.len());
    mesh.parts = single_part(mesh.triangles.len());
    Ok(MeshFile { mesh, levels, warnings })
}

/// What follows the header.
struct Body<'a> {
    path: &'a Path,
    encoding: Encoding,
    /// Line of the next element of a text file.
    line: u32,
    /// Bytes not yet read.
    rest: &'a [u8],
}

impl Body<'_> {
    /// Reads all vertices.
    fn vertices(&mut self, element: &ElementDef, mesh: &mut Mesh) -> Result<(), LoadError> {
        let has = |names: &[&str]| names.iter().all(|n| element.properties.contains_key(*n));
        if !has(&["x", "y", "z"]) {
            let message = "the element \"vertex\" has no properties \"x\", \"y\" and \"z\"";
            return Err(mesh_file::error(self.path, 0, message));
        }
        let least = self.least_count(element);
        let mut positions = Vec::with_capacity(least);
        let mut normals = has(&["nx", "ny", "nz"]).then(|| Vec::with_capacity(least));
        let mut uvs = UV_NAMES.iter().any(|uv| has(uv)).then(|| Vec::with_capacity(least));
        let mut colors = color_levels(element).map(|_| Vec::with_capacity(least));
        for i in 0..element.count {
            let v: Vertex = self.next(element, i)?;
            let mut numbers = v.position.iter().chain(&v.normal).chain(&v.uv).chain(&v.color);
            if !numbers.all(|x| x.is_finite()) {
                return Err(self.error(format!("vertex {i} has a value that is not finite")));
            }
            positions.push(v.position);
            if let Some(normals) = &mut normals {
                normals.push(v.normal);
            }
            if let Some(uvs) = &mut uvs {
                uvs.push(v.uv);
            }
            if let Some(colors) = &mut colors {
                colors.push(v.color);
            }
        }
        mesh.positions = positions;
        mesh.normals = normals.map(|values| Attribute { values, indices: None });
        mesh.uvs = uvs.map(|values| Attribute { values, indices: None });
        mesh.colors = colors.map(|values| Attribute { values, indices: None });
        Ok(())
    }

    /// Reads all faces, with corners below `vertices`.
    fn faces(
        &mut self,
        element: &ElementDef,
        vertices: u32,
        mesh: &mut Mesh,
        warnings: &mut Vec<Warning>,
    ) -> Result<(), LoadError> {
        let mut triangles = std::mem::take(&mut mesh.triangles);
        triangles.reserve_exact(self.least_count(element));
        let (mut without_area, mut polygons) = (0, Polygons::default());
        let mut colors = color_levels(element).map(|_| Vec::new());
        for i in 0..element.count {
            let Face { corners: face, color } = self.face(element, i, vertices, false)?;
            let corner = |i: usize| face[i] as u32;
            match face.len() {
                0..3 => without_area += 1,
                3 => triangles.push([0, 1, 2].map(corner)),
                _ => {
                    let corners = face.iter().map(|c| *c as u32);
                    polygons.cut(corners, &mesh.positions, |t| triangles.push(t.map(corner)));
                }
            }
            self.check_count(&triangles)?;
            if let Some(colors) = &mut colors {
                if !color.iter().all(|x| x.is_finite()) {
                    return Err(self.error(format!("face {i} has a colour that is not finite")));
                }
                colors.resize(triangles.len(), color);
            }
        }
        mesh.face_colors = colors;
        if without_area > 0 {
            let message = format!("{without_area} faces with fewer than three corners left out");
            warnings.push(Warning { at: mesh_file::place(self.path, 0), message });
        }
        mesh.triangles = triangles;
        Ok(())
    }

    /// Reads strips of triangles: each corner after the second makes a triangle with the two
    /// before it, every other one the other way round, and −1 starts anew. Triangles with two
    /// equal corners only join strips.
    fn strips(
        &mut self,
        element: &ElementDef,
        vertices: u32,
        mesh: &mut Mesh,
    ) -> Result<(), LoadError> {
        for i in 0..element.count {
            let strip = self.face(element, i, vertices, true)?.corners;
            for run in strip.split(|c| *c == -1) {
                let triangles = run.windows(3).enumerate().map(|(k, window)| {
                    let [a, b, c] = [window[0], window[1], window[2]].map(|c| c as u32);
                    if k % 2 == 0 { [a, b, c] } else { [b, a, c] }
                });
                mesh.triangles.extend(triangles.filter(|[a, b, c]| a != b && b != c && c != a));
            }
            self.check_count(&mesh.triangles)?;
        }
        Ok(())
    }

    /// An element with corners, each below `vertices`, or −1 if that may end a strip.
    fn face(
        &mut self,
        element: &ElementDef,
        index: usize,
        vertices: u32,
        is_strip: bool,
    ) -> Result<Face, LoadError> {
        let name = &element.name;
        if !CORNER_NAMES.iter().any(|n| element.properties.contains_key(*n)) {
            let message = format!("the element \"{name}\" has no list \"vertex_indices\"");
            return Err(mesh_file::error(self.path, 0, message));
        }
        let face: Face = self.next(element, index)?;
        let range = 0..i64::from(vertices);
        let is_good = |c: &i64| range.contains(c) || (is_strip && *c == -1);
        match face.corners.iter().find(|c| !is_good(c)) {
            None => Ok(face),
            Some(bad) => Err(self.error(format!(
                "{name} {index} refers to vertex {bad}; the vertices are numbered 0 to {}",
                vertices - 1
            ))),
        }
    }

    /// Triangles are numbered with 32 bits.
    fn check_count(&self, triangles: &[[u32; 3]]) -> Result<(), LoadError> {
        if u32::try_from(triangles.len()).is_ok() {
            return Ok(());
        }
        Err(self.error("the file has more than 4294967295 triangles".to_owned()))
    }

    /// Passes over an element that is not read.
    fn skip(&mut self, element: &ElementDef) -> Result<(), LoadError> {
        // Elements without properties take no bytes, however many there are said to be.
        if element.properties.is_empty() && self.encoding != Encoding::Ascii {
            return Ok(());
        }
        (0..element.count).try_for_each(|i| self.next::<Skipped>(element, i).map(|_| ()))
    }

    /// Reads the element with number `index` of its kind.
    fn next<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        index: usize,
    ) -> Result<E, LoadError> {
        let parser = Parser::<E>::new();
        let result = match self.encoding {
            Encoding::Ascii => {
                let line = self.next_line();
                let Some(line) = line else { return Err(self.ends_in(element, index)) };
                parser.read_ascii_element(&String::from_utf8_lossy(line), element)
            }
            Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut self.rest, element),
            Encoding::BinaryLittleEndian => {
                parser.read_little_endian_element(&mut self.rest, element)
            }
        };
        result.map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => self.ends_in(element, index),
            _ => self.error(format!("{} {index} is wrong: {}", element.name, explain(&e))),
        })
    }

    /// The next line of a text file that is not blank; `None` at the end.
    fn next_line(&mut self) -> Option<&[u8]> {
        loop {
            let end = self.rest.iter().position(|b| *b == b'\n').unwrap_or(self.rest.len());
            let line = self.rest.get(..end)?.trim_ascii();
            if line.is_empty() && end == self.rest.len() {
                return None;
            }
            self.rest = self.rest.get(end + 1..).unwrap_or_default();
            self.line += 1;
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    /// How many elements to expect: as many as the header says, but not more than the bytes that
    /// are left can hold.
    fn least_count(&self, element: &ElementDef) -> usize {
        let size = |kind: &ScalarType| match (self.encoding, kind) {
            (_, ScalarType::Short | ScalarType::UShort) | (Encoding::Ascii, _) => 2, // "0 "
            (_, ScalarType::Char | ScalarType::UChar) => 1,
            (_, ScalarType::Int | ScalarType::UInt | ScalarType::Float) => 4,
            (_, ScalarType::Double) => 8,
        };
        let least = |kind: &PropertyType| match kind {
            PropertyType::Scalar(kind) => size(kind),
            PropertyType::List(count, _) => size(count),
        };
        let bytes: usize = element.properties.values().map(|p| least(&p.data_type)).sum();
        element.count.min(1 + self.rest.len() / bytes.max(1))
    }

    fn ends_in(&self, element: &ElementDef, index: usize) -> LoadError {
        let ElementDef { name, count, .. } = element;
        self.error(format!("the file ends in {name} {index} of {count}; is it complete?"))
    }

    /// An error about the line that was read last; binary files have no lines.
    fn error(&self, message: String) -> LoadError {
        let line = if self.encoding == Encoding::Ascii { self.line - 1 } else { 0 };
        mesh_file::error(self.path, line, message)
    }
}

/// What the parser says, on one line.
fn explain(error: &ParseError) -> String {
    let text = error.to_string();
    let text = error.line().map_or(&*text, |l| text.trim_start_matches(&format!("Line {l}: ")));
    let mut parts = text.split("\n\t").map(str::trim);
    let what = parts.next().unwrap_or_default().trim_end_matches('.');
    let what = what.trim_end_matches(" by the destination element");
    match parts.find_map(|part| part.strip_prefix("String: ")) {
        Some(line) => format!("{what}: {}", quote(line.trim_matches('\'').trim_end())),
        None => what.to_owned(),
    }
}

/// The properties of a vertex that are read.
#[derive(Default)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if let Some(channel) = channel(name) {
            return set_channel(&mut self.color, channel, &value);
        }
        let target = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" | "texture_u" => &mut self.uv[0],
            "v" | "t" | "texture_v" => &mut self.uv[1],
            _ => return PropertyAccessResult::Ignored,
        };
        *target = match value {
            Property::Float(x) => x,
            Property::Double(x) => x as f32,
            Property::Char(x) => f32::from(x),
            Property::UChar(x) => f32::from(x),
            Property::Short(x) => f32::from(x),
            Property::UShort(x) => f32::from(x),
            Property::Int(x) => x as f32,
            Property::UInt(x) => x as f32,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// The greatest number of a channel of the colours of an element, if it has some: 1 for real numbers.
fn color_levels(element: &ElementDef) -> Option<f32> {
    let of_channel = |name: &&str| match element.properties.get(*name)?.data_type {
        PropertyType::Scalar(ScalarType::Float | ScalarType::Double) => Some(1.0),
        PropertyType::Scalar(ScalarType::UChar) => Some(f32::from(u8::MAX)),
        PropertyType::Scalar(ScalarType::UShort) => Some(f32::from(u16::MAX)),
        PropertyType::Scalar(ScalarType::UInt) => Some(u32::MAX as f32),
        _ => None,
    };
    let of_all = |names: &[&str; 3]| {
        names.iter().map(of_channel).try_fold(1.0f32, |most, levels| Some(most.max(levels?)))
    };
    COLOR_NAMES.iter().find_map(of_all)
}

/// The channel of a colour that a property of this name gives.
fn channel(name: &str) -> Option<usize> {
    match name {
        "r" | "red" => Some(0),
        "g" | "green" => Some(1),
        "b" | "blue" => Some(2),
        _ => None,
    }
}

fn set_channel(color: &mut [f32; 3], channel: usize, value: &Property) -> PropertyAccessResult {
    let Some(share) = share(value) else {
        return PropertyAccessResult::Ignored;
    };
    color[channel] = share;
    PropertyAccessResult::Set
}

/// A number of a colour: whole ones as shares of the highest.
fn share(value: &Property) -> Option<f32> {
    Some(match *value {
        Property::Float(x) => x,
        Property::Double(x) => x as f32,
        Property::UChar(x) => f32::from(x) / f32::from(u8::MAX),
        Property::UShort(x) => f32::from(x) / f32::from(u16::MAX),
        Property::UInt(x) => (f64::from(x) / f64::from(u32::MAX)) as f32,
        _ => return None,
    })
}

/// The corners of a face, as they are written, and its colour.
#[derive(Default)]
struct Face {
    corners: Vec<i64>,
    color: [f32; 3],
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if let Some(channel) = channel(name) {
            return set_channel(&mut self.color, channel, &value);
        }
        if !CORNER_NAMES.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match value {
            Property::ListChar(list) => widen(&list),
            Property::ListUChar(list) => widen(&list),
            Property::ListShort(list) => widen(&list),
            Property::ListUShort(list) => widen(&list),
            Property::ListInt(list) => widen(&list),
            Property::ListUInt(list) => widen(&list),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

fn widen<T: Copy + Into<i64>>(list: &[T]) -> Vec<i64> {
    list.iter().map(|x| (*x).into()).collect()
}

/// An element of which nothing is kept.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
