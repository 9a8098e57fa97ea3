//! Readers of mesh files: PLY, OBJ and STL.

mod common;
#[path = "meshes/points.rs"]
mod points;
#[path = "meshes/stl.rs"]
mod stl;
#[path = "meshes/text.rs"]
mod text;
#[path = "meshes/textured.rs"]
mod textured;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::{check_bad_files, check_good_files, check_robustness, folder, parse};
use pt_math::Vec3;
use pt_math::color::linear_from_srgb;
use pt_scene::material::Diffuse;
use pt_scene::texture::{Color, Pattern};
use pt_scene::{Geometry, Mesh, Surface, shapes};
use stl::{sheet, stl_files};

/// Returns the only mesh of a scene, which may have points and lines beside it.
fn mesh(bytes: &[u8], path: &Path) -> Arc<Mesh> {
    let scene = parse(bytes, path).unwrap_or_else(|error| panic!("{error}"));
    let mut meshes = scene.objects.iter().filter_map(|object| match &object.geometry {
        Geometry::Mesh(mesh) => Some(Arc::clone(mesh)),
        _ => None,
    });
    let mesh = meshes.next().expect("a mesh");
    assert!(meshes.next().is_none(), "not one mesh");
    mesh
}

fn good(format: &str, name: &str) -> Arc<Mesh> {
    let path = folder(format).join("good").join(name);
    mesh(&std::fs::read(&path).expect("a readable file"), &path)
}

/// Returns the volume of a closed mesh whose front is outside.
fn volume(mesh: &Mesh) -> f32 {
    let p = |i: u32| Vec3::from_array(mesh.positions[i as usize]);
    mesh.triangles.iter().map(|&[a, b, c]| p(a).cross(p(b)).dot(p(c))).sum::<f32>() / 6.0
}

/// Returns twice the area of each triangle, as seen along −z; negative for back faces.
fn areas_along_z(mesh: &Mesh) -> Vec<f32> {
    let p = |i: u32| Vec3::from_array(mesh.positions[i as usize]);
    mesh.triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)).z).collect()
}

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("ply", "ply");
    check_bad_files("stl", "stl");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("ply", "ply");
    check_good_files("stl", "stl");
}

#[test]
fn damaged_files_do_no_harm() {
    check_robustness("ply", "ply", 20_000);
    check_robustness("stl", "stl", 20_000);
}

/// The tetrahedron of the axes has a volume of 1/6, the prism below it 1, the cube 8.
#[test]
fn closed_meshes_have_their_volumes() {
    let files = [
        ("ply", "tetrahedron.ply", 1.0 / 6.0),
        ("ply", "faces_first.ply", 1.0 / 6.0),
        ("ply", "lines_left_out.ply", 1.0 / 6.0),
        ("ply", "strips.ply", 1.0 / 6.0),
        ("ply", "prism_text.ply", 1.0),
        ("ply", "prism_little.ply", 1.0),
        ("ply", "prism_big.ply", 1.0),
        ("obj", "relative.obj", 1.0 / 6.0),
        ("obj", "cube.obj", 8.0),
        ("stl", "tetrahedron.stl", 1.0 / 6.0),
        ("stl", "solid_binary.stl", 1.0 / 6.0),
    ];
    for (format, name, expected) in files {
        let mesh = good(format, name);
        assert!((volume(&mesh) - expected).abs() < 1e-6, "{name}: {}", volume(&mesh));
    }
}

