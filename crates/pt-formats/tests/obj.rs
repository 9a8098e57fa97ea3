//! OBJ files and their materials in MTL files; `meshes.rs` tests what all mesh formats share.

mod common;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::{
    check_bad_files, check_damage_with, check_good_files, check_robustness, folder, parse,
};
use pt_formats::{LoadError, LoadOptions, load, parse_with};
use pt_image::{SaveOptions, save};
use pt_math::DVec3;
use pt_scene::image::Image;
use pt_scene::material::{Diffuse, Glass, MetallicRoughness, Mirror, Plastic, ThinGlass};
use pt_scene::texture::{Bitmap, NormalOrBump, Pattern, Wrap};
use pt_scene::{Color, Geometry, Material, Mesh, Scalar, Scene, Surface, Texture};

fn good(name: &str) -> Scene {
    let path = folder("obj").join("good").join(name);
    parse(&std::fs::read(&path).expect("a readable file"), &path)
        .unwrap_or_else(|error| panic!("{error}"))
}

fn mesh(scene: &Scene) -> &Arc<Mesh> {
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
    mesh
}

fn material<'s>(scene: &'s Scene, name: &str) -> &'s Material {
    scene.materials.iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// Returns the first triangle of each part, and the name of its material.
fn runs(scene: &Scene) -> Vec<(u32, Option<&str>)> {
    let name = |index: u32| scene.materials[index as usize].name.as_str();
    let material = |slot: u32| scene.objects[0].materials[slot as usize].map(name);
    mesh(scene).submeshes.iter().map(|p| (p.triangles.start, material(p.slot))).collect()
}

fn bitmap(texture: &Texture) -> &Bitmap {
    match &texture.pattern {
        Pattern::Bitmap(bitmap) => bitmap,
        Pattern::Product(factors) => bitmap(factors[0].texture().expect("a texture")),
        other => panic!("{other:?}"),
    }
}

fn tint(texture: &Texture) -> [f32; 3] {
    match &texture.pattern {
        Pattern::Product(factors) => match factors[1] {
            Color::Value(tint) => tint,
            Color::Texture(_) => panic!("two textures"),
        },
        _ => [1.0; 3],
    }
}

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("obj", "obj");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("obj", "obj");
}

#[test]
fn damaged_files_do_no_harm() {
    check_robustness("obj", "obj", 20_000);
}

#[test]
fn plain_materials_become_the_nearest_physical_ones() {
    let scene = good("phong.obj");
    let matte = |rgb: [f32; 3]| Diffuse { reflectance: rgb.into(), two_sided: true }.into();
    let white = || Color::from([1.0; 3]);
    let expected: [(&str, Surface); 9] = [
        ("matte", matte([0.2, 0.4, 0.6])),
        (
            "glossy",
            Plastic {
                diffuse: [0.5; 3].into(),
                specular: [0.25; 3].into(),
                alpha: 0.1,
                two_sided: true,
            }
            .into(),
        ),
        ("flat", matte([0.1, 0.2, 0.3])),
        ("mirror", Mirror { reflectance: [0.9, 0.8, 0.7].into() }.into()),
        (
            "solid",
            Glass {
                reflectance: white(),
                transmittance: [0.9, 1.0, 0.9].into(),
                ior: 1.7,
                roughness: None,
            }
            .into(),
        ),
        ("pane", ThinGlass { reflectance: white(), transmittance: white(), ior: 1.5 }.into()),
        ("veil", matte([1.0, 0.0, 0.0])),
        ("lamp", matte([0.0; 3])),
        ("bare", matte([0.5; 3])),
    ];
    assert_eq!(scene.materials.len(), expected.len(), "the unused one is not made");
    for (name, surface) in expected {
        let made = material(&scene, name);
        assert_eq!(made.surface, surface, "{name}");
        let opacity = if name == "veil" { 0.25 } else { 1.0 };
        assert_eq!(made.opacity, Scalar::Value(opacity), "{name}");
        let emission = if name == "lamp" { [3.0, 2.0, 1.0] } else { [0.0; 3] };
        assert_eq!(made.emission, Color::Value(emission), "{name}");
    }
}

