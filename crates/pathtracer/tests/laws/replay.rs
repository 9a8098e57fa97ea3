//! Replayed samples report all of their contributions and the vertices of their paths.

use std::path::{Path, PathBuf};

use pathtracer::{
    Adaptive, Clamp, DirectLight, Film, Filter, INTEGRATORS, Region, Scene, Session, Settings,
    Silent,
};
use pt_cpu::trace::{LightRef, LightSource, Sample, ScatterSite, Vertex};
use pt_cpu::{RenderError, Renderer, Tracer};
use pt_math::{Ray, Spectrum, Vec3};
use pt_scene::LightKind;

use crate::furnace::ESTIMATORS;
use crate::media::foggy_room;
use crate::motion::under_flying_lamps;
use crate::reuse::everything;
use crate::scenes::{Builder, cornell, size, under_a_sky};

const SIZE: [u32; 2] = [24, 18];
const SPP: u32 = 20;

/// Two pixels in the middle of the image, and one at its border.
const PIXELS: [[u32; 2]; 3] = [[12, 9], [7, 13], [23, 2]];

fn session(scene: &Scene, settings: Settings) -> Session {
    Session::new(scene, size(SIZE), settings).expect("the scene makes sense")
}

fn renderer(session: &Session) -> Renderer<'_> {
    Renderer::new(session.scene(), session.settings(), 1, 8, false).expect("it starts")
}

/// Replays the samples of a pixel; returns them and their film.
fn replay(
    session: &Session,
    pixel: [u32; 2],
    samples: std::ops::Range<u32>,
) -> (Vec<Sample>, Film) {
    let mut reported = Vec::new();
    let film = renderer(session).replay(pixel, samples, |sample| reported.push(sample));
    (reported, film.expect("its samples can be explained"))
}

/// Film of a pixel by a render.
fn rendered([x, y]: [u32; 2], session: &Session) -> Film {
    let mut film = Film::new(Region { x, y, width: 1, height: 1 });
    renderer(session).render(&mut film, &Silent);
    film
}

/// Asserts that the sum of all contributions is the sample, and that all samples give the pixel,
/// bit for bit.
fn assert_all_is_reported(scene: &Scene, settings: &Settings, what: &str) {
    let session = session(scene, settings.clone());
    for pixel in PIXELS {
        let (samples, film) = replay(&session, pixel, 0..settings.spp);
        assert!(film == rendered(pixel, &session), "{what}, {pixel:?}: {settings:?}");
        assert!(samples.iter().map(|sample| sample.number).eq(0..settings.spp));
        for sample in &samples {
            let mut sum = Spectrum::ZERO;
            sample.trace.contributions.iter().for_each(|c| sum += c.value);
            sum *= sample.weight;
            assert_eq!(sum, sample.radiance, "{what}, {pixel:?}, sample {}", sample.number);
        }
    }
}

/// All integrators that support replay, with all estimators of direct light.
fn all_settings(light_samples: u32) -> impl Iterator<Item = Settings> {
    let base = Settings { spp: SPP, max_depth: 6, light_samples, ..Settings::default() };
    let known = INTEGRATORS.iter().filter(|known| known.new_traced.is_some());
    known.flat_map(move |known| {
        let base = base.clone();
        ESTIMATORS.map(move |direct| Settings {
            integrator: known.name.to_owned(),
            direct,
            ..base.clone()
        })
    })
}

#[test]
fn the_contributions_that_are_reported_are_the_sample() {
    let scenes = [
        ("a room", cornell()),
        ("a sky", under_a_sky()),
        ("fog", foggy_room()),
        ("what moves", under_flying_lamps()),
        ("everything", everything()),
    ];
    for (what, scene) in &scenes {
        for settings in all_settings(1).chain(all_settings(3)) {
            assert_all_is_reported(scene, &settings, what);
        }
    }
}

