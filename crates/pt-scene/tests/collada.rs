//! The COLLADA reader: good files mean what they say, bad files are refused with a helpful
//! message, and nothing makes it panic or take more than its share of time and memory.
//!
//! The files lie in `tests/formats/collada`. Beside each bad file stands its error, beside a good
//! one its warnings, if it has any. `PT_WRITE_EXPECTED=1 cargo test` writes those anew; read the
//! difference before keeping it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::format::collada::parse;
use pt_scene::{Geometry, LightKind, LoadError, Mesh, Scene, Surface};

const FILES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/collada");
const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/dae");

/// All `.dae` files of a folder, in order.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(Path::new(FILES).join(folder)).expect("the folder exists");
    let mut files: Vec<_> = entries.map(|e| e.expect("a readable entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "dae"));
    files.sort();
    assert!(!files.is_empty());
    files
}

fn good_text(name: &str) -> String {
    let path = Path::new(FILES).join("good").join(name);
    std::fs::read_to_string(path).expect("the file exists")
}

fn read(text: &str) -> Result<Scene, LoadError> {
    parse(text.as_bytes(), Path::new("scene.dae"))
}

fn good(name: &str) -> Scene {
    read(&good_text(name)).expect("a good file")
}

fn meshes(scene: &Scene) -> BTreeMap<&str, &Arc<Mesh>> {
    let mesh_of = |o: &'_ pt_scene::Object| match &o.geometry {
        Geometry::Mesh(_) => true,
        Geometry::Sphere { .. } => false,
    };
    let objects = scene.objects.iter().filter(|o| mesh_of(o));
    objects
        .filter_map(|o| match &o.geometry {
            Geometry::Mesh(mesh) => Some((o.name.as_str(), mesh)),
            Geometry::Sphere { .. } => None,
        })
        .collect()
}

/// Compares a text with the file that has its place, or writes that file if asked to.
fn check_expected(file: &Path, found: &str) {
    let expected = file.with_extension("expected");
    if std::env::var_os("PT_WRITE_EXPECTED").is_some() {
        if found.is_empty() {
            std::fs::remove_file(&expected).ok();
        } else {
            std::fs::write(&expected, found).expect("a writable folder");
        }
    }
    let wanted = std::fs::read_to_string(&expected).unwrap_or_default();
    assert_eq!(found, wanted, "{}", file.display());
}

fn name_of(file: &Path) -> &Path {
    Path::new(file.file_name().expect("a file"))
}

// ---- messages ----------------------------------------------------------------------------------

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    for file in files("bad") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let error = parse(&bytes, name_of(&file)).expect_err("a bad file");
        check_expected(&file, &format!("{error}\n"));
    }
}

#[test]
fn good_files_give_the_expected_warnings() {
    for file in files("good") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let scene = parse(&bytes, name_of(&file)).expect("a good file");
        let warnings: String = scene.warnings.iter().map(|w| format!("{w}\n")).collect();
        check_expected(&file, &warnings);
    }
}

#[test]
fn unknown_endings_name_the_known_ones() {
    let error = pt_scene::format::load(Path::new("scene.blend")).expect_err("no such format");
    assert!(error.to_string().contains(".dae"), "{error}");
}

// ---- placement ---------------------------------------------------------------------------------

/// A map from the images of the axes and of the origin.
fn map(x: [f64; 3], y: [f64; 3], z: [f64; 3], origin: [f64; 3]) -> DAffine3 {
    DAffine3::from_cols(x.into(), y.into(), z.into(), origin.into())
}

