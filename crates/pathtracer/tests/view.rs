//! Cameras: selection, placement, and notes about cameras that see nothing.

use std::path::Path;

use pathtracer::compat::cs184;
use pathtracer::{
    CompileOptions, EnvironmentMap, FORMATS, Hint, LoadError, LoadOptions, Placement, Projection,
    Scene, Session, Settings, Silent,
};

fn read(text: &str, name: &str, options: &LoadOptions) -> Result<Scene, LoadError> {
    let ending = name.rsplit('.').next().expect("an ending");
    let format = FORMATS.iter().find(|format| format.extensions.contains(&ending));
    format.expect("a known format").parse(text.as_bytes(), Path::new(name), options)
}

fn json(text: &str) -> Scene {
    let text = format!("{{\"pathtracer\": 1, {text}}}");
    read(&text, "a.json", &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn session(scene: &Scene, options: CompileOptions) -> Session {
    let settings = Settings { spp: 1, max_depth: 1, ..Settings::default() };
    Session::new(scene, options, settings).expect("a scene that can be rendered")
}

fn at(resolution: [u32; 2]) -> CompileOptions {
    CompileOptions { resolution: Some(resolution), ..CompileOptions::default() }
}

/// Notes on the place of the camera, which come with a hint.
fn advice(scene: &Scene) -> Vec<String> {
    let session = session(scene, at([48, 36]));
    let is_on_camera = |note: &&String| note.starts_with("the camera ");
    let notes: Vec<_> = session.notes().iter().filter(is_on_camera).cloned().collect();
    assert_eq!(session.hints().contains(&Hint::FitCamera), !notes.is_empty(), "{notes:?}");
    notes
}

/// Box without a front: 2 wide, high and deep, its floor at y = 0. The camera is 4 in front of it.
fn open_box(camera_height: f64) -> String {
    let wall = |translate: &str, rotate: &str| {
        format!(r#"{{"type": "rectangle", "to_world": [{rotate} {{"translate": {translate}}}]}}"#)
    };
    let turn = |axis: &str, degrees: i32| format!(r#"{{"rotate": {degrees}, "axis": {axis}}},"#);
    let walls = [
        wall("[0, 0, 0]", &turn("[1, 0, 0]", -90)),
        wall("[0, 2, 0]", &turn("[1, 0, 0]", 90)),
        wall("[0, 1, -1]", ""),
        wall("[-1, 1, 0]", &turn("[0, 1, 0]", 90)),
        wall("[1, 1, 0]", &turn("[0, 1, 0]", -90)),
    ];
    format!(
        r#""cameras": [{{"type": "perspective", "x_fov": 40, "y_fov": 31, "to_world": {{"translate": [0, {camera_height}, 4]}}}}],
        "lights": [{{"type": "point", "intensity": 5, "to_world": {{"translate": [0, 1, 0]}}}}],
        "objects": [{}]"#,
        walls.join(", ")
    )
}

/// From the height of the floor the lower half of the image is empty; from the middle of the box it
/// is not. A fitted camera shows the box.
#[test]
fn a_camera_at_the_height_of_the_floor_is_noted() {
    let floor = json(&open_box(0.0));
    assert_eq!(advice(&json(&open_box(1.0))), [""; 0]);
    let notes = advice(&floor);
    assert!(notes.len() == 1 && notes[0].contains("at least half"), "{notes:?}");
    let fit = CompileOptions { placement: Some(Placement::Fit), ..at([48, 36]) };
    let fitted = session(&floor, fit);
    assert!(!fitted.hints().contains(&Hint::FitCamera));
}

fn camera(from: &str, to: &str) -> String {
    format!(
        r#""cameras": [{{"type": "perspective", "x_fov": 40, "y_fov": 31, "to_world": {{"look_at": {to}, "from": {from}}}}}]"#
    )
}

const SUN: &str = r#"{"type": "directional", "irradiance": 3, "to_world": {"look_at": [0, 0, 0], "from": [1, 2, 1]}}"#;
const LAMP: &str = r#"{"type": "point", "intensity": 3, "to_world": {"translate": [0, 9, 3]}}"#;
const GROUND: &str =
    r#"{"type": "rectangle", "to_world": [{"scale": 50}, {"rotate": -90, "axis": [1, 0, 0]}]}"#;
const HOUSE: &str = r#"{"type": "cube", "to_world": [{"scale": 3}, {"translate": [0, 3, -9]}]}"#;
const BALL: &str = r#"{"type": "sphere", "radius": 0.5}"#;

#[test]
fn a_camera_that_sees_nothing_is_noted() {
    for (what, text) in [
        (
            "away",
            format!(
                "{}, \"lights\": [{LAMP}], \"objects\": [{BALL}]",
                camera("[0, 0, 3]", "[0, 0, 9]")
            ),
        ),
        (
            "past",
            format!(
                "{}, \"lights\": [{SUN}], \"objects\": [{BALL}]",
                camera("[0, 0, 3]", "[3, 0, 0]")
            ),
        ),
    ] {
        let notes = advice(&json(&text));
        assert!(notes.len() == 1 && notes[0].contains("is empty"), "{what}: {notes:?}");
    }
}

/// Inside of a matte ball or cube there is a note; not if a lamp is inside, nor if it is of glass.
#[test]
fn a_camera_inside_of_something_dark_is_noted() {
    let inside = |shape: &str, light: &str| {
        let camera = camera("[0, 0.1, 0.2]", "[0, 0, -1]");
        let ground = GROUND.replace("[1, 0, 0]}", "[1, 0, 0]}, {\"translate\": [0, -2, 0]}");
        let materials = r#"{"glass": {"type": "glass"}, "lamp": {"type": "black", "emission": 1}}"#;
        advice(&json(&format!(
            "{camera}, \"materials\": {materials}, \"lights\": [{light}], \"objects\": [{ground}, {shape}]"
        )))
    };
    let near = r#"{"type": "point", "intensity": 3, "to_world": {"translate": [0, -0.3, 0]}}"#;
    for shape in [BALL, r#"{"type": "cube"}"#] {
        for light in [LAMP, SUN, r#"{"type": "constant", "radiance": 1}"#] {
            let notes = inside(shape, light);
            assert!(notes.len() == 1 && notes[0].contains("inside of"), "{shape}: {notes:?}");
        }
        assert_eq!(inside(shape, near), [""; 0], "{shape}");
    }
    let glass = r#"{"type": "sphere", "material": "glass"}"#;
    let lamp = r#"{"type": "sphere", "material": "lamp"}"#;
    for shape in [glass, lamp] {
        assert_eq!(inside(shape, LAMP), [""; 0], "{shape}");
    }
}

/// Half of an outdoor image is the environment, whether bright or, with the sun alone, black; an
/// object in front of a black background may cover little of the image, and be smaller than a
/// pixel.
#[test]
fn ordinary_views_have_no_note() {
    let sky = r#"{"type": "constant", "radiance": 1}"#;
    let dome = r#"{"type": "hemisphere", "radiance": 1}"#;
    let outside = camera("[0, 1.7, 12]", "[0, 1.7, 0]");
    let speck = r#"{"type": "sphere", "radius": 1e-3, "to_world": {"translate": [0.3, 0.1, 0]}}"#;
    let low = camera("[0, -0.5, 3]", "[0, 0, 0]");
    for (camera, lights, objects) in [
        (&outside, sky, [GROUND, HOUSE]),
        (&outside, dome, [GROUND, HOUSE]),
        (&outside, SUN, [GROUND, HOUSE]),
        (&camera("[0, 0.2, 5]", "[0, 3, 0]"), SUN, [GROUND, HOUSE]),
        (&camera("[0, 0, 9]", "[0, 0, 0]"), SUN, [BALL, BALL]),
        (&camera("[0, 0, 9]", "[0, 0, 0]"), LAMP, [speck, speck]),
        (&low, SUN, [BALL, BALL]),
        (&low, sky, [BALL, GROUND]),
        (&camera("[0, 40, 0.1]", "[0, 0, 0]"), SUN, [GROUND, HOUSE]),
        (&camera("[0, 5, 0]", "[0, 20, -3]"), sky, [GROUND, HOUSE]),
    ] {
        let scene = json(&format!(
            "{camera}, \"lights\": [{lights}], \"objects\": [{}]",
            objects.join(", ")
        ));
        assert_eq!(advice(&scene), [""; 0], "{camera} {lights} {objects:?}");
    }
}

/// A scene whose lights are all black has a note; not if one is not black, nor with an environment
/// map.
#[test]
fn lights_that_emit_nothing_are_noted() {
    let camera = camera("[0, 0, 9]", "[0, 0, 0]");
    let off = r#"{"type": "hemisphere", "radiance": 0}"#;
    let noted = |lights: &str, more: bool| {
        let scene = json(&format!("{camera}, \"lights\": [{lights}], \"objects\": [{BALL}]"));
        let map = EnvironmentMap::new(2, 1, vec![[1.0; 3]; 2]);
        let options = CompileOptions { environment: more.then_some(map), ..at([8, 6]) };
        session(&scene, options).notes().iter().any(|note| note.contains("no light of the scene"))
    };
    assert!(noted(off, false));
    assert!(!noted(&format!("{off}, {SUN}"), false));
    assert!(!noted(off, true));
}

/// A vertex that no triangle uses does not change the image of a scene without a camera.
#[test]
fn unused_vertices_do_not_move_the_camera() {
    let mesh = |more: &str| {
        format!(
            r#""objects": [{{"type": "mesh", "mesh": {{"positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]{more}],
            "triangles": [[0, 1, 2], [0, 2, 3]{}]}}}}]"#,
            if more.is_empty() { "" } else { ", [4, 4, 4], [0, 5, 0]" }
        )
    };
    let image = |more: &str, placement: Option<Placement>| {
        let options = CompileOptions { studio: true, placement, ..at([16, 12]) };
        let mut session = session(&json(&mesh(more)), options);
        session.render(1, 16, &Silent).expect("it renders");
        session.image().pixels
    };
    let far = ", [1e7, 0, 0], [0, -3e8, 0], [0, 0, 1e9]";
    for placement in [None, Some(Placement::Fit)] {
        let wanted = image("", placement);
        let dark = wanted.iter().filter(|pixel| **pixel != wanted[0]).count();
        assert!(dark > 16, "something is seen");
        assert_eq!(image(far, placement), wanted);
    }
}

