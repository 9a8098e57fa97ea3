//! Samples are taken in batches, and are independent of each other.

use pathtracer::{
    Adaptive, DirectLight, Film, INTEGRATORS, Outcome, Scene, Session, Settings, Silent,
};
use pt_cpu::{CameraRays, Renderer, Tracer};
use pt_math::sampler::SamplerBlocks;
use pt_math::{DAffine3, DVec3, Ray, Spectrum};
use pt_scene::LightKind;
use pt_testing::Random;

use crate::furnace::ESTIMATORS;
use crate::scenes::{Builder, cornell, size};

const SIZE: [u32; 2] = [16, 12];

/// Lights of all kinds: an emissive mesh, an emissive sphere, an environment, and a point light.
fn scene() -> Scene {
    let point = LightKind::Point { intensity: [0.3; 3] };
    let camera = cornell().cameras.remove(0);
    Builder(cornell())
        .light(point, DAffine3::from_translation(DVec3::new(0.3, 0.5, 0.5)))
        .seen_by(camera)
}

fn session(settings: Settings) -> Session {
    Session::new(&scene(), size(SIZE), settings).expect("the scene makes sense")
}

/// All integrators with all estimators of direct light.
fn all_settings(light_samples: u32) -> impl Iterator<Item = Settings> {
    let base = Settings { spp: 5, max_depth: 6, light_samples, ..Settings::default() };
    let with = move |integrator: &str, direct: DirectLight| Settings {
        integrator: integrator.to_owned(),
        direct,
        ..base.clone()
    };
    INTEGRATORS.iter().flat_map(move |r| ESTIMATORS.map(|direct| with(r.name, direct)))
}

fn film(session: &Session, settings: &Settings, batch_size: Option<usize>) -> Film {
    let renderer = Renderer::new(session.scene(), settings, 2, 8, false).expect("it starts");
    let renderer = match batch_size {
        Some(n) => renderer.with_batch_size(n),
        None => renderer,
    };
    let mut film = Film::new(session.film().region());
    assert_eq!(renderer.render(&mut film, &Silent).0, Outcome::Finished);
    assert_eq!(film.invalid_samples().count(), 0);
    film
}

#[test]
fn the_size_of_batches_does_not_change_a_bit() {
    let adaptive = Some(Adaptive { batch: 6, tolerance: 0.3 });
    let adaptive = Settings { adaptive, spp: 40, ..Settings::default() };
    let reusing = |reuse| Settings { reuse, ..adaptive.clone() };
    for settings in all_settings(2).chain([reusing(2), reusing(4), adaptive.clone()]) {
        let session = session(settings.clone());
        let reference = film(&session, &settings, None);
        for n in [1, 7] {
            let other = film(&session, &settings, Some(n));
            assert!(other == reference, "batches of {n}: {settings:?}");
        }
    }
}

/// Camera rays of pixels all over the image.
fn starts(session: &Session, n: u32) -> Vec<(Ray, [u32; 2], u32)> {
    let camera = &session.scene().camera;
    let mut random = Random::new(7);
    let start = |sample| {
        let pixel = SIZE.map(|side| random.below(side as usize) as u32);
        let ray = camera.ray(pixel.map(|v| v as f32 + random.unit()), [0.0; 2]);
        (ray, pixel, sample)
    };
    (0..n).map(start).collect()
}

/// Alone, with others, in another order, and after another batch: the radiance of a path is the
/// same. With this many light samples, a batch of paths has more shadow rays than the buffer holds,
/// so that they are traced in several places.
#[test]
fn a_path_depends_on_no_other_path() {
    for settings in all_settings(1).chain(all_settings(30)) {
        let session = session(settings.clone());
        let known = INTEGRATORS.iter().find(|r| r.name == settings.integrator);
        let new = known.expect("it is one of them").new;
        let mut integrator = new(session.scene(), &settings);
        let mut tracer = Tracer::new(session.scene(), false);
        let mut radiance = |starts: &[(Ray, [u32; 2], u32)]| {
            let mut samplers = SamplerBlocks::new(settings.points());
            samplers.refill(starts.iter().map(|&(_, pixel, i)| (pixel, i..i + 1)));
            let rays = starts.iter().map(|s| s.0).collect();
            let starts = CameraRays { rays, samplers, times: None, groups: Vec::new() };
            let mut l = Vec::new();
            integrator.radiance(&mut tracer, &starts, &mut l);
            l
        };
        let starts = starts(&session, 150);
        let together = radiance(&starts);
        assert!(together.iter().any(|&l| l != Spectrum::ZERO), "{settings:?}");
        let alone: Vec<_> = starts.iter().flat_map(|s| radiance(std::slice::from_ref(s))).collect();
        assert!(alone == together, "alone: {settings:?}");
        let backwards: Vec<_> = starts.iter().rev().copied().collect();
        let backwards = radiance(&backwards);
        assert!(backwards.iter().rev().eq(&together), "in another order: {settings:?}");
        assert!(radiance(&[]).is_empty());
    }
}
