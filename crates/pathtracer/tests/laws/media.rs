//! Media: closed forms, white furnaces, and equivalent descriptions of the same medium.

use std::f64::consts::PI;
use std::sync::Arc;

use pathtracer::{DirectLight, Film, Roulette, Scene, Session, Settings};
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::material::{Black, Glass};
use pt_scene::medium::{
    Cloud, Grid, GridFilter, Heterogeneous, MediumEmission, MediumProperties, Phase, PhaseBlend,
    PlacedGrid, Volume,
};
use pt_scene::{LightKind, Medium, Sides, Surface, shapes};
use pt_testing::sidak;

use crate::measure::{
    Luminances, assert_agree, assert_all_agree, assert_uniform, render, settings,
};
use crate::scenes::{Builder, camera, cornell, looking, size, under_a_sky};

pub(crate) fn with_depth(spp: u32, max_depth: u32) -> Settings {
    Settings { integrator: "volpath".into(), max_depth, ..settings(spp) }
}

fn medium(matter: MediumProperties, phase: Phase) -> Medium {
    Medium { name: String::new(), matter, phase, at: pt_scene::Span::default() }
}

pub(crate) fn homogeneous(extinction: [f32; 3], albedo: [f32; 3], phase: Phase) -> Medium {
    medium(MediumProperties::Homogeneous { extinction, albedo, emission: [0.0; 3] }, phase)
}

/// Medium with a grid in the cube [−1, 1]³.
pub(crate) fn grid(grid: Grid, scale: f32, albedo: Volume, phase: Phase) -> Medium {
    let extinction = PlacedGrid {
        grid: Arc::new(grid),
        to_world: DAffine3::from_scale([2.0; 3].into())
            * DAffine3::from_translation([-0.5; 3].into()),
        filter: GridFilter::Trilinear,
    };
    let emission = MediumEmission::Constant([0.0; 3]);
    let matter = Heterogeneous { extinction, scale, albedo, emission };
    medium(MediumProperties::Heterogeneous(Box::new(matter)), phase)
}

/// A cloud: empty in some places, dense in others.
pub(crate) fn cloud(scale: f32, albedo: [f32; 3], phase: Phase) -> Medium {
    let values = (0..20 * 18 * 9u32).map(|i| (i * i % 23).saturating_sub(9) as f32 / 13.0);
    let values = Grid { resolution: [20, 18, 9], channels: 1, values: values.collect() };
    grid(values, scale, Volume::Constant(albedo), phase)
}

/// A cloud whose colours vary from place to place.
fn colored_cloud(scale: f32, albedo: [f32; 3], phase: Phase) -> Medium {
    let cell = |i: u32| [7, 13, 29].map(|k| (i * i * k % 23).saturating_sub(9) as f32 / 13.0);
    let values = (0..20 * 18 * 9u32).flat_map(cell).collect();
    let values = Grid { resolution: [20, 18, 9], channels: 3, values };
    grid(values, scale, Volume::Constant(albedo), phase)
}

/// Fills the last object with a medium.
fn filled(builder: Builder, medium: Medium) -> Builder {
    let Builder(mut scene) = builder;
    scene.media.push(medium);
    let interior = Some(scene.media.len() as u32 - 1);
    let object = scene.objects.last_mut().expect("there is an object");
    object.media = Some(Sides { interior, exterior: None });
    Builder(scene)
}

/// Adds the cube [−1, 1]³ transformed by `place`, whose surface is only the boundary of a medium.
pub(crate) fn block(builder: Builder, place: DAffine3, medium: Medium) -> Builder {
    let Builder(mut scene) = builder.mesh(shapes::cube(), place, Black.into());
    scene.materials.last_mut().expect("it has a material").opacity = 0.0.into();
    filled(Builder(scene), medium)
}

fn glass(ior: f32) -> Surface {
    Glass { reflectance: [1.0; 3].into(), transmittance: [1.0; 3].into(), ior, roughness: None }
        .into()
}