/// File with the course's profile, a camera at the height of the floor with the direction +y and z
/// up, and a ball.
fn course_file(profile: &str, transform: &str) -> String {
    format!(
        r##"<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
        <asset><up_axis>Z_UP</up_axis></asset>
        <library_cameras><camera id="c" name="Camera"><optics><technique_common><perspective>
        <xfov>40</xfov><aspect_ratio>1.333333</aspect_ratio><znear>0.1</znear><zfar>100</zfar>
        </perspective></technique_common></optics></camera></library_cameras>
        <library_geometries><geometry id="g" name="g"><extra><technique profile="{profile}">
        <sphere><radius>2</radius></sphere></technique></extra></geometry></library_geometries>
        <library_visual_scenes><visual_scene id="s">
        <node id="n" name="n">{transform}<instance_camera url="#c"/></node>
        <node id="m" name="m"><matrix>1 0 0 0 0 1 0 5 0 0 1 2 0 0 0 1</matrix><instance_geometry url="#g"/></node>
        </visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
    )
}

const MATRIX: &str = "<matrix>1 0 0 0 0 0 -1 -4 0 1 0 0 0 0 0 1</matrix>";

/// The camera of the file is at (0, −4, 0) with the direction +y, z being up, so that the point in
/// front of it is (0, −3, 0): (0, 0, −3) in the world, where y is up. So the view is from −z. The
/// ball is at (0, 5, 2), in the world (0, 2, 5), and its bounding box has sides of 4. Images of 480
/// columns show the middle of the course's window of 800 columns, and images of other sizes the
/// same.
#[test]
fn files_of_the_course_are_seen_as_the_course_sees_them() {
    let options = LoadOptions::default();
    for profile in ["CGL", "CMU462"] {
        let scene = read(&course_file(profile, MATRIX), "a.dae", &options).expect("a good file");
        for resolution in [[480, 360], [240, 180]] {
            let session = session(&scene, at(resolution));
            let camera = session.scene().camera;
            let distance = 1.5 * 48_f32.sqrt();
            let wanted = pt_math::Vec3::new(0.0, 2.0, 5.0 - distance);
            assert!(camera.position.distance(wanted) < 1e-4, "{}", camera.position);
            let half = 0.6 * 20_f32.to_radians().tan();
            assert!((camera.half_extent[0] - half).abs() < 1e-5, "the same view at any size");
            let of_course = CompileOptions { policies: cs184::POLICIES, ..at([480, 360]) };
            let course = self::session(&scene, of_course).scene().camera;
            assert_eq!((course.position, course.forward), (camera.position, camera.forward));
            let difference = |i: usize| (course.half_extent[i] - camera.half_extent[i]).abs();
            assert!(difference(0) < 1e-6 && difference(1) < 1e-6, "{:?}", course.half_extent);
            assert!(session.hints().contains(&Hint::CameraOfFile));
        }
        for placement in [Placement::Node, Placement::Course] {
            let options = CompileOptions { placement: Some(placement), ..at([48, 36]) };
            let session = session(&scene, options);
            assert!(!session.hints().contains(&Hint::CameraOfFile));
            let at_node =
                session.scene().camera.position.distance(pt_math::Vec3::new(0.0, 0.0, -4.0));
            assert_eq!(at_node < 1e-5, placement == Placement::Node);
        }
    }
}

