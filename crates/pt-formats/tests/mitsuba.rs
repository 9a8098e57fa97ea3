//! Reader of Mitsuba scenes.

#[path = "mitsuba/attributes.rs"]
mod attributes;
mod common;
#[path = "mitsuba/emitters.rs"]
mod emitters;
#[path = "mitsuba/materials.rs"]
mod materials;
#[path = "mitsuba/media.rs"]
mod media;
#[path = "mitsuba/motion.rs"]
mod motion;
#[path = "mitsuba/plugins.rs"]
mod plugins;
#[path = "mitsuba/reliefs.rs"]
mod reliefs;
#[path = "mitsuba/seats.rs"]
mod seats;
#[path = "mitsuba/sensors.rs"]
mod sensors;
#[path = "mitsuba/shapes.rs"]
mod shapes;
#[path = "mitsuba/spectra.rs"]
mod spectra;

use std::path::Path;
use std::sync::Arc;

use common::{check_bad_files, check_good_files, check_robustness, folder, parse};
use materials::ROUGH;
use pt_formats::{LoadOptions, load_with};
use pt_math::{DAffine3, DVec3, Vec3};
use pt_scene::material::{Black, Conductor, Diffuse, Glass, Roughness};
use pt_scene::{Color, Filter, Geometry, Hidden, Material, Mesh, RenderHints, Scene, Surface};

/// Parses a scene with the given content, whose folder is that of the good files.
fn read(content: &str) -> Scene {
    let text = format!("<scene version=\"3.0.0\">{content}</scene>");
    let path = folder("mitsuba").join("good").join("test.xml");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    scene
}

/// Returns the error of a scene with invalid content.
fn refusal(content: &str) -> String {
    let text = format!("<scene version=\"3.0.0\">{content}</scene>");
    let path = folder("mitsuba").join("good").join("test.xml");
    parse(text.as_bytes(), &path).expect_err("a bad scene").to_string()
}

fn good(name: &str) -> Scene {
    let path = folder("mitsuba").join("good").join(name);
    pt_formats::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the material of the only shape, which has this content.
fn material(content: &str) -> Material {
    let mut scene = read(&format!("<shape type=\"sphere\">{content}</shape>"));
    assert_eq!(scene.objects[0].materials, [Some(0)]);
    scene.materials.to_mut().swap_remove(0)
}

/// Returns the constant emission of a material.
fn emission(material: &Material) -> [f32; 3] {
    let Color::Value(emission) = material.emission else { panic!("a texture") };
    emission
}

fn surface(bsdf: &str) -> Surface {
    material(bsdf).surface
}

fn mesh_of(object: &pt_scene::Object) -> &Arc<Mesh> {
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("{} is no mesh", object.name) };
    mesh
}

/// Returns the transform of a cube.
fn transform(steps: &str) -> DAffine3 {
    let shape =
        format!("<shape type=\"cube\"><transform name=\"to_world\">{steps}</transform></shape>");
    read(&shape).objects[0].to_world
}

fn assert_close(a: DVec3, b: DVec3) {
    assert!(a.distance(b) < 1e-9 * (1.0 + b.length()), "{a} is not {b}");
}

// ---- messages ----------------------------------------------------------------------------------

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("mitsuba", "xml");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("mitsuba", "xml");
}

#[test]
fn damaged_files_do_no_harm() {
    check_robustness("mitsuba", "xml", 20_000);
}

#[test]
fn chains_of_includes_are_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |i: usize| folder.path().join(format!("{i}.xml"));
    for i in 0..20 {
        let next = format!("<include filename=\"{}.xml\"/>", i + 1);
        let text = format!("<scene version=\"3.0.0\">{next}{next}</scene>");
        std::fs::write(file(i), text).expect("a writable folder");
    }
    std::fs::write(file(20), "<scene version=\"3.0.0\"/>").expect("a writable folder");
    let error = pt_formats::load(&file(0)).expect_err("too deep").to_string();
    assert!(error.contains("nested deeper than 15"), "{error}");
    // Less deep, but two of each: 2¹⁴ files.
    let error = pt_formats::load(&file(7)).expect_err("too many").to_string();
    assert!(error.contains("more than 1000"), "{error}");
    assert!(pt_formats::load(&file(14)).is_ok());
}

