//! Lights.

use std::f64::consts::PI;

use pt_image::SaveOptions;
use pt_math::{DAffine3, DMat3, DVec2, DVec3};
use pt_scene::texture::{Bitmap, Filter, Pattern, Wrap};
use pt_scene::{Color, LightKind, Material, Portal, Scalar, Scene};

use super::{read, read_all, refusal};

fn light(text: &str) -> (LightKind, DAffine3) {
    let light = read("", text).lights.to_mut().swap_remove(0);
    (light.kind, light.to_world)
}

fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

fn intensity(text: &str) -> [f32; 3] {
    let (LightKind::Point { intensity }, _) = light(text) else { panic!("no point") };
    intensity
}

/// Returns the emission of the first shape of a world.
fn radiance(scene: &Scene) -> [f32; 3] {
    let Color::Value(radiance) = scene.materials[0].emission else { panic!("a texture") };
    radiance
}

#[test]
fn an_rgb_light_is_that_colour_and_other_spectra_have_luminance_one() {
    assert_eq!(
        intensity("LightSource \"point\" \"rgb I\" [1 2 3] \"float scale\" 2"),
        [2.0, 4.0, 6.0]
    );
    for spectrum in
        ["\"blackbody I\" 3000", "\"spectrum I\" [400 7 700 9]", "\"spectrum I\" \"stdillum-F11\""]
    {
        let color = intensity(&format!("LightSource \"point\" {spectrum} \"float scale\" 5"));
        assert!((luminance(color) - 5.0).abs() < 1e-4, "{color:?}");
    }
    let [r, _, b] = intensity("LightSource \"point\" \"blackbody I\" 3000");
    assert!(r > 3.0 * b);
    assert_eq!(intensity("LightSource \"point\""), [1.0; 3]);
}

#[test]
fn power_is_what_goes_into_all_directions() {
    let [r, ..] = intensity("LightSource \"point\" \"float power\" 10");
    assert!((f64::from(r) - 10.0 / (4.0 * PI)).abs() < 1e-6);
    let world =
        "AreaLightSource \"diffuse\" \"float power\" 10 Shape \"sphere\" \"float radius\" 2";
    let [r, ..] = radiance(&read("", world));
    assert!((f64::from(r) - 10.0 / (16.0 * PI * PI)).abs() < 1e-6);
}

/// A number multiplies the emission of a shape, and a texture modulates it; the power is that of
/// the whole shape.
#[test]
fn what_is_masked_emits_nothing() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [2 4 6]";
    let half = read("", &format!("{light} Shape \"sphere\" \"float alpha\" .5"));
    assert_eq!(radiance(&half), [1.0, 2.0, 3.0]);
    let world = format!(
        "Texture \"leaf\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 1
        {light} Shape \"sphere\" \"texture alpha\" \"leaf\""
    );
    let scene = read("", &world);
    let (Color::Texture(emission), Scalar::Texture(opacity)) =
        (&scene.materials[0].emission, &scene.materials[0].opacity)
    else {
        panic!("{:?}", scene.materials[0]);
    };
    let Pattern::Product(factors) = &emission.pattern else { panic!("{emission:?}") };
    assert_eq!(factors.as_ref(), &[[2.0, 4.0, 6.0].into(), Color::Texture(opacity.clone())]);
}