/// Other files keep their camera: those without the profile, and those whose camera is placed by
/// elements that the course's program cannot read.
#[test]
fn other_files_are_seen_from_their_cameras() {
    let placed = "<translate>0 -4 0</translate><rotate>1 0 0 90</rotate>";
    let look = "<lookat>0 -4 0 0 0 0 0 0 1</lookat>";
    for (profile, transform) in [("CGL", placed), ("CGL", look), ("blender", MATRIX)] {
        let text = course_file(profile, transform);
        let scene = read(&text, "a.dae", &LoadOptions::default()).expect("a good file");
        let camera = scene.camera().expect("a camera");
        assert_eq!(camera.placement, Placement::Node, "{profile} {transform}");
    }
}

/// In the course's mode the size of a pixel is kept: half of the columns show half of the view.
#[test]
fn the_course_mode_keeps_the_size_of_pixels() {
    let scene = read(&course_file("CGL", MATRIX), "a.dae", &LoadOptions::default()).unwrap();
    let width = |resolution| {
        let options = CompileOptions { policies: cs184::POLICIES, ..at(resolution) };
        session(&scene, options).scene().camera.half_extent[0]
    };
    let (whole, half) = (width([800, 600]), width([400, 300]));
    assert!((whole - 20_f32.to_radians().tan()).abs() < 1e-5 && (half - 0.5 * whole).abs() < 1e-6);
}