/// A chain of bump maps, each of which refers to the next one, and a shape with the first.
fn row_of_bumps(count: usize) -> String {
    let bumps = "<bsdf type=\"bumpmap\"><texture type=\"checkerboard\"/></bsdf>";
    let bumps = |i: usize| {
        let opened = bumps.replace("\"bumpmap\"", &format!("\"bumpmap\" id=\"{i}\""));
        opened.replace("</bsdf>", &format!("<ref id=\"{}\"/></bsdf>", i + 1))
    };
    let row: String = (0..count).map(bumps).collect();
    let last = format!("<bsdf type=\"diffuse\" id=\"{count}\"/>");
    format!("<shape type=\"sphere\"><ref id=\"0\"/></shape>{row}{last}")
}

/// The shape, 62 bump maps and the bsdf below them are 64 nested objects.
#[test]
fn rows_of_references_are_as_deep_as_nested_objects_may_be() {
    let scene = read(&row_of_bumps(62));
    let mut surface = &scene.materials[0].surface;
    let mut depth = 0;
    while let Surface::SurfaceDetail(embossed) = surface {
        surface = &embossed.surface;
        depth += 1;
    }
    assert_eq!(depth, 62);
    for count in [63, 10_000] {
        let text = format!("<scene version=\"3.0.0\">{}</scene>", row_of_bumps(count));
        let path = folder("mitsuba").join("good").join("test.xml");
        let error = parse(text.as_bytes(), &path).expect_err("too deep").to_string();
        assert!(error.contains("nested deeper than 64"), "{error}");
    }
}

// ---- values and transforms ---------------------------------------------------------------------

#[test]
fn later_steps_act_on_the_result_of_earlier_ones() {
    let map = transform("<scale value=\"2\"/><translate x=\"1\"/><rotate z=\"1\" angle=\"90\"/>");
    assert_close(map.transform_point3(DVec3::X), DVec3::new(0.0, 3.0, 0.0));
    assert_close(map.transform_point3(DVec3::Y), DVec3::new(-2.0, 1.0, 0.0));
}

#[test]
fn steps_may_be_written_in_several_ways() {
    for (one, other) in [
        ("<scale value=\"2\"/>", "<scale x=\"2\" y=\"2\" z=\"2\"/>"),
        ("<scale y=\"3\"/>", "<scale value=\"1, 3, 1\"/>"),
        ("<translate z=\"3\"/>", "<translate value=\"0 0 3\"/>"),
        ("<translate y=\"2\"/>", "<matrix value=\"1 0 0 0 0 1 0 2 0 0 1 0 0 0 0 1\"/>"),
        ("<rotate value=\"0 1 0\" angle=\"30\"/>", "<rotate y=\"1\" angle=\"30\"/>"),
        ("<scale x=\"2\"/>", "<matrix value=\"2,0,0 0,1,0 0,0,1\"/>"),
    ] {
        assert_eq!(transform(one), transform(other), "{one}");
    }
}

#[test]
fn a_node_looks_along_z_to_its_target() {
    let map = transform("<lookat origin=\"1 2 3\" target=\"1 2 -5\" up=\"0 1 0\"/>");
    assert_close(map.transform_point3(DVec3::ZERO), DVec3::new(1.0, 2.0, 3.0));
    assert_close(map.transform_vector3(DVec3::Z), DVec3::NEG_Z);
    assert_close(map.transform_vector3(DVec3::Y), DVec3::Y);
    // Right-handed: +x is to the left when facing along +z with +y up.
    assert_close(map.transform_vector3(DVec3::X), DVec3::NEG_X);
}

#[test]
fn axes_that_are_not_of_unit_length_are_made_so() {
    let content = "<shape type=\"cube\"><transform name=\"to_world\"><rotate y=\"2\" angle=\"90\"/>\
                   </transform></shape>";
    let scene = read(content);
    assert_close(scene.objects[0].to_world.transform_vector3(DVec3::Z), DVec3::X);
    assert_eq!(scene.warnings.len(), 1);
}

#[test]
fn names_stand_for_values_and_the_first_definition_counts() {
    let scene = read(
        "<default name=\"r\" value=\"2\"/><default name=\"r\" value=\"3\"/>\
         <default name=\"radius\" value=\"1$r\"/>\
         <shape type=\"sphere\" id=\"a\\$b\"><float name=\"radius\" value=\"$radius.$r\"/></shape>",
    );
    assert_eq!(scene.objects[0].geometry, Geometry::Sphere { radius: 12.2 });
    assert_eq!(scene.objects[0].name, "a$b");
}

