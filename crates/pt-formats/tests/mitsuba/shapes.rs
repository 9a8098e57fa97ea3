//! Shapes of Mitsuba scenes: transforms, normals and texture coordinates. Numbers without a
//! derivation are the results of Mitsuba 3.9 at the same points.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pt_formats::{LoadError, LoadOptions, parse_with};
use pt_math::{DMat3, DVec3};
use pt_scene::{Geometry, Mesh, Object, Scene};

use crate::common::{check_invariants, folder, parse, without_panics};
use crate::refusal;

/// Parses a scene with the given content, whose folder is that of the good files.
fn try_read(content: &str) -> Result<Scene, LoadError> {
    let text = format!("<scene version=\"3.0.0\">{content}</scene>");
    parse(text.as_bytes(), &folder("mitsuba").join("good").join("test.xml"))
}

fn read(content: &str) -> Scene {
    let scene = try_read(content).unwrap_or_else(|error| panic!("{error}"));
    check_invariants(&scene);
    scene
}

fn mesh_of(object: &Object) -> &Arc<Mesh> {
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("{} is no mesh", object.name) };
    mesh
}

/// Properties of an object at a world-space point.
#[derive(Debug)]
struct Surface {
    /// Distance from the point to the triangle.
    distance: f64,
    /// Normal of the front; interpolated if the mesh is smooth.
    normal: DVec3,
    uv: [f64; 2],
}

/// Returns the surface nearest to a point. Mirroring keeps the front of a mesh: normals are
/// transformed by the inverse transpose.
fn surface_at(object: &Object, point: [f64; 3]) -> Surface {
    let mesh = mesh_of(object);
    let local = object.to_world.inverse().transform_point3(DVec3::from_array(point));
    let to_normal = object.to_world.matrix3.inverse().transpose();
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let nearest = mesh.triangles.iter().enumerate().map(|(i, &corners)| {
        let [a, b, c] = corners.map(|c| vector(mesh.positions[c as usize]));
        let flat = (b - a).cross(c - a);
        let weights = DMat3::from_cols(b - a, c - a, flat).inverse() * (local - a);
        let [s, t] = [weights.x.clamp(0.0, 1.0), weights.y.clamp(0.0, 1.0)];
        let found = a + (b - a) * s + (c - a) * t.min(1.0 - s);
        ((found - local).length(), i, [1.0 - s - t, s, t], flat)
    });
    let (_, i, weights, flat) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a triangle");
    let corners = mesh.triangles[i];
    let place =
        |k: usize| object.to_world.transform_point3(vector(mesh.positions[corners[k] as usize]));
    let on_triangle = (0..3).map(|k| place(k) * weights[k]).sum::<DVec3>();
    let smooth = mesh.normals.as_ref().map(|normals| {
        let at = normals.corners(i, corners);
        (0..3).map(|k| vector(normals.values[at[k] as usize]) * weights[k]).sum::<DVec3>()
    });
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    let at = uvs.corners(i, corners).map(|c| uvs.values[c as usize]);
    Surface {
        distance: (on_triangle - DVec3::from_array(point)).length(),
        normal: (to_normal * smooth.unwrap_or(flat)).normalize(),
        uv: [0, 1].map(|axis| (0..3).map(|k| f64::from(at[k][axis]) * weights[k]).sum()),
    }
}

/// Checks that a point is on an object, with this normal and these texture coordinates.
fn check(object: &Object, point: [f64; 3], normal: [f64; 3], uv: [f64; 2]) {
    let found = surface_at(object, point);
    assert!(found.distance < 2e-5, "{point:?}: {found:?}");
    assert!(found.normal.distance(DVec3::from_array(normal)) < 2e-3, "{point:?}: {found:?}");
    for k in 0..2 {
        assert!((found.uv[k] - uv[k]).abs() < 6e-4, "{point:?}: {found:?}, expected {uv:?}");
    }
}

const FLIP: &str = "<boolean name=\"flip_normals\" value=\"true\"/>";
const MIRROR: &str = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";