#[test]
fn all_encodings_of_ply_give_the_same_mesh() {
    let text = good("ply", "prism_text.ply");
    let rest = |mesh: &Mesh| Mesh { name: String::new(), ..mesh.clone() };
    for name in ["prism_little.ply", "prism_big.ply"] {
        assert_eq!(rest(&good("ply", name)), rest(&text));
    }
    let normals = text.normals.as_ref().expect("normals");
    assert!(normals.values.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    let uvs = text.uvs.as_ref().expect("texture coordinates");
    assert!(text.positions.iter().zip(&uvs.values).all(|(p, uv)| p[..2] == *uv));
}

/// The list is the same for any number of threads: the first thousand errors, a hundred of which
/// are displayed, and a message that there are too many.
#[test]
fn of_very_many_faults_the_first_ones_are_reported() {
    let [mut binary, text] = stl_files(&sheet(180));
    for row in binary[84..].chunks_exact_mut(50).skip(7).step_by(2) {
        row[12..16].copy_from_slice(&f32::INFINITY.to_le_bytes());
    }
    let text = String::from_utf8(text).expect("a text").replace("vertex 9", "vertex x");
    let obj = large_obj(200).replace("f -", "f x").replace(" v 7", "v y");
    let ply = colored_grid(130, Some(true), |i, p| p[i % 2] /= if i > 9000 { 0.0 } else { 1.0 });
    let ascii = String::from_utf8(colored_grid(130, None, |_, _| {})).expect("a text");
    let ascii = ascii.replace(" 3 1", " 3 99999");
    for (bytes, name) in [
        (&binary[..], "a.stl"),
        (text.as_bytes(), "b.stl"),
        (obj.as_bytes(), "c.obj"),
        (&ply, "d.ply"),
        (ascii.as_bytes(), "e.ply"),
    ] {
        let reported = |threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let error = pool.install(|| parse(bytes, Path::new(name))).expect_err("faults");
            (error.each().iter().map(ToString::to_string).collect::<Vec<_>>(), error.to_string())
        };
        let (each, shown) = reported(1);
        assert_eq!(each.len(), 1001, "{name}");
        let last = format!("{name}: too many errors; the rest of the scene is not read");
        assert!(each.contains(&last), "{}", each[1000]);
        assert!(shown.ends_with("\n… and 901 more"), "{shown}");
        let lines = each.iter().filter_map(|e| e.split(':').nth(1)?.parse::<u32>().ok());
        assert!(lines.is_sorted(), "{name}");
        assert_eq!((each, shown), reported(3), "{name}");
    }
}

/// As a part of a scene, a file with errors counts as missing; the message has its first error and
/// location.
#[test]
fn meshes_with_errors_are_missing_in_scenes_with_the_first_one() {
    let text = r#"<scene version="3.0.0">
        <shape type="sphere"/>
        <shape type="obj"><string name="filename" value="many.obj"/></shape>
    </scene>"#;
    let path = folder("obj").join("bad").join("scene.xml");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    let [missing] = &scene.missing[..] else { panic!("{:?}", scene.missing) };
    let end = "many.obj:3:5: found \"zero\", expected a finite number such as 0.5; 12 more errors \
               in this file, listed by `pathtracer check`; the shape is omitted";
    assert!(missing.message.ends_with(end), "{missing}");
    assert_eq!(scene.objects.len(), 1);
}

/// An arrow head: of the two ways to triangulate it, one leaves it.
#[test]
fn concave_polygons_are_cut_inside() {
    for mesh in [good("ply", "arrow.ply"), good("obj", "arrow.obj")] {
        let areas = areas_along_z(&mesh);
        assert!(areas.len() == 2 && areas.iter().all(|a| *a > 0.0), "{areas:?}");
    }
}

#[test]
fn corners_of_obj_have_indices_of_their_own() {
    let mesh = good("obj", "cube.obj");
    let normals = mesh.normals.as_ref().expect("normals");
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    assert_eq!((mesh.positions.len(), normals.values.len(), uvs.values.len()), (8, 6, 4));
    for (i, &corners) in mesh.triangles.iter().enumerate() {
        let p = corners.map(|c| Vec3::from_array(mesh.positions[c as usize]));
        let flat = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        for normal in normals.corners(i, corners) {
            assert_eq!(Vec3::from_array(normals.values[normal as usize]), flat);
        }
        let uv = uvs.corners(i, corners).map(|c| uvs.values[c as usize]);
        let [a, b] = [1, 2].map(|k| [uv[k][0] - uv[0][0], uv[k][1] - uv[0][1]]);
        assert_eq!(a[0] * b[1] - a[1] * b[0], 1.0, "half of the unit square");
    }
}

/// Returns a regular grid of n × n squares in the xy plane.
fn grid(n: usize) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let point = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| [j as f32, i as f32, 0.5]));
    let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    (positions.collect(), triangles.collect())
}

