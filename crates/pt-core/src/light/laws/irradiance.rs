//! The irradiance of each light, by its samples and by its closed form.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use pt_math::{DVec3, Spectrum, Vec3};
use pt_testing::{Random, mean_z_test, sidak};

use super::super::{
    AnyLight, EmitterTriangle, EnvironmentMap, LightTables, MeshLight, SphereLight,
};
use super::{Example, POINTS, all_lights};

/// Normals of lit surfaces: facing the lights of the examples, tilted, and half turned away.
const NORMALS: [Vec3; 4] =
    [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.1, -0.994_987_4), Vec3::NEG_X];

/// Irradiance at `p` on a surface with normal `n`, nothing in the way.
fn closed_form((light, tables): &Example, p: Vec3, n: Vec3) -> f64 {
    let (p, n) = (p.as_dvec3(), n.as_dvec3());
    let level = |s: Spectrum| f64::from(s.luminance());
    match light {
        AnyLight::Point(l) => level(l.intensity) * inverse_square(l.position, p, n),
        AnyLight::Spot(l) => {
            let cos = (p - l.position.as_dvec3()).normalize().dot(l.axis.as_dvec3());
            let lit = cos > f64::from(l.cos_cutoff);
            let share = if lit { cos.powf(f64::from(l.exponent)) } else { 0.0 };
            level(l.intensity) * share * inverse_square(l.position, p, n)
        }
        AnyLight::Directional(l) => level(l.irradiance) * l.to_light.as_dvec3().dot(n).max(0.0),
        AnyLight::Mesh(l) => {
            let sum: f64 = tables.triangles.iter().map(|t| lambert(t, p, n)).sum();
            level(l.radiance) * sum
        }
        AnyLight::Sphere(l) => level(l.radiance) * PI * sphere_factor(l, p, n),
        // Lambert's cosine law over the part of the upper half that the surface faces.
        AnyLight::Hemisphere(l) => level(l.radiance) * FRAC_PI_2 * (1.0 + n.y),
        AnyLight::Environment(l) => match l.map {
            None => level(l.radiance) * PI,
            Some(map) => {
                let map = &tables.environments[map as usize];
                quadrature(n, |d| level(map.radiance(d) * l.radiance))
            }
        },
    }
}

/// cos θ / r².
fn inverse_square(position: Vec3, p: DVec3, n: DVec3) -> f64 {
    let d = position.as_dvec3() - p;
    d.normalize().dot(n).max(0.0) / d.length_squared()
}

/// ∫ cos θ dω over the part of a triangle above the horizon, if `p` is in front of it: half the
/// sum over edges of the angle of the edge times the cosine of the plane through it and `p`.
/// [Lambert 1760; Baum, Rushmeier & Winget 1989, eq. 7]
fn lambert(t: &EmitterTriangle, p: DVec3, n: DVec3) -> f64 {
    let [p0, e1, e2, front] = [t.p0, t.e1, t.e2, t.normal].map(Vec3::as_dvec3);
    if (p - p0).dot(front) <= 0.0 {
        return 0.0;
    }
    let polygon = above_horizon(&[p0 - p, p0 + e1 - p, p0 + e2 - p], n);
    let edge = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let cross = a.cross(b);
        cross.length().atan2(a.dot(b)) * cross.normalize_or_zero().dot(n)
    };
    (0.5 * (0..polygon.len()).map(edge).sum::<f64>()).abs()
}

/// The part of a convex polygon with d·n ≥ 0. [Sutherland & Hodgman 1974]
fn above_horizon(polygon: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            kept.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    kept
}

/// Form factor from a surface element to a sphere, also where the horizon cuts it; 1 inside of a
/// sphere that glows inwards, since equal radiance comes from all around. [Howell, A Catalog of
/// Radiation Heat Transfer Configuration Factors, B-43]
fn sphere_factor(l: &SphereLight, p: DVec3, n: DVec3) -> f64 {
    let to_center = l.center.as_dvec3() - p;
    let h = to_center.length() / f64::from(l.radius);
    match (h > 1.0, l.inward) {
        (true, false) => (),
        (false, true) => return 1.0,
        _ => return 0.0,
    }
    let cos = to_center.normalize().dot(n);
    if cos * h >= 1.0 {
        return cos / (h * h);
    }
    if cos * h <= -1.0 {
        return 0.0;
    }
    let sin = (1.0 - cos * cos).sqrt();
    let root = (h * h - 1.0).sqrt();
    let cut = cos * (-root * cos / sin).acos() - root * (1.0 - h * h * cos * cos).sqrt();
    0.5 - FRAC_1_PI * (root / (h * sin)).asin() + FRAC_1_PI / (h * h) * cut
}

/// ∫ L cos θ dω by the midpoint rule in latitude and longitude.
fn quadrature(n: DVec3, radiance: impl Fn(Vec3) -> f64) -> f64 {
    const ROWS: u32 = 512;
    let step = PI / f64::from(ROWS);
    let cell = |row: u32, column: u32| {
        let (theta, phi) = ((f64::from(row) + 0.5) * step, (f64::from(column) + 0.5) * step);
        let (sin, cos) = theta.sin_cos();
        let d = DVec3::new(sin * phi.cos(), cos, sin * phi.sin());
        radiance(d.as_vec3()) * d.dot(n).max(0.0) * sin
    };
    let row = |r| (0..2 * ROWS).map(|c| cell(r, c)).sum::<f64>();
    (0..ROWS).map(row).sum::<f64>() * step * step
}

/// E = mean of L cos θ / p.
fn estimates((light, tables): &Example, p: Vec3, n: Vec3, count: usize) -> Vec<f64> {
    let mut random = Random::new(11);
    let value = |u| {
        light.sample(tables, p, u).map_or(0.0, |s| {
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

/// The mean over samples is what the formula of each light says.
#[test]
fn samples_bring_the_irradiance_of_the_closed_form() {
    check(&all_lights(), &POINTS);
}

/// A round plate on the axis: E = πL R²/(R² + h²); by samples, and by the formula for polygons.
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

/// Maps whose light is hard to sample: a single texel, one at a pole, one row, black.
#[test]
fn maps_of_all_kinds_light_as_quadrature_says() {
    let map = |w: u32, h: u32, lit: &dyn Fn(u32, u32) -> f32| {
        let texels = (0..w * h).map(|i| [lit(i % w, i / w); 3]).collect();
        let mut tables = LightTables::default();
        tables.environments.push(EnvironmentMap::new(w, h, texels));
        let light = super::super::Environment { radiance: Spectrum::ONE, map: Some(0) };
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
