//! Scenes of pbrt-v4, compared with the images rendered by pbrt-v4, and with the same scenes in
//! other formats.

use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::Arc;

use pathtracer::{CompileOptions, DirectLight, Image, Session, Settings, Silent, image};
use pt_image::SaveOptions;
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Conductor, Glass, Masking};
use pt_scene::{Light, LightKind, Rows, Scene, Span, Surface};

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/pbrt");
const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/pbrt");
const BLOCK: usize = 16;

fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Renders a scene with the settings of its file, except for the number of samples and the size.
fn render(scene: &Scene, spp: u32, resolution: [u32; 2], seed: u32) -> Image {
    let file = &scene.settings;
    let mut settings = Settings { spp, seed, ..Settings::default() };
    settings.max_depth = file.max_depth.unwrap_or(settings.max_depth);
    settings.filter = file.filter.unwrap_or(settings.filter);
    if let Some(integrator) = file.integrator {
        integrator.clone_into(&mut settings.integrator);
    }
    let options = CompileOptions { resolution: Some(resolution), ..CompileOptions::default() };
    let mut session = Session::new(scene, options, settings).expect("it compiles");
    session.render(0, 16, &Silent).expect("it renders");
    session.image()
}

/// Mean luminance of each block of 16 × 16 pixels.
fn blocks(image: &Image) -> Vec<f64> {
    let [width, height] = [image.width as usize, image.height as usize];
    let corners =
        (0..height).step_by(BLOCK).flat_map(|y| (0..width).step_by(BLOCK).map(move |x| [x, y]));
    let mean = |[x0, y0]: [usize; 2]| {
        let rows = (y0..height.min(y0 + BLOCK))
            .map(|y| &image.pixels[y * width + x0..y * width + width.min(x0 + BLOCK)]);
        let (sum, count) =
            rows.flatten().fold((0.0, 0), |(sum, n), p| (sum + luminance(*p), n + 1));
        sum / f64::from(count)
    };
    corners.map(mean).collect()
}

fn mean(image: &Image) -> [f64; 3] {
    let sum =
        image.pixels.iter().fold([0.0; 3], |sum, p| [0, 1, 2].map(|c| sum[c] + f64::from(p[c])));
    sum.map(|s| s / image.pixels.len() as f64)
}