#[test]
fn rectangles_and_spheres_have_the_texture_coordinates_of_mitsuba() {
    let scene = read("<shape type=\"rectangle\"/>");
    check(&scene.objects[0], [0.5, -0.3, 0.0], [0.0, 0.0, 1.0], [0.75, 0.35]);
    // Texture coordinates of a sphere follow its rotation.
    let scene = read(
        "<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/><transform name=\"to_world\">\
         <scale value=\"3\"/><rotate x=\"1\" angle=\"90\"/><translate y=\"1\"/></transform></shape>",
    );
    let sphere = &scene.objects[0];
    assert_eq!(sphere.geometry, Geometry::Sphere { radius: 6.0 });
    let pole = sphere.to_world.transform_point3(DVec3::Z * 6.0);
    assert!(pole.distance(DVec3::new(0.0, -5.0, 0.0)) < 1e-9, "{pole}");
}

#[test]
fn disks_have_polar_coordinates_and_look_to_z() {
    let up = [0.0, 0.0, 1.0];
    let scene = read("<shape type=\"disk\"/>");
    for (point, uv) in [
        ([0.5, 0.2, 0.0], [0.53852, 0.06056]),
        ([-0.5, 0.2, 0.0], [0.53852, 0.43944]),
        ([-0.5, -0.2, 0.0], [0.53852, 0.56056]),
        ([0.5, -0.2, 0.0], [0.53852, 0.93944]),
    ] {
        check(&scene.objects[0], point, up, uv);
    }
    let scene = read(&format!("<shape type=\"disk\">{MIRROR}</shape>"));
    check(&scene.objects[0], [0.5, 0.2, 0.0], up, [0.53852, 0.43944]);
    let scene = read(&format!("<shape type=\"disk\">{FLIP}</shape>"));
    check(&scene.objects[0], [0.5, 0.2, 0.0], [0.0, 0.0, -1.0], [0.53852, 0.06056]);
}

#[test]
fn cylinders_have_the_frame_of_mitsuba_and_look_outwards() {
    let cylinder = |parameters: &str| {
        let mut scene = read(&format!("<shape type=\"cylinder\">{parameters}</shape>"));
        scene.objects.to_mut().swap_remove(0)
    };
    let side = [0.979_80, 0.2, 0.3];
    let out = [0.979_80, 0.2, 0.0];
    check(&cylinder(""), side, out, [0.032_05, 0.3]);
    check(&cylinder(""), [0.2, -0.979_80, 0.3], [0.2, -0.979_80, 0.0], [0.782_05, 0.3]);
    check(&cylinder(FLIP), side, out.map(|x| -x), [0.032_05, 0.3]);
    check(&cylinder(MIRROR), side, out, [0.467_95, 0.3]);
    check(&cylinder(&format!("{FLIP}{MIRROR}")), side, out.map(|x| -x), [0.467_95, 0.3]);
    let between = |p0: &str, p1: &str| {
        cylinder(&format!(
            "<point name=\"p0\" value=\"{p0}\"/><point name=\"p1\" value=\"{p1}\"/>\
             <float name=\"radius\" value=\"0.5\"/>"
        ))
    };
    let skew = between("1 2 3", "2 4 2");
    for (point, normal, uv) in [
        ([2.047_72, 3.0, 2.5], [0.912_87, -0.365_15, 0.182_57], [0.041_74, 0.591_29]),
        ([1.5, 3.0, 3.047_72], [0.182_57, 0.365_15, 0.912_87], [0.823_79, 0.408_71]),
        ([1.5, 3.866_03, 2.5], [-0.577_35, 0.577_35, 0.577_35], [0.682_77, 0.788_67]),
    ] {
        check(&skew, point, normal, uv);
    }
    let [down, along_y] = [between("0 0 0", "0 0 -2"), between("0 0 0", "0 2 0")];
    check(&down, [0.4899, 0.1, -0.5], [0.9798, 0.2, 0.0], [0.967_95, 0.25]);
    check(&along_y, [0.4899, 0.5, 0.1], [0.9798, 0.0, 0.2], [0.967_95, 0.25]);
    check(&along_y, [0.1, 0.5, 0.4899], [0.2, 0.0, 0.9798], [0.782_05, 0.25]);
    // Stretched, it has elliptical cross-sections with their normals.
    let wide = cylinder("<transform name=\"to_world\"><scale x=\"2\"/></transform>");
    check(&wide, [1.732_05, 0.5, 0.5], [0.654_65, 0.755_93, 0.0], [0.083_33, 0.5]);
}

