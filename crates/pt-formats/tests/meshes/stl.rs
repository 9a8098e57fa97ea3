//! Reader of STL files.

use std::fmt::Write;
use std::path::Path;

use pt_formats::{Limits, LoadOptions, read_with};
use pt_scene::Geometry;

use super::common::{folder, parse};
use super::{good, mesh};

/// Equal corners of triangles are one vertex; z is up.
#[test]
fn triangles_of_stl_share_their_corners_and_stand_upright() {
    for name in ["tetrahedron.stl", "solid_binary.stl"] {
        let path = folder("stl").join("good").join(name);
        let bytes = std::fs::read(&path).expect("a readable file");
        let scene = parse(&bytes, &path).unwrap_or_else(|error| panic!("{error}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4), "{name}");
        let up = scene.objects[0].to_world.transform_vector3(pt_math::DVec3::Z);
        assert_eq!(up, pt_math::DVec3::Y);
    }
    assert_eq!(
        *good("stl", "tetrahedron.stl").positions,
        *good("stl", "solid_binary.stl").positions
    );
}

/// Returns the triangles of a wavy sheet of `n` · `n` squares, strip by strip.
pub(super) fn sheet(n: u16) -> Vec<[[f32; 3]; 3]> {
    let point = |i: u16, j: u16| [f32::from(i), f32::from(j), f32::from(i * 7 % 5) * 0.25];
    let square = |k: u16| {
        let [a, b, c, d] =
            [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(di, dj)| point(k / n + di, k % n + dj));
        [[a, b, c], [a, c, d]]
    };
    (0..n * n).flat_map(square).collect()
}

/// Returns a binary and a text STL file.
pub(super) fn stl_files(triangles: &[[[f32; 3]; 3]]) -> [Vec<u8>; 2] {
    let (mut binary, mut text) = (vec![0; 80], "solid sheet\n".to_owned());
    binary.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        binary.extend([0; 12]);
        binary.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        binary.extend([0; 2]);
        text += "facet normal 0 0 1\n outer loop\n";
        for [x, y, z] in triangle {
            writeln!(text, "  vertex {x} {y} {z}").expect("memory");
        }
        text += " endloop\nendfacet\n";
    }
    text += "endsolid\n";
    [binary, text.into_bytes()]
}

/// Corners that are not welded only cost memory; here all are welded except those along the cuts
/// and a few others.
#[test]
fn large_files_of_stl_are_the_same_for_any_number_of_threads() {
    let n = 180;
    let triangles = sheet(n);
    let exact = (usize::from(n) + 1).pow(2);
    for bytes in stl_files(&triangles) {
        assert!(bytes.len() > 3 << 20);
        let read = |threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| mesh(&bytes, Path::new("sheet.stl")))
        };
        let one = read(1);
        let corners = |t: &[u32; 3]| t.map(|corner| one.positions[corner as usize]);
        assert!(one.triangles.iter().map(corners).eq(triangles.iter().copied()));
        let vertices = one.positions.len();
        assert!(vertices >= exact && vertices < exact + exact / 5, "{vertices} of {exact}");
        assert_eq!(one, read(3));
    }
}

/// This includes files whose last triangles are behind the last part that another piece hashes
/// (125,827 of them), and files that are read as a whole because of the memory limit or a value
/// that is not finite.
#[test]
fn large_files_of_stl_that_are_read_in_pieces_are_the_same() {
    let triangles = sheet(255);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sheet.stl");
    let read = |threads: usize, limits: &Limits| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let options = LoadOptions { limits: limits.clone(), ..LoadOptions::default() };
        pool.install(|| read_with(&path, &options))
    };
    let unlimited = Limits::default();
    for count in [104_856, 125_826, 125_827, 125_828, 130_050] {
        let [bytes, _] = stl_files(&triangles[..count]);
        std::fs::write(&path, &bytes).expect("there is room");
        let whole = parse(&bytes, &path).unwrap_or_else(|error| panic!("{error}"));
        for threads in [1, 3] {
            let reading = read(threads, &unlimited);
            assert_eq!(reading.sources, [pt_formats::source_file(&path, &bytes)], "{count}");
            let scene = reading.scene.unwrap_or_else(|error| panic!("{error}"));
            assert!(scene.objects == whole.objects, "{count}");
        }
    }
    let [mut bytes, _] = stl_files(&triangles);
    let limits = Limits { memory: Some(bytes.len() as u64 - 1), ..Limits::default() };
    let error = read(3, &limits).scene.expect_err("a limit");
    assert!(error.to_string().contains("exceeds the memory limit of"), "{error}");
    for bad in [90_000, 130_049] {
        bytes[84 + 50 * bad + 20..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    }
    std::fs::write(&path, &bytes).expect("there is room");
    let reading = read(3, &unlimited);
    assert_eq!(reading.sources, [pt_formats::source_file(&path, &bytes)]);
    let reported = [90_000, 130_049].map(|bad| {
        format!("{}: found a value of triangle {bad} that is not finite", path.display())
    });
    assert_eq!(reading.scene.expect_err("faults").to_string(), reported.join("\n"));
}

#[test]
fn faults_of_large_files_of_stl_are_reported_by_their_places() {
    let triangles = sheet(180);
    let [mut binary, text] = stl_files(&triangles);
    let reported =
        |bytes: &[u8]| parse(bytes, Path::new("a.stl")).expect_err("a fault").to_string();
    let mut expected = Vec::new();
    for bad in [60_000, 40_000, 100] {
        binary[84 + 50 * bad + 20..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        expected.insert(0, format!("a.stl: found a value of triangle {bad} that is not finite"));
        assert_eq!(reported(&binary), expected.join("\n"));
    }
    let mut lines: Vec<&str> = str::from_utf8(&text).expect("a text").lines().collect();
    let mut expected = Vec::new();
    for bad in [300_000, 200_000, 1_000] {
        lines[bad] = "vertices";
        expected.insert(
            0,
            format!("a.stl:{}:1: unknown word \"vertices\" (did you mean \"vertex\"?)", bad + 1),
        );
        assert_eq!(reported(lines.join("\n").as_bytes()), expected.join("\n"));
    }
}