/// A shape with opacity 0, by a number or a constant texture, is an invisible light. Of the two
/// sheets of a two-sided emitter, one has the opacity of the shape, the other one 0.
#[test]
fn nobody_sees_what_is_not_there() {
    let light =
        "AreaLightSource \"diffuse\" \"rgb L\" [2 4 6] \"bool twosided\" true Shape \"disk\"";
    let nothing = "Texture \"nothing\" \"float\" \"constant\" \"float value\" 0";
    for alpha in ["\"float alpha\" 0", "\"texture alpha\" \"nothing\""] {
        let scene = read("", &format!("{nothing} {light} {alpha}"));
        assert_eq!(radiance(&scene), [2.0, 4.0, 6.0]);
        let hidden = |m: &Material| m.hidden_emission && m.opacity == 0.0.into();
        assert!(scene.materials.iter().all(hidden), "{:?}", scene.materials);
    }
    let half = read("", &format!("{light} \"float alpha\" .5")).materials;
    assert_eq!(half.iter().map(|m| &m.opacity).collect::<Vec<_>>(), [&0.5.into(), &0.0.into()]);
    let shows = |m: &Material| !m.hidden_emission && m.emission == [1.0, 2.0, 3.0].into();
    assert!(half.iter().all(shows), "{half:?}");
}

/// The corners of a portal are in world space, regardless of the transform.
#[test]
fn portals_are_read() {
    let portal = "\"point3 portal\" [0 0 0 1 0 0 1 2 0 0 2 0]";
    let text = format!("Translate 1 2 3 LightSource \"infinite\" \"rgb L\" [1 2 3] {portal}");
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
    let portal = Some(Portal { corners });
    assert_eq!(light(&text).0, LightKind::Constant { radiance: [1.0, 2.0, 3.0], portal });
    for (bad, message) in [
        ("\"point3 portal\" [0 0 0 1 0 0 1 2 0]", "expected the four corners of a rectangle"),
        ("\"point3 portal\" [0 0 0 1 0 0 2 2 0 0 2 0]", "is not a rectangle"),
        (
            "\"float illuminance\" 2 \"point3 portal\" [0 0 0 1 0 0 1 2 0 0 2 0]",
            "expected scale instead",
        ),
    ] {
        let found = refusal(&format!("LightSource \"infinite\" {bad}"));
        assert!(found.contains(message), "{found}");
    }
}