#[test]
fn round_meshes_are_made_once() {
    let shapes = "<shape type=\"disk\"/><shape type=\"cylinder\"/>";
    let scene = read(&format!("{shapes}{shapes}<shape type=\"disk\">{FLIP}</shape>"));
    let meshes: Vec<_> = scene.objects.iter().map(mesh_of).collect();
    assert!(Arc::ptr_eq(meshes[0], meshes[2]) && Arc::ptr_eq(meshes[1], meshes[3]));
    assert!(!Arc::ptr_eq(meshes[0], meshes[4]));
}

#[test]
fn v_runs_upwards_or_downwards_as_in_mitsuba() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a writable folder");
        format!("<string name=\"filename\" value=\"{}\"/>", path.display())
    };
    let obj = write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    let ply = write(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty float s\nproperty float t\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n\
         3 0 1 2\n",
    );
    for (kind, file, flips, v) in [
        ("obj", &obj, None, 0.4),
        ("obj", &obj, Some(true), 0.4),
        ("obj", &obj, Some(false), 0.6),
        ("ply", &ply, None, 0.6),
        ("ply", &ply, Some(true), 0.4),
        ("ply", &ply, Some(false), 0.6),
    ] {
        let flips = flips.map(|x| format!("<boolean name=\"flip_tex_coords\" value=\"{x}\"/>"));
        let flips = flips.unwrap_or_default();
        let scene = read(&format!("<shape type=\"{kind}\">{file}{flips}</shape>"));
        check(&scene.objects[0], [0.25, 0.6, 0.0], [0.0, 0.0, 1.0], [0.25, v]);
    }
}

// ---- serialized meshes -------------------------------------------------------------------------

/// A serialized mesh of a version: a bent square with the attributes of the flags.
#[derive(Clone, Copy)]
struct Content {
    version: u8,
    flags: u32,
    counts: [u64; 2],
    name: &'static [u8],
    /// Value of the first coordinate.
    first: f32,
    corner: u32,
}

const PLAIN: Content =
    Content { version: 4, flags: 0x1000, counts: [4, 2], name: b"bent\0", first: 0.0, corner: 3 };

impl Content {
    fn unpacked(&self) -> Vec<u8> {
        let mut bytes = self.flags.to_le_bytes().to_vec();
        if self.version == 4 {
            bytes.extend(self.name);
        }
        bytes.extend(self.counts.iter().flat_map(|count| count.to_le_bytes()));
        let mut push = |numbers: &[f32]| {
            for x in numbers {
                if self.flags & 0x2000 == 0 {
                    bytes.extend(x.to_le_bytes());
                } else {
                    bytes.extend(f64::from(*x).to_le_bytes());
                }
            }
        };
        push(&[self.first, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5]);
        for (flag, numbers) in [(1, &[0.0, 1.0, 1.0].repeat(4)), (8, &vec![0.25; 12])] {
            if flag == 8 && self.flags & 2 != 0 {
                push(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
            }
            if self.flags & flag != 0 {
                push(numbers);
            }
        }
        bytes.extend([0, 1, 2, 1, self.corner, 2].iter().flat_map(|i: &u32| i.to_le_bytes()));
        bytes
    }

    fn packed(&self) -> Vec<u8> {
        let mut packed = ZlibEncoder::new(vec![0x1c, 4, self.version, 0], Compression::default());
        packed.write_all(&self.unpacked()).expect("memory");
        packed.finish().expect("memory")
    }
}

/// Writes a file of several meshes.
fn file_of(meshes: &[Content]) -> Vec<u8> {
    let (mut bytes, mut places) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let place = bytes.len();
        match mesh.version {
            3 => places.extend((place as u32).to_le_bytes()),
            _ => places.extend((place as u64).to_le_bytes()),
        }
        bytes.extend(mesh.packed());
    }
    bytes.extend(places);
    bytes.extend((meshes.len() as u32).to_le_bytes());
    bytes
}

