//! Irradiance of each light by its samples, compared with its closed form.

use std::f64::consts::{PI, TAU};

use pt_math::{DVec3, Mat3, Spectrum, Vec3};
use pt_testing::{Random, mean_z_test, sidak};

use super::super::{
    AnyLight, EmitterTriangle, EnvironmentMap, LightSampleContext, LightTables, MeshLight,
    PlacedMap,
};
use super::{Example, POINTS, all_lights};

/// Normals of receiving surfaces: facing the lights of the examples, tilted, and turned half away.
const NORMALS: [Vec3; 4] =
    [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.1, -0.994_987_4), Vec3::NEG_X];

fn closed_form((light, tables): &Example, p: Vec3, n: Vec3) -> f64 {
    light.laws().irradiance(tables, p.as_dvec3(), n.as_dvec3())
}

/// Returns samples of the estimator L cos θ / p, whose mean is the irradiance.
fn estimates((light, tables): &Example, p: Vec3, n: Vec3, count: usize) -> Vec<f64> {
    let mut random = Random::new(11);
    let value = |u| {
        light.sample(tables, &LightSampleContext::on_surface(p, n, false), u).map_or(0.0, |s| {
            let pdf = s.pdf.map_or(1.0, pt_math::Pdf::get);
            f64::from(s.radiance.luminance()) * f64::from(s.wi.dot(n).max(0.0)) / f64::from(pdf)
        })
    };
    (0..count).map(|_| value(random.unit_2d())).collect()
}

fn check(examples: &[Example], points: &[Vec3]) {
    let tests = examples.len() * points.len() * NORMALS.len();
    for example in examples {
        for &p in points {
            for n in NORMALS {
                let want = closed_form(example, p, n);
                let count = if example.0.is_delta() { 2 } else { 40_000 };
                let got = estimates(example, p, n, count);
                mean_z_test(&got, want, sidak(1e-4, tests))
                    .unwrap_or_else(|e| panic!("{:?} at {p}, normal {n}: {e}", example.0));
            }
        }
    }
}

/// The mean over samples is the closed form of each light.
#[test]
fn samples_bring_the_irradiance_of_the_closed_form() {
    check(&all_lights(), &POINTS);
}

/// A disk on the axis: E = πL R²/(R² + h²); by samples, and by the formula for polygons.
#[test]
fn a_disk_lights_as_its_formula_says() {
    const CORNERS: u32 = 4096;
    let (radius, height, radiance) = (0.8f32, 1.5f32, 2.0);
    let corner = |i: u32| {
        let (s, c) = (f64::from(i) / f64::from(CORNERS) * TAU).sin_cos();
        DVec3::new(c, 0.0, s).as_vec3() * radius
    };
    let triangle = |i| EmitterTriangle {
        p0: Vec3::Y * height,
        e1: corner(i),
        e2: corner(i + 1),
        normal: Vec3::NEG_Y,
        coat: 0.0,
    };
    let triangles: Vec<_> = (0..CORNERS).map(triangle).collect();
    let mut tables = LightTables::default();
    let light = MeshLight::new(&mut tables, &triangles, Spectrum::splat(radiance)).expect("area");
    let example = (light.into(), tables);
    let (r2, h2) = (f64::from(radius * radius), f64::from(height * height));
    let want = PI * f64::from(radiance) * r2 / (r2 + h2);
    let polygon = closed_form(&example, Vec3::ZERO, Vec3::Y);
    assert!((polygon / want - 1.0).abs() < 1e-5, "{polygon} {want}");
    mean_z_test(&estimates(&example, Vec3::ZERO, Vec3::Y, 100_000), want, 1e-4).unwrap();
}

/// Maps that are hard to sample: a single texel, one bright texel, one at a pole, a single row,
/// black.
#[test]
fn maps_of_all_kinds_light_as_quadrature_says() {
    let map = |w: u32, h: u32, context: &dyn Fn(u32, u32) -> f32| {
        let texels = (0..w * h).map(|i| [context(i % w, i / w); 3]).collect();
        let mut tables = LightTables::default();
        tables.environments.push(EnvironmentMap::new(w, h, texels).into());
        let map = Some(PlacedMap { index: 0, to_world: Mat3::IDENTITY });
        let light = super::super::Environment { radiance: Spectrum::ONE, map };
        (AnyLight::from(light), tables)
    };
    let maps = [
        map(1, 1, &|_, _| 3.0),
        map(32, 16, &|x, y| if (x, y) == (31, 7) { 100.0 } else { 0.0 }),
        map(8, 4, &|x, y| if (x, y) == (2, 0) { 10.0 } else { 0.1 }),
        map(16, 1, &|x, _| x as f32),
        map(4, 2, &|_, _| 0.0),
    ];
    check(&maps, &POINTS[..1]);
}
