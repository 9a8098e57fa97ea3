//! The reader of Mitsuba scenes.

mod common;
#[path = "mitsuba/shapes.rs"]
mod shapes;
#[path = "mitsuba/spectra.rs"]
mod spectra;

use std::path::Path;
use std::sync::Arc;

use common::{check_bad_files, check_good_files, check_robustness, folder, parse};
use pt_math::{DAffine3, DVec3, Vec3};
use pt_scene::material::{
    Black, CoatedDiffuse, Conductor, Distribution, Glass, Masking, Matte, Mirror,
    RoughCoatedDiffuse, Roughness, Sided, ThinGlass,
};
use pt_scene::{
    FileSettings, Filter, Geometry, LightKind, Material, Mesh, Projection, Scalar, Scene, Surface,
};

/// What rough surfaces have where nothing is said.
const ROUGH: Roughness = Roughness {
    alpha: [Scalar::Value(0.1), Scalar::Value(0.1)],
    distribution: Distribution::Beckmann,
    masking: Masking::Separable,
};

/// A scene with some content, whose folder is that of the good files.
fn read(content: &str) -> Scene {
    let text = format!("<scene version=\"3.0.0\">{content}</scene>");
    let path = folder("mitsuba").join("good").join("test.xml");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    scene
}

fn good(name: &str) -> Scene {
    let path = folder("mitsuba").join("good").join(name);
    pt_scene::format::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

/// The material of the only shape, of which this is the content.
fn material(content: &str) -> Material {
    let mut scene = read(&format!("<shape type=\"sphere\">{content}</shape>"));
    assert_eq!(scene.objects[0].materials, [Some(0)]);
    scene.materials.swap_remove(0)
}

fn surface(bsdf: &str) -> Surface {
    material(bsdf).surface
}

fn mesh_of(object: &pt_scene::Object) -> &Arc<Mesh> {
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("{} is no mesh", object.name) };
    mesh
}

/// The transform of a cube.
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
    let error = pt_scene::format::load(&file(0)).expect_err("too deep").to_string();
    assert!(error.contains("more than 15 deep"), "{error}");
    // Not so deep, but two of each: 2¹⁴ files.
    let error = pt_scene::format::load(&file(7)).expect_err("too many").to_string();
    assert!(error.contains("more than 1000"), "{error}");
    assert!(pt_scene::format::load(&file(14)).is_ok());
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
    // Right-handed: +x is to the left of one who looks along +z with +y up.
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
    let emitted = |value: &str| {
        let [r, g, b] = material(&format!("<emitter type=\"area\">{value}</emitter>")).emission;
        [r, g, b]
    };
    assert_eq!(emitted("<rgb name=\"radiance\" value=\"2\"/>"), [2.0; 3]);
    assert_eq!(emitted("<float name=\"radiance\" value=\"2\"/>"), [2.0; 3]);
    assert_eq!(emitted(""), [1.0; 3]);
    // An equal-energy spectrum of 2 has X = Y = Z = 2.
    let [r, g, b] = emitted("<spectrum name=\"radiance\" value=\"2\"/>").map(f64::from);
    assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - 2.0).abs() < 1e-3, "Y");
    assert!((0.4124 * r + 0.3576 * g + 0.1805 * b - 2.0).abs() < 1e-3, "X");
    assert!((0.0193 * r + 0.1192 * g + 0.9505 * b - 2.0).abs() < 1e-3, "Z");
    let grey = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"0.25\"/></bsdf>";
    assert_eq!(surface(grey), Matte { reflectance: [0.25; 3].into(), two_sided: false }.into());
}

// ---- files -------------------------------------------------------------------------------------

#[test]
fn one_of_each_kind_of_object() {
    let scene = good("objects.xml");
    assert_eq!(scene.name, "objects");
    let settings = FileSettings {
        resolution: Some([64, 48]),
        crop: None,
        spp: Some(16),
        max_depth: Some(4),
        filter: Some(Filter::Box),
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
    let cloth = Matte { reflectance: [0.8, 0.4, 0.2].into(), two_sided: false };
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
    assert_eq!(surfaces[4].emission, [1.0, 128.0 / 255.0, 0.0]);
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
        ("instances", 15, 0, 5),
        ("spectra", 5, 1, 5),
    ] {
        let scene = pt_scene::format::load(&folder.join(name).with_extension("xml"));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!((scene.objects.len(), scene.lights.len()), (objects, lights), "{name}");
        let settings = FileSettings {
            resolution: Some([128, 128]),
            crop: None,
            spp: Some(64),
            max_depth: Some(interactions),
            filter: Some(Filter::Box),
        };
        assert_eq!(scene.settings, settings, "{name}");
    }
}