/// Reads a serialized mesh through a scene.
fn serialized(bytes: &[u8], parameters: &str) -> Result<Scene, LoadError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.serialized");
    std::fs::write(&path, bytes).expect("a writable folder");
    let text = format!(
        "<scene version=\"3.0.0\"><shape type=\"serialized\"><string name=\"filename\" value=\"{}\"/>\
         {parameters}</shape></scene>",
        path.display()
    );
    let options = LoadOptions { strict: true, ..LoadOptions::default() };
    parse_with(text.as_bytes(), &folder.path().join("test.xml"), &options)
}

const SECOND: &str = "<integer name=\"shape_index\" value=\"1\"/>";

#[test]
fn serialized_meshes_of_both_versions_and_precisions_are_the_same() {
    for version in [3, 4] {
        for flags in [0, 1, 2, 3, 8, 0xb, 0x1b] {
            let single = Content { version, flags: 0x1000 | flags, ..PLAIN };
            let double = Content { version, flags: 0x2000 | flags, ..PLAIN };
            let unsaid = Content { version, flags, ..PLAIN };
            let read = |meshes: &[Content], parameters: &str| {
                let scene = serialized(&file_of(meshes), parameters);
                let scene = scene.unwrap_or_else(|error| panic!("{error}"));
                check_invariants(&scene);
                mesh_of(&scene.objects[0]).as_ref().clone()
            };
            let mesh = read(&[single], "");
            assert_eq!(mesh.name, if version == 4 { "bent" } else { "a" });
            let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
            assert_eq!(mesh.positions, positions);
            assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
            let normals = &mesh.normals.as_ref().expect("normals").values;
            assert_eq!(normals.iter().all(|n| *n == [0.0, 1.0, 1.0]), flags & 1 != 0);
            let uvs = mesh.uvs.as_ref().map(|uvs| uvs.values.to_vec());
            let expected = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
            assert_eq!(uvs, (flags & 2 != 0).then_some(expected));
            for same in [
                read(&[double], ""),
                read(&[unsaid], ""),
                read(&[PLAIN, single, PLAIN].map(|c| Content { version, ..c }), SECOND),
            ] {
                assert_eq!(same, mesh);
            }
            let flat = read(&[single], "<boolean name=\"face_normals\" value=\"true\"/>");
            assert_eq!(flat.normals, None);
        }
    }
}

#[test]
fn wrong_serialized_meshes_are_refused_with_a_reason() {
    let good = file_of(&[PLAIN, PLAIN]);
    let with = |change: Content| file_of(&[change]);
    let patched = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        bytes
    };
    let count_at = good.len() - 4;
    let cases: [(Vec<u8>, &str, &str); 17] = [
        (Vec::new(), "", "too short"),
        (b"ply\nformat".to_vec(), "", "no serialized mesh"),
        (with(Content { version: 5, ..PLAIN }), "", "version 5, expected 3 or 4"),
        (patched(6, 0xff), "", "damaged"),
        (good[..30].to_vec(), "", "may be incomplete"),
        (good.clone(), "<integer name=\"shape_index\" value=\"2\"/>", "no mesh 2; the file has 2"),
        (patched(count_at, 200), SECOND, "damaged table of meshes at the end of the file"),
        (patched(count_at - 1, 1), SECOND, "damaged table of meshes at the end of the file"),
        (patched(count_at - 8, 1), SECOND, "no serialized mesh"),
        (good[..3].to_vec(), SECOND, "too short"),
        (with(Content { counts: [0, 2], ..PLAIN }), "", "0 vertices and 2 triangles, expected"),
        (with(Content { counts: [4, 0], ..PLAIN }), "", "4 vertices and 0 triangles, expected"),
        (with(Content { counts: [4, u64::MAX], ..PLAIN }), "", "exceed 1 GiB"),
        (with(Content { counts: [80_000_000, 2], ..PLAIN }), "", "bytes follow"),
        (with(Content { name: &[b'a'; 2000], ..PLAIN }), "", "longer than 1000 bytes"),
        (with(Content { first: f32::NAN, ..PLAIN }), "", "position of vertex 0 that is not finite"),
        (
            with(Content { corner: 4, ..PLAIN }),
            "",
            "the corners [1, 4, 2] of triangle 1, expected indices of the 4",
        ),
    ];
    for (bytes, parameters, expected) in cases {
        let message = serialized(&bytes, parameters).expect_err(expected).to_string();
        assert!(message.contains(expected) && message.contains("a.serialized"), "{message}");
    }
}

