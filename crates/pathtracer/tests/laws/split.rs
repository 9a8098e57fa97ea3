//! Path splitting at the first surface.

use pathtracer::{Film, Scene, Settings};
use pt_math::sampler::SamplerKind;
use pt_scene::texture::Filter;

use crate::footprints::room;
use crate::furnace::ESTIMATORS;
use crate::measure::{assert_all_agree, noise, refuses, render, settings};
use crate::motion::under_flying_lamps;
use crate::reuse::everything;
use crate::scenes::{cornell, size, under_a_sky};

const SIZE: [u32; 2] = [11, 9];

/// Asserts that films of independent samples agree without and with path splitting.
fn assert_ways_do_not_matter(scene: &Scene, base: &Settings) {
    let film = |(split, seed)| {
        let settings = Settings { split, seed, spp: base.spp / split, ..base.clone() };
        let film = render(scene, size(SIZE), settings).film().clone();
        (format!("{split}: {base:?}"), film)
    };
    let films: Vec<(String, Film)> = [(1, 1), (2, 2), (16, 3)].into_iter().map(film).collect();
    assert_all_agree(&films);
}

#[test]
fn several_ways_bring_the_light_of_one_on_average() {
    let with = |max_depth, spp| Settings { max_depth, ..settings(spp) };
    let room = room(Filter::Trilinear);
    let scenes = [(cornell(), 1), (cornell(), 5), (under_a_sky(), 4), (under_flying_lamps(), 3)];
    for (scene, max_depth) in scenes.into_iter().chain([(room, 3)]) {
        assert_ways_do_not_matter(&scene, &with(max_depth, 8192));
    }
    assert_ways_do_not_matter(&everything(), &with(4, 16_384));
}

#[test]
fn all_estimators_of_direct_light_and_integrators_with_it_split() {
    for integrator in ["path", "direct"] {
        for direct in ESTIMATORS {
            let base = Settings { direct, integrator: integrator.into(), ..settings(2048) };
            assert_ways_do_not_matter(&cornell(), &base);
        }
    }
}

/// The split paths of a sample are stratified like separate samples: several have less noise than
/// one.
#[test]
fn several_ways_have_less_noise_than_one() {
    for sampler in [SamplerKind::Independent, SamplerKind::Sobol] {
        let noise = |split| {
            let settings = Settings { split, sampler, min_bounce: 2, ..settings(256) };
            noise(render(&cornell(), size([24, 24]), settings).film())
        };
        let [one, four, sixteen] = [1, 4, 16].map(noise);
        assert!(four < 0.5 * one && sixteen < 0.4 * one, "{sampler:?}: {one}, {four}, {sixteen}");
    }
}

#[test]
fn what_cannot_split_is_refused() {
    let split = |split| Settings { split, ..Settings::default() };
    let with = |integrator: &str| Settings { integrator: integrator.into(), ..split(2) };
    for ways in [1, 2, 64] {
        assert!(!refuses(&cornell(), &split(ways)));
    }
    let reuse = Settings { reuse: 2, ..split(2) };
    for settings in [split(0), split(3), split(128), with("volpath"), with("cs184"), reuse] {
        assert!(refuses(&cornell(), &settings), "{settings:?}");
    }
}
