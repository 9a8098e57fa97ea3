//! Faults inserted into lobes and lights: none enters the film, none ends the render, none is
//! silent.

use std::sync::Arc;

use pathtracer::{Aov, CompileOptions, Film, Image, InvalidSamples, Rows, Scene, Settings, Silent};
use pt_core::bsdf::LobeRecord;
use pt_core::film::InvalidReason;
use pt_core::{RenderScene, compile};
use pt_cpu::Renderer;
use pt_math::{DAffine3, DVec3};
use pt_scene::image::Samples;
use pt_scene::texture::{Bitmap, Filter, Pattern, Texture, Wrap};
use pt_scene::{Daylight, LightKind, shapes};

use crate::analytic::{KINDS, Kind, luminaire};
use crate::materials::surfaces;
use crate::scenes::{Builder, camera, facing, looking, matte, size};

const FAULTS: [f32; 3] = [f32::NAN, f32::INFINITY, -1.0];

/// A small image of the surroundings of the origin.
fn seen(builder: Builder) -> Scene {
    builder.seen_by(camera(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO, [40.0; 2]))
}

/// Renders, and checks that all values of the film are valid, and that its rejected samples are in
/// the mask.
fn rejections(scene: &RenderScene, settings: &Settings) -> InvalidSamples {
    let renderer = Renderer::new(scene, settings, 1, 16, false).expect("the settings make sense");
    let region = pathtracer::Region::full(scene.camera.resolution);
    let mut film = Film::with_aovs(region, &settings.aovs);
    let _ = renderer.render(&mut film, &Silent);
    assert_eq!(film.samples(), region.area() as u64 * u64::from(settings.spp));
    for pixel in film.pixels() {
        let (mean, error) = pixel.luminance();
        let light = pixel.mean().into_iter().chain([mean, error]);
        assert!(
            light.clone().all(|x| x.is_finite() && x >= 0.0),
            "{:?}",
            light.collect::<Vec<_>>()
        );
    }
    let channels = pathtracer::aov::channels(&film);
    let mask =
        channels.iter().find(|channel| channel.name == "refused.count").expect("is asked for");
    let Samples::Whole(mask) = &mask.samples else { panic!("{mask:?}") };
    let refused = film.invalid_samples();
    assert_eq!(mask.iter().map(|&n| u64::from(n)).sum::<u64>(), refused.count());
    let row = region.width;
    assert!(refused.first.iter().all(|r| mask[(r.y * row + r.x) as usize] > 0), "{refused:?}");
    refused.clone()
}

fn settings(integrator: &str) -> Settings {
    let integrator = integrator.to_owned();
    Settings { spp: 4, max_depth: 4, integrator, aovs: vec![Aov::Refused], ..Settings::default() }
}

fn compiled(scene: &Scene) -> Option<RenderScene> {
    let options = CompileOptions { compensated: true, ..size([8, 8]) };
    Some(compile(scene, options).ok()?.scene)
}

/// Each parameter of a lobe, in turn.
#[test]
fn faults_of_lobes_are_refused_and_reported() {
    for surface in surfaces(false) {
        let scene = seen(
            Builder::default()
                .sphere(DVec3::ZERO, 1.0, surface.clone())
                .light(
                    LightKind::Point { intensity: [20.0; 3] },
                    looking(DVec3::splat(3.0), DVec3::ZERO),
                )
                .sky(0.5),
        );
        let mut scene = compiled(&scene).expect("it makes sense");
        let mut reported = [0; InvalidReason::ALL.len()];
        let ids: Vec<_> = scene.lobes.iter().map(|(id, _)| id).collect();
        for id in ids {
            let sound = scene.lobes[id];
            let words: [u32; size_of::<LobeRecord>() / 4] = bytemuck::cast(sound);
            for place in 1..words.len() {
                for fault in FAULTS {
                    let mut words = words;
                    words[place] = fault.to_bits();
                    scene.lobes[id] = bytemuck::cast(words);
                    let refused = rejections(&scene, &settings("path"));
                    reported.iter_mut().zip(refused.counts).for_each(|(n, more)| *n += more);
                }
            }
            scene.lobes[id] = sound;
        }
        let nothing = rejections(&scene, &settings("path"));
        assert_eq!(nothing, InvalidSamples::default(), "without a fault: {surface:?}");
        assert!(reported[InvalidReason::NotANumber as usize] > 0, "{reported:?} {surface:?}");
    }
}

/// A texture of one colour.
fn texture(color: [f32; 3]) -> Arc<Texture> {
    let image = Arc::new(Image { width: 1, height: 1, pixels: vec![color].into() });
    let bitmap = Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Nearest };
    Arc::new(Texture::from(Pattern::Bitmap(bitmap)))
}