#[test]
fn damaged_serialized_meshes_do_no_harm() {
    without_panics(|| {
        let all = Content { flags: 0x100b, ..PLAIN };
        let good = file_of(&[PLAIN, all]);
        let begins = |length: usize| serialized(&good[..length], "").is_ok();
        let first = PLAIN.packed().len();
        // The first mesh needs nothing after it except a checksum, which is not verified.
        assert!(!begins(first - 12) && begins(first) && begins(good.len()));
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize
        };
        let mut read = 0;
        for round in 0..4000 {
            // Damage before and after compression.
            let mut unpacked = all.unpacked();
            let mut bytes = if round % 2 == 0 {
                let at = next() % unpacked.len();
                unpacked[at] = next() as u8;
                let mut packed = ZlibEncoder::new(vec![0x1c, 4, 4, 0], Compression::fast());
                packed.write_all(&unpacked).expect("memory");
                packed.finish().expect("memory")
            } else {
                let mut bytes = good.clone();
                let at = next() % bytes.len();
                bytes[at] = next() as u8;
                bytes
            };
            if round % 5 == 0 {
                bytes.truncate(next() % bytes.len());
            }
            if let Ok(scene) = serialized(&bytes, if round % 4 == 1 { SECOND } else { "" }) {
                check_invariants(&scene);
                read += 1;
            }
        }
        assert!((400..3600).contains(&read), "{read} were read");
    });
}

#[test]
fn the_serialized_meshes_of_the_peer_scene_are_those_made_by_rule() {
    let path =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/mitsuba/bumpy_spheres.serialized");
    let bytes = std::fs::read(path).expect("a readable file");
    for (parameters, subdivision) in [("", 8), (SECOND, 12)] {
        let scene = serialized(&bytes, parameters).unwrap_or_else(|error| panic!("{error}"));
        let (file, made) =
            (mesh_of(&scene.objects[0]), pt_scene::shapes::bumpy_sphere(subdivision));
        assert_eq!((&file.positions, &file.triangles), (&made.positions, &made.triangles));
    }
}

/// A file that Mitsuba 0.x wrote, with its counts of vertices and triangles.
#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn the_shared_serialized_meshes_load() {
    let path = Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/scenes/mitsuba/common/meshes/matpreview.serialized"
    ));
    let bytes = std::fs::read(path).expect("a readable file");
    for (index, counts) in [(0, (289, 512)), (1, (2078, 3936)), (2, (29_439, 57_152))] {
        let parameters = format!("<integer name=\"shape_index\" value=\"{index}\"/>");
        let scene = serialized(&bytes, &parameters).unwrap_or_else(|error| panic!("{error}"));
        let mesh = mesh_of(&scene.objects[0]);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), counts);
    }
}

// ---- instances ---------------------------------------------------------------------------------

#[test]
fn instances_share_meshes_and_materials_and_compose_transforms() {
    let scene = read(
        "<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\" id=\"box\">\
         <transform name=\"to_world\"><translate x=\"1\"/></transform><bsdf type=\"dielectric\"/>\
         </shape><shape type=\"disk\"/></shape>\
         <shape type=\"instance\" id=\"one\"><ref id=\"g\"/></shape>\
         <shape type=\"instance\" id=\"two\"><transform name=\"to_world\"><scale value=\"2\"/>\
         </transform><ref id=\"g\"/></shape>",
    );
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["box of one", "disk of one", "box of two", "disk of two"]);
    assert!(Arc::ptr_eq(mesh_of(&scene.objects[0]), mesh_of(&scene.objects[2])));
    assert_eq!(scene.objects[0].materials, scene.objects[2].materials);
    assert_eq!(scene.materials.len(), 2);
    let corner = DVec3::new(-1.0, 1.0, 1.0);
    assert_eq!(scene.objects[0].to_world.transform_point3(corner), DVec3::new(0.0, 1.0, 1.0));
    assert_eq!(scene.objects[2].to_world.transform_point3(corner), DVec3::new(0.0, 2.0, 2.0));
}