#[test]
fn a_spectrum_is_white_where_it_is_emitted_and_grey_elsewhere() {
    let emitted =
        |value: &str| emission(&material(&format!("<emitter type=\"area\">{value}</emitter>")));
    assert_eq!(emitted("<rgb name=\"radiance\" value=\"2\"/>"), [2.0; 3]);
    assert_eq!(emitted("<float name=\"radiance\" value=\"2\"/>"), [2.0; 3]);
    assert_eq!(emitted(""), [1.0; 3]);
    // An equal-energy spectrum of 2 has X = Y = Z = 2.
    let [r, g, b] = emitted("<spectrum name=\"radiance\" value=\"2\"/>").map(f64::from);
    assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - 2.0).abs() < 1e-3, "Y");
    assert!((0.4124 * r + 0.3576 * g + 0.1805 * b - 2.0).abs() < 1e-3, "X");
    assert!((0.0193 * r + 0.1192 * g + 0.9505 * b - 2.0).abs() < 1e-3, "Z");
    let grey = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"0.25\"/></bsdf>";
    assert_eq!(surface(grey), Diffuse { reflectance: [0.25; 3].into(), two_sided: false }.into());
}

// ---- files -------------------------------------------------------------------------------------

#[test]
fn one_of_each_kind_of_object() {
    let scene = good("objects.xml");
    assert_eq!(scene.name, "objects");
    let settings = RenderHints {
        resolution: Some([64, 48]),
        crop: None,
        spp: Some(16),
        max_depth: Some(4),
        straight_is_free: false,
        sides_by_shading_normal: true,
        integrator: None,
        aovs: Vec::new(),
        filter: Some(Filter::Box),
        hidden: Hidden::Nothing,
    };
    assert_eq!(scene.settings, settings);
    let surfaces: Vec<_> = scene
        .objects
        .iter()
        .map(|o| scene.materials[o.materials[0].expect("a material") as usize].clone())
        .collect();
    let clear = Glass {
        reflectance: [1.0; 3].into(),
        transmittance: [1.0; 3].into(),
        ior: 2.419,
        roughness: None,
    };
    assert_eq!(surfaces[0].surface, clear.into());
    let cloth = Diffuse { reflectance: [0.8, 0.4, 0.2].into(), two_sided: false };
    assert_eq!(surfaces[1].surface, cloth.into());
    assert_eq!(scene.objects[1].materials, scene.objects[2].materials, "one by two names");
    let copper = Conductor {
        eta: [0.2, 0.9, 1.1],
        k: [3.9, 2.5, 2.4],
        reflectance: [1.0; 3].into(),
        roughness: Some(Roughness { alpha: [0.2.into(), 0.2.into()], ..ROUGH }),
        two_sided: true,
    };
    assert_eq!(surfaces[3].surface, copper.into());
    assert_eq!(surfaces[4].surface, Black.into());
    assert_eq!(surfaces[4].emission, [1.0, 128.0 / 255.0, 0.0].into());
    // The two files describe the same tetrahedron; without face_normals it is smooth.
    let [ply, obj] = [1, 2].map(|i| mesh_of(&scene.objects[i]));
    assert_eq!(ply.positions, obj.positions);
    assert!(ply.normals.is_some() && obj.normals.is_none());
    assert_eq!(scene.lights.len(), 3);
    assert_eq!(scene.cameras.len(), 1);
}

#[test]
fn meshes_and_materials_are_shared() {
    let shape = "<shape type=\"ply\"><string name=\"filename\" value=\"parts/tetrahedron.ply\"/>\
                 <ref id=\"m\"/></shape>";
    let scene = read(&format!("<bsdf type=\"diffuse\" id=\"m\"/>{shape}{shape}"));
    assert!(Arc::ptr_eq(mesh_of(&scene.objects[0]), mesh_of(&scene.objects[1])));
    assert_eq!(scene.materials.len(), 1);
}

#[test]
fn the_scenes_for_peers_load_without_a_warning() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/mitsuba"));
    for (name, objects, lights, interactions) in [
        ("spheres_box", 8, 0, 5),
        ("mirror_glass", 8, 0, 8),
        ("mesh", 7, 0, 5),
        ("point_light", 3, 2, 5),
        ("environment", 4, 1, 5),
        ("envmap", 4, 1, 5),
        ("spot", 4, 2, 5),
        ("small_light", 8, 0, 5),
        ("shapes", 11, 0, 5),
        ("many_lights", 25, 12, 5),
        ("instances", 15, 0, 5),
        ("spectra", 5, 1, 5),
    ] {
        let scene = pt_formats::load(&folder.join(name).with_extension("xml"));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!((scene.objects.len(), scene.lights.len()), (objects, lights), "{name}");
        let settings = RenderHints {
            resolution: Some([128, 128]),
            crop: None,
            spp: Some(64),
            max_depth: Some(interactions),
            straight_is_free: false,
            sides_by_shading_normal: true,
            integrator: None,
            aovs: Vec::new(),
            filter: Some(Filter::Box),
            hidden: Hidden::Nothing,
        };
        assert_eq!(scene.settings, settings, "{name}");
    }
    for (name, media) in [("fog", 2), ("cloud", 1), ("smoke", 2), ("absorption", 3)] {
        let scene = pt_formats::load(&folder.join(name).with_extension("xml"));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!((scene.media.len(), scene.settings.integrator), (media, Some("volpath")));
    }
}

