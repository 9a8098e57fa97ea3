//! Stanford polygon files (PLY), text and binary. [Turk 1994, "The PLY Polygon File Format"]
//!
//! Supported are the properties `x y z`, `nx ny nz`, `u v` (also called `s t` and
//! `texture_u texture_v`) of the element `vertex`; the list `vertex_indices` (also called
//! `vertex_index`) of the elements `face` and `tristrips`; and `red green blue` (also called
//! `r g b`) of `vertex` and `face`. If a file is a scene, its [images](painted) are read as well,
//! and without faces its vertices are points, with segments by `vertex1 vertex2` of the element
//! `edge`. Everything else is ignored.
//!
//! Rows are read in parallel, in chunks: `layout.rs` assigns roles to properties, `rows.rs` finds
//! the start of rows, `words.rs` reads their numbers, and `fixed.rs` those of most binary files,
//! whose rows have constant size.

pub(super) mod attributes;
pub(super) mod columns;
mod edges;
mod fixed;
mod layout;
mod painted;
mod rows;
mod words;

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use attributes::ColorProperties;
use fixed::{PlyVertices, TriangleFaces};
use layout::{COLOR, ElementLayout, IMAGE, IMAGE_NAME, NORMAL, POSITION, UV};
use painted::Painted;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, Header};
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Mesh, Points, Scene, Warning};
use rows::{Body, RowChunk};
use words::ElementRow;

use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file::{ColorLevels, MeshFile, PointsFile, Polygons};
use crate::shared::names::quote;
use crate::shared::{mesh_diagnostics, mesh_file, text};

/// Reads a scene of one object.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let PlyContent { mut file, mut painted, segments } =
        mesh_diagnostics::of_scene(context, |faults| {
            read(bytes, path, faults, None, RequestedContent::Anything)
        })?;
    if file.mesh.triangles.is_empty() {
        return Ok(PointsFile::new(file, segments, path).into_scene(path));
    }
    let slots = painted.lay(&mut file.mesh);
    let mut scene = file.into_scene(path);
    painted.dress(&mut scene, &slots, path, context);
    Ok(scene)
}

/// Reads the mesh of a file.
///
/// # Errors
/// Returns an error if the content is no PLY, is truncated, has no faces, or refers to vertices
/// that do not exist.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    mesh_diagnostics::of_part(|faults| {
        Ok(read(bytes, path, faults, None, RequestedContent::Faces)?.file)
    })
}

/// Reads the points of a file, which may have faces as well.
///
/// # Errors
/// Returns the errors of [`parse_mesh`], except that faces are not required.
pub(super) fn parse_points(bytes: &[u8], path: &Path) -> Result<Points, LoadError> {
    let PlyContent { file, segments, .. } = mesh_diagnostics::of_part(|faults| {
        read(bytes, path, faults, None, RequestedContent::Anything)
    })?;
    Ok(PointsFile::new(file, segments, path).points)
}

/// Requested content.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RequestedContent {
    Faces,
    /// Faces or, if there are none, points.
    Anything,
}

/// Content of a file.
struct PlyContent {
    file: MeshFile,
    painted: Painted,
    /// Segments of the element `edge`, in files without faces.
    segments: Vec<[u32; 2]>,
}