#[test]
fn large_meshes_come_back_as_they_were_written() {
    let (positions, triangles) = grid(60);
    let mut obj = String::new();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty \
         float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    for [x, y, z] in &positions {
        writeln!(obj, "v {x} {y} {z}").expect("memory");
        writeln!(ply, "{x} {y} {z}").expect("memory");
    }
    for [a, b, c] in &triangles {
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).expect("memory");
        writeln!(ply, "3 {a} {b} {c}").expect("memory");
    }
    for (text, name) in [(obj, "grid.obj"), (ply, "grid.ply")] {
        let mesh = mesh(text.as_bytes(), Path::new(name));
        assert_eq!(mesh.name, "grid");
        assert!(mesh.positions == positions && mesh.triangles == triangles);
        assert!(mesh.normals.is_none() && mesh.uvs.is_none());
    }
}

/// Creates a PLY file of the grid with normals, colours of vertices and of faces; big-endian
/// (`Some(true)`), little-endian, or a text. `change` may change the numbers of a row.
fn colored_grid(n: usize, is_big: Option<bool>, change: impl Fn(usize, &mut [f32; 3])) -> Vec<u8> {
    let (positions, triangles) = grid(n);
    let encoding = match is_big {
        None => "ascii",
        Some(true) => "binary_big_endian",
        Some(false) => "binary_little_endian",
    };
    let header = format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty float x\nproperty uchar red\n\
         property uchar green\nproperty uchar blue\nproperty double y\nproperty float z\n\
         property short u\nproperty float v\nelement face {}\nproperty float red\n\
         property float green\nproperty float blue\nproperty list uchar int vertex_indices\n\
         property ushort tag\nend_header\n",
        positions.len(),
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    let mut put = |text: String, number: &[u8], last: &str| match is_big {
        None => bytes.extend((text + last).bytes()),
        Some(true) => bytes.extend(number.iter().rev()),
        Some(false) => bytes.extend(number),
    };
    for (i, p) in positions.iter().enumerate() {
        let mut p = *p;
        change(i, &mut p);
        put(p[0].to_string(), &p[0].to_le_bytes(), " ");
        for channel in [i, 2 * i, 3 * i].map(|c| c as u8) {
            put(channel.to_string(), &[channel], " ");
        }
        put(p[1].to_string(), &f64::from(p[1]).to_le_bytes(), " ");
        put(p[2].to_string(), &p[2].to_le_bytes(), " ");
        let u = (i % 100) as i16 - 50;
        put(u.to_string(), &u.to_le_bytes(), " ");
        put(p[0].to_string(), &p[0].to_le_bytes(), "\n");
    }
    for (i, corners) in triangles.iter().enumerate() {
        for channel in [0.25, i as f32, 0.5] {
            put(channel.to_string(), &channel.to_le_bytes(), " ");
        }
        put("3".to_owned(), &[3], " ");
        for corner in corners {
            put(corner.to_string(), &corner.to_le_bytes(), " ");
        }
        put("9".to_owned(), &9_u16.to_le_bytes(), "\n");
    }
    bytes
}

/// Files of many chunks of rows, in all encodings, with one thread and with three.
#[test]
fn large_files_of_ply_are_the_same_in_all_encodings_and_for_any_number_of_threads() {
    let (positions, triangles) = grid(130);
    let read = |threads, bytes: &[u8]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| mesh(bytes, Path::new("grid.ply")))
    };
    let text = read(1, &colored_grid(130, None, |_, _| {}));
    assert!(text.positions == positions && text.triangles == triangles);
    let uvs = &text.uvs.as_ref().expect("texture coordinates").values;
    assert_eq!((uvs[7], uvs[9999]), ([-43.0, 7.0], [49.0, positions[9999][0]]));
    let colors = &text.colors.as_ref().expect("colours").values;
    assert_eq!(colors[9999], [15, 30, 45].map(|c| linear_from_srgb(c as f32 / 255.0)));
    assert_eq!(text.face_colors.as_ref().expect("colours")[33_000], [0.25, 33_000.0, 0.5]);
    for is_big in [None, Some(true), Some(false)] {
        let bytes = colored_grid(130, is_big, |_, _| {});
        assert_eq!(read(1, &bytes), text);
        assert_eq!(read(3, &bytes), text);
    }
}