/// Three cameras with fields of view of 30, 40 and 50 degrees, in every format that can have
/// several.
fn with_cameras() -> Vec<(&'static str, String)> {
    let fields = [30, 40, 50];
    let json: Vec<_> = fields
        .iter()
        .map(|fov| {
            format!(
                r#"{{"name": "at {fov}", "type": "perspective", "x_fov": {fov}, "y_fov": {fov}}}"#
            )
        })
        .collect();
    let sensors = fields
        .iter()
        .map(|fov| {
            format!(
                "<sensor type=\"perspective\" id=\"at {fov}\"><float name=\"fov\" value=\"{fov}\"/>\
                 <film type=\"hdrfilm\"><integer name=\"width\" value=\"{fov}\"/><integer name=\"height\" \
                 value=\"{fov}\"/></film></sensor>"
            )
        })
        .collect::<Vec<_>>()
        .concat();
    let views: Vec<_> = fields
        .iter()
        .map(|fov| {
            let y = f64::from(*fov).to_radians();
            format!(r#"{{"type": "perspective", "perspective": {{"yfov": {y}, "aspectRatio": 1, "znear": 0.1}}}}"#)
        })
        .collect();
    let nodes: Vec<_> =
        (0..3).map(|i| format!(r#"{{"camera": {i}, "name": "at {}"}}"#, fields[i])).collect();
    let optics = fields
        .iter()
        .map(|fov| {
            format!(
                "<camera id=\"c{fov}\" name=\"at {fov}\"><optics><technique_common><perspective><xfov>{fov}</xfov>\
                 <yfov>{fov}</yfov></perspective></technique_common></optics></camera>"
            )
        })
        .collect::<Vec<_>>()
        .concat();
    let instances = fields
        .iter()
        .map(|fov| format!("<node id=\"n{fov}\"><instance_camera url=\"#c{fov}\"/></node>"))
        .collect::<Vec<_>>()
        .concat();
    vec![
        ("a.json", format!("{{\"pathtracer\": 1, \"cameras\": [{}]}}", json.join(", "))),
        ("a.xml", format!("<scene version=\"3.0.0\">{sensors}</scene>")),
        (
            "a.gltf",
            format!(
                r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0, 1, 2]}}],
                "nodes": [{}], "cameras": [{}]}}"#,
                nodes.join(", "),
                views.join(", ")
            ),
        ),
        (
            "a.dae",
            format!(
                "<COLLADA version=\"1.4.1\"><library_cameras>{optics}</library_cameras><library_visual_scenes>\
                 <visual_scene id=\"s\">{instances}</visual_scene></library_visual_scenes><scene>\
                 <instance_visual_scene url=\"#s\"/></scene></COLLADA>"
            ),
        ),
    ]
}