/// What each kind of transform does to the axes and the origin, worked out by hand.
#[test]
fn transforms_are_what_they_say_and_apply_from_the_last_to_the_first() {
    let (x, y, z, o) = ([1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0., 0., 0.]);
    let expected = [
        ("none", map(x, y, z, o)),
        ("matrix", map([1., 5., 9.], [2., 6., 10.], [3., 7., 12.], [4., 8., 13.])),
        ("matrix over 2", map(x, y, z, [3., 4., 5.])),
        ("translate", map(x, y, z, [1., 2., 3.])),
        ("scale", map([2., 0., 0.], [0., 3., 0.], [0., 0., 4.], o)),
        ("rotate", map(y, [-1., 0., 0.], z, o)),
        ("rotate 120", map(y, z, x, o)),
        // −450° about y is −90°: x goes to z, z to −x.
        ("rotate back", map(z, y, [-1., 0., 0.], o)),
        // From (1, 2, 3) along +x: −z becomes x, so z becomes −x, and x becomes y × z = z.
        ("lookat", map(z, y, [-1., 0., 0.], [1., 2., 3.])),
        // y turns by 45° towards x, along x.
        ("skew", map(x, [1., 1., 0.], z, o)),
        // Scaled first, then turned, then moved.
        ("order", map([0., 2., 0.], [-1., 0., 0.], z, [10., 0., 0.])),
        ("late", map(x, y, z, [7., 0., 0.])),
        ("nested", map(y, [-1., 0., 0.], z, [10., 1., 0.])),
        ("nested", map(y, [-1., 0., 0.], z, [10., 1., 0.])),
        ("pair", map(x, y, z, [0., 4., 5.])),
        ("second of pair", map(x, y, z, [1., 4., 5.])),
        ("ball", map(x, y, z, o)),
    ];
    let scene = good("transforms.dae");
    let names: Vec<_> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, expected.map(|(name, _)| name));
    for (object, (name, to_world)) in scene.objects.iter().zip(expected) {
        assert!(object.to_world.abs_diff_eq(to_world, 1e-15), "{name}: {:?}", object.to_world);
    }
}