#[test]
fn groups_are_not_seen_by_themselves_and_may_be_empty_or_written_later() {
    let instance = "<shape type=\"instance\"><ref id=\"g\"/></shape>";
    let group = |content: &str| format!("<shape type=\"shapegroup\" id=\"g\">{content}</shape>");
    let cube = group("<shape type=\"cube\"/>");
    assert_eq!(read(&cube).objects.len(), 0);
    assert_eq!(read(&format!("{}{instance}", group(""))).objects.len(), 0);
    assert_eq!(read(&format!("{instance}{cube}{instance}")).objects.len(), 2);
    // Errors in a group that is not instanced are reported.
    assert!(try_read(&group("<shape type=\"cone\"/>")).is_err());
}

/// In Mitsuba, the transform of an instance keeps the front of all its meshes, while a mesh outside
/// of a group whose file has no normals is flipped by a mirroring transform.
#[test]
fn mirrored_instances_keep_the_fronts_of_their_meshes() {
    let file = "<string name=\"filename\" value=\"parts/tetrahedron.obj\"/>";
    let mesh = format!("<shape type=\"obj\">{file}</shape>");
    let scene = read(&format!(
        "{mesh}<shape type=\"shapegroup\" id=\"g\">{mesh}</shape><shape type=\"instance\">\
         <ref id=\"g\"/>{MIRROR}</shape>"
    ));
    assert_eq!(mesh_of(&scene.objects[0]), mesh_of(&scene.objects[1]));
    assert!(scene.objects[1].to_world.matrix3.determinant() < 0.0);
}

#[test]
fn few_lines_cannot_ask_for_any_number_of_shapes() {
    let many = |text: &str, count: usize| text.repeat(count);
    let group = |content: &str| format!("<shape type=\"shapegroup\" id=\"g\">{content}</shape>");
    let instance = "<shape type=\"instance\"><ref id=\"g\"/></shape>";
    let spheres = group(&many("<shape type=\"sphere\"/>", 1500));
    let error = try_read(&format!("{spheres}{}", many(instance, 700))).expect_err("too many");
    assert!(error.to_string().contains("number of shapes exceeds 1000000"), "{error}");
}

/// Two triangles that meet at an edge, in the file `fold.obj`, with n₁ = (0, 0, 1) and n₂ =
/// (1, 0, 0) in the coordinates of the file, also after a scale along the axes. In the world, the
/// angles at the vertex (0, 0, 0) are atan(a / b): of the first triangle with the corner (−1, 0, 0)
/// scaled by x, and of the second with (0, 0, −1) scaled by z, and the edge to (0, 1, 0) scaled by
/// y. They are right angles there; at (0, 1, 0), they are atan(x / y) and atan(z / y).
#[test]
fn smooth_normals_are_made_in_the_world() {
    let normal = |steps: &str, scale: DVec3| {
        let scene = read(&format!(
            "<shape type=\"obj\"><string name=\"filename\" value=\"fold.obj\"/>\
             <transform name=\"to_world\">{steps}</transform></shape>"
        ));
        let object = &scene.objects[0];
        let mesh = mesh_of(object);
        let at = mesh.positions.iter().position(|p| *p == [0.0, 1.0, 0.0]).expect("the vertex");
        let local = mesh.normals.as_ref().expect("smooth normals").values[at];
        let inverse = object.to_world.matrix3.inverse().transpose();
        let world = (inverse * DVec3::from_array(local.map(f64::from))).normalize();
        let [first, second] = [scale.x, scale.z].map(|side| f64::atan(side / scale.y));
        let sum = DVec3::new(second, 0.0, first);
        assert!(world.distance(sum.normalize()) < 1e-6, "{steps}: {world} is not {sum}");
        world
    };
    normal("", DVec3::ONE);
    normal("<scale value=\"3\"/>", DVec3::splat(3.0));
    let stretched = normal("<scale x=\"3\" z=\"0.5\"/>", DVec3::new(3.0, 1.0, 0.5));
    // In the coordinates of the file both angles are equal, and the inverse transpose of (1, 0, 1)
    // is (1 / 3, 0, 2).
    assert!(stretched.distance(DVec3::new(1.0 / 3.0, 0.0, 2.0).normalize()) > 0.1, "{stretched}");
}