#[test]
fn faces_have_the_material_that_is_named_last() {
    let scene = good("phong.obj");
    let runs = runs(&scene);
    let first = ["matte", "glossy", "flat"].map(Some);
    assert_eq!(runs[..3], [(0, first[0]), (2, first[1]), (4, first[2])]);
    assert_eq!(runs[9], (18, Some("matte")), "the same slot again");
    assert_eq!(mesh(&scene).submeshes[9].slot, 0);
    assert_eq!(scene.objects[0].materials.len(), 9);
}

#[test]
fn physically_based_statements_become_metallic_roughness() {
    let scene = good("physical.obj");
    let base = || MetallicRoughness {
        base_color: [0.5; 3].into(),
        roughness: 0.5.into(),
        sheen_roughness: 0.5.into(),
        two_sided: true,
        ..MetallicRoughness::default()
    };
    let expected = [
        (
            "metal",
            MetallicRoughness {
                base_color: [1.0, 0.8, 0.4].into(),
                roughness: 0.3.into(),
                metallic: 1.0.into(),
                ..base()
            },
        ),
        (
            "varnish",
            MetallicRoughness {
                base_color: [0.5, 0.1, 0.1].into(),
                roughness: 0.6.into(),
                clearcoat: 0.8.into(),
                clearcoat_roughness: 0.1.into(),
                sheen_color: [0.25; 3].into(),
                ior: 1.4,
                ..base()
            },
        ),
        (
            "rough glass",
            MetallicRoughness {
                base_color: [1.0; 3].into(),
                roughness: 0.2.into(),
                transmission: 0.5.into(),
                ior: 1.33,
                two_sided: false,
                ..base()
            },
        ),
        // α = √(2 / 32) = ¼, and its square root is ½.
        ("gloss", MetallicRoughness { roughness: 0.5.into(), ..base() }),
        ("brushed", MetallicRoughness { metallic: 1.0.into(), anisotropy: 0.7.into(), ..base() }),
    ];
    for (name, principled) in expected {
        assert_eq!(material(&scene, name).surface, principled.into(), "{name}");
    }
}

#[test]
fn images_paint_what_their_statements_say() {
    let scene = good("maps.obj");
    let surface = |name| &material(&scene, name).surface;
    let Surface::Plastic(painted) = surface("painted") else { panic!("no gloss") };
    let diffuse = painted.diffuse.texture().expect("a texture");
    assert_eq!(tint(diffuse), [0.5; 3]);
    assert_eq!(tint(painted.specular.texture().expect("a texture")), [0.1; 3]);
    let light = pt_math::color::linear_from_srgb(20.0 / 255.0);
    assert_eq!(bitmap(diffuse).image.pixels[0][0], light);

    let leaf = material(&scene, "leaf").opacity.texture().expect("a texture");
    assert_eq!(tint(leaf), [0.5; 3]);
    let opacities = &bitmap(leaf).image.pixels;
    assert_eq!((opacities[0], opacities[3]), ([1.0; 3], [64.0 / 255.0; 3]));

    let Surface::SurfaceDetail(normal) = surface("normal") else { panic!("no relief") };
    assert!(matches!(normal.relief, NormalOrBump::Normals(_)));
    let Surface::SurfaceDetail(bumpy) = surface("bumpy") else { panic!("no relief") };
    assert!(matches!(bumpy.relief, NormalOrBump::Heights(_, 0.25)));

    let lit = material(&scene, "lit").emission.texture().expect("a texture");
    assert_eq!(bitmap(lit).image.pixels[0][0], light);

    let Surface::MetallicRoughness(measured) = surface("measured") else {
        panic!("not principled")
    };
    let roughness = measured.roughness.texture().expect("a texture");
    assert_eq!(bitmap(roughness).image.pixels[0], [40.0 / 255.0; 3], "green as it is stored");
    let metallic = measured.metallic.texture().expect("a texture");
    assert_eq!((tint(metallic), bitmap(metallic).image.pixels[1]), ([0.5; 3], [16.0 / 255.0; 3]));
}