/// Reads the mesh of a file, with vertices at the origin in place of invalid ones, and without
/// invalid faces; and its references to images. Properties in `shown` are read in place of colours.
///
/// # Errors
/// Returns an error if nothing more can be read.
fn read(
    bytes: &[u8],
    path: &Path,
    faults: &mut MeshDiagnostics,
    shown: Option<&ColorProperties>,
    wanted: RequestedContent,
) -> Result<PlyContent, LoadError> {
    let bytes = text::unmarked(bytes, path)?;
    let bytes = text_lines(&bytes);
    let (header, line, rest) = header_of(&bytes, path)?;
    let count = |name| header.elements.get(name).map_or(0, |e: &ElementDef| e.count);
    let vertices = count("vertex");
    let has_faces = (count("face"), count("tristrips")) != (0, 0);
    if !has_faces && wanted == RequestedContent::Faces || vertices == 0 {
        let message =
            "found no faces, expected the elements \"vertex\" and \"face\" (or \"tristrips\")";
        return Err(mesh_file::error(path, 0, message));
    }
    if u32::try_from(vertices).is_err() {
        let message = format!("{vertices} vertices exceed the range of 32-bit indices");
        return Err(mesh_file::error(path, 0, message));
    }
    let mut body = Body { path, encoding: header.encoding, line, rest, faults };
    let mut mesh = Mesh { name: mesh_file::name_of(path), ..Mesh::default() };
    let mut warnings = Vec::new();
    let mut levels = ColorLevels::default();
    let mut segments = Vec::new();
    let mut painted = Painted { files: painted::files(&header.comments), ..Painted::default() };
    for element in header.elements.values() {
        let mut layout = ElementLayout::new(element);
        match (shown, element.name.as_str()) {
            (Some(shown), "vertex") => layout.show(&shown.vertices),
            (Some(shown), "face") => layout.show(&shown.faces),
            _ => {}
        }
        match element.name.as_str() {
            "vertex" => {
                levels.vertices = layout.color_levels().unwrap_or(1.0);
                read_vertices(&mut body, &layout, has_faces, &mut mesh)?;
            }
            "face" => {
                levels.faces = layout.color_levels().unwrap_or(1.0);
                let faces =
                    read_faces(&mut body, &layout, vertices as u32, &mut mesh, &mut warnings)?;
                (painted.uvs, painted.images) = faces;
            }
            "tristrips" => read_strips(&mut body, &layout, vertices as u32, &mut mesh)?,
            "edge" if !has_faces => {
                segments = edges::read(&mut body, element, vertices as u32)?;
            }
            _ => body.skip(element)?,
        }
    }
    if mesh.triangles.is_empty() && has_faces {
        let error = mesh_file::error(path, 0, "found no face with three corners");
        if wanted == RequestedContent::Faces || !body.faults.is_empty() {
            return Err(body.faults.because_of(error));
        }
        body.faults.pardon(error, "the vertices are shown as points");
    }
    // Strips have no colours.
    mesh.face_colors = mesh.face_colors.filter(|colors| colors.len() == mesh.triangles.len());
    mesh.submeshes = single_part(mesh.triangles.len());
    Ok(PlyContent { file: MeshFile { mesh, levels, warnings }, painted, segments })
}

/// Parses the header of a file, and returns the line after it, and the rest of the file.
fn header_of<'b>(bytes: &'b [u8], path: &Path) -> Result<(Header, u32, &'b [u8]), LoadError> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<DefaultElement>::new().read_header(&mut reader).map_err(|e| {
        let line = e.line().unwrap_or(0) as u32;
        mesh_file::error(path, line, format!("invalid PLY header: {}", explain(&e)))
    })?;
    let line = reader.line() as u32;
    Ok((header, line, reader.into_inner()))
}

/// Converts the line ends of the header to line feeds, including carriage returns without a line
/// feed; and those of all lines of a text.
fn text_lines(bytes: &[u8]) -> Cow<'_, [u8]> {
    const END: &[u8] = b"end_header";
    let Some(end) = memchr::memmem::find(bytes, END).map(|at| at + END.len()) else {
        return text::with_line_feeds(bytes);
    };
    let header = &bytes[..end];
    if memchr::memmem::find(header, b"format ascii").is_some() {
        return text::with_line_feeds(bytes);
    }
    // If the header ends its lines with carriage returns only, the next byte belongs to the first
    // row.
    let is_alone = matches!(text::with_line_feeds(header), Cow::Owned(_));
    if !is_alone || bytes.get(end) != Some(&b'\r') || memchr::memchr(b'\n', header).is_some() {
        return Cow::Borrowed(bytes);
    }
    let mut changed = text::with_line_feeds(header).into_owned();
    changed.push(b'\n');
    changed.extend_from_slice(&bytes[end + 1..]);
    Cow::Owned(changed)
}

