//! Small files, each of a kind that was once read incorrectly, with their expected images.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use pathtracer::{Aov, CompileOptions, Session, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::{Geometry, Light, LightKind, Projection, Span};

use crate::aovs::channel;
use crate::measure::{render, settings};

fn file(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/cases")).join(name)
}

/// Colours of 8 × 8 pixels of a file, row by row, with its own lights or under a white environment.
fn shown(name: &str, is_under_a_sky: bool) -> Vec<[f64; 3]> {
    let mut scene = pt_formats::load(&file(name)).unwrap_or_else(|error| panic!("{error}"));
    if is_under_a_sky {
        let kind = LightKind::Constant { radiance: [1.0; 3], portal: None };
        let (name, to_world) = ("sky".to_owned(), DAffine3::IDENTITY);
        scene.lights.push(Light { name, to_world, kind, at: Span::default() });
    }
    let options = CompileOptions { resolution: Some([8, 8]), ..CompileOptions::default() };
    let max_depth = scene.settings.max_depth.unwrap_or(4);
    let settings = Settings { max_depth, ..settings(256) };
    let session = render(&scene, options, settings);
    session.image().pixels.iter().map(|pixel| pixel.map(f64::from)).collect()
}

fn mean(pixels: &[[f64; 3]]) -> [f64; 3] {
    let sum = |c: usize| pixels.iter().map(|pixel| pixel[c]).sum::<f64>();
    [0, 1, 2].map(|c| sum(c) / pixels.len() as f64)
}

#[test]
fn flat_files_show_their_colour() {
    // A normal of (0, 0.6, 0.8) in an image of 8 bits, and light at 2 · asin 0.6 from it or along
    // it.
    let (along, across) = (1.0, 0.8 * 0.8 - 0.6 * 0.6);
    let opposite = [0.5, 0.5, 0.0];
    for (name, want) in [
        // Half of the green that a surface emits, and half of the red behind it.
        ("opacity_of_emission.gltf", opposite),
        // Mirrored in y, the normal leans to −y, from where the light comes.
        ("mirrored_relief.gltf", [along; 3]),
        // +x of the image lies along +y, so that its +y lies along −x, from where the light comes.
        ("tangent.gltf", [along; 3]),
        // Whole numbers that are not normalized are levels, of 255.
        ("levels_of_vertices.gltf", [0.2, 0.4, 1.0]),
        // From behind: the mirror image of the front, with the normal reversed.
        ("relief_inside.xml", [along; 3]),
        ("relief_outside.xml", [across; 3]),
    ] {
        let got = mean(&shown(name, false));
        let is_near = (0..3).all(|c| (got[c] - want[c]).abs() < 4e-3);
        assert!(is_near, "{name}: {got:?} for {want:?}");
    }
    // The squares fill the middle of the fitted view. Transparency is sampled: the standard error
    // of 1,024 samples is 1/64 at most.
    let pixels = shown("opacity_of_emission.obj", false);
    let got = mean(&[27, 28, 35, 36].map(|at| pixels[at]));
    assert!((0..3).all(|c| (got[c] - opposite[c]).abs() < 4.0 / 64.0), "{got:?}");
}

/// wrapS of MIRRORED_REPEAT from −1 to 2, wrapT of CLAMP_TO_EDGE from −1 (above) to 2: rows of the
/// upper texels (red, green) to the middle of the image, where its edge is, and of the lower (blue,
/// white) from there; columns repeat in the order 1 0, 0 1, 1 0.
#[test]
fn textures_wrap_along_each_axis_as_it_says() {
    const UPPER: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    const LOWER: [[f64; 3]; 2] = [[0.0, 0.0, 1.0], [1.0; 3]];
    let pixels = shown("wrap.gltf", false);
    for (i, pixel) in pixels.iter().enumerate() {
        let [column, row] = [i % 8, i / 8];
        // Columns that lie between two texels of six are a mixture.
        let texel = (column as f64 + 0.5) / 8.0 * 6.0;
        if (texel - texel.round()).abs() < 0.375 {
            continue;
        }
        let order = [1, 0, 0, 1, 1, 0][texel as usize];
        let want = if row < 4 { UPPER[order] } else { LOWER[order] };
        assert!((0..3).all(|c| (pixel[c] - want[c]).abs() < 1e-6), "{i}: {pixel:?}, {want:?}");
    }
}

