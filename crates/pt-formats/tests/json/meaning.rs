//! Interpretation of the keys and values of a file.

use std::path::Path;
use std::sync::Arc;

use pt_formats::{load, parse, save};
use pt_scene::material::{Diffuse, Hair, Mirror, Pigment};
use pt_scene::{Geometry, Material, Object, Projection, Scene, Surface};

/// Returns the world position of a point of an object.
fn point(object: &Object, p: [f64; 3]) -> [f64; 3] {
    object.to_world.transform_point3(p.into()).to_array()
}

fn close(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
}

/// Parses a scene of these keys.
fn read(keys: &str) -> Scene {
    let text = format!("{{\"pathtracer\": 1, {keys}}}");
    parse(text.as_bytes(), Path::new("test.json")).unwrap_or_else(|error| panic!("{error}"))
}

fn object(keys: &str) -> Object {
    read(&format!("\"objects\": [{{\"type\": \"cube\", {keys}}}]")).objects.to_mut().remove(0)
}

#[test]
fn steps_are_done_one_after_the_other() {
    let turned = object(r#""to_world": [{"translate": [1, 0, 0]}, {"rotate": 90}, {"scale": 2}]"#);
    assert!(close(point(&turned, [0.0; 3]), [0.0, 0.0, -2.0]), "{:?}", turned.to_world);
    let about_x = object(r#""to_world": {"rotate": 90, "axis": [1, 0, 0]}"#);
    assert!(close(point(&about_x, [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]));
    let rows = object(r#""to_world": {"matrix": [[1, 0, 0, 5], [0, 2, 0, 6], [0, 0, 3, 7]]}"#);
    assert_eq!(point(&rows, [1.0; 3]), [6.0, 8.0, 10.0]);
}

#[test]
fn what_looks_does_so_along_its_z_backwards() {
    let looks = object(r#""to_world": {"look_at": [0, 0, 5], "from": [0, 0, 1]}"#);
    assert!(close(point(&looks, [0.0, 0.0, -1.0]), [0.0, 0.0, 2.0]));
    assert!(close(point(&looks, [0.0, 1.0, 0.0]), [0.0, 1.0, 1.0]));
    assert!(looks.to_world.matrix3.determinant() > 0.0, "nothing is mirrored");
}

#[test]
fn a_missing_angle_follows_from_the_shape_of_the_image() {
    let keys = r#""settings": {"resolution": [200, 100]}, "cameras": [{"type": "perspective", "y_fov": 90}]"#;
    let Projection::Perspective { x_fov, y_fov } = read(keys).cameras[0].projection else {
        panic!("it is a perspective");
    };
    assert!((x_fov - 2.0 * 2.0f64.atan().to_degrees()).abs() < 1e-12 && y_fov == 90.0, "{x_fov}");
}

#[test]
fn what_is_named_once_is_shared_and_so_are_shapes() {
    let meshes = r#""meshes": {"m": {"positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]}}"#;
    let object = |mesh: &str| format!("{{\"type\": \"mesh\", \"mesh\": {mesh}}}");
    let scene = read(&format!(
        "{meshes}, \"objects\": [{}, {}, {{\"type\": \"disk\"}}, {}]",
        object("\"m\""),
        object("\"m\""),
        object("{\"shape\": \"disk\"}"),
    ));
    let mesh = |i: usize| match &scene.objects[i].geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("it is a mesh"),
    };
    assert!(Arc::ptr_eq(mesh(0), mesh(1)) && Arc::ptr_eq(mesh(2), mesh(3)));
    assert_eq!((mesh(0).name.as_str(), mesh(2).name.as_str()), ("m", "disk"));
}

#[test]
fn a_material_of_defaults_is_a_word() {
    let scene = read(
        r#""materials": {"a": "diffuse", "b": {"name": "c", "type": "mirror", "emission": 2}}"#,
    );
    let [a, b] = scene.materials.as_slice() else { panic!("there are two") };
    let matte = Diffuse { reflectance: [0.5; 3].into(), two_sided: true };
    assert_eq!((a.name.as_str(), &a.surface), ("a", &Surface::from(matte)));
    let mirror = Mirror { reflectance: [1.0; 3].into() };
    assert_eq!((b.name.as_str(), &b.surface, &b.emission), ("c", &mirror.into(), &[2.0; 3].into()));
}

#[test]
fn former_names_are_still_read() {
    let pairs = [
        (r#""matte""#, r#""diffuse""#),
        (
            r#"{"type": "sided", "front": "matte", "back": "mirror"}"#,
            r#"{"type": "two_sided", "front": "diffuse", "back": "mirror"}"#,
        ),
        (
            r#"{"type": "embossed", "surface": "matte", "height_map": {"type": "cubes", "colors": [0, 1]}}"#,
            r#"{"type": "surface_detail", "surface": "diffuse", "height_map": {"type": "checkerboard3d", "colors": [0, 1]}}"#,
        ),
        (
            r#"{"type": "mix", "first": "matte", "second": "mirror", "share": {"type": "root", "square": 0.5}}"#,
            r#"{"type": "mix", "first": "diffuse", "second": "mirror", "amount": {"type": "sqrt", "square": 0.5}}"#,
        ),
        (
            r#"{"type": "coated_diffuse", "saturates": true}"#,
            r#"{"type": "coated_diffuse", "nonlinear": true}"#,
        ),
    ];
    for (former, current) in pairs {
        let scene = |material: &str| read(&format!("\"materials\": {{\"a\": {material}}}"));
        assert_eq!(scene(former), scene(current), "{former}");
    }
    let camera = |key| {
        read(&format!(
            "\"cameras\": [{{\"type\": \"perspective\", \"x_fov\": 40, \"{key}\": [0.25, 0.5]}}]"
        ))
    };
    assert_eq!(camera("film_offset"), camera("principal_point_offset"));
}

#[test]
fn hair_has_one_of_three_pigments() {
    let pigment = |keys: &str| {
        let scene = read(&format!("\"materials\": {{\"a\": {{\"type\": \"hair\"{keys}}}}}"));
        let Surface::Hair(hair) = &scene.materials[0].surface else { panic!("it is hair") };
        hair.pigment.clone()
    };
    assert_eq!(pigment(""), Pigment::Melanin([1.3, 0.0]));
    assert_eq!(pigment(", \"pheomelanin\": 1"), Pigment::Melanin([0.0, 1.0]));
    assert_eq!(pigment(", \"absorption\": [1, 2, 3]"), Pigment::Absorption([1.0, 2.0, 3.0]));
    assert_eq!(pigment(", \"reflectance\": 0.5"), Pigment::Reflectance([0.5; 3].into()));
    let scene = read(r#""materials": {"a": "hair"}"#);
    assert_eq!(scene.materials[0].surface, Hair::default().into());
}

#[test]
fn names_that_are_not_unique_are_kept() {
    let material = |name: &str| Material {
        name: name.to_owned(),
        surface: Diffuse { reflectance: [0.25; 3].into(), two_sided: false }.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    };
    let materials = ["", "a", "a", "a_2", ""].map(material).to_vec().into();
    let scene = Scene { materials, name: "same".to_owned(), ..Scene::default() };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("names.json");
    save(&scene, &path, false).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(load(&path).unwrap_or_else(|error| panic!("{error}")), scene);
}

#[test]
fn numbers_are_kept_to_the_bit() {
    let mut scene =
        read(r#""objects": [{"type": "sphere"}], "lights": [{"type": "point", "intensity": 1}]"#);
    let strange = [f32::MIN_POSITIVE, 1e-45, 16_777_217.0, f32::MAX, 0.1, 1.0 / 3.0];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bits.json");
    for numbers in strange.windows(3) {
        let intensity = [numbers[0], numbers[1], numbers[2]];
        scene.lights[0].kind = pt_scene::LightKind::Point { intensity };
        scene.objects[0].to_world.translation.x = -0.0;
        scene.objects[0].to_world.translation.y = 0.1 + 0.2;
        save(&scene, &path, true).unwrap_or_else(|error| panic!("{error}"));
        let read = load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read.lights[0].kind, scene.lights[0].kind);
        let bits = |scene: &Scene| scene.objects[0].to_world.to_cols_array().map(f64::to_bits);
        assert_eq!(bits(&read), bits(&scene));
    }
}

#[test]
fn what_cannot_be_written_is_refused_and_nothing_is_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.json");
    let refusal = |scene: &Scene, name: &str| {
        save(scene, &folder.path().join(name), false).expect_err("it is refused").to_string()
    };
    let mut scene = read(r#""objects": [{"type": "sphere"}]"#);
    assert!(refusal(&scene, "a.dae").contains("unknown scene format for writing; known: .json"));
    scene.objects[0].to_world.translation.x = f64::NAN;
    let message = refusal(&scene, "a.json");
    assert!(message.contains("objects: [0]: to_world: found NaN, expected"), "{message}");
    scene.objects[0].to_world.translation.x = 0.0;
    scene.objects[0].materials = vec![Some(3)];
    assert!(refusal(&scene, "a.json").contains("undefined material 3"));
    scene.objects[0].materials = vec![None];
    save(&scene, &path, false).unwrap_or_else(|error| panic!("{error}"));
    assert!(refusal(&scene, "a.json").contains("exists already"));
    save(&scene, &path, true).unwrap_or_else(|error| panic!("{error}"));
}

/// Complete files are marked as JSON, and single keys as JSON with comments.
#[test]
fn the_examples_of_the_page_are_scenes() {
    let page = include_str!("../../../../docs/scene-file.md");
    let mut count = 0;
    for (mark, around) in [("```json\n", ["", ""]), ("```jsonc\n", ["{\"pathtracer\": 1, ", "}"])] {
        for block in page.split(mark).skip(1) {
            let text = block.split("```").next().unwrap_or_default();
            let [before, after] = around;
            let text = format!("{before}{text}{after}");
            let path = Path::new("test.json");
            if let Err(error) = parse(text.as_bytes(), path) {
                panic!("{error}\n{text}");
            }
            count += 1;
        }
    }
    assert!(count >= 7, "{count}");
}