/// Compares our render of a scene with the image that pbrt-v4 rendered with `their_spp` samples:
/// the mean of each channel within 2 %, and the luminance of at least 97 % of the blocks within 5 %
/// and four standard errors.
///
/// The noise is estimated from four renders of ours; theirs has the same for the same number of
/// samples.
fn check_picture(name: &str, their_spp: u32) {
    const RENDERS: u32 = 4;
    const SPP: u32 = 16;
    let [scene, picture] = ["pbrt", "exr"].map(|ending| format!("{SHARED}/{name}.{ending}"));
    let scene = pathtracer::load(Path::new(&scene)).expect("the scene can be read");
    let theirs = image::load(Path::new(&picture)).expect("the picture can be read");
    let size = [theirs.width, theirs.height];
    let ours: Vec<_> = (0..RENDERS).map(|seed| render(&scene, SPP, size, seed)).collect();
    let n = f64::from(RENDERS);
    let their_mean = mean(&theirs);
    let our_mean =
        ours.iter().map(mean).fold([0.0; 3], |sum, m| [0, 1, 2].map(|c| sum[c] + m[c] / n));
    for c in 0..3 {
        let ratio = our_mean[c] / their_mean[c];
        assert!((ratio - 1.0).abs() < 0.02, "{name}: the mean of channel {c} is {ratio} of theirs");
    }
    let parts: Vec<_> = ours.iter().map(blocks).collect();
    let noise = 1.0 + n * f64::from(SPP) / f64::from(their_spp);
    let agrees = |(i, their): (usize, &f64)| {
        let our = parts.iter().map(|p| p[i]).sum::<f64>() / n;
        let variance = parts.iter().map(|p| (p[i] - our).powi(2)).sum::<f64>() / (n - 1.0) / n;
        (our - their).abs() <= 0.05 * their + 4.0 * (variance * noise).sqrt()
    };
    let their_blocks = blocks(&theirs);
    let good = their_blocks.iter().enumerate().filter(|block| agrees(*block)).count();
    let share = good as f64 / their_blocks.len() as f64;
    println!("{name}: {our_mean:?} for {their_mean:?}; {share:.4} of the blocks agree");
    assert!(share >= 0.97, "{name}: {share} of the blocks agree");
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn a_knot_of_copper_in_a_box_looks_as_in_pbrt() {
    check_picture("cornell-knot", 256);
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn five_materials_look_as_in_pbrt() {
    check_picture("spheres", 1024);
}

/// Replaces the separable masking-shadowing of rough surfaces of a Mitsuba scene by the
/// height-correlated one of pbrt-v4.
fn hide_as_in_pbrt(surface: &mut Surface) {
    match surface {
        Surface::Conductor(Conductor { roughness: Some(r), .. })
        | Surface::Glass(Glass { roughness: Some(r), .. }) => {
            r.masking = Masking::Correlated;
        }
        Surface::TwoSided(sided) => {
            hide_as_in_pbrt(&mut sided.front);
            hide_as_in_pbrt(&mut sided.back);
        }
        _ => {}
    }
}

/// Each of our scenes exists for Mitsuba too or, if that has no equivalent, in our own format.
/// Samples are the same, so that there is little noise between the two.
#[test]
fn scenes_for_pbrt_and_their_twins_are_the_same() {
    let entries = std::fs::read_dir(OURS).expect("the folder exists");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "pbrt"));
    files.sort();
    assert!(files.len() >= 16);
    for file in files {
        let of_twin = ["xml", "json"].map(|ending| file.with_extension(ending));
        let of_twin = of_twin.iter().find(|file| file.exists()).expect("a twin");
        let [ours, mut twin] = [&file, of_twin]
            .map(|file| pathtracer::load(file).unwrap_or_else(|error| panic!("{error}")));
        twin.materials.iter_mut().for_each(|material| hide_as_in_pbrt(&mut material.surface));
        let [a, b] = [&ours, &twin].map(|scene| render(scene, 16, [64; 2], 1));
        let (whole_a, whole_b) = (mean(&a), mean(&b));
        for c in 0..3 {
            let ratio = whole_a[c] / whole_b[c];
            assert!((ratio - 1.0).abs() < 5e-3, "{}: {ratio} in channel {c}", file.display());
        }
        for (i, (a, b)) in blocks(&a).into_iter().zip(blocks(&b)).enumerate() {
            assert!((a / b - 1.0).abs() < 0.05, "{}: {} in block {i}", file.display(), a / b);
        }
    }
}

/// Under a white environment of radiance 2, a sheet has radiance 2 (ρ + τ) on both sides.
#[test]
fn a_sheet_under_a_white_sky_has_what_it_reflects_and_lets_through() {
    let sheet = |side: f64| {
        let text = format!(
            "LookAt 0 0 {side}  0 0 0  0 1 0
            Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 Camera \"perspective\" \"float fov\" 10 PixelFilter \"box\"
            WorldBegin LightSource \"infinite\" \"float scale\" 2
            Material \"diffusetransmission\" \"rgb reflectance\" [.1 .2 .3] \"rgb transmittance\" [.5 .25 .1]
            Shape \"disk\""
        );
        let file = Path::new("sheet.pbrt");
        let scene = pt_formats::parse(text.as_bytes(), file).expect("a scene");
        mean(&render(&scene, 256, [8; 2], 1))
    };
    for found in [sheet(5.0), sheet(-5.0)] {
        for (c, expected) in [1.2, 0.9, 0.8].into_iter().enumerate() {
            assert!((found[c] / expected - 1.0).abs() < 0.02, "{found:?}");
        }
    }
}

