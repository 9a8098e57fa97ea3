//! Omissions and variants of exporters: sides of views, opacity, paths, sets of texture
//! coordinates.

use std::path::Path;

use pt_formats::parse;
use pt_image::{SaveOptions, save};
use pt_scene::image::Image;
use pt_scene::{Color, Fit, Geometry, Projection, Scene, Surface};

/// Returns a square with two sets of texture coordinates, the second of which is twice the first,
/// with a material of an effect, and a camera.
fn text(optics: &str, binding: &str, effect: &str) -> String {
    let source = |id: &str, names: &[&str], values: &str| {
        let param = |name: &&str| format!("<param name=\"{name}\" type=\"float\"/>");
        let params = names.iter().map(param).collect::<Vec<_>>().concat();
        let (count, stride) = (values.split(' ').count(), names.len());
        format!(
            "<source id=\"{id}\"><float_array id=\"{id}a\" count=\"{count}\">{values}</float_array><technique_common>\
             <accessor source=\"#{id}a\" count=\"{}\" stride=\"{stride}\">{params}</accessor></technique_common></source>",
            count / stride
        )
    };
    let sources = [
        source("p", &["X", "Y", "Z"], "0 0 0 1 0 0 1 1 0"),
        source("t", &["S", "T"], "0 0 1 0 1 1"),
        source("u", &["S", "T"], "0 0 2 0 2 2"),
    ]
    .concat();
    format!(
        "<COLLADA version=\"1.4.1\"><library_cameras><camera id=\"c\"><optics><technique_common>{optics}\
         </technique_common></optics></camera></library_cameras>\
         <library_effects><effect id=\"e\"><profile_COMMON><technique sid=\"c\"><lambert>{effect}</lambert></technique>\
         </profile_COMMON></effect></library_effects>\
         <library_materials><material id=\"m\"><instance_effect url=\"#e\"/></material></library_materials>\
         <library_geometries><geometry id=\"g\"><mesh>{sources}<vertices id=\"v\"><input semantic=\"POSITION\" \
         source=\"#p\"/></vertices><triangles count=\"1\" material=\"s\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>\
         <input semantic=\"TEXCOORD\" source=\"#t\" offset=\"1\" set=\"0\"/><input semantic=\"TEXCOORD\" source=\"#u\" \
         offset=\"1\" set=\"1\"/><p>0 0 1 1 2 2</p></triangles></mesh></geometry></library_geometries>\
         <library_visual_scenes><visual_scene id=\"s\"><node><instance_camera url=\"#c\"/><instance_geometry url=\"#g\">\
         <bind_material><technique_common><instance_material symbol=\"s\" target=\"#m\">{binding}</instance_material>\
         </technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\
         <scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>"
    )
}

fn read(text: &str, path: &Path) -> Scene {
    parse(text.as_bytes(), path).unwrap_or_else(|error| panic!("{error}"))
}

fn seen(optics: &str) -> (Projection, Fit, String) {
    let scene = read(&text(optics, "", ""), Path::new("a.dae"));
    let notes: Vec<_> = scene.warnings.iter().map(ToString::to_string).collect();
    (scene.cameras[0].projection, scene.cameras[0].fit, notes.join("\n"))
}