/// A skew makes the first axis parallel to its own rotation towards the second.
#[test]
fn skew_turns_its_first_axis() {
    let text = good_text("transforms.dae");
    for (degrees, a, b) in [
        (20.0, DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.2)),
        (-35.0, DVec3::new(0.3, 1.0, 0.0), DVec3::new(1.0, 0.2, 0.0)),
    ] {
        let skew = format!("<skew>{degrees} {} {} {} {} {} {}</skew>", a.x, a.y, a.z, b.x, b.y, b.z);
        let scene = read(&text.replace("<skew>45  0 1 0  1 0 0</skew>", &skew)).expect("good");
        let object = scene.objects.iter().find(|o| o.name == "skew").expect("the skewed object");
        let turned = object.to_world.transform_vector3(a);
        let found = turned.angle_between(a).to_degrees();
        assert!((found - f64::abs(degrees)).abs() < 1e-9, "{found}");
        assert_eq!(turned.dot(b) > a.dot(b), degrees > 0.0);
        let normal = a.cross(b);
        assert!(turned.dot(normal).abs() < 1e-12 * normal.length() * turned.length());
        assert!(object.to_world.transform_vector3(b).abs_diff_eq(b, 1e-15));
        assert!((object.to_world.matrix3.determinant() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn the_axis_that_is_up_becomes_y() {
    let text = good_text("up_axis.dae");
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (name, columns) in [
        ("X_UP", DMat3::from_cols(y, x, -z)),
        ("Y_UP", DMat3::IDENTITY),
        ("Z_UP", DMat3::from_cols(-x, z, y)),
    ] {
        let scene = read(&text.replace("Z_UP", name)).expect("a good file");
        let to_world = DAffine3 { matrix3: columns, translation: columns * DVec3::new(1., 2., 3.) };
        assert_eq!(scene.objects[0].to_world, to_world, "{name}");
        assert_eq!(scene.lights[0].to_world, to_world, "{name}");
        assert_eq!(scene.cameras[0].to_world, to_world, "{name}");
        assert_eq!(scene.objects[0].geometry, Geometry::Sphere { radius: 2.5 });
        assert_eq!(scene.metres_per_unit, 0.0254);
        assert!((columns.determinant() - 1.0).abs() < 1e-15, "{name} would mirror the scene");
    }
}

#[test]
fn skins_and_morphs_show_the_mesh_as_it_was_bound() {
    let scene = good("skin.dae");
    let object = &scene.objects[0];
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(2.0)),
        translation: DVec3::new(1.0, 0.0, 0.0),
    };
    assert_eq!((object.name.as_str(), object.to_world), ("hero", to_world));
    assert_eq!(object.materials, [Some(0)]);
}

// ---- meshes ------------------------------------------------------------------------------------

#[test]
fn all_kinds_of_primitives_become_triangles() {
    let scene = good("primitives.dae");
    let mesh = meshes(&scene)["Kinds 1"].clone();
    let expected: &[&[[u32; 3]]] = &[
        &[[0, 1, 5], [1, 2, 5], [2, 3, 5]],
        &[[0, 1, 3], [3, 1, 2], [0, 1, 4], [4, 2, 3]],
        &[[4, 0, 1], [4, 1, 2], [4, 2, 3]],
        // The last polygon, 0 1 2 4, is concave at 4, so it is cut from 4 to 1.
        &[[0, 1, 2], [0, 1, 2], [0, 2, 3], [4, 0, 1], [4, 1, 2]],
    ];
    let start: Vec<_> = expected.iter().flat_map(|part| part.iter().copied()).collect();
    assert_eq!(mesh.triangles[..start.len()], start);
    let slots: Vec<_> = mesh.parts.iter().map(|p| (p.triangles.clone(), p.slot)).collect();
    assert_eq!(slots, [(0..3, 0), (3..7, 1), (7..10, 2), (10..15, 0), (15..19, 3)]);
    assert_eq!(mesh.name, "Kinds");
    assert_eq!((&mesh.normals, &mesh.uvs), (&None, &None));
}

#[test]
fn strips_fans_and_polygons_face_the_same_way() {
    let scene = good("primitives.dae");
    let mesh = &meshes(&scene)["Kinds 1"];
    for (i, triangle) in mesh.triangles.iter().enumerate().skip(3) {
        let [a, b, c] = triangle.map(|i| DVec3::from(mesh.positions[i as usize].map(f64::from)));
        assert!((b - a).cross(c - a).z > 0.0, "triangle {i} {triangle:?}");
    }
}

#[test]
fn materials_go_to_the_slots_of_their_symbols_and_meshes_are_shared() {
    let scene = good("primitives.dae");
    let names = |object: usize| {
        let materials = scene.objects[object].materials.iter();
        let name = |m: Option<u32>| m.map(|m| scene.materials[m as usize].name.as_str());
        materials.map(|m| name(*m)).collect::<Vec<_>>()
    };
    // The slots are a, b, c and none; c is not bound, and none takes the first binding.
    assert_eq!(names(0), [Some("Red"), Some("Blue"), None, Some("Blue")]);
    assert_eq!(names(1), [None; 4]);
    let (Geometry::Mesh(first), Geometry::Mesh(second)) =
        (&scene.objects[0].geometry, &scene.objects[1].geometry)
    else {
        panic!("both are meshes")
    };
    assert!(Arc::ptr_eq(first, second));
}

#[test]
fn inputs_may_share_offsets_and_accessors_may_skip_numbers() {
    let scene = good("primitives.dae");
    let mesh = meshes(&scene)["Inputs"].clone();
    assert_eq!(mesh.positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 1]]);
    let normals = mesh.normals.as_ref().expect("normals");
    // The second triangle has none; it gets that of its plane, which faces −z.
    assert_eq!(normals.values, [[0., 0., 1.], [0., 0., 2.], [0., 0., -1.]]);
    assert_eq!(normals.indices.as_deref(), Some(&[[1, 0, 1], [2, 2, 2]][..]));
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    assert_eq!(uvs.values, [[0., 0.], [1., 0.], [0., 1.], [0., 0.]]);
    assert_eq!(uvs.indices.as_deref(), Some(&[[0, 1, 2], [3, 3, 3]][..]));
}

#[test]
fn normals_of_vertices_need_no_indices() {
    let scene = good("primitives.dae");
    let normals = meshes(&scene)["Smooth"].normals.clone().expect("normals");
    assert_eq!(normals.values, [[0., 0., 1.], [0., 0., 1.], [0., 0., 0.]]);
    assert_eq!(normals.indices, None);
}

// ---- materials, lights, cameras ----------------------------------------------------------------

