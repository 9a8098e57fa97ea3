//! Many lights, of which a tree chooses one at a time.

use pathtracer::{CompileOptions, DirectLight, Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::LightKind;
use pt_testing::{Random, sidak};

use crate::measure::{assert_agree, render, settings};
use crate::scenes::{Builder, camera, facing, looking, matte, size};

/// A floor and a block under lights of all kinds that may be in a tree, or of those without extent.
fn scene(extended: bool) -> Scene {
    const LIGHTS: usize = 40;
    let mut random = Random::new(4);
    let mut within = |low: DVec3, high: DVec3| {
        let t = (random.in_cube().as_dvec3() + DVec3::ONE) * 0.5;
        low + (high - low) * t
    };
    let mut builder =
        Builder::default().quad(facing(DVec3::NEG_Y, DVec3::Y, 2.0), matte([0.6; 3])).mesh(
            pt_scene::shapes::cube(),
            DAffine3::from_translation(DVec3::new(0.2, -0.7, 0.1))
                * DAffine3::from_scale(DVec3::splat(0.3)),
            matte([0.7, 0.3, 0.2]),
        );
    for i in 0..LIGHTS {
        let at = within(DVec3::new(-2.0, 0.0, -2.0), DVec3::new(2.0, 1.5, 1.0));
        let towards = within(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, -0.5, 1.0));
        builder = match if extended { i % 4 } else { i % 2 } {
            0 => builder
                .light(LightKind::Point { intensity: [0.05; 3] }, DAffine3::from_translation(at)),
            1 => {
                let (falloff_angle, falloff_exponent) = (50.0, 2.0);
                let kind = LightKind::Spot { intensity: [0.4; 3], falloff_angle, falloff_exponent };
                builder.light(kind, looking(at, towards))
            }
            2 => builder.glowing_sphere(at, 0.05, 4.0),
            _ => builder.glowing_quad(facing(at, (towards - at).normalize(), 0.08), 5.0),
        };
    }
    builder.seen_by(camera(DVec3::new(0.0, 1.0, 5.0), DVec3::new(0.0, -0.5, 0.0), [40.0, 32.0]))
}

fn film(extended: bool, most_single_lights: usize, settings: Settings) -> Film {
    let options = CompileOptions { most_single_lights: Some(most_single_lights), ..size([10, 8]) };
    render(&scene(extended), options, settings).film().clone()
}

/// A light that a tree chooses brings on average what all of them bring, and what paths find of them
/// has the weight that is left; also with several samples. Random directions hardly find lights so
/// small: they are tried with those that only sampling finds.
#[test]
fn a_tree_of_lights_brings_the_light_of_all() {
    use DirectLight::{CosineHemisphere, Light, Mis, UniformHemisphere};
    const CASES: [(bool, DirectLight, u32); 6] = [
        (true, Mis, 1),
        (true, Mis, 3),
        (true, Light, 1),
        (false, Mis, 1),
        (false, UniformHemisphere, 1),
        (false, CosineHemisphere, 2),
    ];
    let base = Settings { max_depth: 2, ..settings(1024) };
    let all = [false, true].map(|extended| film(extended, usize::MAX, base.clone()));
    for ((extended, direct, light_samples), seed) in CASES.into_iter().zip(1..) {
        let chosen = film(extended, 0, Settings { direct, light_samples, seed, ..base.clone() });
        let name = format!("{direct:?} -l {light_samples}, {extended}");
        assert_agree(&all[usize::from(extended)], &chosen, sidak(1e-4, CASES.len()), &name);
    }
}