/// A camera that looks along −z, almost in parallel.
pub(crate) fn straight() -> pathtracer::Camera {
    camera(DVec3::new(0.0, 0.0, 8.0), DVec3::ZERO, [1e-3, 1e-3])
}

fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

const FORWARDS: Phase = Phase::HenyeyGreenstein { g: 0.7 };
const BACKWARDS: Phase = Phase::HenyeyGreenstein { g: -0.4 };

/// Environment through two blocks: each single sample is e^(−σd), up to the rounding of distances.
#[test]
fn what_only_absorbs_has_no_noise() {
    let sigma = [0.2, 0.9, 3.0];
    let absorbing = || homogeneous(sigma, [0.0; 3], Phase::Isotropic);
    let place = |z: f64, depth: f64| {
        DAffine3::from_translation(DVec3::new(0.0, 0.0, z))
            * DAffine3::from_scale(DVec3::new(1.0, 1.0, depth))
    };
    let scene = block(Builder::default().sky(1.0), place(0.0, 0.5), absorbing());
    let scene = block(scene, place(4.0, 0.25), absorbing()).seen_by(straight());
    let film = render(&scene, size([8, 8]), with_depth(1, 10));
    let want = luminance(sigma.map(|s| (-1.5 * f64::from(s)).exp()));
    for pixel in film.film().pixels() {
        let (got, _) = pixel.luminance();
        assert!((got - want).abs() < 2e-6, "{got}, expected {want}");
    }
}

/// A pane of glass that absorbs, seen straight on under a constant environment of radiance 1. With
/// F = ((n − 1) / (n + 1))² and T = e^(−σd), it transmits (1 − F)² T / (1 − F²T²) and reflects
/// F + (1 − F)² F T² / (1 − F²T²). [Born & Wolf, Principles of Optics, §1.6.4, without
/// interference]
#[test]
fn glass_that_absorbs_follows_beers_law() {
    let (ior, sigma) = (1.5, [0.1, 0.5, 2.0]);
    let absorbing = homogeneous(sigma, [0.0; 3], Phase::Isotropic);
    let place = DAffine3::from_scale(DVec3::new(20.0, 20.0, 0.5));
    let scene = Builder::default().sky(1.0).mesh(shapes::cube(), place, glass(ior));
    let scene = filled(scene, absorbing).seen_by(straight());
    let film = render(&scene, size([6, 6]), with_depth(4096, 200));
    let f = f64::from((ior - 1.0) / (ior + 1.0)).powi(2);
    let want = luminance(sigma.map(|s| {
        let t = (-f64::from(s)).exp();
        let inside = 1.0 - f * f * t * t;
        (1.0 - f).powi(2) * t / inside + f + (1.0 - f).powi(2) * f * t * t / inside
    }));
    assert_uniform(film.film(), want, 1e-4, "a pane");
}