/// Objects without absorption are invisible in front of a white environment: all light that enters
/// leaves again, with and without refraction, and little is still below the surface after the last
/// step. In grey, as one distance is sampled for all channels, there is little noise.
#[test]
fn what_scatters_below_its_surface_and_absorbs_nothing_vanishes_before_a_white_sky() {
    for (eta, g) in [(1.0, 0.0), (1.33, 0.0), (1.33, 0.7)] {
        let text = format!(
            "LookAt 0 0 5  0 0 0  0 1 0
            Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 Camera \"perspective\" \"float fov\" 20 PixelFilter \"box\"
            WorldBegin LightSource \"infinite\"
            Material \"subsurface\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [4 4 4] \"float eta\" {eta} \"float g\" {g}
            Shape \"sphere\""
        );
        let scene = pt_formats::parse(text.as_bytes(), Path::new("ball.pbrt")).expect("a scene");
        let image = render(&scene, 64, [8; 2], 1);
        println!("{eta} {g}: {:?}", mean(&image));
        for c in mean(&image) {
            assert!((c - 1.0).abs() < 5e-3, "{eta} {g}: {:?}", mean(&image));
        }
    }
}

/// Mean luminance of a world through a narrow camera at z = 5, by each estimator of direct light.
fn seen_by_each(world: &str, spp: u32) -> Vec<f64> {
    let text = format!(
        "LookAt 0 0 5  0 0 0  0 1 0
        Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 Camera \"perspective\" \"float fov\" 2 PixelFilter \"box\"
        WorldBegin {world}"
    );
    let scene = pt_formats::parse(text.as_bytes(), Path::new("world.pbrt")).expect("a scene");
    let each = [DirectLight::Mis, DirectLight::Light, DirectLight::CosineHemisphere];
    let seen = |(integrator, direct): (&str, DirectLight)| {
        let settings = Settings {
            spp,
            max_depth: 1,
            integrator: integrator.into(),
            direct,
            ..Settings::default()
        };
        let options = CompileOptions { resolution: Some([8; 2]), ..CompileOptions::default() };
        let mut session = Session::new(&scene, options, settings).expect("it compiles");
        session.render(0, 16, &Silent).expect("it renders");
        luminance(mean(&session.image()).map(|c| c as f32))
    };
    let of_path = each.map(|direct| seen(("path", direct)));
    let of_media = [DirectLight::Mis, DirectLight::Light].map(|direct| seen(("volpath", direct)));
    of_path.into_iter().chain(of_media).collect()
}

/// A black disk of opacity 0.3 that emits 2 in front of an environment of 1 has radiance 0.3 · 2 +
/// 0.7 · 1: from its front, and from both sides if both emit.
#[test]
fn what_emits_is_seen_as_far_as_it_is_there() {
    for (sides, turn) in [("false", 0), ("true", 0), ("true", 180)] {
        let world = format!(
            "LightSource \"infinite\" Material \"diffuse\" \"rgb reflectance\" [0 0 0] Rotate {turn} 1 0 0
            AreaLightSource \"diffuse\" \"rgb L\" [2 2 2] \"bool twosided\" {sides} Shape \"disk\" \"float alpha\" .3"
        );
        for found in seen_by_each(&world, 256) {
            assert!((found / 1.3 - 1.0).abs() < 0.02, "{sides} {turn}: {found}");
        }
    }
}

/// Below the middle of a disk of radius 1 at height 1, the irradiance is L π / 2: Lambert's cosine
/// law over its cone. The disk has opacity ½, or a pattern of opaque and transparent squares.
#[test]
fn what_emits_lights_as_far_as_it_is_there() {
    let squares =
        "Texture \"squares\" \"float\" \"checkerboard\" \"float uscale\" 64 \"float vscale\" 64
        \"float tex1\" 0 \"float tex2\" 1";
    for alpha in ["\"float alpha\" .5", "\"texture alpha\" \"squares\""] {
        let world = format!(
            "{squares} Material \"diffuse\" \"rgb reflectance\" [.8 .8 .8] Shape \"disk\" \"float radius\" .2
            Material \"diffuse\" \"rgb reflectance\" [0 0 0]
            AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] Translate 0 0 1 Rotate 180 1 0 0
            Shape \"disk\" {alpha} \"float innerradius\" .4 AttributeEnd"
        );
        // The cone through the hole is subtracted from the cone of half angle 45°: sin² of its
        // angle.
        let expected = 0.8 * 0.5 * 4.0 * (0.5 - 0.16 / 1.16);
        for found in seen_by_each(&world, 1024) {
            assert!((found / expected - 1.0).abs() < 0.02, "{alpha}: {found} for {expected}");
        }
    }
}

