//! Textured emission, and spot lights with projected images.

use std::sync::Arc;

use pathtracer::{CompileOptions, Film, Scene, Session, Settings};
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::image::Image;
use pt_scene::material::{Black, MetallicRoughness};
use pt_scene::texture::{Bitmap, Filter, Pattern, Texture, Wrap};
use pt_scene::{Attribute, Geometry, LightKind, shapes};

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_agree, assert_all_agree, render, settings};
use crate::scenes::{Builder, camera, facing, looking, matte, size};

/// Image without interpolation between its texels.
fn image(width: u32, pixels: &[[f32; 3]]) -> Arc<Texture> {
    let height = pixels.len() as u32 / width;
    let image = Arc::new(Image { width, height, pixels: pixels.to_vec().into() });
    let bitmap = Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Nearest };
    Arc::new(Pattern::Bitmap(bitmap).into())
}

/// A panel above a floor with a wall; its left half is dim and its right half bright. As it faces
/// down, u grows to the left.
fn under_a_panel(textured: bool) -> Scene {
    let (dim, bright) = ([0.5, 1.0, 2.0], [8.0, 6.0, 3.0]);
    let to_world = |x: f64, half: f64| {
        let down = facing(DVec3::new(x, 1.5, 0.0), DVec3::NEG_Y, 1.0);
        down * DAffine3::from_scale(DVec3::new(half, 1.0, 1.0))
    };
    let room = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6; 3]))
        .quad(facing(DVec3::NEG_Z * 1.5, DVec3::Z, 3.0), matte([0.5, 0.4, 0.7]));
    let panel = |b: Builder, x, half| b.quad(to_world(x, half), Black.into());
    let context = if textured {
        panel(room, 0.0, 1.0).emitting(image(2, &[bright, dim]))
    } else {
        let left = panel(room, -0.5, 0.5).emitting(image(1, &[dim]));
        panel(left, 0.5, 0.5).emitting(image(1, &[bright]))
    };
    context.seen_by(camera(DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 0.7, 0.0), [40.0, 32.0]))
}

fn film(scene: &Scene, options: CompileOptions, spp: u32, seed: u32) -> Film {
    let settings = Settings { max_depth: 3, seed, ..settings(spp) };
    render(scene, options, settings).film().clone()
}

fn resolution() -> CompileOptions {
    size([10, 8])
}

/// One panel of two colours equals two panels of one colour each; with single lights or a light
/// tree, and with a black half.
#[test]
fn a_texture_of_two_colours_is_two_lights() {
    let two = film(&under_a_panel(false), resolution(), 4096, 1);
    for most in [None, Some(0)] {
        let options = CompileOptions { most_single_lights: most, ..resolution() };
        let one = film(&under_a_panel(true), options, 4096, 2);
        assert_agree(&one, &two, 1e-4, &format!("{most:?}"));
    }
}

/// Textured emissive panel and ball, an emissive mesh with vertex colours and a spot light with a
/// slide, in a room.
fn shop_window() -> Scene {
    let picture =
        image(3, &[[5.0, 0.0, 0.0], [0.0; 3], [0.0, 4.0, 1.0], [0.0; 3], [2.0; 3], [0.1; 3]]);
    let mut square = shapes::rectangle();
    let colors = vec![[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0; 3]];
    square.colors = Some(Attribute { values: colors.into(), indices: None });
    let slide = LightKind::LinearSpot {
        intensity: [3.0; 3],
        beam_angle: 20.0,
        cutoff_angle: 35.0,
        texture: Some(image(2, &[[1.0, 0.2, 0.2], [0.1, 0.9, 0.3], [0.0; 3], [0.5; 3]])),
    };
    let from = DVec3::new(-1.5, 1.8, 1.5);
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6; 3]))
        .quad(facing(DVec3::NEG_Z * 1.5, DVec3::Z, 3.0), matte([0.5, 0.4, 0.7]))
        .quad(facing(DVec3::new(0.0, 2.0, 0.0), DVec3::NEG_Y, 0.7), Black.into())
        .emitting(Arc::clone(&picture))
        .sphere(DVec3::new(1.0, 0.4, 0.3), 0.4, Black.into())
        .emitting(picture)
        .mesh(square, facing(DVec3::new(-1.4, 0.6, -0.3), DVec3::X, 0.4), matte([0.3; 3]))
        .emitting(Arc::new(Pattern::VertexColors.into()))
        .light(slide, looking(from, DVec3::ZERO))
        .seen_by(camera(DVec3::new(0.0, 1.2, 4.5), DVec3::new(0.0, 0.8, 0.0), [44.0, 36.0]))
}

/// All estimators of direct light and the light tree agree, pixel by pixel.
#[test]
fn estimators_agree_where_lights_have_textures() {
    let of = |direct, most_single_lights, seed| {
        let settings = Settings { direct, seed, max_depth: 3, ..settings(4096) };
        let options = CompileOptions { most_single_lights, ..resolution() };
        let name = format!("{direct:?} {most_single_lights:?}");
        (name, render(&shop_window(), options, settings).film().clone())
    };
    let mut films: Vec<_> = ESTIMATORS.into_iter().zip(0..).map(|(d, s)| of(d, None, s)).collect();
    films.push(of(ESTIMATORS[0], Some(0), 17));
    assert_all_agree(&films);
}

/// A black emission texture is black, and gives no light.
#[test]
fn black_textures_give_no_light() {
    let scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 1.0), Black.into())
        .emitting(image(1, &[[0.0; 3]]))
        .sphere(DVec3::Y, 0.2, matte([0.5; 3]))
        .seen_by(camera(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, [30.0, 24.0]));
    let dark = film(&scene, resolution(), 16, 0);
    assert!(dark.pixels().all(|p| p.mean() == [0.0; 3]));
}