/// The material of each object, by name, in short.
fn materials_in_short(scene: &Scene) -> BTreeMap<&str, String> {
    let in_short = |object: &pt_scene::Object| {
        let Some(index) = object.materials[0] else { return "default".to_owned() };
        let material = &scene.materials[index as usize];
        let surface = match &material.surface {
            Surface::Matte(m) => format!("matte {:?}", m.reflectance),
            Surface::Mirror(m) => format!("mirror {:?}", m.reflectance),
            Surface::Glass(m) => format!("glass {:?} {:?} {}", m.reflectance, m.transmittance, m.ior),
            Surface::Refraction(m) => format!("refraction {:?} {}", m.transmittance, m.ior),
            Surface::Conductor(m) => format!("conductor {:?} {:?} {}", m.eta, m.k, m.alpha),
            Surface::Plastic(m) => format!("plastic {:?} {:?} {}", m.diffuse, m.specular, m.alpha),
            Surface::Black(_) => "black".to_owned(),
        };
        match material.emission {
            [0.0, 0.0, 0.0] => surface,
            emission => format!("{surface}, emits {emission:?}"),
        }
    };
    scene.objects.iter().map(|o| (o.name.as_str(), in_short(o))).collect()
}

#[test]
fn effects_of_the_common_profile_become_the_nearest_material() {
    let scene = good("materials_common.dae");
    let matte = "matte [0.1, 0.2, 0.3]";
    let expected = [
        ("lambert", matte),
        ("no-diffuse", "matte [0.5, 0.5, 0.5]"),
        // α = √(2/(48 + 2)) = 0.2
        ("phong", "plastic [0.1, 0.2, 0.3] [0.5, 0.5, 0.5] 0.2"),
        ("dull", matte),
        ("blinn", "plastic [0.1, 0.2, 0.3] [0.2, 0.2, 0.2] 1"),
        ("constant", "black, emits [1.0, 2.0, 3.0]"),
        ("glowing", "matte [0.1, 0.2, 0.3], emits [4.0, 5.0, 6.0]"),
        ("chrome", "mirror [0.45, 0.4, 0.35]"),
        ("varnish", matte),
        ("alpha-glass", "glass [1.0, 1.0, 1.0] [1.0, 1.0, 1.0] 1.33"),
        ("tinted-glass", "glass [1.0, 1.0, 1.0] [1.0, 0.8, 0.6] 1.5"),
        ("rgb-opaque", matte),
        ("alpha-opaque", matte),
        ("half", matte),
        ("a-zero", "glass [1.0, 1.0, 1.0] [1.0, 1.0, 1.0] 1.5"),
        ("rgb-one", "glass [1.0, 1.0, 1.0] [1.0, 1.0, 1.0] 1.5"),
        ("textured", "matte [0.5, 0.5, 0.5]"),
        // α = √(2/(6 + 2)) = 0.5
        ("parameters", "plastic [0.1, 0.2, 0.3] [0.3, 0.3, 0.3] 0.5"),
        ("parameters-set", "plastic [0.7, 0.8, 0.9] [0.3, 0.3, 0.3] 0.5"),
        ("foreign", "matte [0.5, 0.5, 0.5]"),
        ("elsewhere", "default"),
    ];
    let expected: BTreeMap<_, _> = expected.map(|(name, text)| (name, text.to_owned())).into();
    assert_eq!(materials_in_short(&scene), expected);
}

#[test]
fn materials_of_the_course_are_taken_as_they_are() {
    let scene = good("materials_course.dae");
    let matte = "matte [0.1, 0.2, 0.3]";
    let expected = [
        ("emission", "black, emits [10.0, 20.0, 30.0]"),
        ("mirror", "mirror [1.0, 0.8, 0.4]"),
        ("glass", "glass [0.7, 0.6, 0.5] [1.0, 0.9, 0.8] 1.45"),
        ("refraction", "refraction [1.0, 1.0, 0.5] 1.3"),
        ("microfacet", "conductor [0.33228, 1.0162, 1.2474] [3.1646, 2.5785, 2.4603] 0.05"),
        ("diffuse", "matte [0.4, 0.5, 0.6]"),
        ("old-profile", "mirror [0.5, 0.5, 0.5]"),
        ("last-wins", "mirror [0.25, 0.25, 0.25]"),
        ("unknown", matte),
        ("no-reflectance", "mirror [1.0, 1.0, 1.0]"),
        ("other-profile", matte),
    ];
    let expected: BTreeMap<_, _> = expected.map(|(name, text)| (name, text.to_owned())).into();
    assert_eq!(materials_in_short(&scene), expected);
}