#[test]
fn images_are_scaled_and_moved() {
    let scene = good("maps.obj");
    let Surface::Diffuse(Diffuse { reflectance, .. }) = &material(&scene, "moved").surface else {
        panic!("not matte")
    };
    let texture = reflectance.texture().expect("a texture");
    assert_eq!(texture.to_pattern * DVec3::new(0.5, 0.25, 1.0), DVec3::new(1.25, 0.25, 1.0));
    assert_eq!(bitmap(texture).wrap, Wrap::REPEAT);
}

#[test]
fn missing_images_are_loud_and_missing_materials_are_not() {
    let loud = |scene: &Scene, name: &str| {
        let Material { surface, opacity, .. } = material(scene, name);
        let Surface::Diffuse(Diffuse { reflectance, .. }) = surface else { return false };
        let texture = reflectance.texture();
        *opacity == Scalar::Value(1.0)
            && texture.is_some_and(|t| matches!(t.pattern, Pattern::Checkerboard(_)))
    };
    let scene = good("missing_image.obj");
    assert!(loud(&scene, "wood") && scene.missing.len() == 1);
    let scene = good("two_libraries.obj");
    assert_eq!(runs(&scene), [(0, Some("matte")), (2, Some("metal")), (4, None)]);
    assert!(!loud(&scene, "matte") && !loud(&scene, "metal"), "those are in other files");
    assert_eq!(scene.missing.len(), 1);
}

#[test]
fn materials_that_are_not_found_leave_the_default_one() {
    let scene = good("not_found.obj");
    assert_eq!(runs(&scene), [(0, None), (2, None), (4, Some("glossy"))]);
}

#[test]
fn vertices_keep_their_colours_where_faces_have_no_material() {
    let scene = good("some_coordinates.obj");
    let of_vertices = scene.objects[0].materials[0].expect("colours");
    let Surface::Diffuse(Diffuse { reflectance, .. }) =
        &scene.materials[of_vertices as usize].surface
    else {
        panic!("not matte")
    };
    assert_eq!(reflectance.texture().expect("colours").pattern, Pattern::VertexColors);
    assert_eq!(runs(&scene)[1], (1, Some("painted")));
    let uvs = mesh(&scene).uvs.as_ref().expect("texture coordinates");
    assert_eq!(uvs.corners(0, [0, 1, 2]).map(|i| uvs.values[i as usize]), [[0.0; 2]; 3]);
    assert_eq!(uvs.corners(1, [0, 2, 1]).map(|i| uvs.values[i as usize]), [[0.0, 1.0]; 3]);
}

/// Runs of materials across the pieces that are read in parallel, with one thread and with three.
#[test]
fn materials_of_large_files_are_the_same_for_any_number_of_threads() {
    let mut text = "mtllib phong.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    let names = ["matte", "glossy", "mirror"];
    let (mut expected, mut triangles) = (Vec::new(), 0);
    for run in 0..600_u32 {
        let name = names[(run * run % 3 + run % 2) as usize % 3];
        writeln!(text, "usemtl {name}").expect("memory");
        let length = 1 + run * 37 % 500;
        if expected.last().is_none_or(|(_, last)| *last != Some(name)) {
            expected.push((triangles, Some(name)));
        }
        for _ in 0..length {
            text.push_str("f 1 2 3\n");
        }
        triangles += length;
    }
    assert!(text.len() > 2 << 19, "{}", text.len());
    let path = folder("obj").join("good/large.obj");
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let scene = pool.install(|| parse(text.as_bytes(), &path)).expect("a scene");
        assert_eq!(runs(&scene), expected);
        common::check_invariants(&scene);
    }
}

