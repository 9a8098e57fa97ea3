//! Byte-order marks, line breaks and continued lines in text files of all formats.

use std::path::Path;

use pt_scene::{Geometry, Scene};

use super::common::{files, folder, parse};
use super::{good, mesh};

/// Returns the content of a file, without locations.
fn read(bytes: &[u8], path: &Path) -> String {
    let Scene { objects, materials, cameras, lights, media, .. } =
        parse(bytes, path).unwrap_or_else(|error| panic!("{error}"));
    format!("{objects:?} {materials:?} {cameras:?} {lights:?} {media:?}")
}

/// A byte-order mark, and the kind of line breaks, have no effect.
#[test]
fn marks_and_line_breaks_change_no_scene() {
    let texts = [
        ("collada", "dae"),
        ("gltf", "gltf"),
        ("json", "json"),
        ("mitsuba", "xml"),
        ("obj", "obj"),
        ("pbrt", "pbrt"),
        ("ply", "ply"),
        ("stl", "stl"),
    ];
    for (format, ending) in texts {
        let mut tried = 0;
        for file in files(format, "good", ending) {
            let bytes = std::fs::read(&file).expect("a readable file");
            let Ok(text) = std::str::from_utf8(&bytes) else { continue };
            if text.contains(['\0', '\r']) {
                continue;
            }
            let expected = read(&bytes, &file);
            let marked = format!("\u{feff}{text}");
            let utf_16 = |order: fn(u16) -> [u8; 2], text: &str| -> Vec<u8> {
                text.encode_utf16().flat_map(order).collect()
            };
            let variants = [
                ("mark", marked.clone().into_bytes()),
                ("CR", text.replace('\n', "\r").into_bytes()),
                ("CR LF", text.replace('\n', "\r\n").into_bytes()),
                ("UTF-16, little-endian", utf_16(u16::to_le_bytes, &marked)),
                ("UTF-16, big-endian", utf_16(u16::to_be_bytes, &marked)),
                ("UTF-16 without a mark", utf_16(u16::to_le_bytes, text)),
                ("UTF-32", marked.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect()),
            ];
            for (what, variant) in variants {
                let found = read(&variant, &file);
                assert!(found == expected, "{}, {what}", file.display());
            }
            tried += 1;
        }
        assert!(tried > 0, "no text of {format}");
    }
}

/// A row of a binary file may begin with the byte of a line feed, which does not belong to a header
/// with carriage returns.
#[test]
fn headers_of_binary_ply_files_may_end_their_lines_in_carriage_returns() {
    for (name, ten) in [("little", 10_i32.to_le_bytes()), ("big", 10_i32.to_be_bytes())] {
        let header = format!(
            "ply\rformat binary_{name}_endian 1.0\relement vertex 3\rproperty int x\rproperty int y\r\
             property int z\relement face 1\rproperty list uchar uchar vertex_index\rend_header\r"
        );
        let mut bytes = header.into_bytes();
        bytes.extend([ten; 9].as_flattened());
        bytes.extend([3, 0, 1, 2]);
        assert_eq!(mesh(&bytes, Path::new("a.ply")).positions, [[10.0; 3]; 3]);
    }
}

/// The square equals that of the same statements on one line each.
#[test]
fn a_backslash_joins_the_next_line_of_an_obj_to_its_own() {
    let plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n# a\\\nf 1//1 2//1 3//1 4//1\n";
    let joined = "v 0 \\\n 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 \\\n0\\\n 1\n# a\\\nf 1//1 2//1 \\\r\n3//1 4//1\n";
    let read = |text: &str| mesh(text.as_bytes(), Path::new("a.obj"));
    assert_eq!(read(joined), read(plain));
    let wrong = joined.replace("f 1//1", "f 1//2");
    let error = parse(wrong.as_bytes(), Path::new("a.obj")).expect_err("no normal").to_string();
    assert!(error.starts_with("a.obj:10:"), "{error}");
}

/// Headers of binary files may begin with any bytes, and names in texts may contain any bytes.
#[test]
fn binary_and_text_files_of_stl_are_distinguished() {
    let binary = std::fs::read(folder("stl").join("good/solid_binary.stl")).expect("a file");
    let text = std::fs::read_to_string(folder("stl").join("good/tetrahedron.stl")).expect("a file");
    let facets = &text[text.find("facet").expect("a facet")..];
    let expected = good("stl", "tetrahedron.stl");
    let count = |bytes: &[u8]| {
        let scene = parse(bytes, Path::new("tetrahedron.stl")).unwrap_or_else(|e| panic!("{e}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        assert_eq!(mesh.positions, expected.positions);
        mesh.triangles.len()
    };
    for name in
        ["solid \0\0\0 old\n", "SOLID\t\u{fc}\n", "\u{feff}solid\n", "solid\r\n", "\n \n", ""]
    {
        assert_eq!(count(format!("{name}{facets}").as_bytes()), 4, "{name:?}");
    }
    for header in
        [&b"solid facet normal endsolid"[..], b"facet normal", b"\xEF\xBB\xBFsolid", b"\xFF\xFE"]
    {
        for more in [&b""[..], b"more"] {
            let mut bytes = binary.clone();
            bytes[..80].fill(b' ');
            bytes[..header.len()].copy_from_slice(header);
            bytes.extend(more);
            // With bytes after its triangles, a file that begins like a text is one.
            if more.is_empty() || !header.starts_with(b"facet") && header[0] < 0x80 {
                assert_eq!(count(&bytes), 4, "{header:?}");
            }
        }
    }
}