#[test]
fn lights_of_all_kinds() {
    let scene = good("lights_cameras.dae");
    let kinds: Vec<_> = scene.lights.iter().map(|l| (l.name.as_str(), l.kind.clone())).collect();
    let color = [1.0, 2.0, 3.0];
    let spot = |falloff_angle, falloff_exponent| LightKind::Spot {
        intensity: color,
        falloff_angle,
        falloff_exponent,
    };
    let expected = [
        ("ambient", LightKind::Hemisphere { radiance: color }),
        ("directional", LightKind::Directional { irradiance: color }),
        ("point", LightKind::Point { intensity: color }),
        ("linear", LightKind::Point { intensity: color }),
        ("spot", spot(45.0, 0.15)),
        ("wide-spot", spot(180.0, 0.0)),
        ("area", LightKind::Area { radiance: [10.0, 11.0, 12.0] }),
        ("channels", LightKind::Point { intensity: [8.0, 4.0, 2.0] }),
        ("colourless", LightKind::Point { intensity: [1.0; 3] }),
        ("only-blender", LightKind::Area { radiance: [4.0, 5.0, 6.0] }),
    ];
    assert_eq!(kinds, expected);
}

/// tan(x/2) = aspect · tan(y/2), for all cameras but the one that gives both angles.
#[test]
fn cameras_get_both_fields_of_view() {
    let scene = good("lights_cameras.dae");
    let half_tangents = |c: &pt_scene::Camera| {
        [c.x_fov, c.y_fov].map(|angle| (angle.to_radians() / 2.0).tan())
    };
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["both", "x and aspect", "y and aspect", "aspect", "x"]);
    let t = |degrees: f64| (degrees.to_radians() / 2.0).tan();
    let expected = [[t(90.), t(60.)], [1.0, 0.5], [0.5, 1.0], [t(50.), t(50.)], [t(60.), t(60.) * 0.75]];
    for (camera, expected) in scene.cameras.iter().zip(expected) {
        let found = half_tangents(camera);
        assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-12), "{camera:?}");
    }
    let distances: Vec<_> = scene.cameras.iter().map(|c| (c.near, c.far)).collect();
    assert_eq!(distances[..3], [(0.5, 20.0), (0.5, 20.0), (0.001, 1000.0)]);
}

// ---- robustness --------------------------------------------------------------------------------

#[test]
fn no_prefix_of_a_good_file_makes_it_panic_or_passes_for_the_whole() {
    for file in files("good") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let end = bytes.trim_ascii_end().len();
        for length in 0..end {
            let result = parse(&bytes[..length], name_of(&file));
            assert!(result.is_err(), "{}: {length} bytes of {end}", file.display());
        }
    }
}

/// A generator for the tests below (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n
    }
}

/// Changes that files suffer: flipped bits, other bytes, missing and repeated pieces, pieces of
/// other files, and numbers that are extreme.
fn damage(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    const NASTY: [&str; 12] = [
        "-1", "4294967295", "18446744073709551615", "1e308", "NaN", "INF", "", "<", "</", "#", "&amp;",
        "é",
    ];
    let at = random.below(bytes.len());
    let end = at + random.below(bytes.len() - at).min(80);
    match random.below(12) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.below(256) as u8,
        2 => drop(bytes.drain(at..end)),
        3 => {
            let piece = bytes[at..end].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        4 => {
            let from = random.below(other.len());
            let piece = &other[from..other.len().min(from + end - at)];
            bytes.splice(at..at, piece.iter().copied());
        }
        _ => {
            let digits = |i: &usize| bytes[*i].is_ascii_digit();
            let start = (at..bytes.len()).find(digits).unwrap_or(at);
            let stop = (start..bytes.len()).find(|i| !digits(i)).unwrap_or(start);
            bytes.splice(start..stop, NASTY[random.below(NASTY.len())].bytes());
        }
    }
}