#[test]
fn many_materials_that_are_not_found_are_reported_in_short() {
    let mut text = "mtllib phong.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for i in 0..50_000 {
        writeln!(text, "usemtl none{i}\nf 1 2 3").expect("memory");
    }
    let scene = parse(text.as_bytes(), &folder("obj").join("good/many.obj")).expect("a scene");
    assert_eq!(scene.warnings.len(), 21);
    let last = scene.warnings[20].to_string();
    assert!(last.ends_with("many.obj:45: 49980 more undefined materials"), "{last}");
}

#[test]
fn files_of_materials_do_not_lead_out_of_the_folder() {
    let path = folder("obj").join("good/a.obj");
    let text = "mtllib ../bad/materials_many.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let scene = parse_with(text.as_bytes(), &path, &LoadOptions::default()).expect("a scene");
    let missing: Vec<_> = scene.missing.iter().map(ToString::to_string).collect();
    assert!(
        missing.len() == 1 && missing[0].contains("outside of the scene folder"),
        "{missing:?}"
    );
}

/// OBJ files as parts of other scenes have no materials, without a warning.
#[test]
fn meshes_in_scenes_of_mitsuba_have_no_materials_of_their_own() {
    let text = "<scene version=\"3.0.0\"><shape type=\"obj\"><string name=\"filename\" value=\"two_libraries.obj\"/></shape></scene>";
    let scene = parse(text.as_bytes(), &folder("obj").join("good/a.xml")).expect("a scene");
    assert_eq!((&scene.missing, &scene.warnings), (&Vec::new(), &Vec::new()));
    assert_eq!(mesh(&scene).submeshes.len(), 1);
}

/// Damaged material libraries, read through the scene that refers to them.
#[test]
fn damaged_files_of_materials_do_no_harm() {
    let temporary = tempfile::tempdir().expect("a folder");
    let maps = temporary.path().join("maps");
    std::fs::create_dir(&maps).expect("a folder");
    let grey = Image { width: 1, height: 1, pixels: vec![[0.5; 3]].into() };
    for name in ["squares.png", "holes.png", "slopes.png", "heights.png"] {
        save(&grey, &maps.join(name), &SaveOptions::default()).expect("a picture");
    }
    let names = ["phong.mtl", "physical.mtl", "maps.mtl", "approximated.mtl"];
    let good = folder("obj").join("good");
    let all: Vec<(Vec<u8>, PathBuf)> = names
        .map(|name| good.join(name))
        .map(|path| (std::fs::read(&path).expect("a readable file"), path))
        .to_vec();
    check_damage_with(&all, 1000, |bytes, path| -> Result<Scene, LoadError> {
        let library = temporary.path().join(path.file_name().expect("a name"));
        std::fs::write(&library, bytes).expect("a writable folder");
        let obj = path.with_extension("obj");
        let text = std::fs::read(&obj).expect("a readable file");
        let beside: PathBuf = temporary.path().join(obj.file_name().expect("a name"));
        parse(&text, &beside)
    });
}

#[test]
fn our_scenes_are_read_without_notes() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/obj/materials.obj"));
    let scene = load(path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    assert_eq!((&scene.missing, &scene.warnings), (&Vec::new(), &Vec::new()));
}