/// The name of a layer, its extinction, and the medium with a phase function.
type Layer = (&'static str, [f64; 3], fn(Phase) -> Medium);

/// Value of a phase function at an angle with this cosine.
fn value(phase: &Phase, cos: f64) -> f64 {
    match phase {
        Phase::Isotropic => 1.0 / (4.0 * PI),
        Phase::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos * cos),
        Phase::HenyeyGreenstein { g } => {
            let g = f64::from(*g);
            let base = 1.0 + g * g - 2.0 * g * cos;
            (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
        }
        // Of the values 1, 2 and 6, ∫ p dω = 2π (1.5 + 4) for 1.
        Phase::Table { .. } if cos < 0.0 => (2.0 + cos) / (11.0 * PI),
        Phase::Table { .. } => (2.0 + 4.0 * cos) / (11.0 * PI),
        Phase::Blend(blend) => {
            let share = f64::from(blend.amount);
            (1.0 - share) * value(&blend.first, cos) + share * value(&blend.second, cos)
        }
        Phase::Microflakes { .. } => panic!("they do not depend on the angle alone"),
    }
}

/// Light that a layer of depth D scatters once: parallel light of irradiance E comes from the side
/// of the camera at the cosine μ, so L = ∫ σs p E e^(−σt z (1 + 1/μ)) dz from 0 to D.
#[test]
fn single_scattering_follows_its_closed_form() {
    const DEPTH: f64 = 2.0;
    const IRRADIANCE: f32 = 3.0;
    let to_light = DVec3::new(0.6, 0.0, 0.8);
    let mu = to_light.z;
    let blend = PhaseBlend {
        first: BACKWARDS,
        second: Phase::Blend(Box::new(PhaseBlend {
            first: Phase::Rayleigh,
            second: FORWARDS,
            amount: 0.25,
        })),
        amount: 0.7,
    };
    let table = Phase::Table { values: vec![1.0, 2.0, 6.0] };
    let blend_of_table =
        PhaseBlend { first: table.clone(), second: Phase::Isotropic, amount: 0.25 };
    let [blend, blend_of_table] = [blend, blend_of_table].map(|b| Phase::Blend(Box::new(b)));
    let phases =
        [Phase::Isotropic, FORWARDS, BACKWARDS, Phase::Rayleigh, table, blend, blend_of_table];
    let media: [Layer; 4] = [
        ("grey", [0.7; 3], |phase| homogeneous([0.7; 3], [0.6; 3], phase)),
        ("coloured", [0.1, 0.7, 4.0], |phase| homogeneous([0.1, 0.7, 4.0], [0.6; 3], phase)),
        ("grid", [0.7; 3], |phase| {
            grid(Grid::uniform(0.35), 2.0, Volume::Constant([0.6; 3]), phase)
        }),
        ("coloured grid", [0.1, 0.7, 4.0], |phase| {
            let sigma = Grid::uniform_color([0.05, 0.35, 2.0]);
            grid(sigma, 2.0, Volume::Constant([0.6; 3]), phase)
        }),
    ];
    for phase in &phases {
        let p = value(phase, -to_light.z);
        for (name, sigma, medium) in &media {
            let light = LightKind::Directional { irradiance: [IRRADIANCE; 3] };
            // The layer is only the cube of the grid, so light enters by its front alone.
            let scene = Builder::default().light(light, looking(to_light, DVec3::ZERO));
            let wide = DAffine3::from_scale(DVec3::new(50.0, 50.0, 1.0));
            let mut scene = block(scene, wide, medium(phase.clone())).seen_by(straight());
            if let MediumProperties::Heterogeneous(grid) = &mut scene.media[0].matter {
                grid.extinction.to_world = wide * grid.extinction.to_world;
            }
            let film = render(&scene, size([6, 6]), with_depth(4096, 1));
            let want = luminance(sigma.map(|sigma| {
                let path = 1.0 + 1.0 / mu;
                0.6 * p * f64::from(IRRADIANCE) * (1.0 - (-sigma * DEPTH * path).exp()) / path
            }));
            let what = format!("{name}, {phase:?}");
            assert_uniform(film.film(), want, sidak(1e-4, phases.len() * media.len()), &what);
        }
    }
}

/// Microflakes in the cube [−1, 1]³: homogeneous, or from one kind to the other along x.
fn flakes(matrices: &[[f32; 6]]) -> Phase {
    let resolution = [matrices.len() as u32, 1, 1];
    let grid = Grid { resolution, channels: 6, values: matrices.concat() };
    let to_world =
        DAffine3::from_scale([2.0; 3].into()) * DAffine3::from_translation([-0.5; 3].into());
    let filter = GridFilter::Trilinear;
    Phase::Microflakes { matrices: PlacedGrid { grid: Arc::new(grid), to_world, filter } }
}

const FLAKES: [f32; 6] = [0.15, 0.25, 0.9, 0.02, -0.1, 0.2];
const FIBRES: [f32; 6] = [0.6, 0.55, 0.08, 0.1, 0.02, -0.05];

/// Light that a layer of depth D with microflakes scatters once, seen from straight above: with
/// σ(ω)² = ωᵀSω, the extinction is σt σ(ω), and σs σ(ωo) p(ωo, ωi) = σs D(ωh) / 4 with D(ω) = 1 /
/// (π √|S| (ωᵀS⁻¹ω)²).
#[test]
fn single_scattering_of_microflakes_follows_its_closed_form() {
    const DEPTH: f64 = 2.0;
    const IRRADIANCE: f32 = 3.0;
    let to_light = DVec3::new(0.6, 0.0, 0.8);
    for entries in [FLAKES, FIBRES] {
        let [xx, yy, zz, xy, xz, yz] = entries.map(f64::from);
        let s = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let area = |w: DVec3| w.dot(s * w).sqrt();
        let half = (to_light + DVec3::Z).normalize();
        let stretch = half.dot(s.inverse() * half);
        let normals = 1.0 / (PI * s.determinant().sqrt() * stretch * stretch);
        for medium in [
            homogeneous([0.7; 3], [0.6; 3], flakes(&[entries])),
            grid(Grid::uniform(0.35), 2.0, Volume::Constant([0.6; 3]), flakes(&[entries])),
            grid(Grid::uniform(0.35), 2.0, Volume::Constant([0.6; 3]), flakes(&[entries; 3])),
        ] {
            let light = LightKind::Directional { irradiance: [IRRADIANCE; 3] };
            let scene = Builder::default().light(light, looking(to_light, DVec3::ZERO));
            let wide = DAffine3::from_scale(DVec3::new(50.0, 50.0, 1.0));
            let mut scene = block(scene, wide, medium).seen_by(straight());
            if let MediumProperties::Heterogeneous(grid) = &mut scene.media[0].matter {
                grid.extinction.to_world = wide * grid.extinction.to_world;
            }
            let film = render(&scene, size([6, 6]), with_depth(4096, 1));
            let path = 0.7 * (area(DVec3::Z) + area(to_light) / to_light.z);
            let scattered = 0.7 * 0.6 * normals / 4.0 * f64::from(IRRADIANCE);
            let want = scattered * (1.0 - (-path * DEPTH).exp()) / path;
            assert_uniform(film.film(), want, sidak(1e-4, 6), &format!("{entries:?}"));
        }
    }
}

#[test]
fn microflakes_that_make_no_sense_are_refused() {
    let flat = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    let even = |phase| homogeneous([1.0; 3], [0.5; 3], phase);
    let blend = PhaseBlend { first: flakes(&[FLAKES]), second: FORWARDS, amount: 0.5 };
    for (medium, word) in [
        (even(flakes(&[flat])), "not positive definite"),
        (cloud(1.0, [0.5; 3], flakes(&[FLAKES, flat])), "not positive definite"),
        (even(flakes(&[FLAKES, FIBRES])), "expected a heterogeneous medium"),
        (cloud(1.0, [0.5; 3], flakes(&[FLAKES.map(|x| 1e12 * x)])), "optical depth"),
        (even(Phase::Blend(Box::new(blend))), "cannot be blended"),
    ] {
        let scene = block(Builder::default().sky(1.0), DAffine3::IDENTITY, medium);
        let Err(error) = Session::new(&scene.seen_by(straight()), size([2, 2]), with_depth(1, 1))
        else {
            panic!("{word} is not said")
        };
        assert!(error.to_string().contains(word), "{error}");
    }
}

/// Under a constant environment of radiance 1, media without absorption have radiance 1 too,
/// however they scatter.
#[test]
fn media_that_absorb_nothing_are_invisible_under_an_even_sky() {
    let white = [1.0; 3];
    let turned = DAffine3::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 0.7);
    let media = || {
        [
            ("isotropic", homogeneous([1.5; 3], white, Phase::Isotropic)),
            ("forwards", homogeneous([1.5; 3], white, FORWARDS)),
            ("coloured", homogeneous([0.5, 1.0, 3.0], white, BACKWARDS)),
            ("cloud", cloud(3.0, white, Phase::Isotropic)),
            ("cloud, forwards", cloud(3.0, white, FORWARDS)),
            ("coloured cloud", colored_cloud(3.0, white, FORWARDS)),
            ("flakes", homogeneous([2.0; 3], white, flakes(&[FLAKES]))),
            ("turning flakes", colored_cloud(4.0, white, flakes(&[FLAKES, FIBRES]))),
        ]
    };
    let inside = [("nothing", None), ("glass", Some(glass(1.5))), ("bubble", Some(glass(0.75)))];
    let tests = media().len() * inside.len() * 2;
    for (name, medium) in media() {
        for (boundary, surface) in &inside {
            for direct in [DirectLight::Mis, DirectLight::Light] {
                let scene = Builder::default().sky(1.0);
                let scene = match surface {
                    None => block(scene, turned, medium.clone()),
                    Some(surface) => {
                        filled(scene.sphere(DVec3::ZERO, 1.0, surface.clone()), medium.clone())
                    }
                };
                let scene = scene.seen_by(camera(DVec3::Z * 5.0, DVec3::ZERO, [30.0, 30.0]));
                let settings = Settings { direct, ..with_depth(1024, 5000) };
                let film = render(&scene, size([7, 7]), settings);
                let what = format!("{name} in {boundary}, {direct:?}");
                assert_uniform(film.film(), 1.0, sidak(1e-4, tests), &what);
            }
        }
    }
}

