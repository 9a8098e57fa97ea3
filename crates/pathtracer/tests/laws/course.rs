//! Radiance of the course's mode, compared with the documented formulas of its program.

use std::f64::consts::PI;

use pathtracer::compat::cs184;
use pathtracer::{CompileOptions, DirectLight, Region, Roulette, Scene, Session, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::LightKind;
use pt_testing::{irradiance, sidak};

use crate::measure::{Luminances, assert_uniform, finish, render, settings};
use crate::scenes::{Builder, camera, facing, inward_cube, looking, matte};

const ALBEDO: f32 = 0.6;
const UP: DVec3 = DVec3::Y;
const LIGHT: DVec3 = DVec3::new(0.0, 1.49, 0.0);
const RADIANCE: f32 = 10.0;
/// The size of the image of which one pixel is rendered: so small that the radiance does not vary.
const RESOLUTION: [u32; 2] = [2001, 2001];

pub(crate) fn course(spp: u32) -> Settings {
    Settings {
        integrator: "cs184".into(),
        direct: DirectLight::Light,
        roulette: Roulette::Fixed(0.65),
        max_depth: 1,
        ..settings(spp)
    }
}

/// A floor under some light. Its front faces down, because the course's program reverses the
/// normals of flat shapes.
fn floor() -> Builder {
    Builder::default().quad(facing(DVec3::ZERO, -UP, 50.0), matte([ALBEDO; 3]))
}

/// Renders the pixel in the middle of the view on to the floor point `p`, and compares.
fn check(scene: &Builder, p: DVec3, settings: Settings, irradiance: f64, what: &str) {
    let view = camera(p + DVec3::new(5.0, 4.0, 6.0), p, [20.0, 20.0]);
    let options = CompileOptions {
        resolution: Some(RESOLUTION),
        policies: cs184::POLICIES,
        camera: Some(view),
        ..CompileOptions::default()
    };
    let mut session = Session::new(&scene.0, options, settings).expect("the scene makes sense");
    session.restrict(Region { x: 1000, y: 1000, width: 1, height: 1 }).expect("inside");
    finish(&mut session);
    let want = f64::from(ALBEDO) / PI * irradiance;
    assert_uniform(session.film(), want, sidak(1e-4, 20), &format!("{what} at {p}"));
}

const POINTS: [DVec3; 3] = [DVec3::ZERO, DVec3::new(0.2, 0.0, 0.1), DVec3::new(-0.9, 0.0, 0.7)];

/// The square of the light is 0.6 by 0.8.
fn to_square() -> DAffine3 {
    looking(LIGHT, LIGHT - UP) * DAffine3::from_scale(DVec3::new(0.6, 0.8, 1.0))
}

fn corners() -> [DVec3; 4] {
    [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
        .map(|[x, y]| to_square().transform_point3(DVec3::new(x, y, 0.0)))
}

/// ∫ cos θ cos θ' / r dA over the square: the irradiance of an area light whose density forgets to
/// divide by the distance once. Physics has r².
fn course_area(p: DVec3) -> f64 {
    const N: u32 = 400;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(N) - 0.5;
    let term = |i: u32, j: u32| {
        let d = to_square().transform_point3(DVec3::new(at(i), at(j), 0.0)) - p;
        let cos = d.y / d.length();
        cos * cos / d.length()
    };
    let sum: f64 = (0..N * N).map(|k| term(k / N, k % N)).sum();
    0.6 * 0.8 * sum / f64::from(N * N)
}

#[test]
fn area_lights_count_times_their_distance() {
    for p in POINTS {
        let scene = floor().light(LightKind::Area { radiance: [RADIANCE; 3] }, to_square());
        let want = f64::from(RADIANCE) * course_area(p);
        check(&scene, p, course(20_000), want, "area light");
    }
}

/// The example of the notes on the course's program: the light of its Cornell boxes, and the floor
/// point in front where physics has a radiance of 0.3651. There, the course has 0.5604.
#[test]
fn the_documented_floor_point_is_as_bright_as_documented() {
    let radiance = |e: f64| f64::from(ALBEDO) / PI * f64::from(RADIANCE) * e;
    let at = |z: f64| DVec3::new(0.0, 0.0, z);
    let physical = |z: f64| radiance(irradiance::of_polygon(&corners(), at(z), UP));
    let (mut near, mut far) = (0.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (near + far);
        if physical(middle) > 0.3651 { near = middle } else { far = middle }
    }
    let course = radiance(course_area(at(near)));
    assert!((course - 0.5604).abs() < 2e-4, "{course} at {near}");
}

/// With hemisphere sampling, whose rays hit the emissive mesh, the same light has the physical
/// irradiance.
#[test]
fn hemisphere_sampling_finds_physical_light() {
    for p in POINTS {
        let mesh = to_square() * DAffine3::from_scale(DVec3::new(0.5, 0.5, 1.0));
        let scene = floor()
            .emissive_quad(mesh, RADIANCE)
            .light(LightKind::Area { radiance: [RADIANCE; 3] }, to_square());
        let direct = DirectLight::UniformHemisphere;
        let settings = Settings { direct, light_samples: 2, ..course(20_000) };
        let want = f64::from(RADIANCE) * irradiance::of_polygon(&corners(), p, UP);
        check(&scene, p, settings, want, "emissive mesh");
    }
}

/// Point lights have no fall-off, directional light comes from the direction of the node's −z as
/// seen from the origin, ambient light from the upper half, and spot lights are black.
#[test]
fn other_lights_are_those_of_the_course() {
    for p in POINTS {
        let node = looking(LIGHT, DVec3::new(0.5, 0.2, -0.4));
        let cos = (LIGHT - p).normalize().y;
        let point = floor().light(LightKind::Point { intensity: [3.0; 3] }, node);
        check(&point, p, course(16), 3.0 * cos, "point light");
        let ahead = node.transform_point3(DVec3::NEG_Z).normalize();
        let directional = floor().light(LightKind::Directional { irradiance: [2.0; 3] }, node);
        check(&directional, p, course(16), 2.0 * ahead.y, "directional light");
        let ambient = floor().light(LightKind::Hemisphere { radiance: [2.0; 3] }, node);
        check(&ambient, p, course(20_000), 2.0 * PI, "ambient light");
        let kind =
            LightKind::Spot { intensity: [9.0; 3], falloff_angle: 170.0, falloff_exponent: 0.0 };
        check(&floor().light(kind, node), p, course(16), 0.0, "spot light");
    }
}

/// A closed room with a light, an emissive mesh in its place, and a sphere.
fn room() -> Scene {
    let node = looking(DVec3::new(0.0, 0.97, 0.0), DVec3::new(0.0, 0.0, 0.0));
    let mesh = DAffine3::from_translation(DVec3::Y * 0.98)
        * looking(DVec3::ZERO, -UP)
        * DAffine3::from_scale(DVec3::splat(0.5));
    Builder::default()
        .mesh(inward_cube(), DAffine3::IDENTITY, matte([0.9, 0.8, 0.7]))
        .sphere(DVec3::new(-0.3, -0.6, -0.2), 0.4, matte([0.8; 3]))
        .emissive_quad(mesh, 4.0)
        .light(LightKind::Area { radiance: [4.0; 3] }, node)
        .0
}

/// The images of light of exactly 0, 1, … m interactions (`-o 0`, without roulette) add up to the
/// image of all (`-o 1`, with roulette).
#[test]
fn images_of_single_depths_add_up() {
    const DEPTH: u32 = 6;
    let luminances = |settings| {
        let view = camera(DVec3::new(0.1, 0.2, 0.95), DVec3::NEG_Z, [90.0, 90.0]);
        let options = CompileOptions {
            resolution: Some([10, 10]),
            policies: cs184::POLICIES,
            camera: Some(view),
            ..CompileOptions::default()
        };
        Luminances::of(render(&room(), options, settings).film())
    };
    let only = |m| {
        let roulette = Roulette::Fixed(1.0);
        let (max_depth, min_bounce, max_bounce) = (m, m, m);
        let seed = 1 + m;
        Settings { max_depth, min_bounce, max_bounce, roulette, seed, ..course(4096) }
    };
    let sum = (1..=DEPTH).fold(luminances(only(0)), |sum, m| sum.plus(&luminances(only(m))));
    let all = luminances(Settings { max_depth: DEPTH, ..course(4096) });
    let (mean, error) = all.whole();
    assert!(mean > 0.5 && error < 0.01 * mean, "{mean} ± {error}");
    sum.compare(&all, 1e-4).unwrap_or_else(|e| panic!("{e}"));
}