#[test]
fn no_damage_makes_it_panic() {
    let originals: Vec<_> =
        files("good").iter().map(|f| std::fs::read(f).expect("a readable file")).collect();
    let mut random = Random(0x00C0_11AD_A000_0001);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = originals[random.below(originals.len())].clone();
        let other = &originals[random.below(originals.len())];
        for _ in 0..=random.below(3) {
            damage(&mut bytes, other, &mut random);
            if bytes.is_empty() {
                break;
            }
        }
        match parse(&bytes, Path::new("damaged.dae")) {
            Ok(scene) => {
                check_invariants(&scene);
                read += 1;
            }
            Err(error) => {
                assert!(error.to_string().starts_with("damaged.dae"), "{error}");
                refused += 1;
            }
        }
    }
    // Otherwise the damage would be too strong, or too weak, to reach most of the reader.
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}

/// What whoever takes a scene relies on.
fn check_invariants(scene: &Scene) {
    for object in &scene.objects {
        assert!(object.to_world.is_finite());
        assert!(object.materials.iter().flatten().all(|m| (*m as usize) < scene.materials.len()));
        let Geometry::Mesh(mesh) = &object.geometry else { continue };
        assert!(mesh.positions.iter().flatten().all(|c| c.is_finite()));
        let in_range = |n: usize, t: &[[u32; 3]]| t.iter().flatten().all(|i| (*i as usize) < n);
        assert!(in_range(mesh.positions.len(), &mesh.triangles));
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let within = |n: usize, corners: [u32; 3]| corners.iter().all(|i| (*i as usize) < n);
            let normals = mesh.normals.as_ref();
            assert!(normals.is_none_or(|a| within(a.values.len(), a.corners(i, *triangle))));
            let uvs = mesh.uvs.as_ref();
            assert!(uvs.is_none_or(|a| within(a.values.len(), a.corners(i, *triangle))));
        }
        let mut covered = 0;
        for part in &mesh.parts {
            assert_eq!(part.triangles.start, covered);
            assert!((part.slot as usize) < object.materials.len());
            covered = part.triangles.end;
        }
        assert_eq!(covered as usize, mesh.triangles.len());
    }
}

/// Small files that ask for much; each must be answered at once.
#[test]
fn files_cannot_ask_for_more_than_they_are_worth() {
    let text = good_text("transforms.dae");
    let refusal = |text: &str| read(text).expect_err("too much").to_string();

    let deep = format!("{}{}", "<node>".repeat(100_000), "</node>".repeat(100_000));
    let message = refusal(&text.replace("<node name=\"none\">", &format!("{deep}<node>")));
    assert!(message.contains("nested deeper than 1000"), "{message}");

    let attributes: String = (0..100_000).fold(String::new(), |s, i| s + &format!(" a{i}=''"));
    let message = refusal(&text.replace("<asset>", &format!("<asset{attributes}>")));
    assert!(message.contains("more than 1000 attributes"), "{message}");

    let namespaces = "<a xmlns:b='c'/>".repeat(20_000);
    let message = refusal(&text.replace("<asset>", &format!("{namespaces}<asset>")));
    assert!(message.contains("namespaces"), "{message}");

    // Thirty nodes, each of which contains the next one twice, are a billion nodes.
    let doubling = |i| format!("<instance_node url=\"#n{}\"/>", i + 1).repeat(2);
    let nodes: String = (0..30).map(|i| format!("<node id=\"n{i}\">{}</node>", doubling(i))).collect();
    let nodes = format!("<library_nodes>{nodes}<node id=\"n30\"/>");
    let text = text.replace("<library_nodes>", &nodes).replace("#pair", "#n0");
    let message = refusal(&text);
    assert!(message.contains("more than 2000000 nodes"), "{message}");

    // A chain of nodes is as deep as nested nodes would be.
    let chain: String = (0..5000)
        .map(|i| format!("<node id=\"c{i}\"><instance_node url=\"#c{}\"/></node>", i + 1))
        .collect();
    let message = refusal(&text.replace(&nodes, &format!("<library_nodes>{chain}")).replace("#n0", "#c0"));
    assert!(message.contains("nested deeper than 1000"), "{message}");

    let mesh = good_text("primitives.dae").replace("count=\"6\"", "count=\"18446744073709551615\"");
    read(&mesh).expect("counts are not believed");
}