#[test]
fn shared_scenes_load() {
    let shared =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/mitsuba/scenes"));
    for (name, objects, lights) in [("hello.xml", 1, 2), ("cbox/cbox-rgb.xml", 8, 0)] {
        let path = shared.join(name);
        if !path.exists() {
            println!("skipped: {} not found", path.display());
            continue;
        }
        let scene = pt_scene::format::load(&path).unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        assert_eq!((scene.objects.len(), scene.lights.len()), (objects, lights), "{name}");
    }
}

// ---- materials ---------------------------------------------------------------------------------

#[test]
fn shapes_without_a_bsdf_are_grey_or_black_if_they_emit() {
    let grey = Matte { reflectance: [0.5; 3].into(), two_sided: false };
    assert_eq!(material("").surface, grey.into());
    assert_eq!(material("").emission, [0.0; 3]);
    let lamp = material("<emitter type=\"area\"/>");
    assert_eq!((lamp.surface, lamp.emission), (Black.into(), [1.0; 3]));
}

#[test]
fn both_sides_reflect_if_the_author_says_so() {
    let twosided = |bsdf: &str| surface(&format!("<bsdf type=\"twosided\">{bsdf}</bsdf>"));
    let diffuse = "<bsdf type=\"diffuse\"/>";
    assert_eq!(surface(diffuse), Matte { reflectance: [0.5; 3].into(), two_sided: false }.into());
    assert_eq!(twosided(diffuse), Matte { reflectance: [0.5; 3].into(), two_sided: true }.into());
    let mirror = "<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/></bsdf>";
    assert_eq!(twosided(mirror), Mirror { reflectance: [1.0; 3].into() }.into());
    let one_sided = Conductor {
        eta: [0.0; 3],
        k: [1.0; 3],
        reflectance: [1.0; 3].into(),
        roughness: None,
        two_sided: false,
    };
    assert_eq!(surface(mirror), one_sided.clone().into());
    let rough = Conductor { roughness: Some(ROUGH), two_sided: true, ..one_sided };
    assert_eq!(twosided("<bsdf type=\"roughconductor\"/>"), rough.into());
}

#[test]
fn metals_have_names_and_facets_a_distribution() {
    let gold = Conductor {
        eta: [0.143, 0.3753, 1.442],
        k: [3.983, 2.3856, 1.6034],
        reflectance: [1.0; 3].into(),
        roughness: Some(Roughness {
            alpha: [0.3.into(), 0.3.into()],
            distribution: Distribution::Ggx,
            ..ROUGH
        }),
        two_sided: false,
    };
    let found = surface(
        "<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Au\"/>\
         <float name=\"alpha\" value=\"0.3\"/><string name=\"distribution\" value=\"ggx\"/></bsdf>",
    );
    assert_eq!(found, gold.into());
}

#[test]
fn dielectrics_may_be_rough_or_thin() {
    let index = "<float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" value=\"1\"/>";
    let of_kind = |kind| surface(&format!("<bsdf type=\"{kind}\">{index}</bsdf>"));
    let clear = [1.0; 3];
    let rough = Glass {
        reflectance: clear.into(),
        transmittance: clear.into(),
        ior: 1.5,
        roughness: Some(ROUGH),
    };
    assert_eq!(of_kind("roughdielectric"), rough.into());
    let thin = ThinGlass { reflectance: clear.into(), transmittance: clear.into(), ior: 1.5 };
    assert_eq!(of_kind("thindielectric"), thin.into());
}

#[test]
fn plastic_is_a_base_under_a_coat() {
    let plain = CoatedDiffuse {
        diffuse: [0.5; 3].into(),
        specular: [1.0; 3].into(),
        ior: (1.49 / 1.000_277) as f32,
        saturates: false,
        two_sided: false,
    };
    assert_eq!(surface("<bsdf type=\"plastic\"/>"), plain.clone().into());
    let both = surface(
        "<bsdf type=\"twosided\"><bsdf type=\"plastic\">\
         <boolean name=\"nonlinear\" value=\"true\"/></bsdf></bsdf>",
    );
    assert_eq!(both, CoatedDiffuse { saturates: true, two_sided: true, ..plain }.into());
}