/// Clouds of noise in the cube [−1, 1]³.
fn noise(extinction: [f32; 3], albedo: [f32; 3]) -> Medium {
    let matter = Cloud {
        extinction,
        albedo,
        density: 2.0,
        wispiness: 1.0,
        frequency: 5.0,
        low: [0.0, 0.3, 0.0],
        high: [1.0; 3],
        to_world: DAffine3::from_scale(DVec3::new(2.0, 2.0 / 0.7, 2.0))
            * DAffine3::from_translation(DVec3::new(-0.5, -0.65, -0.5)),
    };
    medium(MediumProperties::Cloud(Box::new(matter)), FORWARDS)
}

/// Sets the emission of a medium to 1, the radiance of an opaque absorber.
fn emissive(mut medium: Medium) -> Medium {
    match &mut medium.matter {
        MediumProperties::Homogeneous { emission, .. } => *emission = [1.0; 3],
        MediumProperties::Heterogeneous(matter) => {
            matter.emission = MediumEmission::Constant([1.0; 3]);
        }
        MediumProperties::Cloud(_) => panic!("clouds do not emit"),
    }
    medium
}

/// In thermal equilibrium, all points have the same radiance, whatever is absorbed or scattered.
/// [Kirchhoff 1860]
#[test]
fn media_as_bright_as_the_sky_are_invisible() {
    let grey = [0.6; 3];
    let place = DAffine3::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 0.7);
    let media = [
        ("homogeneous", emissive(homogeneous([1.5; 3], grey, FORWARDS))),
        ("black", emissive(homogeneous([1.5; 3], [0.0; 3], Phase::Isotropic))),
        ("coloured", emissive(homogeneous([0.5, 1.0, 3.0], [0.9, 0.5, 0.1], BACKWARDS))),
        ("cloud", emissive(cloud(3.0, grey, FORWARDS))),
        ("black cloud", emissive(cloud(3.0, [0.0; 3], FORWARDS))),
        ("coloured cloud", emissive(colored_cloud(3.0, [0.9, 0.5, 0.1], FORWARDS))),
        ("noise that absorbs nothing", noise([4.0, 2.0, 1.0], [1.0; 3])),
    ];
    for (name, medium) in &media {
        let scene = block(Builder::default().sky(1.0), place, medium.clone());
        let scene = scene.seen_by(camera(DVec3::Z * 5.0, DVec3::ZERO, [30.0, 30.0]));
        let film = render(&scene, size([7, 7]), with_depth(1024, 5000));
        assert_uniform(film.film(), 1.0, sidak(1e-4, media.len()), name);
    }
    // Camera in the medium, a pane of glass, and a wall of the same radiance.
    let view = camera(DVec3::new(0.2, 0.1, 0.0), DVec3::NEG_Z, [80.0, 80.0]);
    let mut scene = Builder::default()
        .emissive_sphere(DVec3::ZERO, -2.0, 1.0)
        .seen_by(pathtracer::Camera { medium: Some(0), ..view });
    scene.media.push(emissive(homogeneous([0.6, 0.8, 1.0], [0.5; 3], FORWARDS)));
    let film = render(&scene, size([7, 7]), with_depth(1024, 5000));
    assert_uniform(film.film(), 1.0, 1e-4, "a camera within");
}