/// All errors are reported, at any position.
#[test]
fn faults_of_large_files_of_ply_are_reported_by_their_places() {
    let message =
        |bytes: &[u8]| parse(bytes, Path::new("grid.ply")).expect_err("a fault").to_string();
    for is_big in [None, Some(true), Some(false)] {
        let reported = |vertex: usize| {
            let line = is_big.map_or(format!(":{}", 19 + vertex), |_| String::new());
            format!("grid.ply{line}: found a value of vertex {vertex} that is not finite")
        };
        let infinite = colored_grid(130, is_big, |i, p| {
            if i == 9000 || i == 17_000 {
                p[1] = f32::INFINITY;
            }
        });
        assert_eq!(message(&infinite), [9000, 17_000].map(reported).join("\n"));
        let good = colored_grid(130, is_big, |_, _| {});
        if is_big.is_some() {
            let cut = &good[..good.len() - 27 * 1000 - 5];
            let expected =
                "grid.ply: unexpected end of the file in face 32799 of 33800; it may be incomplete";
            assert_eq!(message(cut), expected);
            let mut bad = good.clone();
            let at = bad.len() - 27 * 1000 + 13;
            bad[at..at + 4].copy_from_slice(&[255; 4]);
            assert!(message(&bad).contains("found vertex -1 in face 32800,"), "{}", message(&bad));
        }
    }
}

/// Creates an OBJ file of the grid, with normals for half of its faces, and all notations of
/// corners.
fn large_obj(n: usize) -> String {
    let (positions, triangles) = grid(n);
    let mut text = "# a grid\nvn 0 0 1\n".to_owned();
    let (mut above, mut next) = (0, 0);
    for corners in &triangles {
        let highest = corners.iter().max().map_or(0, |c| *c as usize);
        while above <= highest {
            let [x, y, z] = positions[above];
            writeln!(text, " v {x} {y} {z} # number {above}\r").expect("memory");
            above += 1;
        }
        let [a, b, c] = corners.map(|c| c as usize);
        match next % 3 {
            0 => writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1),
            1 => writeln!(text, "f -{} -{} -{}", above - a, above - b, above - c),
            _ => writeln!(text, "f {}//1 {}//-1 {}//1", a + 1, b + 1, c + 1),
        }
        .expect("memory");
        next += 1;
    }
    text
}

/// Files of many pieces, with one thread and with three.
#[test]
fn large_files_of_obj_are_the_same_for_any_number_of_threads() {
    let (positions, triangles) = grid(200);
    let text = large_obj(200);
    assert!(text.len() > 3 << 19, "{}", text.len());
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let scene = pool.install(|| parse(text.as_bytes(), Path::new("grid.obj")));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        assert!(mesh.positions == positions && mesh.triangles == triangles);
        assert!(mesh.normals.is_none());
        let warnings: Vec<_> = scene.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            warnings,
            ["grid.obj: some corners have no normals; the normals of the others are ignored"]
        );
    }
}

/// Errors of vertices and of faces are reported in order of their lines, and indices refer to items
/// above only.
#[test]
fn faults_of_large_files_of_obj_are_reported_by_their_places() {
    let text = large_obj(200);
    let lines: Vec<&str> = text.lines().collect();
    let with = |changes: &[(usize, &str)]| {
        let mut lines = lines.clone();
        for (line, text) in changes {
            lines[line - 1] = text;
        }
        let error = parse(lines.join("\n").as_bytes(), Path::new("grid.obj"));
        error.expect_err("a fault").to_string()
    };
    let vertex = "grid.obj:90001:5: found \"x\", expected a finite number such as 0.5";
    let face = "grid.obj:90002:5: found \"2x\", expected an index of the vertices above:";
    let both = with(&[(90_002, "f 1 2x 3"), (90_001, "v 0 x 0")]);
    assert!(both.starts_with(&format!("{vertex}\n{face}")), "{both}");
    let both = with(&[(90_002, "f 1 2x 3"), (110_000, "v 0 x 0")]);
    assert!(both.starts_with(face), "{both}");
    assert!(both.contains("\ngrid.obj:110000:5: found \"x\", expected"), "{both}");
    assert_eq!(both.lines().count(), 2, "{both}");
    let later = with(&[(60_000, "f 1 2 40000")]);
    assert!(later.starts_with("grid.obj:60000:7: found \"40000\", expected an index"), "{later}");
}