#[test]
fn rough_plastic_has_one_roughness() {
    let plain = RoughCoatedDiffuse {
        diffuse: [0.5; 3].into(),
        specular: [1.0; 3].into(),
        ior: (1.49 / 1.000_277) as f32,
        alpha: 0.1,
        distribution: Distribution::Beckmann,
        saturates: false,
        two_sided: false,
    };
    assert_eq!(surface("<bsdf type=\"roughplastic\"/>"), plain.clone().into());
    let other = surface(
        "<bsdf type=\"twosided\"><bsdf type=\"roughplastic\">\
         <string name=\"distribution\" value=\"ggx\"/><float name=\"alpha\" value=\"0.3\"/>\
         <boolean name=\"nonlinear\" value=\"true\"/></bsdf></bsdf>",
    );
    let want = RoughCoatedDiffuse {
        alpha: 0.3,
        distribution: Distribution::Ggx,
        saturates: true,
        two_sided: true,
        ..plain
    };
    assert_eq!(other, want.into());
}

#[test]
fn glass_has_the_index_of_its_inside_over_its_outside() {
    let ior = |parameters: &str| {
        let bsdf = format!("<bsdf type=\"dielectric\">{parameters}</bsdf>");
        let Surface::Glass(glass) = surface(&bsdf) else { panic!("no glass") };
        glass.ior
    };
    assert_eq!(ior(""), (1.5046 / 1.000_277) as f32);
    let bubble = "<string name=\"int_ior\" value=\"air\"/><string name=\"ext_ior\" \
                  value=\"Water\"/>";
    assert_eq!(ior(bubble), (1.000_277 / 1.333) as f32);
    let numbers = "<float name=\"int_ior\" value=\"3\"/><integer name=\"ext_ior\" value=\"2\"/>";
    assert_eq!(ior(numbers), 1.5);
}

/// A sphere is turned inside out by each of flip_normals, a mirroring transform and a negative
/// radius.
#[test]
fn spheres_turned_inside_out() {
    let sphere = |parameters: &str, bsdf: &str| {
        let scene =
            read(&format!("<shape type=\"sphere\">{parameters}<bsdf type=\"{bsdf}\"/></shape>"));
        (scene.materials[0].surface.clone(), scene.warnings.len())
    };
    let flip = "<boolean name=\"flip_normals\" value=\"true\"/>";
    let mirror = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
    let negative = "<float name=\"radius\" value=\"-1\"/>";
    for (parameters, inverted) in [
        (String::new(), false),
        (flip.to_owned(), true),
        (mirror.to_owned(), true),
        (negative.to_owned(), true),
        (format!("{flip}{mirror}"), false),
        (format!("{flip}{mirror}{negative}"), true),
    ] {
        let matte: Surface = Matte { reflectance: [0.5; 3].into(), two_sided: false }.into();
        let behind = Sided { front: Surface::from(Black).into(), back: matte.clone().into() };
        let want = if inverted { behind.into() } else { matte };
        assert_eq!(sphere(&parameters, "diffuse"), (want, 0), "{parameters}");
        let (Surface::Glass(glass), 0) = sphere(&parameters, "dielectric") else { panic!("glass") };
        assert_eq!(glass.ior < 1.0, inverted, "{parameters}");
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

/// Where the front of the first triangle looks, in the world. Mirroring keeps the front of a mesh:
/// normals go through the inverse transpose.
fn front(scene: &Scene) -> DVec3 {
    let object = &scene.objects[0];
    let mesh = mesh_of(object);
    let p = mesh.triangles[0].map(|c| Vec3::from_array(mesh.positions[c as usize]).as_dvec3());
    let normal = (p[1] - p[0]).cross(p[2] - p[0]);
    (object.to_world.matrix3.inverse().transpose() * normal).normalize()
}

/// What version 3.9 of Mitsuba shows of these shapes from +z, by the side on which it shades.
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
            // Made by rule, or with normals in the file: the normals decide.
            assert_eq!(is_front("rectangle", "", mirrored, flipped), !flipped);
            assert_eq!(is_front("obj", &with_normals, mirrored, flipped), !flipped);
            // Otherwise the corners decide, after the transform.
            assert_eq!(is_front("obj", &plain, mirrored, flipped), flipped == mirrored);
            let both = format!("{plain}{flat}");
            assert_eq!(is_front("obj", &both, mirrored, flipped), flipped == mirrored);
            let both = format!("{with_normals}{flat}");
            assert_eq!(is_front("obj", &both, mirrored, flipped), flipped == mirrored);
        }
    }
}