/// A camera in an unbounded medium is in a furnace, too: the medium scatters everywhere, lit by a
/// wall of radiance 1 all around.
#[test]
fn a_camera_may_be_in_a_medium() {
    let view = camera(DVec3::new(0.2, 0.1, 0.0), DVec3::NEG_Z, [80.0, 80.0]);
    for phase in [Phase::Isotropic, FORWARDS] {
        let mut scene = Builder::default()
            .emissive_sphere(DVec3::ZERO, -2.0, 1.0)
            .seen_by(pathtracer::Camera { medium: Some(0), ..view.clone() });
        scene.media.push(homogeneous([0.6, 0.8, 1.0], [1.0; 3], phase.clone()));
        for direct in [DirectLight::Mis, DirectLight::Light] {
            let settings = Settings { direct, ..with_depth(1024, 5000) };
            let film = render(&scene, size([7, 7]), settings);
            assert_uniform(film.film(), 1.0, sidak(1e-4, 4), &format!("{phase:?}, {direct:?}"));
        }
    }
}

/// A foggy room with a forward-scattering cloud.
pub(crate) fn fog() -> Scene {
    foggy(cloud(8.0, [0.9, 0.8, 0.7], FORWARDS))
}

/// A foggy room with the given medium in a cloud, a ball of turbid glass, and lights of all kinds.
pub(crate) fn foggy(cloud: Medium) -> Scene {
    let turned = DAffine3::from_translation(DVec3::new(-0.1, 0.3, 0.2))
        * DAffine3::from_mat3(DMat3::from_rotation_y(0.5) * 0.5);
    let point = LightKind::Point { intensity: [0.3; 3] };
    let mut room = Builder(cornell());
    let view = room.0.cameras.remove(0);
    room.0.media.push(homogeneous([0.05, 0.1, 0.2], [0.9, 0.8, 0.7], BACKWARDS));
    let milk = homogeneous([4.0, 6.0, 9.0], [0.99, 0.9, 0.8], FORWARDS);
    let room = room.light(point, DAffine3::from_translation(DVec3::new(0.3, 0.5, 0.5)));
    let room = filled(room.sphere(DVec3::new(0.5, -0.7, 0.5), 0.25, glass(1.5)), milk);
    let Builder(mut room) = block(room, turned, cloud);
    for object in &mut room.objects {
        if let Some(sides) = &mut object.media {
            sides.exterior = Some(0);
        }
    }
    let cloud = room.media.last_mut().expect("the cloud");
    if let MediumProperties::Heterogeneous(grid) = &mut cloud.matter {
        grid.extinction.to_world = turned * grid.extinction.to_world;
    }
    Builder(room).seen_by(pathtracer::Camera { medium: Some(0), ..view })
}