#[test]
fn a_spot_falls_smoothly_with_the_cosine() {
    let text = "LightSource \"spot\" \"point3 from\" [1 2 3] \"point3 to\" [1 2 9] \"float coneangle\" 60 \
                \"float conedeltaangle\" 40";
    let (LightKind::Ies { profile, .. }, to_world) = light(text) else { panic!("no table") };
    assert_eq!(to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    assert!(to_world.transform_vector3(DVec3::NEG_Z).distance(DVec3::Z) < 1e-12);
    let [end, start] = [60.0_f64, 20.0].map(|angle| angle.to_radians().cos());
    for angle in [0.0_f32, 10.0, 19.9, 20.1, 33.3, 47.0, 59.9, 60.1, 90.0, 180.0] {
        let t = ((f64::from(angle).to_radians().cos() - end) / (start - end)).clamp(0.0, 1.0);
        let expected = t * t * (3.0 - 2.0 * t);
        let found = f64::from(profile.candela(angle, 123.0));
        assert!((found - expected).abs() < 1e-4, "{angle}: {found}, {expected}");
    }
}

#[test]
fn parallel_light_goes_from_one_point_to_the_other() {
    let text = "Rotate 90 0 0 1 LightSource \"distant\" \"point3 from\" [3 0 0] \"point3 to\" [1 0 0] \
                \"float illuminance\" 4";
    let (LightKind::Directional { irradiance }, to_world) = light(text) else {
        panic!("not parallel")
    };
    assert_eq!(irradiance, [4.0; 3]);
    assert!(to_world.transform_vector3(DVec3::NEG_Z).distance(DVec3::NEG_Y) < 1e-12);
}

#[test]
fn the_exposure_multiplies_all_light() {
    let world = "LightSource \"infinite\" AreaLightSource \"diffuse\" Shape \"sphere\"";
    let camera = "Camera \"perspective\" \"float shutterclose\" .5";
    let scene = read_all(&format!("Film \"rgb\" \"float iso\" 400 {camera} WorldBegin {world}"));
    assert_eq!(radiance(&scene), [2.0; 3]);
    let LightKind::Constant { radiance, .. } = scene.lights[0].kind else { panic!("not constant") };
    assert_eq!(radiance, [2.0; 3]);
}

/// Exposure of the default second at ISO 400 by four, for each kind of light.
#[test]
fn the_exposure_multiplies_each_light() {
    const FILM: &str = "Film \"rgb\" \"float iso\" 400";
    let picture = "\"string filename\" \"slide.exr\"";
    for kind in ["point", "spot", "distant", "goniometric", "projection", "infinite"] {
        let file =
            if matches!(kind, "goniometric" | "projection" | "infinite") { picture } else { "" };
        let text = format!("LightSource \"{kind}\" {file}");
        let pixels = vec![[1.0, 0.5, 2.0]; 16];
        let strength = |film| match exposed_with_picture(4, pixels.clone(), film, &text).0 {
            LightKind::Environment { scale, .. } => [scale; 3],
            light => *light.strength().expect("a colour"),
        };
        assert_eq!(strength(FILM), strength("").map(|c| 4.0 * c), "{kind}");
    }
}

#[test]
fn what_is_in_an_object_and_what_is_only_a_border_do_not_shine() {
    let area = "AreaLightSource \"diffuse\" Shape \"sphere\"";
    for world in [
        format!("ObjectBegin \"a\" {area} ObjectEnd ObjectInstance \"a\""),
        format!("Material \"interface\" {area}"),
    ] {
        let scene = read("", &world);
        assert_eq!((radiance(&scene), scene.warnings.len()), ([0.0; 3], 1));
    }
}

/// Half of the square map is red: the converted map is red in the same directions, and only there.
#[test]
fn a_square_map_shines_from_where_it_does_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let side = 8_u32;
    let pixel = |i: u32| if i % side < side / 2 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let pixels = (0..side * side).map(pixel).collect();
    let image = pt_scene::image::Image { width: side, height: side, pixels };
    let path = folder.path().join("sky.exr");
    pt_image::save(&image, &path, &SaveOptions::default()).expect("it is written");
    let text = "Camera \"perspective\" WorldBegin LightSource \"infinite\" \"string filename\" \"sky.exr\"";
    let file = folder.path().join("a.pbrt");
    std::fs::write(&file, text).expect("it is written");
    let scene = pt_formats::load(&file).expect("a scene");
    let LightKind::Environment { image, .. } = &scene.lights[0].kind else { panic!("no map") };
    // Columns of the square with u < ½ are directions with x < 0.
    for direction in
        [DVec3::new(-0.8, 0.3, 0.4), DVec3::new(0.8, -0.3, -0.4), DVec3::new(-0.1, -0.9, 0.1)]
    {
        let local = scene.lights[0].to_world.inverse().transform_vector3(direction.normalize());
        let azimuth = local.z.atan2(-local.x).rem_euclid(2.0 * PI) / (2.0 * PI);
        let row = (local.y.acos() / PI * f64::from(image.height)) as usize;
        let column = (azimuth * f64::from(image.width)) as usize;
        let [r, _, b] = image.pixels[row * image.width as usize + column];
        assert_eq!(r > b, direction.x < 0.0, "{direction}");
    }
}

/// Reads a light in a folder with an image of these texels.
fn with_picture(width: u32, pixels: Vec<[f32; 3]>, text: &str) -> (LightKind, DAffine3) {
    exposed_with_picture(width, pixels, "", text)
}

/// A light that shows a picture, with a film.
fn exposed_with_picture(
    width: u32,
    pixels: Vec<[f32; 3]>,
    film: &str,
    text: &str,
) -> (LightKind, DAffine3) {
    let folder = tempfile::tempdir().expect("a folder");
    let image = pt_scene::image::Image {
        width,
        height: pixels.len() as u32 / width,
        pixels: pixels.into(),
    };
    let path = folder.path().join("slide.exr");
    pt_image::save(&image, &path, &SaveOptions::default()).expect("it is written");
    let file = folder.path().join("a.pbrt");
    std::fs::write(&file, format!("{film} Camera \"perspective\" WorldBegin {text}"))
        .expect("it is written");
    let light = pt_formats::load(&file).expect("a scene").lights.to_mut().swap_remove(0);
    (light.kind, light.to_world)
}