fn field(scene: &Scene) -> f64 {
    let Projection::Perspective { x_fov, .. } = scene.camera().expect("a camera").projection else {
        panic!("a perspective")
    };
    x_fov.round()
}

/// By name and by number in the order of the file; Mitsuba and glTF use the first one by default,
/// the others the last one. With the camera of a Mitsuba scene comes the size of its film.
#[test]
fn a_camera_is_chosen_by_name_or_number() {
    for (name, text) in with_cameras() {
        let chosen = |camera: Option<&str>| {
            let options =
                LoadOptions { camera: camera.map(str::to_owned), ..LoadOptions::default() };
            read(&text, name, &options)
        };
        let default = chosen(None).unwrap_or_else(|error| panic!("{error}"));
        let first = ["a.xml", "a.gltf"].contains(&name);
        assert_eq!(field(&default), if first { 30.0 } else { 50.0 }, "{name}");
        let notes: Vec<_> = default.warnings.iter().map(ToString::to_string).collect();
        let listed = "0 \"at 30\", 1 \"at 40\", 2 \"at 50\"";
        assert_eq!(
            notes.iter().filter(|note| note.contains(listed)).count(),
            1,
            "{name}: {notes:?}"
        );
        for (camera, wanted) in [("0", 30.0), ("1", 40.0), ("2", 50.0), ("at 40", 40.0)] {
            let scene = chosen(Some(camera)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(field(&scene), wanted, "{name} {camera}");
            let reported =
                scene.warnings.iter().any(|warning| warning.to_string().contains("cameras"));
            assert!(!reported, "{name} {camera}");
            if name == "a.xml" {
                assert_eq!(scene.settings.resolution, Some([wanted as u32; 2]));
            }
        }
        for wrong in ["3", "at 60", "-1", ""] {
            let error = chosen(Some(wrong)).expect_err("no such camera").to_string();
            assert!(error.contains(listed), "{name}: {error}");
        }
    }
}