/// Radiance of an environment from a direction: all directions differ.
fn sky(d: DVec3) -> [f32; 3] {
    [1.0 + 0.9 * d.x, 1.0 + 0.9 * d.y, 1.0 + 0.9 * d.z].map(|c| c as f32)
}

/// Direction of a point of an equal-area square, by the inverse of its formulas: rings around the
/// middle are polar angles. [Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using
/// SIMD"]
fn direction(u: f64, v: f64) -> DVec3 {
    let [u, v] = [2.0 * u - 1.0, 2.0 * v - 1.0];
    let distance = 1.0 - (u.abs() + v.abs());
    let r = 1.0 - distance.abs();
    let phi = if r == 0.0 { 0.0 } else { ((v.abs() - u.abs()) / r + 1.0) * PI / 4.0 };
    let across = r * (2.0 - r * r).sqrt();
    let (sin, cos) = phi.sin_cos();
    DVec3::new(
        (across * cos).copysign(u),
        (across * sin).copysign(v),
        (1.0 - r * r).copysign(distance),
    )
}

/// The same environment as a square map for pbrt-v4, rotated, and in latitude and longitude.
#[test]
fn a_square_map_of_the_sky_lights_as_one_in_latitude_and_longitude() {
    const SIDE: u32 = 64;
    let folder = tempfile::tempdir().expect("a folder");
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let square = (0..SIDE * SIDE).map(|i| sky(direction(at(i % SIDE, SIDE), at(i / SIDE, SIDE))));
    let map = Image { width: SIDE, height: SIDE, pixels: square.collect() };
    image::save(&map, &folder.path().join("sky.exr"), &SaveOptions::default())
        .expect("it is written");
    let text = "Scale -1 1 1 LookAt 0 1 5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 30 PixelFilter \"box\"
        WorldBegin AttributeBegin Rotate 35 1 0.5 0
        LightSource \"infinite\" \"string filename\" \"sky.exr\" \"float scale\" 2 AttributeEnd
        Shape \"sphere\" Material \"conductor\" \"float roughness\" .1 Translate 1.2 0 0 Shape \"sphere\" \"float radius\" .5";
    let file = folder.path().join("sky.pbrt");
    std::fs::write(&file, text).expect("it is written");
    let scene = pathtracer::load(&file).expect("it can be read");
    // Columns of a map in latitude and longitude look along (−cos φ, sin φ) of x and z, its rows
    // down from +y.
    let turn = pt_math::DMat3::from_cols_array(&rotation(35.0, DVec3::new(1.0, 0.5, 0.0)));
    let (width, height) = (8 * SIDE, 4 * SIDE);
    let pixels = (0..width * height).map(|i| {
        let (sin, cos) = (at(i / width, height) * PI).sin_cos();
        let (across, along) = (at(i % width, width) * TAU).sin_cos();
        sky(turn.transpose() * DVec3::new(-sin * along, cos, sin * across))
    });
    let image = Arc::new(Image { width, height, pixels: pixels.collect() });
    let kind = LightKind::Environment { image, scale: 2.0, rows: Rows::PixelCenters, portal: None };
    let light =
        Light { name: String::new(), to_world: DAffine3::IDENTITY, kind, at: Span::default() };
    let twin = Scene { lights: vec![light].into(), ..scene.clone() };
    let [a, b] = [&scene, &twin].map(|scene| render(scene, 64, [64; 2], 3));
    for (i, (a, b)) in blocks(&a).into_iter().zip(blocks(&b)).enumerate() {
        assert!((a / b - 1.0).abs() < 0.02, "{} in block {i}", a / b);
    }
    for c in 0..3 {
        assert!(
            (mean(&a)[c] / mean(&b)[c] - 1.0).abs() < 5e-3,
            "channel {c}: {:?}, {:?}",
            mean(&a),
            mean(&b)
        );
    }
}

/// Rotation about an axis in degrees, column by column. [Rodrigues 1840]
fn rotation(degrees: f64, axis: DVec3) -> [f64; 9] {
    let turn = pt_math::DQuat::from_axis_angle(axis.normalize(), degrees.to_radians());
    pt_math::DMat3::from_quat(turn).to_cols_array()
}