#[test]
fn so_they_are_where_they_are_cut_off_or_weighed() {
    let base = Settings { spp: SPP, ..Settings::default() };
    let clamped = Clamp { direct: 0.5, indirect: 0.1 };
    for settings in [
        Settings { filter: Filter::LANCZOS, ..base.clone() },
        Settings { clamp: clamped, ..base.clone() },
        Settings { clamp: clamped, integrator: "volpath".into(), ..base.clone() },
        Settings { min_bounce: 2, ..base.clone() },
        Settings { adaptive: None, seed: 7, filter: Filter::GAUSSIAN, ..base },
    ] {
        assert_all_is_reported(&cornell(), &settings, "a room");
        assert_all_is_reported(&under_a_sky(), &settings, "a sky");
    }
}

/// The scene files of the project, with the integrators of their settings.
#[test]
fn so_they_are_in_every_scene_of_the_project() {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes"));
    let files = |folder: PathBuf| {
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        let is_scene = |path: &PathBuf| path.extension().is_some_and(|e| e == "xml" || e == "dae");
        paths.filter(is_scene).collect::<Vec<_>>()
    };
    let all = [files(folder.to_owned()), files(folder.join("mitsuba"))].concat();
    assert!(all.len() > 30, "{all:?}");
    for path in all {
        let scene = pathtracer::load(&path).unwrap_or_else(|e| panic!("{e}"));
        let integrator = scene.settings.integrator.unwrap_or("path").to_owned();
        let filter = scene.settings.filter.unwrap_or_default();
        let settings = Settings { spp: 6, integrator, filter, ..Settings::default() };
        assert_all_is_reported(&scene, &settings, &path.display().to_string());
    }
}

/// Convergence is checked after every batch; samples with the same number are the same.
#[test]
fn samples_of_an_adaptive_render_are_the_first_of_the_others() {
    let adaptive = Some(Adaptive { batch: 8, tolerance: 0.2 });
    let settings = Settings { spp: 200, adaptive, ..Settings::default() };
    let session = session(&cornell(), settings);
    let film = rendered(PIXELS[0], &session);
    let count = film.uniform_spp().expect("it is one pixel");
    assert!((8..200).contains(&count), "{count}");
    let (_, reported) = replay(&session, PIXELS[0], 0..count);
    assert!(reported == film);
}

/// Each vertex is in the direction sampled at the one before, with its throughput.
#[test]
fn vertices_are_where_the_path_went() {
    let scenes = [cornell(), under_a_sky(), everything()];
    for scene in &scenes {
        let session = session(scene, Settings { spp: SPP, ..Settings::default() });
        for sample in PIXELS.iter().flat_map(|&pixel| replay(&session, pixel, 0..SPP).0) {
            let trace = &sample.trace;
            let Some(first) = trace.vertices.first() else { continue };
            assert_along(trace.eye, trace.direction, first.p);
            assert_eq!(first.throughput, Spectrum::ONE);
            for pair in trace.vertices.windows(2) {
                assert_follows(&pair[0], &pair[1]);
            }
        }
    }
}

fn assert_along(from: Vec3, direction: Vec3, to: Vec3) {
    assert!((to - from).normalize().dot(direction) > 1.0 - 1e-4, "{from} to {to} in {direction}");
}

fn assert_follows(vertex: &Vertex, next: &Vertex) {
    let departure = vertex.scatter.expect("it went on");
    assert_along(vertex.p, departure.direction, next.p);
    let mut want = vertex.throughput * departure.weight;
    if let Some(q) = departure.survival {
        want *= 1.0 / q;
    }
    assert_eq!(want, next.throughput);
}

