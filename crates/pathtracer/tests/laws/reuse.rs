//! Path reuse between neighbouring pixels.

use pathtracer::{Adaptive, CompileOptions, DirectLight, Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Mix, SurfaceDetail};
use pt_scene::shapes;
use pt_scene::texture::{Filter, NormalOrBump};

use crate::furnace::ESTIMATORS;
use crate::materials::{row, surfaces};
use crate::measure::{assert_all_agree, noise, refuses, render, settings};
use crate::motion::under_flying_lamps;
use crate::scenes::{Builder, camera, cornell, facing, gloss, matte, metal, size, under_a_sky};

/// Not multiples of the side of any tile, so that some are cut off.
const SIZE: [u32; 2] = [11, 9];

fn film(scene: &Scene, options: CompileOptions, settings: Settings) -> Film {
    render(scene, options, settings).film().clone()
}

/// Films of independent samples, without and with path reuse.
fn films(scene: &Scene, base: &Settings) -> Vec<(String, Film)> {
    let film = |(reuse, seed)| {
        let settings = Settings { reuse, seed, ..base.clone() };
        (format!("{reuse}: {base:?}"), film(scene, size(SIZE), settings))
    };
    [(1, 1), (2, 2), (4, 3)].into_iter().map(film).collect()
}

/// In the open box, and under an environment.
#[test]
fn light_of_other_paths_is_the_light_of_ones_own_on_average() {
    for (scene, depth) in [(cornell(), 5), (cornell(), 2), (under_a_sky(), 4)] {
        assert_all_agree(&films(&scene, &Settings { max_depth: depth, ..settings(4096) }));
    }
}

/// With every estimator of direct light.
#[test]
fn all_estimators_of_direct_light_share_it() {
    for direct in ESTIMATORS {
        for light_samples in [1, 3] {
            let base = Settings { direct, light_samples, max_depth: 4, ..settings(1024) };
            assert_all_agree(&films(&cornell(), &base));
        }
    }
}

/// A floor with balls and blocks of all materials, some with transparency, interpolated normals or
/// stochastic lobes, close to each other and to a wall.
pub(crate) fn everything() -> Scene {
    let mut all = surfaces(true);
    let mix = Mix { first: metal().into(), second: matte([0.7; 3]).into(), amount: 0.4.into() };
    let relief = NormalOrBump::Normals(row(&[[0.6, 0.45, 0.9], [0.4, 0.55, 0.9]], Filter::Nearest));
    all.push(mix.into());
    all.push(SurfaceDetail::new(gloss(), relief).into());
    let at = |i: usize| DVec3::new((i % 6) as f64 - 2.5, 0.45, 1.0 - (i / 6) as f64);
    let floor = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 4.0), metal())
        .quad(facing(DVec3::new(0.0, 0.0, -1.8), DVec3::Z, 4.0), matte([0.8, 0.7, 0.5]));
    let balls = (0..).zip(all).fold(floor, |b, (i, surface)| {
        let place = DAffine3::from_translation(at(i)) * DAffine3::from_scale(DVec3::splat(0.4));
        match i % 3 {
            0 => b.sphere(at(i), 0.4, surface),
            1 => b.mesh(shapes::cube(), place, surface),
            _ => b.mesh(shapes::bumpy_sphere(3), place, surface),
        }
    });
    let mut scene = balls
        .emissive_quad(facing(DVec3::new(1.0, 3.0, 1.0), DVec3::NEG_Y, 0.7), 8.0)
        .sky(0.3)
        .seen_by(camera(DVec3::new(0.0, 2.5, 5.0), DVec3::ZERO, [55.0, 45.0]));
    for material in scene.materials.iter_mut().step_by(4) {
        material.opacity = 0.6.into();
    }
    scene
}

#[test]
fn all_materials_share_their_light() {
    for direct in [DirectLight::Mis, DirectLight::Light] {
        assert_all_agree(&films(&everything(), &Settings { direct, ..settings(4096) }));
    }
}

/// A pixel is sampled until it has converged, whatever its neighbours do.
#[test]
fn adaptive_sampling_finds_the_same_image() {
    let adaptive = Some(Adaptive { batch: 512, tolerance: 0.01 });
    assert_all_agree(&films(&cornell(), &Settings { adaptive, ..settings(8192) }));
}

/// Noise of light scattered more than once, which path reuse reduces.
#[test]
fn sixteen_paths_have_a_fraction_of_the_noise_of_one() {
    let settings = |reuse| Settings { reuse, min_bounce: 2, ..settings(256) };
    let noise = |reuse| noise(&film(&cornell(), size([24, 24]), settings(reuse)));
    let [one, four, sixteen] = [1, 2, 4].map(noise);
    assert!(four < 0.6 * one && sixteen < 0.4 * one, "{one}, {four}, {sixteen}");
}

/// Tiles have sides of 1, 2 or 4, the integrator must support path reuse, and the scene must be
/// static.
#[test]
fn what_cannot_share_its_light_is_refused() {
    let reuse = |reuse| Settings { reuse, ..Settings::default() };
    let with = |integrator: &str| Settings { integrator: integrator.into(), ..reuse(2) };
    for side in [1, 2, 4] {
        assert!(!refuses(&cornell(), &reuse(side)));
    }
    for settings in [reuse(0), reuse(3), reuse(8), with("volpath"), with("ao")] {
        assert!(refuses(&cornell(), &settings), "{settings:?}");
    }
    assert!(
        refuses(&under_flying_lamps(), &reuse(2)) && !refuses(&under_flying_lamps(), &reuse(1))
    );
}