/// The centre of the square is +z of the map, which is +y of the light; the centre of its right
/// edge is +x of both, and that of its lower edge +y of the map, which is +z of the light.
/// [pbrt-v4, `GoniometricLight`; Clarberg 2008]
#[test]
fn goniometric_maps_have_their_z_along_y() {
    const SIDE: u32 = 33;
    let spots = [(16, 16, DVec3::Y), (32, 16, DVec3::X), (0, 16, DVec3::NEG_X)];
    let spots = spots.into_iter().chain([(16, 32, DVec3::Z), (16, 0, DVec3::NEG_Z)]);
    for (x, y, expected) in spots {
        let mut pixels = vec![[0.0; 3]; (SIDE * SIDE) as usize];
        pixels[(y * SIDE + x) as usize] = [1.0; 3];
        let text = "LightSource \"goniometric\" \"string filename\" \"slide.exr\"";
        let (kind, to_world) = with_picture(SIDE, pixels, text);
        let LightKind::Ies { profile, .. } = kind else { panic!("{kind:?}") };
        // Intensity along a direction of the light, by the angles of the luminaire, whose nadir is
        // −z.
        let along = |direction: DVec3| {
            let DVec3 { x, y, z } = to_world.matrix3.inverse() * direction;
            let vertical = (-z).acos().to_degrees();
            let horizontal = y.atan2(x).to_degrees().rem_euclid(360.0);
            profile.candela(vertical as f32, horizontal as f32)
        };
        for axis in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            assert_eq!(along(axis) > 0.5, axis == expected, "{x} {y}: {axis}");
        }
    }
}

#[test]
fn values_in_quotes_are_reported_as_such() {
    for (light, expected) in [
        ("\"bool twosided\" \"true\"", "written without quotes: \"bool twosided\" true"),
        ("\"bool twosided\" [ \"false\" ]", "written without quotes: \"bool twosided\" false"),
        ("\"bool twosided\" yes", "found \"yes\", expected true or false"),
        ("\"float scale\" \"2\"", "written without quotes: \"float scale\" 2"),
        ("\"string filename\" a.exr", "expected a text in quotes: \"a.exr\""),
    ] {
        let error = refusal(&format!("AreaLightSource \"diffuse\" {light} Shape \"sphere\""));
        assert!(error.contains(expected), "{error}");
    }
}

/// Returns the intensity of the projected image along a direction in the world.
fn thrown((kind, to_world): &(LightKind, DAffine3), direction: DVec3) -> [f32; 3] {
    let LightKind::LinearSpot { intensity, cutoff_angle, texture: Some(slide), .. } = kind else {
        panic!("no slide: {kind:?}")
    };
    let Pattern::Bitmap(Bitmap { image, wrap: Wrap::BLACK, filter: Filter::Nearest }) =
        &slide.pattern
    else {
        panic!("{:?}", slide.pattern)
    };
    let DVec3 { x, y, z } = to_world.matrix3.inverse() * direction;
    if z >= 0.0 || x.hypot(y).atan2(-z).to_degrees() > *cutoff_angle {
        return [0.0; 3];
    }
    let tangent = cutoff_angle.to_radians().tan();
    let on_slide = DVec2::splat(0.5) + DVec2::new(x, y) * (0.5 / (-z * tangent));
    let uv = slide.to_pattern.transform_point2(on_slide);
    let size = DVec2::new(f64::from(image.width), f64::from(image.height));
    let at = DVec2::new(uv.x, 1.0 - uv.y) * size;
    if at.min_element() < 0.0 || at.cmpge(size).any() {
        return [0.0; 3];
    }
    let texel = image.pixels[at.y as usize * image.width as usize + at.x as usize];
    [0, 1, 2].map(|c| texel[c] * intensity[c])
}

