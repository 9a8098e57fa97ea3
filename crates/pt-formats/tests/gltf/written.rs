//! Scenes written as glTF.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_formats::{FORMATS, LoadOptions, load, load_with, save};
use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::image::Image;
use pt_scene::material::{Diffuse, Glass, MetallicRoughness};
use pt_scene::texture::{Bitmap, Blend, Edge, Filter, NormalOrBump, Pattern, Procedural, Wrap};
use pt_scene::{
    Color, Geometry, Light, LightKind, Material, Object, Scalar, Scene, Span, Surface, Texture,
};
use serde_json::Value;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Writes a scene as glTF, and returns the scene read back, the file, and the notes.
fn written(scene: &Scene) -> (Scene, Vec<u8>, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let [path, again] = ["a.glb", "b.glb"].map(|name| folder.path().join(name));
    let notes = save(scene, &path, false).unwrap_or_else(|error| panic!("{error}"));
    let read = load(&path).unwrap_or_else(|error| panic!("{error}"));
    let bytes = std::fs::read(&path).expect("it was written");
    save(scene, &again, false).unwrap_or_else(|error| panic!("{error}"));
    assert!(bytes == std::fs::read(&again).expect("it was written"), "{}", scene.name);
    super::common::check_invariants(&read);
    validate(&bytes);
    (read, bytes, notes)
}

/// Removes everything that differs between files: name, locations and notes.
fn bare(mut scene: Scene) -> Scene {
    scene.name.clear();
    scene.warnings.clear();
    scene.objects.iter_mut().for_each(|object| object.at = Span::default());
    scene.lights.iter_mut().for_each(|light| light.at = Span::default());
    scene.media.iter_mut().for_each(|medium| medium.at = Span::default());
    scene
}

/// Removes the texels of all normal maps from the materials, and returns them.
fn take_normals(scene: &mut Scene) -> Vec<f32> {
    let mut normals = Vec::new();
    for material in &mut scene.materials {
        let Surface::SurfaceDetail(embossed) = &mut material.surface else { continue };
        let NormalOrBump::Normals(texture) = &mut embossed.relief else { continue };
        let Pattern::Bitmap(bitmap) = &mut Arc::make_mut(texture).pattern else { continue };
        let image = Arc::make_mut(&mut bitmap.image);
        normals.extend(std::mem::take(&mut image.pixels).into_vec().into_flattened());
    }
    normals
}

/// Collects the scenes in a folder and its subfolders.
fn scenes_in(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.expect("a readable entry").path()) {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "parts") {
            scenes_in(&path, found);
        } else if FORMATS.iter().any(|format| format.extensions.contains(&ending)) {
            found.push(path);
        }
    }
    found.sort();
}

/// Splits a file into its JSON and its buffer.
fn chunks(bytes: &[u8]) -> (Value, &[u8]) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four")) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json = word(12);
    assert!(json.is_multiple_of(4) && &bytes[16..20] == b"JSON");
    let value = serde_json::from_slice(&bytes[20..20 + json]).expect("valid JSON");
    let rest = &bytes[20 + json..];
    if rest.is_empty() {
        return (value, rest);
    }
    let length = u32::from_le_bytes(rest[..4].try_into().expect("four")) as usize;
    assert!(length.is_multiple_of(4) && &rest[4..8] == b"BIN\0" && rest.len() == 8 + length);
    (value, &rest[8..])
}