#[test]
fn encodings_with_a_byte_order_mark() {
    let text = good_text("up_axis.dae").replace("id=\"n\"", "id=\"Kügelchen 😀\"");
    let expected = read(&text).expect("a good file");
    assert_eq!(expected.objects[0].name, "Kügelchen 😀");
    let units: Vec<u16> = "\u{FEFF}".encode_utf16().chain(text.encode_utf16()).collect();
    let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
    let marked = format!("\u{FEFF}{text}");
    for bytes in [&little[..], &big, marked.as_bytes()] {
        assert_eq!(parse(bytes, Path::new("scene.dae")).expect("a good file"), expected);
    }
}

/// The place of an error does not depend on how the file is broken into lines.
#[test]
fn places_in_one_long_line() {
    let path = Path::new(FILES).join("bad/index_too_large.dae");
    let text = std::fs::read_to_string(path).expect("the file exists").replace('\n', " ");
    let text = text.replace("<asset>", &format!("<!--{}--><asset>", "é".repeat(10_000)));
    let Err(LoadError::Content { at, .. }) = read(&text) else { panic!("a bad file") };
    let (before, _) = text.split_once("3</p>").expect("the bad index");
    assert_eq!((at.line, at.column as usize), (1, before.chars().count() + 1));
}

// ---- the scenes of the course ------------------------------------------------------------------

/// Per scene: triangles, spheres, lights, and how many triangles or spheres have which material.
type Content = (&'static str, usize, usize, &'static [&'static str], &'static [(&'static str, usize)]);

const WALLS: [(&str, usize); 4] =
    [("0.6 0.6 0.6", 6), ("emits 10 10 10", 2), ("0.6 0.2 0.2", 2), ("0.2 0.2 0.6", 2)];

macro_rules! box_with {
    ($($more:expr),*) => { &[$($more,)* WALLS[0], WALLS[1], WALLS[2], WALLS[3]] };
}

const AREA: &[&str] = &["area 10 10 10"];
const GLASS: (&str, usize) = ("glass 1 1 1, 1 1 1, 1.45", 1);
const MIRROR: (&str, usize) = ("mirror 1 1 1", 1);

/// What the course's renderer reads from its scenes.
const COURSE: &[Content] = &[
    (
        "keenan/banana",
        2458,
        0,
        &["ambient 1 1 1", "directional 1 1 1"],
        &[("0.506329 0.375042 0.2765", 28), ("none", 8), ("0.64 0.3728968 0.037932", 2422)],
    ),
    (
        "keenan/building",
        39506,
        0,
        &["ambient 1 1 1", "directional 1 1 1"],
        &[("0.8 0.670901 0.519588", 39498), ("none", 8)],
    ),
    ("meshedit/cow", 5856, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 5856)]),
    ("meshedit/maxplanck", 50801, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 50801)]),
    ("meshedit/teapot", 2464, 0, &["directional 1 1 1"], &[("0.48 0.48 0.48", 2464)]),
    ("simple/cube", 12, 0, &["point 1 1 1"], &[("none", 12)]),
    ("simple/plane", 2, 0, &["point 1 1 1"], &[("0.6 0.6 0.6", 2)]),
    ("sky/CBbunny", 28588, 0, AREA, box_with!(("0.5 0.5 0.5", 28576))),
    (
        "sky/CBbunny_microfacet_cu",
        28588,
        0,
        AREA,
        box_with!(("conductor 0.33228 1.0162 1.2474, 3.1646 2.5785 2.4603, 0.05", 28576)),
    ),
    ("sky/CBempty", 12, 0, &["point 5 5 5"], &WALLS),
    ("sky/CBspheres", 12, 2, AREA, box_with!(GLASS, MIRROR)),
    ("sky/CBspheres_lambertian", 12, 2, AREA, box_with!(("0.8 0.8 0.8", 2))),
    (
        "sky/CBspheres_microfacet_al_ag",
        12,
        2,
        AREA,
        box_with!(
            ("conductor 0.059193 0.059881 0.047366, 4.1283 3.5892 2.8132, 0.25", 1),
            ("conductor 1.3352 1.0109 0.68955, 7.3398 6.6157 5.6471, 0.025", 1)
        ),
    ),
    ("sky/CBspheres_refract", 12, 2, AREA, box_with!(("refraction 1 1 1, 1.45", 1), MIRROR)),
    ("sky/CBspheres_tex", 12, 2, AREA, box_with!(GLASS, MIRROR)),
    ("sky/bunny", 33696, 0, &["ambient 1 1 1"], &[("0.48 0.48 0.48", 28576), ("0.25 0.25 0.25", 5120)]),
    (
        "sky/bunny_unlit",
        33696,
        0,
        &["ambient 0 0 0"],
        &[("0.48 0.48 0.48", 28576), ("0.25 0.25 0.25", 5120)],
    ),
];