/// Negative emission counts as 0: a square that emits 1 on its left half and "−1" on its right one.
#[test]
fn negative_emission_is_none_and_has_a_note() {
    let scene = Builder::default()
        .quad(DAffine3::IDENTITY, Black.into())
        .emitting(image(2, &[[1.0; 3], [-1.0, 0.5, -0.25]]))
        .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [2.0, 2.0]));
    let session = render(&scene, size([8, 8]), settings(16));
    let least = session.image().pixels.into_iter().flatten().fold(f32::INFINITY, f32::min);
    assert_eq!(least, 0.0);
    let note =
        session.notes().iter().find(|note| note.contains("negative radiance")).expect("a note");
    assert!(note.contains("1 pixel of 2") && note.contains("(1, 0)"), "{note}");
}

#[test]
fn textures_that_are_no_light_are_refused() {
    let compiled = |scene: &Scene| {
        Session::new(scene, CompileOptions::default(), settings(1)).err().map(|e| e.to_string())
    };
    let emissive =
        |texture| Builder::default().quad(DAffine3::IDENTITY, Black.into()).emitting(texture).0;
    let spot = |cutoff_angle, texture: Arc<Texture>, turn: DMat3| {
        let kind = LightKind::LinearSpot {
            intensity: [1.0; 3],
            beam_angle: 10.0,
            cutoff_angle,
            texture: Some(texture),
        };
        Builder::default().light(kind, DAffine3::from_mat3(turn)).0
    };
    let white = || image(1, &[[1.0; 3]]);
    let colors: Arc<Texture> = Arc::new(Pattern::VertexColors.into());
    let skewed = DMat3::from_cols(DVec3::X, DVec3::ONE, DVec3::Z);
    let cases = [
        (emissive(image(1, &[[f32::NAN; 3]])), "texture of the emission: pixel (0, 0) is [NaN"),
        (emissive(Arc::clone(&colors)), "colours of vertices on a mesh without them"),
        (spot(30.0, image(1, &[[f32::NAN; 3]]), DMat3::IDENTITY), "texture of the light: pixel"),
        (
            spot(30.0, colors, DMat3::IDENTITY),
            "expected another texture for a light without a mesh",
        ),
        (spot(90.0, white(), DMat3::IDENTITY), "below 90°"),
        (spot(30.0, white(), skewed), "expected rotations, reflections and uniform scales only"),
    ];
    for (scene, want) in cases {
        let message = compiled(&scene).expect("it makes no sense");
        assert!(message.contains(want), "{message}");
    }
}

/// Black below a clear coat.
fn coated(clearcoat: f32) -> pt_scene::Surface {
    MetallicRoughness {
        base_color: [0.0; 3].into(),
        clearcoat: clearcoat.into(),
        ..MetallicRoughness::default()
    }
    .into()
}

/// Emission below a coat c: E (1 − c F), with F = 0.04 + 0.96 (1 − cos θ)⁵. [glTF 2.0,
/// KHR_materials_clearcoat]
#[test]
fn coats_attenuate_emission_below_them() {
    for clearcoat in [0.0f32, 0.5, 1.0] {
        for degrees in [0.0f64, 50.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let eye = DVec3::new(3.0 * sin, 0.0, 3.0 * cos);
            let scene = Builder::default()
                .emissive_mesh(shapes::rectangle(), DAffine3::IDENTITY, coated(clearcoat), 2.0)
                .seen_by(camera(eye, DVec3::ZERO, [0.1, 0.1]));
            let session = render(&scene, size([2, 2]), settings(4));
            let fresnel = 0.04 + 0.96 * (1.0 - cos).powi(5);
            let want = 2.0 * (1.0 - f64::from(clearcoat) * fresnel);
            let (got, _) = session.film().pixel(0, 0).luminance();
            assert!((got / want - 1.0).abs() < 2e-3, "{clearcoat}, {degrees}°: {got}, {want}");
        }
    }
}

/// Lamps under a coat give the same light with every estimator: squares, balls, with textures, in a
/// tree.
#[test]
fn lamps_under_a_coat_light_as_they_are_seen() {
    let room = || Builder::default().quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6; 3]));
    let square = facing(DVec3::new(-0.8, 0.6, 0.0), DVec3::new(0.8, -0.6, 0.0), 0.5);
    let ball = DAffine3::from_translation(DVec3::new(0.7, 0.5, 0.0));
    let lamps = |scene: Builder, texture: Option<Arc<Texture>>| {
        let scene = scene.emissive_mesh(shapes::rectangle(), square, coated(1.0), 2.0);
        let scene = match &texture {
            Some(texture) => scene.emitting(Arc::clone(texture)),
            None => scene,
        };
        let scene = scene.object(Geometry::Sphere { radius: 0.3 }, ball, coated(1.0), [3.0; 3]);
        texture.into_iter().fold(scene, Builder::emitting)
    };
    let texture = image(2, &[[1.0, 3.0, 2.0], [2.0, 0.5, 1.0]]);
    for texture in [None, Some(texture)] {
        // The lamps, whose coats are mirrors, are not in view.
        let (eye, floor) = (DVec3::new(0.0, 2.0, 3.5), DVec3::new(0.0, 0.0, 1.2));
        let scene = lamps(room(), texture).seen_by(camera(eye, floor, [30.0, 24.0]));
        let mut films = Vec::new();
        for most in [None, Some(0)] {
            for direct in ESTIMATORS {
                let settings = Settings { direct, max_depth: 1, ..settings(4096) };
                let options = CompileOptions { most_single_lights: most, ..resolution() };
                let name = format!("{direct:?}, {most:?}");
                films.push((name, render(&scene, options, settings).film().clone()));
            }
        }
        assert_all_agree(&films);
    }
}