/// That room with a coloured cloud.
pub(crate) fn foggy_room() -> Scene {
    foggy(colored_cloud(5.0, [0.9, 0.7, 0.5], FORWARDS))
}

pub(crate) fn film_of(scene: &Scene, settings: Settings) -> Film {
    render(scene, size([12, 10]), settings).film().clone()
}

/// A grid with a single value equals a homogeneous medium.
#[test]
fn a_uniform_grid_is_homogeneous() {
    for phase in [Phase::Isotropic, FORWARDS] {
        let uniform = Grid { resolution: [3, 9, 17], channels: 1, values: vec![0.25; 459] };
        let albedo = Grid { resolution: [2, 1, 1], channels: 3, values: [0.9, 0.7, 0.5].repeat(2) };
        let to_world =
            DAffine3::from_translation([-2.0; 3].into()) * DAffine3::from_scale([4.0; 3].into());
        let filter = GridFilter::Nearest;
        let albedo = PlacedGrid { grid: Arc::new(albedo), to_world, filter };
        let media = [
            homogeneous([4.0; 3], [0.9, 0.7, 0.5], phase.clone()),
            grid(uniform.clone(), 16.0, Volume::Constant([0.9, 0.7, 0.5]), phase.clone()),
            grid(uniform, 16.0, Volume::Grid(albedo), phase.clone()),
        ];
        let films: Vec<_> = media
            .into_iter()
            .zip(0..)
            .map(|(medium, seed)| {
                let settings = Settings { seed, ..with_depth(2048, 12) };
                (format!("{phase:?}, {seed}"), film_of(&foggy(medium), settings))
            })
            .collect();
        assert_all_agree(&films);
    }
}