/// Validates a file by the rules of the specification, without our reader. [glTF 2.0, §3 and §4.4]
fn validate(bytes: &[u8]) {
    let (root, binary) = chunks(bytes);
    let list = |name: &str| root[name].as_array().map_or(&[][..], Vec::as_slice);
    let index = |value: &Value, name: &str| {
        let index = value.as_u64().unwrap_or_else(|| panic!("{value} is no index")) as usize;
        assert!(index < list(name).len(), "{index} is no index into {name}");
        index
    };
    assert_eq!(root["asset"]["version"], "2.0");
    for (name, value) in root.as_object().expect("an object") {
        assert!(value.as_array().is_none_or(|list| !list.is_empty()), "{name} is empty");
    }
    if let Some(buffer) = root["buffers"].get(0) {
        assert_eq!(buffer["byteLength"], binary.len());
    }
    for view in list("bufferViews") {
        let [start, length] =
            ["byteOffset", "byteLength"].map(|f| view[f].as_u64().expect("bytes"));
        assert!(start.is_multiple_of(4) && length > 0 && start + length <= binary.len() as u64);
    }
    for accessor in list("accessors") {
        check_accessor(
            accessor,
            &list("bufferViews")[index(&accessor["bufferView"], "bufferViews")],
            binary,
        );
    }
    for image in list("images") {
        let view = &list("bufferViews")[index(&image["bufferView"], "bufferViews")];
        let start = view["byteOffset"].as_u64().expect("bytes") as usize;
        assert_eq!(
            (&binary[start..start + 4], image["mimeType"].as_str()),
            (&b"\x89PNG"[..], Some("image/png"))
        );
    }
    for texture in list("textures") {
        index(&texture["source"], "images");
        index(&texture["sampler"], "samplers");
    }
    for primitive in
        list("meshes").iter().flat_map(|mesh| mesh["primitives"].as_array().expect("a list"))
    {
        let material = &list("materials")[index(&primitive["material"], "materials")];
        let attributes = primitive["attributes"].as_object().expect("an object");
        let count = |value: &Value| list("accessors")[index(value, "accessors")]["count"].clone();
        let vertices = count(&attributes["POSITION"]);
        assert!(attributes.values().all(|attribute| count(attribute) == vertices));
        assert!(list("accessors")[index(&attributes["POSITION"], "accessors")]["max"].is_array());
        assert_eq!(count(&primitive["indices"]).as_u64().expect("a number") % 3, 0);
        let has_texture = material.to_string().contains("Texture\":");
        assert!(!has_texture || attributes.contains_key("TEXCOORD_0"), "{material}");
    }
    check_nodes(list("nodes"), &root["scenes"][0]["nodes"]);
    let mut used = HashSet::new();
    find_extensions(&root, &mut used);
    let listed: HashSet<_> = list("extensionsUsed")
        .iter()
        .map(|name| name.as_str().expect("a name").to_owned())
        .collect();
    assert_eq!(used, listed);
    for material in list("materials") {
        let factors =
            [&material["emissiveFactor"], &material["pbrMetallicRoughness"]["baseColorFactor"]];
        for factor in factors.into_iter().filter_map(Value::as_array).flatten() {
            assert!((0.0..=1.0).contains(&factor.as_f64().expect("a number")), "{material}");
        }
    }
}

/// Checks that an accessor is within its view, that its bounds are exact, and that normals and
/// indices are valid.
fn check_accessor(accessor: &Value, view: &Value, binary: &[u8]) {
    let number = |value: &Value| value.as_u64().expect("a number") as usize;
    let width = match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        other => panic!("{other:?}"),
    };
    let size = if accessor["componentType"] == 5123 { 2 } else { 4 };
    let count = number(&accessor["count"]);
    assert!(count > 0 && count * width * size == number(&view["byteLength"]));
    let start = number(&view["byteOffset"]);
    let bytes = &binary[start..start + count * width * size];
    if accessor["componentType"] != 5126 {
        assert_eq!(view["target"], 34_963);
        return;
    }
    assert_eq!(view["target"], 34_962);
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|x| f32::from_le_bytes(*x)).collect();
    assert!(numbers.iter().all(|x| x.is_finite()));
    for (bound, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
        let Some(stated) = accessor[bound].as_array() else { continue };
        for (c, stated) in stated.iter().enumerate() {
            let found = numbers.iter().skip(c).step_by(width).copied().reduce(pick);
            assert_eq!(stated.as_f64(), found.map(f64::from));
        }
    }
}

/// Checks that each node has one parent, and a transform of scale, rotation and translation.
fn check_nodes(nodes: &[Value], roots: &Value) {
    let mut parents = vec![0; nodes.len()];
    let children = nodes.iter().map(|node| &node["children"]).chain([roots]);
    for child in children.filter_map(Value::as_array).flatten() {
        parents[child.as_u64().expect("an index") as usize] += 1;
    }
    assert!(parents.iter().all(|count| *count == 1));
    for matrix in nodes.iter().filter_map(|node| node["matrix"].as_array()) {
        let m: Vec<f64> = matrix.iter().map(|x| x.as_f64().expect("a number")).collect();
        let [x, y, z] = [0, 4, 8].map(|i| DVec3::new(m[i], m[i + 1], m[i + 2]).normalize());
        assert!([x.dot(y), y.dot(z), z.dot(x)].iter().all(|cos| cos.abs() < 1e-5), "{matrix:?}");
    }
}

fn find_extensions(value: &Value, found: &mut HashSet<String>) {
    if let Some(fields) = value.as_object() {
        if let Some(extensions) = fields.get("extensions").and_then(Value::as_object) {
            found.extend(extensions.keys().cloned());
        }
        fields.values().for_each(|value| find_extensions(value, found));
    }
    value.as_array().into_iter().flatten().for_each(|value| find_extensions(value, found));
}

