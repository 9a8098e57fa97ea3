//! Renders with media do not depend on units, batches or positions; media that the integrator does
//! not support are reported, and invalid ones are rejected.

use pathtracer::{DirectLight, Film, Hint, Outcome, Scene, Session, Settings, Silent};
use pt_cpu::Renderer;
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Diffuse;
use pt_scene::medium::{Grid, MediumProperties, Phase, Volume};
use pt_scene::{LightKind, Sides};
use pt_testing::sidak;

use crate::invariance::moved;
use crate::measure::assert_agree;
use crate::media::{block, cloud, film_of, fog, foggy, grid, homogeneous, straight, with_depth};
use crate::scenes::{Builder, cornell, facing, size, under_a_sky};

/// Without media, `volpath` agrees with `path`, also through transparent surfaces.
#[test]
fn without_media_it_is_the_path_tracer() {
    let mut holes = cornell();
    let veil = Diffuse { reflectance: [0.8, 0.5, 0.3].into(), two_sided: true };
    holes = Builder(holes).quad(facing(DVec3::Z * 0.8, DVec3::Z, 0.8), veil.into()).0;
    holes.materials.last_mut().expect("the veil").opacity = 0.4.into();
    for (name, scene) in [("room", cornell()), ("sky", under_a_sky()), ("veil", holes)] {
        for direct in [DirectLight::Mis, DirectLight::Light] {
            let settings = Settings { direct, ..with_depth(2048, 5) };
            let path = Settings { integrator: "path".into(), seed: 1, ..settings.clone() };
            let (a, b) = (film_of(&scene, settings), film_of(&scene, path));
            assert_agree(&a, &b, sidak(1e-4, 6), &format!("{name}, {direct:?}"));
        }
    }
}

/// Threads, tiles and batches do not change a bit, with one and with many light samples.
#[test]
fn samples_in_media_are_pure() {
    let scene = fog();
    for light_samples in [1, 40] {
        let settings = Settings { light_samples, ..with_depth(3, 8) };
        let settings = Settings { sampler: pathtracer::SamplerKind::Sobol, ..settings };
        let session = Session::new(&scene, size([16, 12]), settings.clone()).expect("it compiles");
        let film = |threads, tile, batch| {
            let renderer = Renderer::new(session.scene(), &settings, threads, tile, false);
            let renderer = renderer.expect("it starts").with_batch_size(batch);
            let mut film = Film::new(session.film().region());
            assert_eq!(renderer.render(&mut film, &Silent).0, Outcome::Finished);
            assert_eq!(film.invalid_samples().count(), 0);
            film
        };
        let reference = film(1, 16, 1024);
        for (threads, tile, batch) in [(1, 16, 1), (2, 8, 7), (3, 5, 100)] {
            assert!(film(threads, tile, batch) == reference, "{threads} {tile} {batch}");
        }
    }
}

/// Media scale with the unit of length, of which a power of two does not even change the rounding;
/// and a scene with a cloud that is translated and rotated gives the same image.
#[test]
fn media_may_stand_anywhere_in_any_unit() {
    let mut scene = fog();
    scene.lights.to_mut().retain(|light| !matches!(light.kind, LightKind::Point { .. }));
    let film = |scene: &Scene, seed| film_of(scene, Settings { seed, ..with_depth(2048, 5) });
    let here = film(&scene, 0);
    assert!(film(&Scene { metres_per_unit: 0.25, ..scene.clone() }, 0) == here);
    let turn = DAffine3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 2.0);
    let by = DAffine3::from_translation(DVec3::new(30.0, -20.0, 50.0)) * turn;
    let mut there = moved(scene, by);
    for medium in &mut there.media {
        if let MediumProperties::Heterogeneous(grid) = &mut medium.matter {
            grid.extinction.to_world = by * grid.extinction.to_world;
        }
    }
    assert_agree(&here, &film(&there, 1), 1e-4, "moved");
}

/// An integrator without media adds one note to a scene with media.
#[test]
fn media_that_are_not_seen_are_reported() {
    let scene = foggy(cloud(8.0, [1.0; 3], Phase::Isotropic));
    let notes = |scene: &Scene, integrator: &str| {
        let settings = Settings { integrator: integrator.into(), ..Settings::default() };
        let session = Session::new(scene, size([2, 2]), settings).expect("it compiles");
        session.hints().iter().filter(|hint| **hint == Hint::UseIntegrator("volpath")).count()
    };
    assert_eq!(notes(&scene, "path"), 1);
    assert_eq!(notes(&scene, "volpath"), 0);
    assert_eq!(notes(&cornell(), "path"), 0);
}

/// Invalid media are rejected with a reason.
#[test]
fn media_that_make_no_sense_are_refused() {
    let grid_of = |values: Vec<f32>, scale| {
        let cells = Grid { resolution: [2, 1, 1], channels: 1, values };
        grid(cells, scale, Volume::Constant([0.5; 3]), Phase::Isotropic)
    };
    let cases = [
        (homogeneous([1.0, -1.0, 0.0], [0.5; 3], Phase::Isotropic), "extinction of -1"),
        (homogeneous([f32::INFINITY; 3], [0.5; 3], Phase::Isotropic), "extinction of inf"),
        (homogeneous([1.0; 3], [1.5; 3], Phase::Isotropic), "albedo of 1.5"),
        (
            homogeneous([1.0; 3], [0.5; 3], Phase::HenyeyGreenstein { g: 1.0 }),
            "expected -1 < g < 1",
        ),
        (grid_of(vec![1.0, f32::NAN], 1.0), "extinction of NaN"),
        (grid_of(vec![1.0; 3], 1.0), "found 3 numbers, expected those of a grid of 2 x 1 x 1"),
        (grid_of(vec![1.0; 2], 1e6), "optical depth"),
        (grid_of(vec![1.0; 2], -1.0), "extinction of -1"),
    ];
    for (medium, want) in cases {
        let scene = block(Builder::default().sky(1.0), DAffine3::IDENTITY, medium);
        let scene = scene.seen_by(straight());
        let result = Session::new(&scene, size([2, 2]), Settings::default());
        let message = result.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(message.contains(want), "{message}, expected {want}");
    }
    let mut dangling = cornell();
    dangling.media.push(homogeneous([1.0; 3], [0.5; 3], Phase::Isotropic));
    dangling.objects[0].media = Some(Sides { interior: Some(3), exterior: None });
    let result = Session::new(&dangling, size([2, 2]), Settings::default());
    let message = result.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(
        message.contains("medium index 3 out of range; expected an index below 1"),
        "{message}"
    );
}