/// Reads all vertices.
fn read_vertices(
    body: &mut Body,
    layout: &ElementLayout,
    has_faces: bool,
    mesh: &mut Mesh,
) -> Result<(), LoadError> {
    if !layout.has(&["x", "y", "z"]) {
        let message = "missing properties \"x\", \"y\" and \"z\" of the element \"vertex\"";
        return Err(mesh_file::error(body.path, 0, message));
    }
    let fixed = match body.encoding {
        Encoding::Ascii => None,
        Encoding::BinaryBigEndian => fixed::vertices::<true>(layout, body.rest),
        Encoding::BinaryLittleEndian => fixed::vertices::<false>(layout, body.rest),
    };
    let vertices = match fixed {
        Some((vertices, size)) => {
            body.rest = &body.rest[size..];
            vertices
        }
        None => any_vertices(body, layout, has_faces)?,
    };
    let all = |values: Vec<_>| Attribute { values: values.into(), indices: None };
    mesh.positions = vertices.positions.into();
    mesh.normals = vertices.normals.map(all);
    mesh.uvs = vertices.uvs.map(|values| Attribute { values: values.into(), indices: None });
    mesh.colors = vertices.colors.map(all);
    Ok(())
}

/// Reads all vertices, of any encoding and with any properties. Those of a file without faces may
/// be not finite, as scanners write missing measurements.
fn any_vertices(
    body: &mut Body,
    layout: &ElementLayout,
    has_faces: bool,
) -> Result<PlyVertices, LoadError> {
    let empty = |capacity| PlyVertices {
        positions: pt_memory::with_capacity(capacity),
        normals: layout.has(&["nx", "ny", "nz"]).then(|| pt_memory::with_capacity(capacity)),
        uvs: layout.has_uvs().then(|| pt_memory::with_capacity(capacity)),
        colors: layout.color_levels().map(|_| pt_memory::with_capacity(capacity)),
    };
    let origin = ElementRow::default();
    let path = body.path;
    let read = |chunk: &RowChunk, faults: &mut MeshDiagnostics| {
        let (mut vertices, mut without_color) = (empty(chunk.count), Vec::new());
        chunk.rows(faults, |i, row| {
            let row = row.and_then(|row| {
                let is_finite = |at: usize| row.numbers[at].is_finite();
                let fault = || format!("found a value of vertex {i} that is not finite");
                if !(COLOR..IMAGE).all(is_finite) {
                    without_color.push(i);
                }
                let others = (0..COLOR).chain(IMAGE..row.numbers.len());
                let is_usable = !has_faces || others.into_iter().all(is_finite);
                is_usable.then_some(row).ok_or_else(fault)
            });
            // The following vertices keep their indices.
            vertices.push(row.as_ref().copied().unwrap_or(&origin));
            row.map(drop)
        });
        for i in without_color {
            let message = format!("found a colour of vertex {i} that is not finite");
            faults.pardon(mesh_file::error(path, 0, message), "the vertex becomes black");
        }
        vertices
    };
    let mut all = empty(body.least_count(layout));
    body.read(layout, read, |part| all.append(part))?;
    Ok(all)
}

impl PlyVertices {
    fn push(&mut self, ElementRow { numbers, .. }: &ElementRow) {
        let three = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
        self.positions.push(three(POSITION));
        self.normals.iter_mut().for_each(|normals| normals.push(three(NORMAL)));
        self.uvs.iter_mut().for_each(|uvs| uvs.push([numbers[UV], numbers[UV + 1]]));
        let color = three(COLOR);
        let is_finite = color.iter().all(|c| c.is_finite());
        let color = if is_finite { color } else { [0.0; 3] };
        self.colors.iter_mut().for_each(|colors| colors.push(color));
    }