/// All of them, except included files and files of parts.
#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn shared_scenes_load() {
    let shared = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/mitsuba"));
    let mut files = Vec::new();
    for folder in ["docs/scenes", "scenes", "scenes/cbox", "scenes/matpreview"] {
        let entries = std::fs::read_dir(shared.join(folder)).expect("the folder exists");
        files.extend(entries.map(|entry| entry.expect("a readable entry").path()));
    }
    files.retain(|path| path.extension().is_some_and(|e| e == "xml"));
    assert!(files.len() > 15, "{files:?}");
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        let says = text.contains("name=\"spp\"") || !text.contains("$spp");
        let spp = ("spp".to_owned(), "4".to_owned());
        let definitions = if says { Vec::new() } else { vec![spp] };
        let scene = load_with(
            &path,
            &LoadOptions { definitions, allow_outside: true, ..LoadOptions::default() },
        );
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        let lights = scene.lights.len()
            + scene.materials.iter().filter(|m| m.emission != [0.0; 3].into()).count();
        assert!(!scene.objects.is_empty() && lights > 0, "{}", path.display());
    }
}

// ---- shapes ------------------------------------------------------------------------------------

#[test]
fn spheres_stand_where_their_transform_puts_them() {
    let scene = read(
        "<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"0\" z=\"0\"/>\
         <float name=\"radius\" value=\"0.5\"/><transform name=\"to_world\"><scale value=\"4\"/>\
         <rotate z=\"1\" angle=\"90\"/></transform></shape>",
    );
    let sphere = &scene.objects[0];
    let Geometry::Sphere { radius } = sphere.geometry else { panic!("no sphere") };
    assert!((radius - 2.0).abs() < 1e-12);
    assert_close(sphere.to_world.translation, DVec3::new(0.0, 4.0, 0.0));
}

/// Returns the world-space normal of the first triangle. Mirroring keeps the front of a mesh:
/// normals are transformed by the inverse transpose.
fn front(scene: &Scene) -> DVec3 {
    let object = &scene.objects[0];
    let mesh = mesh_of(object);
    let p = mesh.triangles[0].map(|c| Vec3::from_array(mesh.positions[c as usize]).as_dvec3());
    let normal = (p[1] - p[0]).cross(p[2] - p[0]);
    (object.to_world.matrix3.inverse().transpose() * normal).normalize()
}

/// Expected results are those of Mitsuba 3.9 for these shapes seen from +z: the side that it
/// shades.
#[test]
fn fronts_are_on_the_side_on_which_mitsuba_has_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let file = |name: &str, faces: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("{triangle}{faces}")).expect("a writable folder");
        format!("<string name=\"filename\" value=\"{}\"/>", path.display())
    };
    let plain = file("plain.obj", "f 1 2 3\n");
    let with_normals = file("normals.obj", "vn 0 0 1\nf 1//1 2//1 3//1\n");
    let is_front = |kind: &str, parameters: &str, mirrored: bool, flipped: bool| {
        let x = if mirrored { -1 } else { 1 };
        let content = format!(
            "<shape type=\"{kind}\"><transform name=\"to_world\"><scale x=\"{x}\"/></transform>\
             <boolean name=\"flip_normals\" value=\"{flipped}\"/>{parameters}</shape>"
        );
        front(&read(&content)).z > 0.0
    };
    let flat = "<boolean name=\"face_normals\" value=\"true\"/>";
    for flipped in [false, true] {
        for mirrored in [false, true] {
            // If the mesh is procedural or the file has normals, the normals decide.
            assert_eq!(is_front("rectangle", "", mirrored, flipped), !flipped);
            assert_eq!(is_front("obj", &with_normals, mirrored, flipped), !flipped);
            // Otherwise the order of vertices decides, after the transform.
            assert_eq!(is_front("obj", &plain, mirrored, flipped), flipped == mirrored);
            let both = format!("{plain}{flat}");
            assert_eq!(is_front("obj", &both, mirrored, flipped), flipped == mirrored);
            let both = format!("{with_normals}{flat}");
            assert_eq!(is_front("obj", &both, mirrored, flipped), flipped == mirrored);
        }
    }
}