/// Lights of a kind, one channel of which has this value.
fn faulty(kind: Kind, x: f32) -> Vec<(&'static str, LightKind)> {
    let light = [1.0, x, 2.0];
    let sky = |pixel, scale| LightKind::Environment {
        image: Arc::new(Image { width: 2, height: 1, pixels: vec![[1.0; 3], pixel].into() }),
        scale,
        rows: Rows::default(),
        portal: None,
    };
    let linear = |intensity, texture| LightKind::LinearSpot {
        intensity,
        beam_angle: 30.0,
        cutoff_angle: 60.0,
        texture,
    };
    match kind {
        Kind::Hemisphere => vec![("hemisphere", LightKind::Hemisphere { radiance: light })],
        Kind::Constant => {
            vec![("constant", LightKind::Constant { radiance: light, portal: None })]
        }
        Kind::Environment => {
            vec![("environment", sky(light, 1.0)), ("scale of the environment", sky([1.0; 3], x))]
        }
        Kind::Directional => vec![("directional", LightKind::Directional { irradiance: light })],
        Kind::DistantDisk => {
            let disk = LightKind::DistantDisk { irradiance: light, angular_radius: 5.0 };
            vec![("disk", disk)]
        }
        Kind::Point => vec![("point", LightKind::Point { intensity: light })],
        Kind::Spot => {
            let (falloff_angle, falloff_exponent) = (90.0, 2.0);
            let spot = LightKind::Spot { intensity: light, falloff_angle, falloff_exponent };
            vec![("spot", spot)]
        }
        Kind::LinearSpot => vec![
            ("linear spot", linear(light, None)),
            ("projector", linear([1.0; 3], Some(texture(light)))),
        ],
        Kind::PunctualSpot => {
            let (inner_angle, outer_angle) = (30.0, 60.0);
            let spot = LightKind::PunctualSpot { intensity: light, inner_angle, outer_angle };
            vec![("punctual spot", spot)]
        }
        Kind::Projector => {
            let (x_fov, y_fov, texture) = (60.0, 40.0, texture([1.0; 3]));
            let projector = LightKind::Projector { intensity: light, x_fov, y_fov, texture };
            vec![("flat projector", projector)]
        }
        Kind::Ies => {
            vec![("luminaire", LightKind::Ies { profile: Arc::new(luminaire()), scale: light })]
        }
        Kind::Daylight => {
            let daylight = Daylight { turbidity: f64::from(x), ..Daylight::default() };
            vec![("daylight", LightKind::Daylight(daylight))]
        }
        Kind::Area => vec![("area", LightKind::Area { radiance: light })],
    }
}

/// Scenes with lights of each kind, one channel of which has this value.
fn lit_by(x: f32) -> Vec<(&'static str, Scene)> {
    let light = [1.0, x, 2.0];
    let ball = || Builder::default().sphere(DVec3::ZERO, 1.0, matte([0.5; 3]));
    let above = looking(DVec3::new(0.5, 3.0, 1.0), DVec3::ZERO);
    let small = above * DAffine3::from_scale(DVec3::splat(0.5));
    let kinds = KINDS.iter().flat_map(|kind| faulty(*kind, x));
    let mut scenes: Vec<_> =
        kinds.map(|(name, kind)| (name, seen(ball().light(kind, above)))).collect();
    let far = DVec3::new(0.5, 3.0, 1.0);
    scenes.extend([
        ("emissive mesh", seen(ball().emissive_mesh(shapes::cube(), small, matte([0.5; 3]), x))),
        ("emissive sphere", seen(ball().emissive_sphere(far, 0.5, x))),
        (
            "mesh with an emission texture",
            seen(ball().emissive_quad(facing(far, -far, 0.5), 1.0).emitting(texture(light))),
        ),
        (
            "sphere with an emission texture",
            seen(ball().emissive_sphere(far, 0.5, 1.0).emitting(texture(light))),
        ),
    ]);
    let many = (0..100).fold(ball(), |b, i| {
        let at = DVec3::new(f64::from(i) / 50.0 - 1.0, 2.0, 1.0);
        b.emissive_sphere(at, 0.01, if i == 50 { x } else { 5.0 })
    });
    scenes.push(("one of many", seen(many)));
    scenes
}

/// A scene with an invalid light is rejected, or the samples that it lights are.
#[test]
fn faults_of_lights_are_refused_and_reported() {
    for x in FAULTS {
        for (name, scene) in lit_by(x) {
            let options = CompileOptions { compensated: true, ..size([8, 8]) };
            let Ok(compiled) = compile(&scene, options) else { continue };
            // In environment maps, such values are replaced, and negative values of emission count
            // as 0.
            let is_reported = |note: &String| {
                note.contains("environment image") || note.contains("negative radiance")
            };
            let is_noted = compiled.notes.lines().iter().any(is_reported);
            for integrator in ["path", "volpath"] {
                let refused = rejections(&compiled.scene, &settings(integrator));
                // Among many lights, one without power is never sampled.
                let is_reported =
                    refused.count() > 0 || is_noted || (name, x) == ("one of many", -1.0);
                assert!(is_reported, "{name}, {x}, {integrator}: {refused}");
            }
        }
    }
    for (name, scene) in lit_by(3.0) {
        let scene = compiled(&scene).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(rejections(&scene, &settings("path")), InvalidSamples::default(), "{name}");
    }
}