/// Describes the first difference.
fn difference(a: &Scene, b: &Scene) -> String {
    fn first<T: PartialEq + std::fmt::Debug>(what: &str, a: &[T], b: &[T]) -> Option<String> {
        if a.len() != b.len() {
            return Some(format!("{} and {} {what}", a.len(), b.len()));
        }
        let (a, b) = a.iter().zip(b).find(|(a, b)| a != b)?;
        let [a, b] = [a, b].map(|x| format!("{x:?}"));
        let at = a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count();
        let near = |text: &str| {
            let all = text.chars().skip(at.saturating_sub(200)).take(400);
            all.collect::<String>()
        };
        Some(format!("{what}\n{}\n{}", near(&a), near(&b)))
    }
    first("cameras", &a.cameras, &b.cameras)
        .or(first("lights", &a.lights, &b.lights))
        .or(first("media", &a.media, &b.media))
        .or(first("materials", &a.materials, &b.materials))
        .or(first("objects", &a.objects, &b.objects))
        .unwrap_or_else(|| "settings".to_owned())
}

#[test]
fn scenes_of_gltf_are_read_as_they_were() {
    let mut scenes = Vec::new();
    scenes_in(&Path::new(ROOT).join("scenes/gltf"), &mut scenes);
    assert!(scenes.len() >= 7, "{}", scenes.len());
    for path in scenes {
        let scene = load(&path).unwrap_or_else(|error| panic!("{error}"));
        let (read, _, notes) = written(&scene);
        let (mut read, mut scene) = (bare(read), bare(scene));
        let [found, wanted] = [&mut read, &mut scene].map(take_normals);
        assert!(read == scene, "{}: {}", path.display(), difference(&read, &scene));
        // A 16-bit image has them to its precision, with the scale included.
        let close = found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 2e-5);
        assert!(found.len() == wanted.len() && close, "{}", path.display());
        assert!(notes.is_empty(), "{}: {notes:?}", path.display());
    }
}

/// All files are valid, and have the original number of cameras and triangles, unless a note
/// explains the difference.
#[test]
fn scenes_of_all_formats_can_be_written() {
    let mut scenes = Vec::new();
    scenes_in(&Path::new(ROOT).join("scenes"), &mut scenes);
    scenes_in(&Path::new(ROOT).join("tests/formats/gltf/good"), &mut scenes);
    assert!(scenes.len() > 70, "{}", scenes.len());
    for path in scenes {
        let options = LoadOptions::default();
        let scene = load_with(&path, &options).unwrap_or_else(|error| panic!("{error}"));
        let (read, _, notes) = written(&scene);
        let is_noted = |text: &str| notes.iter().any(|note| note.contains(text));
        let triangles = |scene: &Scene| {
            let count = |object: &Object| match &object.geometry {
                Geometry::Mesh(mesh) => mesh.triangles.len(),
                _ => 0,
            };
            scene.objects.iter().map(count).sum::<usize>()
        };
        let squares =
            scene.lights.iter().filter(|light| matches!(light.kind, LightKind::Area { .. }));
        if !is_noted("the sphere becomes triangles")
            && !is_noted("it represents the emissive surface")
        {
            assert_eq!(
                triangles(&read),
                triangles(&scene) + 2 * squares.count(),
                "{}",
                path.display()
            );
        }
        assert!(is_noted("panoramas") || read.cameras.len() == scene.cameras.len());
    }
}

/// In Blender files of the course, a square light and the emissive surface are the same lamp, which
/// is written once.
#[test]
fn a_light_on_an_emissive_surface_is_not_written_beside_it() {
    let matte = Diffuse { reflectance: [0.5; 3].into(), two_sided: true };
    let lamp = Material { emission: [3.0; 3].into(), ..material("lamp", matte) };
    let rectangle = Geometry::Mesh(Arc::new(pt_scene::shapes::rectangle()));
    let square = |z: f64| Light {
        name: "square".to_owned(),
        to_world: DAffine3::from_translation(DVec3::Z * z),
        kind: LightKind::Area { radiance: [3.0; 3] },
        at: Span::default(),
    };
    let scene = |lights: Vec<Light>| Scene {
        materials: vec![lamp.clone()].into(),
        objects: vec![object(rectangle.clone(), DAffine3::IDENTITY, 0)].into(),
        lights: lights.into(),
        ..Scene::default()
    };
    let (read, _, notes) = written(&scene(vec![square(0.001)]));
    assert_eq!(read.objects.len(), 1);
    assert!(
        notes.iter().any(|note| note.contains("it represents the emissive surface")),
        "{notes:?}"
    );
    let (read, _, notes) = written(&scene(vec![square(0.5)]));
    assert_eq!(read.objects.len(), 2);
    assert!(!notes.iter().any(|note| note.contains("it represents")), "{notes:?}");
}