/// A face of four corners among many of three makes two triangles.
#[test]
fn polygons_in_large_files_of_ply_are_cut() {
    let mut bytes = colored_grid(130, Some(false), |_, _| {});
    let text = String::from_utf8_lossy(&bytes[..600]).replace("face 33800", "face 33801");
    let header = text.find("end_header\n").expect("an end") + 11;
    bytes.splice(..header, text[..header].bytes());
    bytes.extend([0.5_f32, 0.5, 1.0].iter().flat_map(|x| x.to_le_bytes()));
    bytes.push(4);
    bytes.extend([0_i32, 1, 132, 131].iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0, 0]);
    let mesh = mesh(&bytes, Path::new("grid.ply"));
    assert_eq!(mesh.triangles.len(), 33_802);
    assert_eq!(mesh.triangles[33_800..], [[0, 1, 132], [0, 132, 131]]);
    assert_eq!(mesh.face_colors.as_ref().expect("colours")[33_801], [0.5, 0.5, 1.0]);
}

#[test]
fn colours_of_vertices_are_numbers_or_shares() {
    let body = |properties: &str, values: [&str; 3]| {
        let [a, b, c] = values;
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{properties}element face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n3 0 1 2\n"
        );
        parse(text.as_bytes(), Path::new("colours.ply"))
    };
    let of = |kind: &str, names: [&str; 3]| {
        names.map(|name| format!("property {kind} {name}\n")).concat()
    };
    let colors = |properties: &str, values| {
        let scene = body(properties, values).unwrap_or_else(|error| panic!("{error}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        mesh.colors.as_ref().map(|colors| colors.values.clone())
    };
    let (long, short) = (["red", "green", "blue"], ["r", "g", "b"]);
    let expected = Some(vec![[1.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.4, 0.6, 1.0]].into());
    assert_eq!(colors(&of("float", short), ["1 0 0", "0 0.2 0", "0.4 0.6 1"]), expected);
    assert_eq!(colors(&of("double", long), ["1 0 0", "0 0.2 0", "0.4 0.6 1"]), expected);
    // Integers are sRGB levels.
    let expected = expected.map(|all| all.iter().map(|c| c.map(linear_from_srgb)).collect());
    let with_alpha = of("uchar", long) + "property uchar alpha\n";
    assert_eq!(colors(&with_alpha, ["255 0 0 9", "0 51 0 9", "102 153 255 9"]), expected);
    let words = ["65535 0 0", "0 13107 0", "26214 39321 65535"];
    assert_eq!(colors(&of("ushort", long), words), expected);
    assert_eq!(colors(&of("float", ["r", "green", "b"]), ["1 0 0"; 3]), None);
    // An invalid number has no further consequences.
    let properties = of("float", long);
    let scene = body(&properties, ["1 0 0", "1 0 nan", "0 1 0"]).expect("the rest is shown");
    let found = colors(&properties, ["1 0 0", "1 0 nan", "0 1 0"]).expect("colours");
    assert_eq!(found, [[1.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0]]);
    let note = "found a colour of vertex 1 that is not finite; the vertex becomes black";
    assert!(scene.warnings.iter().any(|w| w.message == note), "{:?}", scene.warnings);
    // Signed integers are no colours.
    assert_eq!(colors(&of("int", long), ["1 0 0"; 3]), None);
}

/// Each triangle of a polygon has its colour; triangles of strips have none.
#[test]
fn colours_of_faces_are_those_of_their_triangles() {
    let read = |last: &str| {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
             property float z\nelement face 2\nproperty list uchar int vertex_indices\n\
             property float red\nproperty float green\nproperty float blue\n{last}"
        );
        parse(text.as_bytes(), Path::new("faces.ply"))
    };
    let corners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let faces = "4 0 1 2 3 0.5 0.25 1\n3 0 1 3 1 0 0.5\n";
    let colors = |last: &str| {
        let scene = read(last).unwrap_or_else(|error| panic!("{error}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        mesh.face_colors.clone()
    };
    let (first, second) = ([0.5, 0.25, 1.0], [1.0, 0.0, 0.5]);
    let expected = Some(vec![first, first, second].into());
    assert_eq!(colors(&format!("end_header\n{corners}{faces}")), expected);
    let strip = "element tristrips 1\nproperty list uchar int vertex_indices\nend_header\n";
    assert_eq!(colors(&format!("{strip}{corners}{faces}3 0 1 2\n")), None);
    assert!(read(&format!("end_header\n{corners}3 0 1 2 nan 0 0\n3 0 1 3 1 0 0\n")).is_err());
}

/// Mesh files that are scenes have a material with their colours.
#[test]
fn meshes_by_themselves_are_seen_in_their_colours() {
    let pattern = |text: &str, name: &str| {
        let scene = parse(text.as_bytes(), Path::new(name)).expect("a mesh");
        let material = scene.objects[0].materials[0].map(|m| &scene.materials[m as usize]);
        material.map(|material| match &material.surface {
            Surface::Diffuse(Diffuse { reflectance: Color::Texture(texture), two_sided: true }) => {
                texture.pattern.clone()
            }
            other => panic!("{other:?}"),
        })
    };
    let obj = "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n";
    assert_eq!(pattern(obj, "a.obj"), Some(Pattern::VertexColors));
    assert_eq!(mesh(obj.as_bytes(), Path::new("a.obj")).colors.clone().map(|c| c.values), {
        Some(vec![[1.0, linear_from_srgb(0.5), 0.0], [0.0; 3], [1.0; 3]].into())
    });
    // A weight is no colour, and one vertex with a colour does not make the mesh coloured.
    for plain in
        ["v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"]
    {
        assert_eq!(pattern(plain, "b.obj"), None);
    }
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
               property uchar r\nproperty uchar g\nproperty uchar b\nend_header\n\
               0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n";
    assert_eq!(pattern(ply, "c.ply"), Some(Pattern::FaceColors));
}

/// Memory reserved for the counts in a header is bounded by the bytes that follow.
#[test]
fn counts_in_headers_reserve_no_memory() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty uchar \
                  x\nproperty uchar y\nproperty uchar z\nelement nothing 18446744073709551615\n\
                  element face 18446744073709551615\nproperty list uint uint vertex_indices\n\
                  end_header\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend([7; 3000]);
    let error = parse(&bytes, Path::new("short.ply")).expect_err("too short");
    assert!(error.to_string().contains("end of the file in vertex 1000 of 4000000000"), "{error}");
}

#[test]
fn the_mesh_of_the_peer_scenes_is_the_one_made_by_rule() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/mitsuba/bumpy_sphere.ply");
    let file = mesh(&std::fs::read(path).expect("a readable file"), Path::new(path));
    let made = shapes::bumpy_sphere(50);
    assert_eq!(file.triangles.len(), 50_000);
    assert_eq!((&file.positions, &file.triangles), (&made.positions, &made.triangles));
}

/// Well-known meshes, with the counts of vertices and triangles in their files.
#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn shared_meshes_load() {
    let shared = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes"));
    let meshes = [
        ("obj/spot.obj", 2930, 5856),
        ("obj/suzanne.obj", 507, 968),
        ("obj/teapot.obj", 3644, 6320),
        ("obj/igea.ply", 134_345, 268_686),
        ("mitsuba/common/meshes/bunny.ply", 35_947, 69_451),
        ("mitsuba/common/meshes/teapot.ply", 1177, 2256),
    ];
    for (name, vertices, triangles) in meshes {
        let path: PathBuf = shared.join(name);
        let bytes = std::fs::read(&path).expect("a readable file");
        let mesh = mesh(&bytes, &path);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{name}");
    }
}