// ---- emitters and sensors ----------------------------------------------------------------------

#[test]
fn lights_shine_where_they_are_told() {
    let down = |scene: &Scene| {
        let light = &scene.lights[0];
        assert_eq!(light.kind, LightKind::Directional { irradiance: [1.0; 3] });
        assert!((light.to_world.matrix3.determinant() - 1.0).abs() < 1e-12);
        light.to_world.transform_vector3(DVec3::NEG_Z)
    };
    let by_direction = read(
        "<emitter type=\"directional\"><vector name=\"direction\" x=\"3\" y=\"-4\" z=\"0\"/>\
         </emitter>",
    );
    assert_close(down(&by_direction), DVec3::new(0.6, -0.8, 0.0));
    // +z of the node, turned about y, is +x.
    let by_node = read(
        "<emitter type=\"directional\"><transform name=\"to_world\"><rotate y=\"1\" \
         angle=\"90\"/><scale value=\"3\"/></transform></emitter>",
    );
    assert_close(down(&by_node), DVec3::X);
    for position in [
        "<point name=\"position\" value=\"1 2 3\"/>",
        "<transform name=\"to_world\"><scale value=\"5\"/><translate value=\"1 2 3\"/></transform>",
    ] {
        let scene = read(&format!("<emitter type=\"point\">{position}</emitter>"));
        assert_eq!(scene.lights[0].kind, LightKind::Point { intensity: [1.0; 3] });
        assert_close(scene.lights[0].to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    }
}

/// Mitsuba: the angles are those to the axis, in degrees, and the beam has 3/4 of the cutoff.
#[test]
fn spots_shine_along_z_with_their_angles() {
    let spot = |parameters: &str| {
        read(&format!(
            "<emitter type=\"spot\">{parameters}<transform name=\"to_world\"><lookat origin=\"1 2 3\" \
             target=\"1 0 3\" up=\"1 0 0\"/></transform></emitter>"
        ))
    };
    let (plain, given) = (
        spot(""),
        spot("<float name=\"cutoff_angle\" value=\"40\"/><float name=\"beam_width\" value=\"5\"/>"),
    );
    for (scene, [beam_angle, cutoff_angle]) in [(plain, [15.0, 20.0]), (given, [5.0, 40.0])] {
        let light = &scene.lights[0];
        let kind = LightKind::LinearSpot { intensity: [1.0; 3], beam_angle, cutoff_angle };
        assert_eq!(light.kind, kind);
        assert_close(light.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
        assert_close(light.to_world.transform_vector3(DVec3::NEG_Z), DVec3::NEG_Y);
    }
}

/// Mitsuba: uv = (atan2(x, −z) / 2π, acos(y) / π), as computed by its 3.9.1; ours begins at −x of the
/// node and goes on towards +z.
#[test]
fn images_of_the_sky_are_turned_to_our_convention() {
    let folder = tempfile::tempdir().unwrap();
    let image = pt_scene::image::Image { width: 2, height: 1, pixels: vec![[0.5; 3], [2.0; 3]] };
    let path = folder.path().join("sky.exr");
    pt_scene::image::save(&image, &path, &pt_scene::image::SaveOptions::default()).unwrap();
    let emitter = |rest: &str| {
        format!(
            "<emitter type=\"envmap\"><string name=\"filename\" value=\"{}\"/>{rest}</emitter>",
            path.display()
        )
    };
    let turned = "<float name=\"scale\" value=\"3\"/><transform name=\"to_world\"><rotate y=\"1\" \
                  angle=\"90\"/></transform>";
    for (rest, scale, beginning, quarter) in
        [("", 1.0, DVec3::NEG_Z, DVec3::X), (turned, 3.0, DVec3::NEG_X, DVec3::NEG_Z)]
    {
        let scene = read(&emitter(rest));
        let light = &scene.lights[0];
        let kind = LightKind::Environment {
            image: std::sync::Arc::new(image.clone()),
            scale,
            rows: pt_scene::Rows::FromPoleToPole,
        };
        assert_eq!(light.kind, kind);
        assert_close(light.to_world.transform_vector3(DVec3::NEG_X), beginning);
        assert_close(light.to_world.transform_vector3(DVec3::Z), quarter);
        assert_close(light.to_world.transform_vector3(DVec3::Y), DVec3::Y);
    }
}

#[test]
fn cameras_look_at_their_target_with_their_right_to_the_right() {
    let scene = read(
        "<sensor type=\"perspective\"><transform name=\"to_world\"><lookat origin=\"0 0 5\" \
         target=\"0 0 0\" up=\"0 1 0\"/></transform></sensor>",
    );
    // Our camera at this place with this view has the axes of the world.
    let expected = DAffine3::from_translation(DVec3::new(0.0, 0.0, 5.0));
    assert!(scene.cameras[0].to_world.abs_diff_eq(expected, 1e-12));
}

fn fields_of_view(camera: &pt_scene::Camera) -> [f64; 2] {
    let Projection::Perspective { x_fov, y_fov } = camera.projection else { panic!("{camera:?}") };
    [x_fov, y_fov]
}

#[test]
fn fields_of_view_belong_to_their_axis() {
    let half_tangents = |width: u32, height: u32, parameters: &str| {
        let scene = read(&format!(
            "<sensor type=\"perspective\">{parameters}<film type=\"hdrfilm\"><integer \
             name=\"width\" value=\"{width}\"/><integer name=\"height\" value=\"{height}\"/>\
             <rfilter type=\"box\"/></film></sensor>"
        ));
        fields_of_view(&scene.cameras[0]).map(|degrees| (0.5 * degrees.to_radians()).tan())
    };
    let half = 25_f64.to_radians().tan();
    for (axis, wide, tall) in [
        ("x", [half, half / 1.5], [half, half * 1.5]),
        ("y", [half * 1.5, half], [half / 1.5, half]),
        ("smaller", [half * 1.5, half], [half, half * 1.5]),
        ("larger", [half, half / 1.5], [half / 1.5, half]),
    ] {
        let parameters = format!(
            "<float name=\"fov\" value=\"50\"/><string name=\"fov_axis\" value=\"{axis}\"/>"
        );
        for (found, expected) in [
            (half_tangents(300, 200, &parameters), wide),
            (half_tangents(200, 300, &parameters), tall),
        ] {
            for i in 0..2 {
                assert!((found[i] - expected[i]).abs() < 1e-12, "{axis}: {found:?}");
            }
        }
    }
    // 36 mm × 24 mm behind 50 mm, unless the author says otherwise.
    for (length, parameters) in
        [(50.0, ""), (35.0, "<string name=\"focal_length\" value=\"35mm\"/>")]
    {
        let [x, y] = half_tangents(300, 200, parameters);
        assert!((x - 18.0 / length).abs() < 1e-12 && (y - 12.0 / length).abs() < 1e-12);
    }
    let diagonal = "<float name=\"fov\" value=\"50\"/><string name=\"fov_axis\" \
                    value=\"diagonal\"/>";
    let [x, y] = half_tangents(200, 300, diagonal);
    assert!((x.hypot(y) - half).abs() < 1e-12 && (y / x - 1.5).abs() < 1e-12);
}

#[test]
fn the_first_sensor_is_the_one_that_is_used() {
    let scene = good("films.xml");
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["not used", "used"]);
    let used = scene.cameras.last().expect("a camera");
    assert_eq!((used.lens_radius, used.focal_distance), (0.1, 4.0));
    assert!((fields_of_view(used)[1] - 30.0).abs() < 1e-12);
    assert_eq!(scene.settings.resolution, Some([768, 576]));
    assert_eq!(scene.settings.filter, Some(Filter::GAUSSIAN));
    assert_eq!(scene.settings.max_depth, Some(1));
}

#[test]
fn orthographic_cameras_take_their_size_from_the_scale_of_their_node() {
    let camera = |transform: &str| {
        let mut scene = read(&format!(
            "<sensor type=\"orthographic\"><float name=\"near_clip\" value=\"0.5\"/><float \
             name=\"far_clip\" value=\"10\"/><transform name=\"to_world\">{transform}</transform>\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"100\"/><integer \
             name=\"height\" value=\"50\"/></film></sensor>"
        ));
        scene.cameras.swap_remove(0)
    };
    let plain = camera("");
    let view = |half_width, half_height| Projection::Orthographic { half_width, half_height };
    assert_eq!(plain.projection, view(1.0, 0.5));
    assert_eq!((plain.near, plain.far), (0.5, 10.0));
    // Mitsuba 3.9.1: from (1 − 2, 2, 3 + 0.5 · 4) and (1, 2 + 1.5, 5) over a distance of 9.5.
    let scaled = camera("<scale value=\"2 3 4\"/><translate value=\"1 2 3\"/>");
    assert_eq!(scaled.projection, view(2.0, 1.5));
    assert_eq!((scaled.near, scaled.far), (2.0, 11.5));
    assert_close(scaled.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    assert_close(scaled.to_world.matrix3.x_axis, DVec3::NEG_X);
    assert_close(scaled.to_world.matrix3.z_axis, DVec3::NEG_Z);
}

#[test]
fn films_are_cropped_and_moved() {
    let sensor = |film: &str, offset: &str| {
        read(&format!(
            "<sensor type=\"perspective\">{offset}<film type=\"hdrfilm\"><integer \
             name=\"width\" value=\"100\"/><integer name=\"height\" value=\"50\"/>{film}</film>\
             </sensor>"
        ))
    };
    let number = |name: &str, value: i32| format!("<integer name=\"{name}\" value=\"{value}\"/>");
    let crop = |values: [i32; 4]| {
        let names = ["crop_offset_x", "crop_offset_y", "crop_width", "crop_height"];
        let film: String = names.iter().zip(values).map(|(name, v)| number(name, v)).collect();
        sensor(&film, "").settings.crop
    };
    assert_eq!(crop([20, 10, 40, 30]), Some([20, 10, 40, 30]));
    assert_eq!(crop([0, 0, 100, 49]), Some([0, 0, 100, 49]));
    assert_eq!(crop([0, 0, 100, 50]), None);
    assert_eq!(sensor(&number("crop_width", 8), "").settings.crop, Some([0, 0, 8, 50]));
    let offset = "<float name=\"principal_point_offset_x\" value=\"0.1\"/><float \
                  name=\"principal_point_offset_y\" value=\"-0.2\"/>";
    assert_eq!(sensor("", offset).cameras[0].film_offset, [0.1, -0.2]);
    assert_eq!(sensor("", "").cameras[0].film_offset, [0.0; 2]);
}

#[test]
fn filters_have_mitsubas_defaults() {
    let filter = |rfilter: &str| {
        let film = format!("<film type=\"hdrfilm\">{rfilter}</film>");
        read(&format!("<sensor type=\"perspective\">{film}</sensor>")).settings.filter
    };
    let number = |name: &str, value: f64| format!("<float name=\"{name}\" value=\"{value}\"/>");
    let with = |kind: &str, parameters: &str| {
        filter(&format!("<rfilter type=\"{kind}\">{parameters}</rfilter>"))
    };
    assert_eq!(filter(""), Some(Filter::GAUSSIAN));
    assert_eq!(read("<sensor type=\"perspective\"/>").settings.filter, Some(Filter::GAUSSIAN));
    assert_eq!(read("").settings.filter, None);
    for (kind, expected) in [
        ("box", Filter::Box),
        ("tent", Filter::Tent { radius: 1.0 }),
        ("gaussian", Filter::Gaussian { stddev: 0.5, radius: 2.0 }),
        ("mitchell", Filter::MITCHELL),
        ("catmullrom", Filter::Mitchell { b: 0.0, c: 0.5 }),
        ("lanczos", Filter::Lanczos { lobes: 3.0 }),
    ] {
        assert_eq!(with(kind, ""), Some(expected), "{kind}");
    }
    assert_eq!(with("tent", &number("radius", 2.5)), Some(Filter::Tent { radius: 2.5 }));
    assert_eq!(with("gaussian", &number("stddev", 1.0)), Some(Filter::gaussian(1.0)));
    let cubic = number("B", 0.5) + &number("C", 0.25);
    assert_eq!(with("mitchell", &cubic), Some(Filter::Mitchell { b: 0.5, c: 0.25 }));
    let lobes = "<integer name=\"lobes\" value=\"2\"/>";
    assert_eq!(with("lanczos", lobes), Some(Filter::Lanczos { lobes: 2.0 }));
}

#[test]
fn depth_counts_interactions_with_surfaces() {
    let depth = |integrator: &str| read(integrator).settings.max_depth;
    let path = |depth: i32| {
        format!(
            "<integrator type=\"path\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>"
        )
    };
    assert_eq!(depth(""), Some(u32::MAX));
    assert_eq!(depth("<integrator type=\"path\"/>"), Some(u32::MAX));
    assert_eq!(depth(&path(-1)), Some(u32::MAX));
    assert_eq!(depth(&path(1)), Some(0));
    assert_eq!(depth(&path(2)), Some(1));
    assert_eq!(depth("<integrator type=\"direct\"/>"), Some(1));
}