/// The same with colours.
#[test]
fn a_uniform_coloured_grid_is_homogeneous() {
    let albedo = [0.9, 0.7, 0.5];
    let values = [0.25, 0.1, 0.02].repeat(459);
    let uniform = Grid { resolution: [3, 9, 17], channels: 3, values };
    let media = [
        homogeneous([4.0, 1.6, 0.32], albedo, FORWARDS),
        grid(uniform, 16.0, Volume::Constant(albedo), FORWARDS),
    ];
    let films: Vec<_> = media
        .into_iter()
        .zip(0..)
        .map(|(medium, seed)| {
            let settings = Settings { seed, ..with_depth(2048, 12) };
            (format!("{seed}"), film_of(&foggy(medium), settings))
        })
        .collect();
    assert_all_agree(&films);
}

/// Light sampling alone, and MIS with phase functions and BSDFs, with one and four samples of each
/// light, and with and without Russian roulette.
#[test]
fn estimators_agree_in_media() {
    let scene = fog();
    let base = with_depth(4096, 6);
    let all = [
        base.clone(),
        Settings { light_samples: 4, spp: 2048, ..base.clone() },
        Settings { direct: DirectLight::Light, ..base.clone() },
        Settings { roulette: Roulette::Fixed(0.6), ..base },
    ];
    let films: Vec<_> = all
        .into_iter()
        .zip(0..)
        .map(|(settings, seed)| {
            let what = format!("{:?} {:?}", settings.direct, settings.roulette);
            (what, film_of(&scene, Settings { seed, ..settings }))
        })
        .collect();
    assert_all_agree(&films);
}

/// Under an environment of which MIS-compensated light sampling leaves the dark part to phase
/// functions and BSDFs.
#[test]
fn estimators_agree_in_a_cloud_under_an_image_of_the_sky() {
    let mut scene = Builder(under_a_sky());
    let view = scene.0.cameras.remove(0);
    let place = DAffine3::from_translation(DVec3::new(0.0, 1.2, 0.5));
    let mut scene = block(scene, place, cloud(3.0, [0.9, 0.8, 0.7], FORWARDS)).seen_by(view);
    if let MediumProperties::Heterogeneous(grid) = &mut scene.media[0].matter {
        grid.extinction.to_world = place * grid.extinction.to_world;
    }
    let base = with_depth(4096, 6);
    let light = Settings { direct: DirectLight::Light, seed: 1, ..base.clone() };
    let (mis, light) = (film_of(&scene, base), film_of(&scene, light));
    assert_agree(&mis, &light, 1e-4, "a cloud under a sky");
}

/// Light scattered k times, for k = 0 … 3 and more, adds up to all light.
#[test]
fn depths_in_media_add_up() {
    let scene = foggy(cloud(8.0, [0.9, 0.8, 0.7], Phase::Isotropic));
    let only = |min_bounce, max_bounce| {
        let settings = Settings { min_bounce, max_bounce, seed: min_bounce, ..with_depth(2048, 6) };
        Luminances::of(&film_of(&scene, settings))
    };
    let each = (1..=2).fold(only(0, 0), |sum, k| sum.plus(&only(k, k)));
    let all = film_of(&scene, Settings { seed: 9, ..with_depth(2048, 6) });
    let result = each.plus(&only(3, u32::MAX)).compare(&Luminances::of(&all), 1e-4);
    result.unwrap_or_else(|e| panic!("depth by depth: {e}"));
}