    fn append(&mut self, mut more: Self) {
        self.positions.append(&mut more.positions);
        append(&mut self.normals, more.normals);
        append(&mut self.uvs, more.uvs);
        append(&mut self.colors, more.colors);
    }
}

/// Appends values of the same kind, if there are any.
fn append<T>(all: &mut Option<Vec<T>>, more: Option<Vec<T>>) {
    if let (Some(all), Some(mut more)) = (all, more) {
        all.append(&mut more);
    }
}

/// Texture coordinates and image indices of triangles, if a file has them.
type Laid = (Option<Vec<[[f32; 2]; 3]>>, Option<Vec<i64>>);

/// Reads all faces, with corners below `vertices`; returns their texture coordinates and image
/// indices.
fn read_faces(
    body: &mut Body,
    layout: &ElementLayout,
    vertices: u32,
    mesh: &mut Mesh,
    warnings: &mut Vec<Warning>,
) -> Result<Laid, LoadError> {
    check_corners(body, layout)?;
    let fixed = match body.encoding {
        Encoding::Ascii => None,
        Encoding::BinaryBigEndian => fixed::triangles::<true>(layout, vertices, body.rest),
        Encoding::BinaryLittleEndian => fixed::triangles::<false>(layout, vertices, body.rest),
    };
    let TriangleFaces { mut corners, colors, uvs, images } = match fixed {
        Some((triangles, size)) => {
            body.rest = &body.rest[size..];
            triangles
        }
        None => any_faces(body, layout, vertices, &mesh.positions, warnings)?,
    };
    mesh.face_colors = colors.map(Into::into);
    if mesh.triangles.is_empty() {
        mesh.triangles = corners.into();
    } else {
        mesh.triangles.to_mut().append(&mut corners);
    }
    check_count(body, &mesh.triangles)?;
    Ok((uvs, images))
}

/// Reads all faces, of any encoding and number of corners.
fn any_faces(
    body: &mut Body,
    layout: &ElementLayout,
    vertices: u32,
    positions: &[[f32; 3]],
    warnings: &mut Vec<Warning>,
) -> Result<TriangleFaces, LoadError> {
    let empty = |capacity| TriangleFaces {
        corners: pt_memory::with_capacity(capacity),
        colors: layout.color_levels().map(|_| pt_memory::with_capacity(capacity)),
        uvs: layout.has_coordinates().then(Vec::new),
        images: layout.has(&[IMAGE_NAME]).then(Vec::new),
    };
    let read = |chunk: &RowChunk, faults: &mut MeshDiagnostics| {
        let (mut triangles, mut without_area) = (empty(chunk.count), 0_usize);
        let mut polygons = Polygons::default();
        chunk.rows(faults, |i, row| {
            let row = row?;
            check_indices("face", i, &row.corners, 0..i64::from(vertices))?;
            let color = [0, 1, 2].map(|k| row.numbers[COLOR + k]);
            if !color.iter().all(|x| x.is_finite()) {
                return Err(format!("found a colour of face {i} that is not finite"));
            }
            let coordinates = coordinates(row).map_err(|what| format!("face {i}: {what}"))?;
            let all = row.corners.as_slice();
            let mut push = |cut: [usize; 3]| {
                triangles.corners.push(cut.map(|c| all[c] as u32));
                triangles.colors.iter_mut().for_each(|colors| colors.push(color));
                let uv = cut.map(|c| coordinates.get(c).copied().unwrap_or_default());
                triangles.uvs.iter_mut().for_each(|uvs| uvs.push(uv));
                let image = row.numbers[IMAGE] as i64;
                triangles.images.iter_mut().for_each(|images| images.push(image));
            };
            match all.len() {
                0..3 => without_area += 1,
                3 => push([0, 1, 2]),
                _ => polygons.cut(all.iter().map(|c| *c as u32), positions, push),
            }
            Ok(())
        });
        (triangles, without_area)
    };
    let (mut all, mut without_area) = (empty(body.least_count(layout)), 0);
    let at_the_end = mesh_file::place(body.path, 0);
    body.read(layout, read, |(mut part, its_without_area)| {
        all.corners.append(&mut part.corners);
        append(&mut all.colors, part.colors);
        append(&mut all.uvs, part.uvs);
        append(&mut all.images, part.images);
        without_area += its_without_area;
    })?;
    if without_area > 0 {
        let message = format!("{without_area} faces with fewer than three corners omitted");
        warnings.push(Warning { at: at_the_end, message });
    }
    Ok(all)
}