/// E = I · ramp² · cos θ / d², with the ramp of the cosine from the inner to the outer cone.
/// [KHR_lights_punctual]
#[test]
fn spots_fall_off_by_the_square_of_the_ramp() {
    let pixels = shown("spot.gltf", false);
    let at = |x: f64, y: f64| {
        let d2 = 4.0 + x * x + y * y;
        let cos = 2.0 / d2.sqrt();
        let ramp = ((cos - 0.6f64.cos()) / (0.3f64.cos() - 0.6f64.cos())).clamp(0.0, 1.0);
        0.8 / PI * 10.0 * ramp * ramp * cos / d2
    };
    for (i, pixel) in pixels.iter().enumerate() {
        let place = |k: usize, j: u32| -2.0 + 0.5 * (k as f64 + (f64::from(j) + 0.5) / 32.0);
        let all = (0..32).flat_map(|j| (0..32).map(move |k| (j, k)));
        let want = all.map(|(j, k)| at(place(i % 8, j), place(i / 8, k))).sum::<f64>() / 1024.0;
        // A pixel is the mean of 256 samples of a function that varies by up to 1.
        assert!((pixel[0] - want).abs() < 0.03, "{i}: {} for {want}", pixel[0]);
    }
}

/// A coat alone reflects F(1) = 0.04 of a white sky where it is seen from the front. Of 16,384
/// samples by chance, the standard error is 0.0015.
#[test]
fn a_coat_reflects_a_twenty_fifth() {
    let got = mean(&shown("coat.gltf", true));
    assert!((got[0] - 0.04).abs() < 6e-3, "{got:?}");
}

/// pbrt-v4 takes the +y of the light for the +z of its map, in whose middle the only light is: an
/// intensity of 1 from the middle of a sphere of radius 1 and albedo ½ is 0.5 / π, and nothing
/// would be seen in any other direction.
#[test]
fn goniometric_maps_have_y_and_z_exchanged() {
    let pixels = shown("goniometric.pbrt", false);
    assert!(pixels.iter().all(|pixel| (pixel[0] * PI / 0.5 - 1.0).abs() < 1e-3), "{:?}", pixels[0]);
}

/// v is 0 at z = −r and grows with the latitude; the middle of the view is 0.2 from that pole.
#[test]
fn spheres_of_pbrt_have_v_from_below() {
    let scene = pt_formats::load(&file("sphere_coordinates.pbrt")).expect("it is read");
    let options = CompileOptions { resolution: Some([101, 101]), ..CompileOptions::default() };
    let settings = Settings { aovs: vec![Aov::Uv], ..settings(16) };
    let session = render(&scene, options, settings);
    let eye = DVec3::new(0.4, 0.9, -5.0).normalize();
    let want = 1.0 - eye.z.acos() / PI;
    let got = channel(&session, "uv.V", [50, 50]);
    assert!((got - want).abs() < 0.02, "{got} for {want}");
}

/// The height follows from the shape of the image.
#[test]
fn a_horizontal_angle_alone_is_that() {
    let scene = pt_formats::load(&file("horizontal_angle.dae")).expect("it is read");
    let options = CompileOptions { resolution: Some([32, 16]), ..CompileOptions::default() };
    let session = Session::new(&scene, options, settings(1)).expect("it compiles");
    let Projection::Perspective { .. } = scene.cameras[0].projection else { panic!("a view") };
    let half = session.scene().camera.half_extent.map(f64::from);
    let want = (PI / 6.0).tan();
    assert!((half[0] - want).abs() < 1e-6 && (half[1] - want / 2.0).abs() < 1e-6, "{half:?}");
}

/// Lines that go on, marks of the order of bytes, and lines that end in carriage returns alone.
#[test]
fn text_is_read_as_editors_write_it() {
    for (name, triangles, vertices) in [
        ("continued.obj", 2, 4),
        ("marked.obj", 2, 4),
        ("carriage_returns.ply", 1, 3),
        ("marked.stl", 1, 3),
    ] {
        let scene = pt_formats::load(&file(name)).unwrap_or_else(|error| panic!("{error}"));
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("{name}") };
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (triangles, vertices), "{name}");
    }
}

#[test]
fn refusals_say_what_is_wrong() {
    for (name, want) in [
        ("zeros.glb", "zeros.glb:1: invalid JSON: EOF"),
        ("quoted_boolean.pbrt", "true and false are written without quotes"),
        ("own_blend.xml", "\"b\" contains itself"),
        ("own_bump.xml", "\"b\" contains itself"),
        ("own_mask.xml", "\"b\" contains itself"),
        ("own_sides.xml", "\"b\" contains itself"),
    ] {
        let refused = pt_formats::load(&file(name)).expect_err(name).to_string();
        assert!(refused.contains(want), "{refused}");
    }
}