/// The shorter side spans the angle; x is to the right, y is up, and nothing is beyond the edges.
#[test]
fn a_picture_is_thrown_as_it_is_there() {
    const PLACED: &str = "Translate 1 2 3 Rotate 30 1 2 3 Scale 2 2 2";
    let pixels: Vec<_> = (1..=8_u8).map(|i| [f32::from(i), 0.5, 0.0]).collect();
    let tangent = 35_f64.to_radians().tan();
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 30_f64.to_radians());
    for (width, sides) in [(4, [2.0, 1.0]), (2, [1.0, 2.0])] {
        let text = format!(
            "{PLACED} LightSource \"projection\" \"string filename\" \"slide.exr\" \"float fov\" 70 \"float scale\" 3"
        );
        let light = with_picture(width, pixels.clone(), &text);
        assert_eq!(light.1.translation, DVec3::new(1.0, 2.0, 3.0));
        let height = 8 / width;
        for row in 0..height {
            for column in 0..width {
                let middle = |i: u32, n: u32| (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
                let x = middle(column, width) * sides[0] * tangent;
                let y = -middle(row, height) * sides[1] * tangent;
                let want = (row * width + column + 1) as f32 * 3.0;
                let found = thrown(&light, turn * DVec3::new(x, y, 1.0));
                assert_eq!(found, [want, 1.5, 0.0], "{column} {row} of {width}");
            }
        }
        for (x, y) in [(1.01, 0.9), (-0.9, 1.01), (-1.01, -0.9), (0.9, -1.01)] {
            let beyond = DVec3::new(x * sides[0] * tangent, y * sides[1] * tangent, 1.0);
            assert_eq!(thrown(&light, turn * beyond), [0.0; 3]);
            assert!(
                thrown(&light, turn * DVec3::new(beyond.x * 0.98, beyond.y * 0.98, 1.0))
                    != [0.0; 3]
            );
        }
        assert_eq!(thrown(&light, turn * DVec3::NEG_Z), [0.0; 3]);
    }
}

/// Integrates over all directions, with evenly distributed points on the sphere.
#[test]
fn the_power_of_a_picture_is_what_it_throws() {
    const POINTS: u32 = 400_000;
    let pixels: Vec<_> = (1..=8_u8).map(|i| [f32::from(i), 0.5, 2.0]).collect();
    let text = "LightSource \"projection\" \"string filename\" \"slide.exr\" \"float fov\" 80 \"float power\" 25";
    let light = with_picture(4, pixels, text);
    let golden = PI * (5_f64.sqrt() - 1.0);
    let direction = |i: u32| {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(POINTS);
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let equator = (1.0 - z * z).sqrt();
        DVec3::new(equator * cos, equator * sin, z)
    };
    let sum: f64 = (0..POINTS).map(|i| f64::from(luminance(thrown(&light, direction(i))))).sum();
    let power = sum * 4.0 * PI / f64::from(POINTS);
    // The sum over texels evaluates the cubed cosine at their centres, which is not exactly its
    // mean.
    assert!((power / 25.0 - 1.0).abs() < 0.03, "{power}");
    let bad = refusal(
        "LightSource \"projection\" \"string filename\" \"parts/dots.png\" \"float fov\" 180",
    );
    assert!(bad.contains("found a field of view of 180°"), "{bad}");
    assert!(
        refusal("LightSource \"projection\"").contains("missing parameter \"string filename\"")
    );
}

#[test]
fn images_of_the_sky_are_square() {
    let error = refusal("LightSource \"infinite\" \"string filename\" \"../bad/wide.png\"");
    assert!(error.contains("4 × 2 pixels, expected a square equal-area map"), "{error}");
}