/// A roof of two squares that meet at a right angle at x = 0, and a third one that continues below
/// the second. In one group, the normal of the ridge is the mean of both sides; in two groups, and
/// without any, each side has its own.
#[test]
fn corners_are_smooth_within_their_group() {
    let read = |first: &str, second: &str, third: &str| {
        let text = format!(
            "v 0 0 1\nv 0 1 1\nv -1 1 0\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv 2 0 -1\nv 2 1 -1\n\
             {first}\nf 1 2 3 4\n{second}\nf 1 5 6 2\n{third}\nf 5 7 8 6\n"
        );
        parse(text.as_bytes(), Path::new("a.obj")).unwrap_or_else(|error| panic!("{error}"))
    };
    let at_ridge = |scene: &Scene| -> Vec<[f32; 3]> {
        let mesh = mesh(scene);
        let Some(normals) = &mesh.normals else { return Vec::new() };
        let corners = (0..4).flat_map(|i| {
            let triangle = mesh.triangles[i];
            triangle.into_iter().zip(normals.corners(i, triangle))
        });
        corners.filter(|(p, _)| *p < 2).map(|(_, n)| normals.values[n as usize]).collect()
    };
    let is = |found: [f32; 3], expected: [f32; 3]| {
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6)
    };
    let side = std::f32::consts::FRAC_1_SQRT_2;
    for (first, second, third, smooth) in [
        ("s 1", "", "s off", true),
        ("s 1", "s off", "s 1", false),
        ("s 1", "s 2", "", false),
        ("s 0", "s 3", "s 3", false),
        ("s on", "s 1", "s off", true),
    ] {
        let scene = read(first, second, third);
        let found = at_ridge(&scene);
        assert_eq!(found.len(), 6);
        for normal in found {
            let flat = is(normal, [-side, 0.0, side]) || is(normal, [side, 0.0, side]);
            let mean = is(normal, [0.0, 0.0, 1.0]);
            assert_eq!((mean, flat), (smooth, !smooth), "{first} {second}: {normal:?}");
        }
    }
    assert!(mesh(&read("", "s off", "s 0")).normals.is_none());
}

/// A surface with emission (0, 4, 2) and opacity ½ emits half of that; an opacity map also scales
/// emission.
#[test]
fn only_what_is_there_emits() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = Image { width: 2, height: 1, pixels: vec![[0.0; 3], [1.0; 3]].into() };
    save(&image, &folder.path().join("cut.png"), &SaveOptions::default()).expect("it is written");
    let file = folder.path().join("a.obj");
    std::fs::write(
        &file,
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n",
    )
    .expect("it is written");
    let emission = |more: &str| {
        let text = format!("newmtl a\nKd 0 0 0\nKe 0 4 2\n{more}\n");
        std::fs::write(folder.path().join("a.mtl"), text).expect("it is written");
        load(&file)
            .unwrap_or_else(|error| panic!("{error}"))
            .materials
            .to_mut()
            .swap_remove(0)
            .emission
    };
    for (more, expected) in [
        ("", [0.0, 4.0, 2.0]),
        ("d 0.5", [0.0, 2.0, 1.0]),
        ("Tr 0.75", [0.0, 1.0, 0.5]),
        ("d 0", [0.0; 3]),
        // Glass ignores opacity.
        ("d 0.5\nillum 7", [0.0, 4.0, 2.0]),
    ] {
        assert_eq!(emission(more), Color::Value(expected), "{more}");
    }
    let Color::Texture(texture) = emission("map_d cut.png") else { panic!("no map") };
    let Pattern::Product(factors) = &texture.pattern else { panic!("{:?}", texture.pattern) };
    assert_eq!(factors[0], Color::Value([0.0, 4.0, 2.0]));
    let share = factors[1].texture().expect("the map");
    assert_eq!(bitmap(share).image.pixels, [[0.0; 3], [1.0; 3]]);
}

/// Errors without further consequences are skipped, except in strict mode.
#[test]
fn one_bad_thing_does_not_cost_the_file() {
    let scene = good("pardoned.obj");
    let mesh = mesh(&scene);
    assert_eq!(mesh.triangles.len(), 2);
    let colors = mesh.colors.as_ref().expect("colours");
    assert_eq!(colors.values, [[1.0, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 1.0]]);
    assert_eq!(mesh.uvs.as_ref().map(|uvs| uvs.values.len()), Some(2), "one, and 0 0");
    let path = folder("obj").join("good").join("pardoned.obj");
    let options = pt_formats::LoadOptions { strict: true, ..Default::default() };
    let text = std::fs::read(&path).expect("a readable file");
    let message = pt_formats::parse_with(&text, &path, &options).expect_err("strict").to_string();
    for fault in ["expected at least three", "none are above", "expected a finite number"] {
        assert!(message.contains(fault), "{message}");
    }
}