fn object(geometry: Geometry, to_world: DAffine3, material: u32) -> Object {
    Object {
        name: "thing".to_owned(),
        to_world,
        motion: None,
        geometry,
        materials: vec![Some(material)],
        media: None,
        at: Span { element: "thing".to_owned(), ..Span::default() },
    }
}

fn material(name: &str, surface: impl Into<Surface>) -> Material {
    Material {
        name: name.to_owned(),
        surface: surface.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}

#[test]
fn features_that_gltf_lacks_are_noted_once() {
    let matte = Diffuse { reflectance: [0.5; 3].into(), two_sided: false };
    let light = |kind| Light {
        name: "lamp".to_owned(),
        to_world: DAffine3::IDENTITY,
        kind,
        at: Span { element: "lamp".to_owned(), ..Span::default() },
    };
    let sphere = || object(Geometry::Sphere { radius: 2.0 }, DAffine3::IDENTITY, 0);
    let scene = Scene {
        materials: vec![material("paint", matte)].into(),
        objects: vec![sphere(), sphere()].into(),
        lights: vec![
            light(LightKind::Constant { radiance: [1.0; 3], portal: None }),
            light(LightKind::Constant { radiance: [2.0; 3], portal: None }),
            light(LightKind::Point { intensity: [3.0, 2.0, 0.7] }),
        ]
        .into(),
        settings: pt_scene::RenderHints { spp: Some(4), ..Default::default() },
        ..Scene::default()
    };
    let (read, _, notes) = written(&scene);
    let expected = [
        ": lamp: environment lights are not representable in glTF; the light is omitted",
        "material \"paint\": the black back side becomes like the front side",
        ": thing: the sphere becomes triangles",
        "settings: render settings are not representable in glTF and omitted: samples per pixel",
    ];
    assert_eq!(notes, expected);
    assert_eq!(read.lights.len(), 1);
    assert_eq!(read.lights[0].kind, scene.lights[2].kind);
    let [Geometry::Mesh(a), Geometry::Mesh(b)] = [0, 1].map(|i| read.objects[i].geometry.clone())
    else {
        panic!("spheres become meshes")
    };
    assert!(Arc::ptr_eq(&a, &b), "they share one mesh");
}

#[test]
fn lengths_become_metres() {
    let glass = Glass {
        reflectance: [1.0; 3].into(),
        transmittance: [1.0; 3].into(),
        ior: 1.5,
        roughness: None,
    };
    let cube = Geometry::Mesh(Arc::new(pt_scene::shapes::cube()));
    let scene = Scene {
        metres_per_unit: 0.01,
        materials: vec![material("glass", glass)].into(),
        objects: vec![object(cube, DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)), 0)]
            .into(),
        ..Scene::default()
    };
    let (read, ..) = written(&scene);
    let corner = read.objects[0].to_world.transform_point3(DVec3::ONE);
    assert!(corner.distance(DVec3::new(0.02, 0.03, 0.04)) < 1e-9, "{corner}");
    let Surface::MetallicRoughness(look) = &read.materials[0].surface else { panic!("{read:?}") };
    assert_eq!((look.transmission.clone(), look.ior), (1.0.into(), 1.5));
}

/// A sheared object is written as two nodes and keeps its transform.
#[test]
fn what_is_sheared_keeps_its_shape() {
    let sheared =
        DAffine3::from_cols_array(&[1.0, 0.0, 0.0, 0.7, 1.0, 0.0, -0.3, 0.2, 2.0, 5.0, 6.0, 7.0]);
    let matte = Diffuse { reflectance: [0.5; 3].into(), two_sided: true };
    let cube = Geometry::Mesh(Arc::new(pt_scene::shapes::cube()));
    let scene = Scene {
        materials: vec![material("paint", matte)].into(),
        objects: vec![object(cube, sheared, 0)].into(),
        ..Scene::default()
    };
    let (read, _, notes) = written(&scene);
    assert!(read.objects[0].to_world.abs_diff_eq(sheared, 1e-12) && notes.is_empty());
}

