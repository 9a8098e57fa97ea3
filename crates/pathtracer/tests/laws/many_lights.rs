//! Many lights, of which a light tree chooses one at a time.

use pathtracer::{CompileOptions, DirectLight, Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Glass, Roughness};
use pt_scene::medium::{MediumProperties, Phase};
use pt_scene::{LightKind, Medium, Surface};
use pt_testing::{Random, sidak};

use crate::measure::{assert_agree, render, settings};
use crate::scenes::{Builder, camera, facing, looking, matte, size};

/// Kinds of lights, and the medium between them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Lights without extent.
    Points,
    /// All lights that a light tree supports.
    All,
    /// All lights that a light tree supports, in fog.
    Fog,
}

fn rough_glass() -> Surface {
    Glass {
        reflectance: [1.0; 3].into(),
        transmittance: [1.0; 3].into(),
        ior: 1.5,
        roughness: Some(Roughness::beckmann(0.5)),
    }
    .into()
}

/// A floor, a block and a pane of rough glass under many lights.
fn scene(kind: Kind) -> Scene {
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
    let pane = facing(DVec3::new(-0.6, -0.5, 0.8), DVec3::new(0.2, 0.3, 1.0).normalize(), 0.4);
    builder = builder.quad(pane, rough_glass());
    for i in 0..LIGHTS {
        let at = within(DVec3::new(-2.0, 0.0, -2.0), DVec3::new(2.0, 1.5, 1.0));
        let towards = within(DVec3::new(-1.0, -1.0, -1.0), DVec3::new(1.0, -0.5, 1.0));
        builder = match if kind == Kind::Points { i % 2 } else { i % 4 } {
            0 => builder
                .light(LightKind::Point { intensity: [0.05; 3] }, DAffine3::from_translation(at)),
            1 => {
                let (falloff_angle, falloff_exponent) = (50.0, 2.0);
                let kind = LightKind::Spot { intensity: [0.4; 3], falloff_angle, falloff_exponent };
                builder.light(kind, looking(at, towards))
            }
            2 => builder.emissive_sphere(at, 0.05, 4.0),
            _ => builder.emissive_quad(facing(at, (towards - at).normalize(), 0.08), 5.0),
        };
    }
    let mut eye = camera(DVec3::new(0.0, 1.0, 5.0), DVec3::new(0.0, -0.5, 0.0), [40.0, 32.0]);
    if kind == Kind::Fog {
        let matter = MediumProperties::Homogeneous {
            extinction: [0.2; 3],
            albedo: [0.8; 3],
            emission: [0.0; 3],
        };
        let (name, at) = (String::new(), pt_scene::Span::default());
        builder.0.media.push(Medium { name, matter, phase: Phase::Isotropic, at });
        eye.medium = Some(0);
    }
    builder.seen_by(eye)
}

fn film(kind: Kind, most_single_lights: usize, settings: Settings) -> Film {
    let options = CompileOptions { most_single_lights: Some(most_single_lights), ..size([10, 8]) };
    let integrator = if kind == Kind::Fog { "volpath" } else { "path" }.into();
    render(&scene(kind), options, Settings { integrator, ..settings }).film().clone()
}

/// A light chosen by a tree gives on average the light of all of them, and emission hit by rays has
/// the complementary weight; also with several samples. Hemisphere sampling hardly finds such small
/// lights: it is tested with lights that only sampling finds.
#[test]
fn a_tree_of_lights_brings_the_light_of_all() {
    use DirectLight::{CosineHemisphere, Light, Mis, UniformHemisphere};
    const CASES: [(Kind, DirectLight, u32); 7] = [
        (Kind::All, Mis, 1),
        (Kind::All, Mis, 3),
        (Kind::All, Light, 1),
        (Kind::Points, Mis, 1),
        (Kind::Points, UniformHemisphere, 1),
        (Kind::Points, CosineHemisphere, 2),
        (Kind::Fog, Mis, 1),
    ];
    let base = Settings { max_depth: 2, ..settings(1024) };
    let all = [Kind::Points, Kind::All, Kind::Fog].map(|kind| film(kind, usize::MAX, base.clone()));
    for ((kind, direct, light_samples), seed) in CASES.into_iter().zip(1..) {
        let chosen = film(kind, 0, Settings { direct, light_samples, seed, ..base.clone() });
        let name = format!("{direct:?} -l {light_samples}, {kind:?}");
        assert_agree(&all[kind as usize], &chosen, sidak(1e-4, CASES.len()), &name);
    }
}