/// The normals of a mirrored mesh are computed from the mirrored triangles, which face the other
/// way, as in Mitsuba.
#[test]
fn smooth_normals_of_mirrored_meshes_follow_their_triangles() {
    let scene = read(
        "<shape type=\"obj\"><string name=\"filename\" value=\"fold.obj\"/>\
         <transform name=\"to_world\"><scale x=\"-3\" z=\"0.5\"/></transform></shape>",
    );
    let object = &scene.objects[0];
    let mesh = mesh_of(object);
    let at = mesh.positions.iter().position(|p| *p == [0.0, 1.0, 0.0]).expect("the vertex");
    let local = mesh.normals.as_ref().expect("smooth normals").values[at];
    let inverse = object.to_world.matrix3.inverse().transpose();
    let world = (inverse * DVec3::from_array(local.map(f64::from))).normalize();
    // Triangles in the world: the corners (3, 0, 0), (0, 1, 0) face along -z, the other along +x.
    let [first, second] = [3.0, 0.5_f64].map(f64::atan);
    let expected = DVec3::new(second, 0.0, -first).normalize();
    assert!(world.distance(expected) < 1e-6, "{world} is not {expected}");
}

/// Radii are three standard deviations, whose logarithms are in the file; 45° of a quaternion are a
/// quarter turn. With adaptive clamping, a radius is √(2 ln(opacity / 0.01)) standard deviations,
/// and splats with an opacity below 0.01 are omitted.
#[test]
fn splats_are_ellipsoids() {
    let shape = |kind: &str, inside: &str| {
        format!(
            "<shape type=\"{kind}\"><string name=\"filename\" value=\"parts/splats.ply\"/>{inside}</shape>"
        )
    };
    let radii = |object: &pt_scene::Object| {
        let axes = object.to_world.matrix3;
        [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()]
    };
    let close = |got: [f64; 3], want: [f64; 3]| {
        got.iter().zip(want).all(|(a, b)| (a / b - 1.0).abs() < 1e-6)
    };
    let scene = read(&shape("ellipsoids", ""));
    let [first, turned, thin] = scene.objects.as_slice() else { panic!("three ellipsoids") };
    assert!(close(radii(first), [3.0, 6.0, 1.5]));
    assert_eq!(first.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    let axis = turned.to_world.matrix3.x_axis;
    assert!((axis - DVec3::new(0.0, 3.0, 0.0)).length() < 1e-5, "{axis}");
    assert!(close(radii(thin), [3e-6, 3.0, 3.0]));
    // Of a transform, the rotation and the mean scale are used.
    let inside = "<transform name=\"to_world\"><scale x=\"1\" y=\"2\" z=\"6\"/><translate x=\"5\"/></transform>\
                  <float name=\"extent\" value=\"1\"/><float name=\"scale_factor\" value=\"2\"/>";
    let scene = read(&shape("ellipsoids", inside));
    assert!(close(radii(&scene.objects[0]), [6.0, 12.0, 3.0]));
    assert_eq!(scene.objects[0].to_world.translation, DVec3::new(6.0, 4.0, 18.0));
    let fading = "<boolean name=\"extent_adaptive_clamping\" value=\"true\"/>";
    let scene = read(&shape("ellipsoidsmesh", fading));
    assert_eq!(scene.objects.len(), 2, "the third has an opacity of 0.0067");
    let half = (2.0 * f64::ln(0.5 / 0.01)).sqrt();
    assert!(close(radii(&scene.objects[0]), [half, 2.0 * half, 0.5 * half]));
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("a mesh") };
    assert_eq!((mesh.triangles.len(), mesh.normals.is_none()), (20, true));
    let inner = "<shape type=\"cube\" name=\"shell\"><transform name=\"to_world\"><scale value=\"7\"/></transform></shape>";
    let scene = read(&shape("ellipsoidsmesh", inner));
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("a mesh") };
    let corner = f64::from(mesh.positions[0][0].abs());
    assert!((corner - 3.0 / 11f64.sqrt()).abs() < 1e-6, "the middles of triangles touch: {corner}");
    let message = refusal(&shape("ellipsoidsmesh", "<string name=\"shell\" value=\"cone\"/>"));
    assert!(message.contains("unknown shell \"cone\""), "{message}");
}