/// Materials that glTF supports are read back unchanged.
#[test]
fn textures_are_read_as_they_were() {
    let levels = |step: u32| {
        let color = |i: u32| {
            [0, 1, 2].map(|c| linear_from_srgb(((i * step + 80 * c) % 256) as f32 / 255.0))
        };
        Arc::new(Image { width: 8, height: 4, pixels: (0..32).map(color).collect() })
    };
    let grey = |step: u32, highest: u32| {
        let share = |i: u32| [(i * step % (highest + 1)) as f32 / highest as f32; 3];
        Arc::new(Image { width: 8, height: 4, pixels: (0..32).map(share).collect() })
    };
    let to_pattern = DMat3::from_cols(DVec3::X * 2.0, DVec3::Y * 0.5, DVec3::new(0.25, 0.5, 1.0));
    let texture = |image: Arc<Image>| {
        let wrap = Wrap { u: Edge::Mirror, v: Edge::Clamp };
        let bitmap = Bitmap { image, wrap, filter: Filter::Trilinear };
        Arc::new(Texture::on_surface(Pattern::Bitmap(bitmap), to_pattern))
    };
    let tinted = |image, factor: [f32; 3]| {
        let factors = [Color::Texture(texture(image)), factor.into()];
        Arc::new(Pattern::Product(Box::new(factors)).into())
    };
    let between = Blend {
        first: [150.0; 3].into(),
        second: [450.0; 3].into(),
        amount: Scalar::Texture(texture(grey(37, 255))),
    };
    let [strength, x, y] = [19, 23, 29].map(|step| Scalar::Texture(texture(grey(step, 255))));
    let surface = MetallicRoughness {
        base_color: Color::Texture(tinted(levels(7), [0.5, 0.25, 1.0])),
        roughness: Scalar::Texture(texture(grey(3, 255))),
        metallic: Scalar::Texture(tinted(grey(5, 255), [0.75; 3])),
        ior: 1.25,
        specular: Scalar::Texture(texture(grey(31, 255))),
        specular_color: Color::Texture(tinted(levels(41), [1.5, 1.0, 0.5])),
        anisotropy: strength,
        anisotropy_direction: [x, y],
        anisotropy_rotation: 0.3,
        iridescence: Scalar::Texture(texture(grey(43, 255))),
        film_ior: 1.75,
        film_thickness: Scalar::Texture(Arc::new(Pattern::Blend(Box::new(between)).into())),
        clearcoat: Scalar::Texture(texture(grey(11, 65_535))),
        clearcoat_roughness: Scalar::Texture(tinted(grey(47, 255), [0.5; 3])),
        sheen_color: Color::Texture(texture(levels(13))),
        sheen_roughness: Scalar::Texture(texture(grey(53, 255))),
        two_sided: true,
        ..MetallicRoughness::default()
    };
    let opacity = Scalar::Texture(texture(grey(255, 255)));
    let material = Material {
        emission: Color::Texture(tinted(levels(17), [8.0, 4.0, 2.0])).times(&opacity),
        hidden_emission: false,
        opacity,
        ..material("paint", surface)
    };
    let rectangle = Geometry::Mesh(Arc::new(pt_scene::shapes::rectangle()));
    let scene = Scene {
        materials: vec![material].into(),
        objects: vec![object(rectangle, DAffine3::IDENTITY, 0)].into(),
        ..Scene::default()
    };
    let (read, _, notes) = written(&scene);
    let (read, scene) = (bare(read), bare(scene));
    assert!(read == scene, "{}", difference(&read, &scene));
    assert!(notes.is_empty(), "{notes:?}");
}

/// A procedural texture is written as its mean, with a note.
#[test]
fn computed_textures_become_their_mean() {
    let cubes = Procedural::Checkerboard3d([[0.25, 0.5, 0.75], [0.75, 0.5, 0.0]]);
    let reflectance = Color::Texture(Arc::new(Pattern::Procedural(cubes).into()));
    let matte = Diffuse { reflectance, two_sided: true };
    let rectangle = Geometry::Mesh(Arc::new(pt_scene::shapes::rectangle()));
    let scene = Scene {
        materials: vec![material("paint", matte)].into(),
        objects: vec![object(rectangle, DAffine3::IDENTITY, 0)].into(),
        ..Scene::default()
    };
    let (read, _, notes) = written(&scene);
    let Surface::MetallicRoughness(look) = &read.materials[0].surface else {
        panic!("another surface")
    };
    assert_eq!(look.base_color, Color::Value([0.5, 0.5, 0.375]));
    assert!(
        notes.iter().any(|note| note.contains("one of the combined textures is omitted")),
        "{notes:?}"
    );
}
