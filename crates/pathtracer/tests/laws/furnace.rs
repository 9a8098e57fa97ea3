//! White furnaces: enclosures whose radiance is the sum of a geometric series, and objects that a
//! constant environment makes invisible.

use std::f64::consts::PI;

use pathtracer::compat::{Policies, cs184};
use pathtracer::{CompileOptions, DirectLight, Roulette, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Conductor, Glass, Mirror};
use pt_scene::{LightKind, Surface, shapes};
use pt_testing::sidak;

use crate::measure::{assert_uniform, render, settings};
use crate::scenes::{Builder, camera, inward_cube, matte, size};

pub(crate) const ESTIMATORS: [DirectLight; 4] = [
    DirectLight::Mis,
    DirectLight::Light,
    DirectLight::UniformHemisphere,
    DirectLight::CosineHemisphere,
];

/// A closed room whose walls emit radiance 1 and reflect ρ: after m interactions L = 1 + ρ + … +
/// ρᵐ, and in the limit 1/(1 − ρ).
///
/// Light sampling alone is left out: near the edges between walls, its samples have infinite
/// variance.
#[test]
fn a_closed_room_emits_by_the_geometric_series() {
    const DEPTHS: [u32; 4] = [0, 1, 5, 200];
    let rho = [0.8, 0.5, 0.2];
    let scene = Builder::default()
        .emissive_mesh(inward_cube(), DAffine3::IDENTITY, matte(rho), 1.0)
        .seen_by(camera(DVec3::new(0.3, -0.2, 0.4), DVec3::NEG_Z, [80.0, 80.0]));
    let estimators = ESTIMATORS.into_iter().filter(|&d| d != DirectLight::Light);
    for direct in estimators {
        for max_depth in DEPTHS {
            let spp = if max_depth > 5 { 1024 } else { 2048 };
            let settings = Settings { direct, max_depth, ..settings(spp) };
            let film = render(&scene, size([10, 8]), settings);
            let series = |rho: f32| {
                let rho = f64::from(rho);
                (1.0 - rho.powi(max_depth as i32 + 1)) / (1.0 - rho)
            };
            let [r, g, b] = rho.map(series);
            let want = 0.2126 * r + 0.7152 * g + 0.0722 * b;
            let what = format!("{direct:?}, {max_depth} interactions");
            assert_uniform(film.film(), want, sidak(1e-4, 3 * DEPTHS.len()), &what);
        }
    }
}

/// Light scattered inside of a diffuse sphere is the same everywhere in it. A point light of
/// intensity I in its centre gives L₁ = ρE/π with E = I/r², and each further interaction ρ times as
/// much: L = L₁ (1 − ρᵐ)/(1 − ρ). For the course's program, which has no fall-off, E = I.
#[test]
fn light_in_a_diffuse_sphere_is_even() {
    const RHO: f32 = 0.75;
    const RADIUS: f64 = 2.0;
    const INTENSITY: f32 = 3.0;
    const DEPTHS: [u32; 4] = [1, 2, 4, 100];
    let kind = LightKind::Point { intensity: [INTENSITY; 3] };
    let scene = Builder::default()
        .sphere(DVec3::ZERO, -RADIUS, matte([RHO; 3]))
        .light(kind, DAffine3::IDENTITY)
        .0;
    for (course, policies) in [(false, Policies::PHYSICAL), (true, cs184::POLICIES)] {
        for max_depth in DEPTHS {
            let view = camera(DVec3::new(0.3, -0.2, 0.4), DVec3::NEG_Z, [80.0, 80.0]);
            let options = CompileOptions { policies, camera: Some(view), ..size([10, 8]) };
            let spp = 4096;
            let (integrator, roulette) = if course {
                ("cs184", Roulette::Fixed(0.65))
            } else {
                ("path", Roulette::Throughput)
            };
            let settings =
                Settings { integrator: integrator.into(), roulette, max_depth, ..settings(spp) };
            let film = render(&scene, options, settings);
            let rho = f64::from(RHO);
            let e = f64::from(INTENSITY) / if course { 1.0 } else { RADIUS * RADIUS };
            let want = rho * e / PI * (1.0 - rho.powi(max_depth as i32)) / (1.0 - rho);
            let what = format!("{integrator}, {max_depth} interactions");
            assert_uniform(film.film(), want, sidak(1e-4, 2 * DEPTHS.len()), &what);
        }
    }
}

/// Under a constant environment of radiance 1, objects without absorption have radiance 1 too: a
/// diffuse convex shape of albedo 1, mirrors, and glass, whose refraction increases the radiance at
/// entry and decreases it at exit.
#[test]
fn what_absorbs_nothing_is_invisible_under_an_even_sky() {
    let glass = |ior| {
        Glass { reflectance: [1.0; 3].into(), transmittance: [1.0; 3].into(), ior, roughness: None }
            .into()
    };
    let perfect = Conductor {
        eta: [0.0; 3],
        k: [1.0; 3],
        reflectance: [1.0; 3].into(),
        roughness: None,
        two_sided: false,
    };
    let surfaces: [(&str, Surface); 5] = [
        ("diffuse", matte([1.0; 3])),
        ("mirror", Mirror { reflectance: [1.0; 3].into() }.into()),
        ("metal", perfect.into()),
        ("glass", glass(1.5)),
        ("bubble", glass(1.0 / 1.33)),
    ];
    let tests = ESTIMATORS.len() * surfaces.len() * 2;
    for (name, surface) in surfaces {
        let sphere = Builder::default().sphere(DVec3::ZERO, 1.0, surface.clone());
        let turned = DAffine3::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 0.7);
        let cube = Builder::default().mesh(shapes::cube(), turned, surface.clone());
        for (shape, scene) in [("sphere", sphere), ("cube", cube)] {
            let view = camera(DVec3::new(0.0, 1.0, 5.0), DVec3::ZERO, [35.0, 35.0]);
            let scene = scene.sky(1.0).seen_by(view);
            for direct in ESTIMATORS {
                let settings = Settings { direct, max_depth: 2000, ..settings(1024) };
                let film = render(&scene, size([9, 9]), settings);
                let what = format!("{name} {shape}, {direct:?}");
                assert_uniform(film.film(), 1.0, sidak(1e-4, tests), &what);
            }
        }
    }
}