/// A single given side is kept for each image; with a ratio, or both sides, each image contains all
/// of the view.
#[test]
fn a_side_of_a_view_that_stands_alone_is_kept() {
    let view = |inner: &str| seen(&format!("<perspective>{inner}</perspective>"));
    let (x, y) = ("<xfov>60</xfov>", "<yfov>40</yfov>");
    let ratio = "<aspect_ratio>2</aspect_ratio>";
    for (inner, expected) in [
        (x.to_owned(), Fit::Width),
        (y.to_owned(), Fit::Height),
        (format!("{x}{y}"), Fit::Whole),
        (format!("{x}{ratio}"), Fit::Whole),
        (format!("{y}{ratio}"), Fit::Whole),
    ] {
        let (projection, fit, notes) = view(&inner);
        let Projection::Perspective { x_fov, y_fov } = projection else { panic!("{projection:?}") };
        assert!(!inner.contains("xfov") || x_fov == 60.0);
        assert!(!inner.contains("yfov") || y_fov == 40.0);
        assert_eq!((fit, notes.as_str()), (expected, ""), "{inner}");
    }
    let flat = |inner: &str| seen(&format!("<orthographic>{inner}</orthographic>")).1;
    assert_eq!(flat("<xmag>2</xmag>"), Fit::Width);
    assert_eq!(flat("<ymag>2</ymag>"), Fit::Height);
    assert_eq!(flat("<xmag>2</xmag><ymag>2</ymag>"), Fit::Whole);
    // tan(40°/2) · 2 is the tangent of half of 72.1°.
    assert_eq!(view(&format!("<xfov>72.1</xfov>{y}{ratio}")).2, "");
    assert!(view(&format!("{x}{y}{ratio}")).2.contains("inconsistent width, height"));
    let (projection, _, notes) = view("");
    assert!(matches!(projection, Projection::Perspective { x_fov: 50.0, .. }));
    assert!(notes.contains("missing <xfov> and <yfov>; <xfov> 50 is used"), "{notes}");
}

/// The transmittance is 1 − a t, a t, 1 − c t and c t for a colour c with alpha a, and t alone
/// scales a colour of ones. [COLLADA 1.5.0, "Determining Transparency"]
#[test]
fn all_modes_of_opacity_say_what_passes() {
    let color = |mode: &str, color: &str| {
        format!("<transparent{mode}><color>{color}</color></transparent>")
    };
    let amount = |t: &str| format!("<transparency><float>{t}</float></transparency>");
    for (effect, passes) in [
        (amount("0"), true),
        (amount("1"), false),
        (color("", "0 0 0 1") + &amount("1"), false),
        (color("", "0 0 0 1") + &amount("0"), true),
        (color(" opaque=\"A_ONE\"", "1 1 1 0"), true),
        (color(" opaque=\"A_ZERO\"", "1 1 1 0"), false),
        (color(" opaque=\"A_ZERO\"", "0 0 0 1"), true),
        (color(" opaque=\"RGB_ZERO\"", "1 1 1 0"), true),
        (color(" opaque=\"RGB_ZERO\"", "1 1 1 0") + &amount("0"), false),
        (color(" opaque=\"RGB_ONE\"", "1 1 1 0"), false),
        (color(" opaque=\"RGB_ONE\"", "0 0 0 1"), true),
    ] {
        let scene = read(&text("<perspective/>", "", &effect), Path::new("a.dae"));
        let is_glass = matches!(scene.materials[0].surface, Surface::Glass(_));
        assert_eq!(is_glass, passes, "{effect}");
    }
}

/// An effect names coordinates, and an instance assigns the number of a set to them.
#[test]
fn texture_coordinates_are_those_of_the_set_that_is_bound() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = Image { width: 1, height: 1, pixels: vec![[1.0; 3]].into() };
    save(&image, &folder.path().join("a.png"), &SaveOptions::default()).expect("it is written");
    let effect = "<diffuse><texture texture=\"a.png\" texcoord=\"layout\"/></diffuse>";
    let bind = |name: &str, set: &str| {
        format!("<bind_vertex_input semantic=\"{name}\" input_semantic=\"TEXCOORD\"{set}/>")
    };
    for (binding, last, note) in [
        (String::new(), [1.0, 1.0], ""),
        (bind("layout", " input_set=\"0\""), [1.0, 1.0], ""),
        (bind("layout", " input_set=\"1\""), [2.0, 2.0], ""),
        (bind("other", " input_set=\"1\""), [1.0, 1.0], ""),
        (bind("layout", ""), [1.0, 1.0], ""),
        (bind("layout", " input_set=\"7\""), [1.0, 1.0], "missing set 7"),
    ] {
        let scene = read(
            &text("<perspective><xfov>9</xfov></perspective>", &binding, effect),
            &folder.path().join("a.dae"),
        );
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
        let uvs = mesh.uvs.as_ref().expect("coordinates");
        let corner = uvs.corners(0, mesh.triangles[0])[2];
        assert_eq!(uvs.values[corner as usize], last, "{binding}");
        let notes: Vec<_> = scene.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(notes.is_empty(), note.is_empty(), "{notes:?}");
        assert!(notes.iter().all(|n| n.contains(note)), "{notes:?}");
    }
}

