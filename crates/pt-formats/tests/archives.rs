//! Scenes in ZIP archives.

use std::io::{Cursor, Write};
use std::path::Path;

use pt_formats::{LoadOptions, parse, parse_with};
use pt_scene::{Geometry, Surface};
use zip::write::{SimpleFileOptions, ZipWriter};

const TRIANGLE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
const COLLADA: &str = include_str!("../../../scenes/cornell.dae");

fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        zip.start_file(*name, SimpleFileOptions::default()).expect("there is room");
        zip.write_all(content).expect("there is room");
    }
    zip.finish().expect("there is room").into_inner()
}

fn refusal(bytes: &[u8], name: &str) -> String {
    parse(bytes, Path::new(name)).expect_err("it is refused").to_string()
}

#[test]
fn the_scene_of_an_archive_is_read_with_what_it_names() {
    let bytes = archive(&[
        ("read me.txt", b"a triangle"),
        ("model/a.obj", TRIANGLE.as_bytes()),
        ("model/a.mtl", b"newmtl m\nKd 0.25 0.5 0.75\n"),
        ("model/parts/other.obj", TRIANGLE.as_bytes()),
    ]);
    let scene = parse(&bytes, Path::new("a.zip")).expect("a scene");
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
    assert_eq!(mesh.triangles.len(), 1);
    assert!(matches!(&scene.materials[0].surface, Surface::Diffuse(_)), "{:?}", scene.materials[0]);
    assert!(scene.missing.is_empty());
}

#[test]
fn manifests_name_the_scene_of_zae_files() {
    let manifest = b"<?xml version=\"1.0\"?><dae_root>./scenes/box.dae</dae_root>";
    let bytes = archive(&[
        ("manifest.xml", manifest),
        ("other.dae", b"<COLLADA"),
        ("scenes/box.dae", COLLADA.as_bytes()),
    ]);
    let scene = parse(&bytes, Path::new("a.zae")).expect("a scene");
    assert!(scene.objects.len() > 3);
}

#[test]
fn messages_name_the_archive() {
    let bytes = archive(&[("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 zero\nf 1 2 3\n")]);
    let message = refusal(&bytes, "b.zip");
    assert!(message.starts_with("b.zip/a.obj:3"), "{message}");
    let bytes = archive(&[("a.obj", TRIANGLE.as_bytes())]);
    let scene = parse(&bytes, Path::new("b.zip")).expect("a scene");
    let message: Vec<_> = scene.missing.iter().map(ToString::to_string).collect();
    assert!(
        message[0].contains("b.zip/a.obj:1") && message[0].contains("b.zip/a.mtl"),
        "{message:?}"
    );
    assert!(!message[0].contains("pathtracer-"), "{message:?}");
}

#[test]
fn archives_that_lead_out_or_are_no_scene_are_refused() {
    let object = TRIANGLE.as_bytes();
    for (files, expected) in [
        (&[("../a.obj", object)][..], "found \"../a.obj\" in the archive, expected paths inside"),
        (&[("a.txt", object)], "found no scene of a supported format"),
        (&[("b.zip", object)], "found no scene of a supported format"),
        (
            &[("a.obj", object), ("b.obj", object)],
            "found 2 scenes in the archive (a.obj, b.obj), expected one; unpack it",
        ),
    ] {
        let message = refusal(&archive(files), "a.zip");
        assert!(message.contains(expected), "{message}");
    }
    assert!(refusal(b"PK\x03\x04", "a.zip").contains("found no readable archive"));
    let mut linked = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    linked.add_symlink("a.obj", "/etc/passwd", options).expect("there is room");
    let bytes = linked.finish().expect("there is room").into_inner();
    assert!(refusal(&bytes, "a.zip").contains("expected paths inside of the archive"));
    // A file in the archive cannot refer to others outside of it.
    let bytes =
        archive(&[("a.obj", b"mtllib ../../etc/a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")]);
    let scene = parse(&bytes, Path::new("a.zip")).expect("a scene");
    assert!(scene.missing[0].message.contains("outside of the scene folder"));
}

#[test]
fn what_is_unpacked_is_limited() {
    let large = vec![b' '; 40_000_000];
    let bytes = archive(&[("a.obj", TRIANGLE.as_bytes()), ("b.txt", &large)]);
    assert!(bytes.len() < 100_000);
    let mut options = LoadOptions::default();
    options.limits.memory = Some(10_000_000);
    let message =
        parse_with(&bytes, Path::new("a.zip"), &options).expect_err("too large").to_string();
    assert!(message.contains("exceeds the memory limit of 10000000 bytes"), "{message}");
}

/// Each byte changed, and truncated at each position.
#[test]
fn damaged_archives_do_no_harm() {
    let bytes = archive(&[("m/a.obj", TRIANGLE.as_bytes()), ("m/a.mtl", b"newmtl m\nKd 1 0 0\n")]);
    for place in 0..bytes.len() {
        for value in [0, 0x7F, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[place] = value;
            drop(parse(&damaged, Path::new("a.zip")));
        }
        drop(parse(&bytes[..place], Path::new("a.zip")));
    }
}
