//! All ways to estimate the same image converge to it.

use pathtracer::{
    Daylight, DirectLight, Film, LightKind, Roulette, SamplerKind, Session, Settings,
};
use pt_math::DAffine3;
use pt_testing::sidak;

use crate::furnace::ESTIMATORS;
use crate::measure::{Luminances, assert_agree, assert_all_agree, render, settings};
use crate::scenes::{cornell, size, under_a_sky};

const SPP: u32 = 4096;
const DEPTH: u32 = 4;

fn film(settings: Settings) -> Film {
    render(&cornell(), size([12, 10]), settings).film().clone()
}

fn base() -> Settings {
    Settings { max_depth: DEPTH, ..settings(SPP) }
}

/// Light sampling, two kinds of hemisphere sampling, and MIS, with one and with four samples of
/// each light: every pair agrees, pixel by pixel.
#[test]
fn estimators_of_direct_light_agree() {
    let mut films: Vec<(String, Film)> = Vec::new();
    for direct in ESTIMATORS {
        for light_samples in [1, 4] {
            // A seed of its own makes the images independent.
            let seed = films.len() as u32;
            let settings = Settings { direct, light_samples, seed, ..base() };
            films.push((format!("{direct:?} -l {light_samples}"), film(settings)));
        }
    }
    assert_all_agree(&films);
}

/// Under an environment with a bright and a dark part, of which MIS-compensated light sampling
/// leaves the dark one to the BSDF: every pair of estimators agrees.
#[test]
fn estimators_agree_under_an_image_of_the_sky() {
    let films: Vec<(String, Film)> = ESTIMATORS
        .iter()
        .flat_map(|&direct| [1, 3].map(|n| (direct, n)))
        .zip(20..)
        .map(|((direct, light_samples), seed)| {
            let settings = Settings { direct, light_samples, seed, ..base() };
            let film = render(&under_a_sky(), size([12, 10]), settings).film().clone();
            (format!("{direct:?} -l {light_samples}"), film)
        })
        .collect();
    assert_all_agree(&films);
}

/// Under daylight with a wide sun that the horizon cuts: every pair of estimators agrees.
#[test]
fn estimators_agree_by_day() {
    let daylight = Daylight {
        to_sun: [0.6, 0.3, 0.7],
        turbidity: 6.0,
        sun: 0.5,
        aperture: 60.0,
        limb_darkening: true,
        ..Daylight::default()
    };
    let mut scene = under_a_sky();
    scene.lights[0].kind = LightKind::Daylight(daylight);
    scene.lights[0].to_world = DAffine3::from_rotation_z(0.1);
    let films: Vec<(String, Film)> = ESTIMATORS
        .iter()
        .zip(40..)
        .map(|(&direct, seed)| {
            let settings = Settings { direct, seed, ..base() };
            let film = render(&scene, size([12, 10]), settings).film().clone();
            (format!("{direct:?}"), film)
        })
        .collect();
    assert_all_agree(&films);
}

/// A scene that is compiled for the settings of one estimator is rejected by another.
#[test]
fn light_sampling_alone_refuses_a_compensated_sky() {
    let mis = Settings::default();
    let session = Session::new(&under_a_sky(), size([4, 4]), mis.clone()).expect("it compiles");
    let light = Settings { direct: DirectLight::Light, ..mis.clone() };
    let course = Settings { integrator: "cs184".into(), ..mis.clone() };
    let accepts = |settings| pt_cpu::Renderer::new(session.scene(), settings, 1, 16, false).is_ok();
    assert!(accepts(&mis) && !accepts(&light) && !accepts(&course));
}

/// All samplers converge to the same image.
#[test]
fn samplers_agree() {
    let kinds = SamplerKind::NAMES.map(|(_, kind)| kind);
    let film = |sampler| film(Settings { sampler, seed: sampler as u32, ..base() });
    let independent = film(SamplerKind::Independent);
    for kind in kinds.into_iter().filter(|&k| k != SamplerKind::Independent) {
        assert_agree(
            &independent,
            &film(kind),
            sidak(1e-4, 3),
            &format!("independent and {kind:?}"),
        );
    }
}

/// The light scattered k times, for k = 0 … m, adds up to all light; in particular emission, direct
/// and indirect light do.
#[test]
fn depths_add_up() {
    let all = Luminances::of(&film(base()));
    let only = |min_bounce, max_bounce| {
        let seed = 10 + min_bounce;
        Luminances::of(&film(Settings { min_bounce, max_bounce, seed, ..base() }))
    };
    let each = (1..=DEPTH).fold(only(0, 0), |sum, k| sum.plus(&only(k, k)));
    each.compare(&all, 1e-4).unwrap_or_else(|e| panic!("depth by depth: {e}"));
    let parts = only(0, 0).plus(&only(1, 1)).plus(&only(2, u32::MAX));
    parts.compare(&all, 1e-4).unwrap_or_else(|e| panic!("emission, direct, indirect: {e}"));
    let beyond = only(DEPTH + 1, u32::MAX).whole();
    assert_eq!(beyond, (0.0, 0.0), "nothing is scattered more often than --max-depth");
}

/// Light of exactly k interactions does not depend on how many are allowed.
#[test]
fn fewer_interactions_are_a_part_of_more() {
    let shallow = film(Settings { max_depth: 2, ..base() });
    let part = film(Settings { max_depth: 20, max_bounce: 2, seed: 1, ..base() });
    assert_agree(&shallow, &part, 1e-4, "--max-depth 2 and the first two of 20");
}

/// Russian roulette does not change the mean, only the noise.
#[test]
fn roulette_keeps_the_mean() {
    let kinds = [Roulette::Fixed(1.0), Roulette::Throughput, Roulette::Fixed(0.5)];
    let films: Vec<_> = kinds
        .into_iter()
        .zip(0..)
        .map(|(roulette, seed)| film(Settings { roulette, seed, max_depth: 12, ..base() }))
        .collect();
    for (kind, film) in kinds.iter().zip(&films).skip(1) {
        assert_agree(&films[0], film, sidak(1e-4, 2), &format!("without and with {kind:?}"));
    }
}