fn rgb([r, g, b]: [f32; 3]) -> String {
    format!("{r} {g} {b}")
}

/// What the course's renderer makes of a material: of plastics it sees the base alone.
fn course_material(scene: &Scene, material: Option<u32>) -> String {
    let Some(material) = material.map(|m| &scene.materials[m as usize]) else { return "none".into() };
    match &material.surface {
        Surface::Matte(m) => rgb(m.reflectance),
        Surface::Plastic(m) => rgb(m.diffuse),
        Surface::Mirror(m) => format!("mirror {}", rgb(m.reflectance)),
        Surface::Glass(m) => format!("glass {}, {}, {}", rgb(m.reflectance), rgb(m.transmittance), m.ior),
        Surface::Refraction(m) => format!("refraction {}, {}", rgb(m.transmittance), m.ior),
        Surface::Conductor(m) => format!("conductor {}, {}, {}", rgb(m.eta), rgb(m.k), m.alpha),
        Surface::Black(_) => format!("emits {}", rgb(material.emission)),
    }
}

fn course_light(kind: &LightKind) -> String {
    match kind {
        LightKind::Hemisphere { radiance } => format!("ambient {}", rgb(*radiance)),
        LightKind::Directional { irradiance } => format!("directional {}", rgb(*irradiance)),
        LightKind::Point { intensity } => format!("point {}", rgb(*intensity)),
        LightKind::Area { radiance } => format!("area {}", rgb(*radiance)),
        other => panic!("the course's scenes have no {other:?}"),
    }
}

#[test]
fn scenes_of_the_course_load_completely() {
    if !Path::new(SHARED).exists() {
        println!("skipped: {SHARED} not found");
        return;
    }
    for (name, triangles, spheres, lights, materials) in COURSE {
        let path = Path::new(SHARED).join(format!("{name}.dae"));
        let scene = pt_scene::format::load(&path).expect("a good file");
        check_invariants(&scene);
        assert_eq!(scene.warnings, [], "{name}");
        assert_eq!(scene.cameras.len(), 1, "{name}");
        let found: Vec<_> = scene.lights.iter().map(|l| course_light(&l.kind)).collect();
        assert_eq!(found, *lights, "{name}");
        let (mut counts, mut of_material) = ([0, 0], BTreeMap::new());
        let mut count = |kind: usize, material, n| {
            counts[kind] += n;
            *of_material.entry(course_material(&scene, material)).or_insert(0) += n;
        };
        for object in &scene.objects {
            match &object.geometry {
                Geometry::Sphere { .. } => count(1, object.materials[0], 1),
                Geometry::Mesh(mesh) => mesh.parts.iter().for_each(|part| {
                    count(0, object.materials[part.slot as usize], part.triangles.len());
                }),
            }
        }
        assert_eq!(counts, [*triangles, *spheres], "{name}");
        let expected = materials.iter().map(|(m, n)| ((*m).to_owned(), *n)).collect();
        assert_eq!(of_material, expected, "{name}");
    }
}