/// Paths of Windows and of other machines, and their URLs.
#[test]
fn images_are_found_by_the_paths_of_other_machines() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("my maps")).expect("a folder");
    for (name, color) in [("my maps/a.png", [1.0, 0.0, 0.0]), ("b.png", [0.0, 1.0, 0.0])] {
        let image = Image { width: 1, height: 1, pixels: vec![color].into() };
        save(&image, &folder.path().join(name), &SaveOptions::default()).expect("it is written");
    }
    for (written, expected) in [
        ("my maps/a.png", [1.0, 0.0, 0.0]),
        ("my%20maps/a.png", [1.0, 0.0, 0.0]),
        ("my maps\\a.png", [1.0, 0.0, 0.0]),
        (".\\my%20maps\\a.png", [1.0, 0.0, 0.0]),
        ("file:///C:/projects/lamp/my%20maps/a.png", [1.0, 0.0, 0.0]),
        ("C:\\projects\\lamp\\my maps\\a.png", [1.0, 0.0, 0.0]),
        ("file://D:/other/a/b.png", [0.0, 1.0, 0.0]),
        ("file:b.png", [0.0, 1.0, 0.0]),
        ("/home/somebody/lamp/b.png", [0.0, 1.0, 0.0]),
    ] {
        let effect = format!("<diffuse><texture texture=\"{written}\" texcoord=\"t\"/></diffuse>");
        let scene = read(&text("<perspective/>", "", &effect), &folder.path().join("a.dae"));
        assert!(scene.missing.is_empty(), "{written}: {:?}", scene.missing);
        let Surface::Diffuse(matte) = &scene.materials[0].surface else { panic!("not matte") };
        let Color::Texture(texture) = &matte.reflectance else { panic!("{written}: no texture") };
        let pt_scene::texture::Pattern::Bitmap(bitmap) = &texture.pattern else {
            panic!("{written}")
        };
        assert_eq!(bitmap.image.pixels, [expected], "{written}");
    }
}

/// A missing camera or light has no further consequences, except in strict mode.
#[test]
fn cameras_and_lights_that_are_not_there_are_left_out() {
    let text = |instance: &str| {
        format!(
            "<COLLADA version=\"1.4.1\"><library_lights><light id=\"l\"><technique_common><point><color>1 1 1</color>\
             </point></technique_common></light></library_lights><library_visual_scenes><visual_scene id=\"s\"><node>\
             <instance_light url=\"#l\"/>{instance}</node></visual_scene></library_visual_scenes>\
             <scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>"
        )
    };
    for kind in ["camera", "light"] {
        let text = text(&format!("<instance_{kind} url=\"#none\"/>"));
        let read = |strict: bool| {
            let options = pt_formats::LoadOptions { strict, ..Default::default() };
            pt_formats::parse_with(text.as_bytes(), std::path::Path::new("a.dae"), &options)
        };
        let scene = read(false).expect("the rest is shown");
        assert_eq!(scene.lights.len(), 1);
        let wanted = format!("expected the id of a <{kind}> of this file");
        let is_noted = |w: &pt_scene::Warning| {
            w.message.contains(&wanted) && w.message.ends_with("; the instance is omitted")
        };
        assert!(scene.warnings.iter().any(is_noted), "{:?}", scene.warnings);
        let message = read(true).expect_err("strict").to_string();
        assert!(message.contains(&wanted), "{message}");
    }
}
