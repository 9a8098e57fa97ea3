//! Materials, lights and cameras.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use pt_formats::{LoadError, LoadOptions, parse_with};
use pt_image::SaveOptions;
use pt_scene::image::Image;
use pt_scene::material::Black;
use pt_scene::texture::{Bitmap, Edge, Filter, Pattern, Wrap};
use pt_scene::{Color, LightKind, Material, Projection, Scene, Surface};

use crate::{FILES, good, value};

/// Returns a short description of the material of each object, by name.
fn materials_in_short(scene: &Scene) -> BTreeMap<&str, String> {
    let in_short = |object: &pt_scene::Object| {
        let Some(index) = object.materials[0] else { return "default".to_owned() };
        let material = &scene.materials[index as usize];
        let surface = match &material.surface {
            Surface::Diffuse(m) if m.reflectance.texture().is_some() => "matte texture".to_owned(),
            Surface::Diffuse(m) => format!("matte {:?}", value(&m.reflectance)),
            Surface::Mirror(m) => format!("mirror {:?}", value(&m.reflectance)),
            Surface::Glass(m) => {
                format!("glass {:?} {:?} {}", value(&m.reflectance), value(&m.transmittance), m.ior)
            }
            Surface::Refraction(m) => format!("refraction {:?} {}", value(&m.transmittance), m.ior),
            Surface::Conductor(m) => {
                let alpha = m.roughness.as_ref().map_or(0.0, |r| value(&r.alpha[0]));
                format!("conductor {:?} {:?} {alpha}", m.eta, m.k)
            }
            Surface::Plastic(m) => {
                format!("plastic {:?} {:?} {}", value(&m.diffuse), value(&m.specular), m.alpha)
            }
            Surface::ThinGlass(m) => format!("thin glass {}", m.ior),
            Surface::CoatedDiffuse(m) => format!("coated {:?}", value(&m.diffuse)),
            Surface::Black(_) => "black".to_owned(),
            other => panic!("COLLADA files have no {other:?}"),
        };
        match value(&material.emission) {
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
        ("textured", "matte texture"),
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

/// tan(x/2) = aspect · tan(y/2), for all cameras except the one with both angles; and half of the
/// width is aspect times half of the height for parallel rays.
#[test]
fn cameras_get_both_fields_of_view() {
    let scene = good("lights_cameras.dae");
    let tangent = |angle: f64| (angle.to_radians() / 2.0).tan();
    let half = |c: &pt_scene::Camera| match c.projection {
        Projection::Perspective { x_fov, y_fov } => [x_fov, y_fov].map(tangent),
        Projection::Orthographic { half_width, half_height } => [half_width, half_height],
        Projection::Panorama => panic!("{c:?}"),
    };
    let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
    let perspective = ["both", "x and aspect", "y and aspect", "aspect", "x"];
    assert_eq!(names[..5], perspective);
    assert_eq!(names[5..], ["flat", "flat both", "flat y and aspect"]);
    let t = tangent;
    let expected = [
        [t(90.), t(60.)],
        [1.0, 0.5],
        [0.5, 1.0],
        [t(50.), t(50.)],
        [t(60.), t(60.) * 0.75],
        [1.0, 0.75],
        [3.0, 2.0],
        [4.0, 2.0],
    ];
    for (i, (camera, expected)) in scene.cameras.iter().zip(expected).enumerate() {
        let found = half(camera);
        assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-12), "{camera:?}");
        let is_parallel = matches!(camera.projection, Projection::Orthographic { .. });
        assert_eq!(is_parallel, i >= 5, "{camera:?}");
    }
    let distances: Vec<_> = scene.cameras.iter().map(|c| (c.near, c.far)).collect();
    assert_eq!(distances[..3], [(0.5, 20.0), (0.5, 20.0), (0.001, 1000.0)]);
    assert_eq!(distances[6], (0.25, 30.0));
}

/// If a file uses the course's profile for its materials, the rest of it is also for the course:
/// modelling tools write a glossy part beside every colour, which the course's program ignores.
#[test]
fn common_materials_of_course_files_are_matte() {
    let text = crate::good_text("materials_common.dae");
    let mark = "<library_effects>";
    let course = "<library_effects><effect id=\"of-course\"><extra><technique profile=\"CGL\">\
                  <mirror><reflectance>1 1 1</reflectance></mirror></technique></extra></effect>";
    assert!(text.contains(mark));
    let text = text.replacen(mark, course, 1);
    let scene = crate::read(&text).expect("a good file");
    let looks = materials_in_short(&scene);
    assert_eq!(looks["phong"], "matte [0.1, 0.2, 0.3]");
    assert_eq!(looks["blinn"], "matte [0.1, 0.2, 0.3]");
}

// ---- textures ----------------------------------------------------------------------------------

/// Returns the material of each object, by name.
fn materials(scene: &Scene) -> BTreeMap<&str, &Material> {
    let of = |object: &pt_scene::Object| {
        object.materials[0].map_or(&scene.materials[0], |m| &scene.materials[m as usize])
    };
    scene.objects.iter().map(|o| (o.name.as_str(), of(o))).collect()
}

fn diffuse(material: &Material) -> &Color {
    match &material.surface {
        Surface::Diffuse(m) => &m.reflectance,
        Surface::Plastic(m) => &m.diffuse,
        other => panic!("{other:?} is not diffuse"),
    }
}

fn bitmap(color: &Color) -> &Bitmap {
    match color.texture().map(|t| &t.pattern) {
        Some(Pattern::Bitmap(bitmap)) => bitmap,
        _ => panic!("{color:?} is no image"),
    }
}

/// Parses a scene that may refer to files of other folders.
fn parse_anywhere(bytes: &[u8], file: &Path) -> Result<Scene, LoadError> {
    parse_with(bytes, file, &LoadOptions { allow_outside: true, ..LoadOptions::default() })
}

/// A texture is found through sampler, surface and image, as far as the exporter wrote these.
/// Images have mipmaps, and are read once.
#[test]
fn images_paint_materials() {
    let file = Path::new(FILES).join("textures.dae");
    let bytes = std::fs::read(&file).expect("a readable file");
    let scene = parse_anywhere(&bytes, &file).unwrap_or_else(|error| panic!("{error}"));
    let all = materials(&scene);
    let first = bitmap(diffuse(all["diffuse"]));
    assert_eq!(
        (first.image.width, first.wrap, first.filter),
        (32, Wrap::REPEAT, Filter::Trilinear)
    );
    let wraps = ["clamped", "bordered", "mixed"].map(|name| bitmap(diffuse(all[name])).wrap);
    assert_eq!(wraps, [Wrap::CLAMP, Wrap::BLACK, Wrap { u: Edge::Mirror, v: Edge::Repeat }]);
    let screen = all["screen"];
    assert_eq!(screen.surface, Black.into());
    let Surface::Plastic(varnish) = &all["varnish"].surface else { panic!("no gloss") };
    let same = [&screen.emission, &varnish.diffuse, diffuse(all["curtain"])];
    assert!(same.iter().all(|color| Arc::ptr_eq(&bitmap(color).image, &first.image)));
    assert!(!Arc::ptr_eq(&bitmap(&varnish.specular).image, &first.image));
    for name in ["lost", "unnamed"] {
        let Color::Texture(texture) = diffuse(all[name]) else { panic!("{name} is of one colour") };
        let squares = [[1.0, 0.0, 1.0], [0.0; 3]];
        assert_eq!(texture.pattern, Pattern::Checkerboard(squares), "{name}");
    }
    // Differences from the author's intent are reported with file, element and replacement.
    let reported = scene.warnings.iter().chain(&scene.missing);
    let warnings: Vec<_> = reported.map(ToString::to_string).collect();
    let expected = [
        "<border_color> of effect \"bordered-effect\": \"0 0.5 0 1\" around an image is replaced \
         by black",
        "<reflective> of effect \"chrome-effect\": the texture",
        "<transparent> of effect \"curtain-effect\": the texture",
        "<diffuse> of effect \"lost-effect\": the texture \"lost.png\" is not shown",
        "<diffuse> of effect \"unnamed-effect\": the texture \"nothing\" is not shown",
    ];
    assert_eq!(warnings.len(), expected.len(), "{warnings:#?}");
    for (warning, expected) in warnings.iter().zip(expected) {
        assert!(warning.contains(expected), "{warning}");
    }
}

/// Images may be in any folder, by a URL of a file or by a path; the course's program ignores them.
#[test]
fn images_are_found_by_url_and_path() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a picture.png");
    let image = Image { width: 1, height: 1, pixels: vec![[1.0, 0.0, 0.0]].into() };
    pt_image::save(&image, &path, &SaveOptions::default()).expect("a writable folder");
    let file = folder.path().join("scene.dae");
    let template = std::fs::read_to_string(format!("{FILES}/textures.dae")).expect("a file");
    let color = |written: &str, more: &str| {
        let text = template.replace("<init_from>lost.png", &format!("<init_from>{written}"));
        let scene = parse_anywhere(
            text.replace("<lambert>", &format!("{more}<lambert>")).as_bytes(),
            &file,
        );
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        diffuse(materials(&scene)["lost"]).clone()
    };
    let (absolute, escaped) =
        (path.display().to_string(), path.display().to_string().replace(' ', "%20"));
    for written in [
        "a picture.png",
        "./a%20picture.png",
        &absolute,
        &format!("file://{escaped}"),
        &format!("file://localhost{escaped}"),
        &format!("file://{absolute}"),
    ] {
        assert_eq!(bitmap(&color(written, "")).image.pixels, [[1.0, 0.0, 0.0]], "{written}");
    }
    let profile = "<extra><technique profile=\"CGL\"><mirror/></technique></extra>";
    let has_cgl_shading = template.replacen(
        "</profile_COMMON></effect>",
        &format!("</profile_COMMON>{profile}</effect>"),
        1,
    );
    let scene =
        parse_anywhere(has_cgl_shading.as_bytes(), &file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(*diffuse(materials(&scene)["clamped"]), [0.5; 3].into());
}

/// At the root mean square distance, a light is as strong as in the file: at 3 units from the
/// centre of a cube of side 2, this is √10; at twice the distance, the light has a quarter. A light
/// that falls off with the square alone is the same everywhere. The course's program ignores
/// attenuation.
#[test]
fn lights_are_as_strong_as_their_attenuation_says() {
    let text = |terms: &str| {
        format!(
            r##"<COLLADA version="1.4.1"><asset><unit meter="0.5"/></asset>
            <library_lights><light id="l"><technique_common><point><color>1 2 4</color>{terms}</point></technique_common></light></library_lights>
            <library_geometries><geometry id="g"><mesh>
            <source id="p"><float_array id="a" count="9">-1 -1 -1 1 1 1 1 -1 1</float_array><technique_common>
            <accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
            <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
            <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
            <library_visual_scenes><visual_scene id="s"><node><translate>3 0 0</translate><instance_light url="#l"/></node>
            <node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
            <scene><instance_visual_scene url="#s"/></scene></COLLADA>"##
        )
    };
    let intensity = |terms: &str, ignore_attenuation: bool| {
        let options = LoadOptions { ignore_attenuation, ..LoadOptions::default() };
        let scene = parse_with(text(terms).as_bytes(), Path::new("light.dae"), &options).unwrap();
        let LightKind::Point { intensity } = scene.lights[0].kind else { panic!("a point") };
        let is_noted = scene.warnings.iter().any(|w| w.message.contains("middle distance"));
        (intensity[0], is_noted)
    };
    assert_eq!(intensity("", false), (1.0, false));
    let square = "<constant_attenuation>0</constant_attenuation><quadratic_attenuation>2</quadratic_attenuation>";
    assert_eq!(intensity(square, false), (0.125, false), "half a metre is a unit");
    assert_eq!(intensity(square, true), (1.0, false));
    let even = "<constant_attenuation>4</constant_attenuation>";
    assert_eq!(intensity(even, false), (0.25 * 10.0 / 4.0, true));
    let zero = "<constant_attenuation>0</constant_attenuation>";
    assert_eq!(intensity(zero, false), (1.0, false));
}