/// The recorded factors of a light sample multiply to its value: β f |cos| L w / (p n), with the
/// lobe in between.
#[test]
fn diffuse_surfaces_reflect_what_light_samples_tell() {
    let lamp = LightKind::Point { intensity: [0.3; 3] };
    let place = pt_math::DAffine3::from_translation(pt_math::DVec3::new(0.3, 0.5, 0.5));
    let camera = cornell().cameras.remove(0);
    let scene = Builder(cornell()).light(lamp, place).seen_by(camera);
    let session = session(&scene, Settings { spp: SPP, light_samples: 2, ..Settings::default() });
    let mut seen = 0;
    for sample in PIXELS.iter().flat_map(|&pixel| replay(&session, pixel, 0..SPP).0) {
        for contribution in &sample.trace.contributions {
            let LightSource::Light(light) = contribution.source else { continue };
            let vertex = &sample.trace.vertices[contribution.vertices - 1];
            let is_lambertian = matches!(vertex.site, ScatterSite::Surface { lobe: "Diffuse", .. });
            if contribution.value.is_black() || !is_lambertian {
                continue;
            }
            let density = light.pdf.map_or(1.0, pt_math::Pdf::get) * light.samples as f32;
            let irradiance = light.radiance * (light.weight / density);
            // f |cos| ≤ albedo / π, which is at most 0.7 / π here.
            let most = vertex.throughput * irradiance * (0.7 / std::f32::consts::PI);
            let [value, most] = [contribution.value, most].map(Spectrum::max_channel);
            assert!(value <= most * 1.0001 && value > 0.0, "{value} > {most}");
            assert!((0.0..=1.0).contains(&light.weight));
            assert_eq!(light.pdf.is_none(), light.distance.is_finite() && light.samples == 1);
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
}

/// If a light sample is not occluded, a ray in its direction hits the light that was chosen among
/// many, at the recorded distance.
#[test]
fn the_light_that_was_chosen_is_where_the_sample_is() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/mitsuba/many_lights.xml");
    let scene = pathtracer::load(Path::new(path)).unwrap_or_else(|e| panic!("{e}"));
    let session = session(&scene, Settings { spp: SPP, ..Settings::default() });
    let compiled = session.scene();
    let mut tracer = Tracer::new(compiled, false);
    let mut seen = 0;
    for sample in PIXELS.iter().flat_map(|&pixel| replay(&session, pixel, 0..SPP).0) {
        for contribution in &sample.trace.contributions {
            let LightSource::Light(light) = contribution.source else { continue };
            let (LightRef::Static(number), Some(chosen)) = (light.light, light.chosen) else {
                continue;
            };
            assert!(chosen.probability > 0.0 && chosen.probability <= 1.0);
            let tree = compiled.lights.as_slice()[number].tree(&compiled.light_tables);
            let primitive = tree.and_then(|tree| tree.primitive(chosen.number));
            if contribution.value.is_black() || primitive.is_none() {
                continue;
            }
            let p = sample.trace.vertices[contribution.vertices - 1].p;
            let ray = Ray::new(p + light.direction * 1e-3, light.direction);
            let mut hits = Vec::new();
            tracer.intersect(&[ray][..], |_| 0.0, &mut hits);
            let hit = hits[0].expect("the light is there");
            assert_eq!(Some(hit.primitive), primitive);
            assert!((hit.t + 1e-3 - light.distance).abs() < 1e-3 * light.distance);
            seen += 1;
        }
    }
    assert!(seen > 50, "{seen}");
}

#[test]
fn what_is_no_sum_of_single_paths_is_refused() {
    let refused = |settings: Settings| {
        let session = session(&cornell(), settings);
        let replayed = renderer(&session).replay(PIXELS[0], 0..1, |_| {});
        assert!(matches!(replayed, Err(RenderError::NotRecorded { .. })));
    };
    for integrator in ["ao", "normals"] {
        refused(Settings { integrator: integrator.into(), ..Settings::default() });
    }
    refused(Settings { reuse: 2, ..Settings::default() });
    refused(Settings { split: 4, ..Settings::default() });
    let direct = DirectLight::CosineHemisphere;
    assert_all_is_reported(
        &cornell(),
        &Settings { direct, spp: 4, ..Settings::default() },
        "a room",
    );
}