/// Returns the texture coordinates at the corners of a face; empty if it has none.
///
/// # Errors
/// Returns a message if their number is wrong.
fn coordinates(row: &ElementRow) -> Result<&[[f32; 2]], String> {
    let (pairs, rest) = row.coordinates.as_chunks::<2>();
    let (found, wanted) = (row.coordinates.len(), 2 * row.corners.len());
    if found > 0 && (!rest.is_empty() || found != wanted) {
        return Err(format!(
            "found {found} numbers in \"texcoord\", expected two for each corner, {wanted}"
        ));
    }
    if !pairs.as_flattened().iter().all(|x| x.is_finite()) {
        return Err("found texture coordinates that are not finite".to_owned());
    }
    Ok(pairs)
}

/// Reads triangle strips: each corner after the second makes a triangle with the two before it,
/// every other one reversed, and −1 starts a new strip. Degenerate triangles only join strips.
fn read_strips(
    body: &mut Body,
    layout: &ElementLayout,
    vertices: u32,
    mesh: &mut Mesh,
) -> Result<(), LoadError> {
    check_corners(body, layout)?;
    let read = |chunk: &RowChunk, faults: &mut MeshDiagnostics| {
        let mut triangles = Vec::new();
        chunk.rows(faults, |i, row| {
            let row = row?;
            check_indices("tristrips", i, &row.corners, -1..i64::from(vertices))?;
            for run in row.corners.split(|c| *c == -1) {
                let all = run.windows(3).enumerate().map(|(k, window)| {
                    let [a, b, c] = [window[0], window[1], window[2]].map(|c| c as u32);
                    if k % 2 == 0 { [a, b, c] } else { [b, a, c] }
                });
                triangles.extend(all.filter(|[a, b, c]| a != b && b != c && c != a));
            }
            Ok(())
        });
        triangles
    };
    body.read(layout, read, |mut triangles| mesh.triangles.to_mut().append(&mut triangles))?;
    check_count(body, &mesh.triangles)
}

/// Checks that faces and strips have a list of corners, unless there are none of them.
fn check_corners(body: &Body, layout: &ElementLayout) -> Result<(), LoadError> {
    let ElementDef { name, count, .. } = layout.element;
    if *count == 0 || layout.has_corners() {
        return Ok(());
    }
    let message = format!("missing list \"vertex_indices\" of the element \"{name}\"");
    Err(mesh_file::error(body.path, 0, message))
}

/// Checks that the corners of element number `i` are in a range, whose end is the number of
/// vertices.
fn check_indices(
    name: &str,
    i: usize,
    corners: &[i64],
    range: std::ops::Range<i64>,
) -> Result<(), String> {
    match corners.iter().find(|c| !range.contains(c)) {
        None => Ok(()),
        Some(bad) => {
            Err(format!("found vertex {bad} in {name} {i}, expected 0 to {}", range.end - 1))
        }
    }
}

/// Checks that the number of triangles fits into 32 bits.
fn check_count(body: &Body, triangles: &[[u32; 3]]) -> Result<(), LoadError> {
    if u32::try_from(triangles.len()).is_ok() {
        return Ok(());
    }
    Err(body.error("more than 4294967295 triangles".to_owned()))
}

/// Formats an error of the parser on one line.
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
