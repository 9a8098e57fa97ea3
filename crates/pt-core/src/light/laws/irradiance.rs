//! Irradiance of each light, by its samples and by its closed form.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use pt_math::{DVec3, Mat3, Spectrum, Vec3};
use pt_testing::{Random, irradiance, mean_z_test, sidak};

use super::super::tree::TreeLight;
use super::super::{
    AnyLight, DistantDisk, EmitterTriangle, EnvironmentMap, Falloff, Light, LightSampleContext,
    LightTables, MeshLight, PlacedMap, PortalSky, SphereLight, Sun, TexturedSphere,
    TexturedTriangle,
};
use super::{Example, POINTS, all_lights};

/// Normals of receiving surfaces: facing the lights of the examples, tilted, and turned half away.
const NORMALS: [Vec3; 4] =
    [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.1, -0.994_987_4), Vec3::NEG_X];

/// Irradiance at `p` on a surface with normal `n`, without occlusion.
fn closed_form((light, tables): &Example, p: Vec3, n: Vec3) -> f64 {
    let (p, n) = (p.as_dvec3(), n.as_dvec3());
    let level = level_of;
    match &light.shown() {
        AnyLight::Point(l) => level(l.intensity) * inverse_square(l.position, p, n),
        AnyLight::Spot(l) => {
            let cos = (p - l.position.as_dvec3()).normalize().dot(l.axis.as_dvec3());
            let share = of_falloff(l.falloff, cos);
            level(l.intensity) * share * inverse_square(l.position, p, n)
        }
        AnyLight::Ies(l) => {
            let w = (p - l.position.as_dvec3()).normalize();
            let [x, y, z] =
                [l.axes.x_axis, l.axes.y_axis, l.axes.z_axis].map(|a| a.as_dvec3().dot(w));
            let vertical = (-z).acos().to_degrees();
            let horizontal = y.atan2(x).to_degrees().rem_euclid(360.0);
            let profile = &tables.profiles[l.profile as usize];
            let candela = f64::from(profile.candela(vertical as f32, horizontal as f32));
            level(l.scale) * candela * inverse_square(l.position, p, n)
        }
        AnyLight::Directional(l) => level(l.irradiance) * l.to_light.as_dvec3().dot(n).max(0.0),
        AnyLight::DistantDisk(l) => of_disk(l, n),
        AnyLight::Sun(l) => of_sun(tables, l, n),
        AnyLight::Mesh(l) => {
            let sum: f64 = tables.triangles.iter().map(|t| of_triangle(t, p, n)).sum();
            level(l.radiance) * sum
        }
        AnyLight::Sphere(l) => level(l.radiance) * of_sphere(l, p, n),
        AnyLight::TexturedMesh(_) => {
            let laid = tables.triangles.iter().zip(&tables.textured_triangles);
            laid.map(|(t, laid)| of_textured_triangle(tables, t, laid, p, n)).sum()
        }
        AnyLight::TexturedSphere(l) => of_textured_sphere(tables, l, p, n),
        AnyLight::Projector(l) => {
            let w = (p - l.spot.position.as_dvec3()).normalize();
            let share = of_falloff(l.spot.falloff, w.dot(l.spot.axis.as_dvec3()));
            if share == 0.0 {
                return 0.0;
            }
            let slide = &tables.slides[l.slide as usize];
            let picture = level(slide.share(&tables.textures, w.as_vec3()));
            level(l.spot.intensity) * share * picture * inverse_square(l.spot.position, p, n)
        }
        AnyLight::ManyLights(l) => {
            let of_one = |(light, _): (&TreeLight, u32)| match light {
                TreeLight::Triangle(t, radiance) => level(*radiance) * of_triangle(t, p, n),
                TreeLight::Textured(..) | TreeLight::Other(_) => {
                    unreachable!("the example has triangles")
                }
            };
            tables.trees[l.tree as usize].primitives().map(of_one).sum()
        }
        // The point light of the example.
        AnyLight::ManyPoints(_) => 3.0 * inverse_square(Vec3::new(0.1, 2.5, 0.3), p, n),
        AnyLight::Hidden(_) => unreachable!("it would be another light if it were seen"),
        AnyLight::ClearSky(l) => {
            irradiance::of_sky(n, 512, |d| level(l.le_infinite(tables, Vec3::ZERO, d.as_vec3())))
        }
        AnyLight::PortalSky(l) => of_portal(tables, l, p, n),
        // Lambert's cosine law over the part of the upper hemisphere that the surface faces.
        AnyLight::Hemisphere(l) => level(l.radiance) * FRAC_PI_2 * (1.0 + n.y),
        AnyLight::Environment(l) => match l.map {
            None => level(l.radiance) * PI,
            Some(_) => irradiance::of_sky(n, 512, |d| {
                level(l.le_infinite(tables, Vec3::ZERO, d.as_vec3()))
            }),
        },
    }
}

fn of_falloff(falloff: Falloff, cos: f64) -> f64 {
    match falloff {
        Falloff::Cosine { cos_cutoff, exponent } => {
            if cos > f64::from(cos_cutoff) {
                cos.powf(f64::from(exponent))
            } else {
                0.0
            }
        }
        Falloff::Linear { beam, cutoff } => {
            let (angle, beam, cutoff) = (cos.acos(), f64::from(beam), f64::from(cutoff));
            if angle <= beam { 1.0 } else { ((cutoff - angle) / (cutoff - beam)).max(0.0) }
        }
        Falloff::Flat { cutoff } => {
            if cos >= f64::from(cutoff).cos() {
                cos.powi(-3)
            } else {
                0.0
            }
        }
        Falloff::Punctual { inner, outer } => {
            let [inner, outer] = [inner, outer].map(|angle| f64::from(angle).cos());
            let share = (cos - outer) / (inner - outer);
            if cos >= inner { 1.0 } else { share.max(0.0).powi(2) }
        }
    }
}

/// Irradiance of a sphere at distance 1 whose radius is the sine of the angle.
fn of_disk(l: &DistantDisk, n: DVec3) -> f64 {
    let cos = 1.0 - f64::from(l.one_minus_cos);
    let radius = (1.0 - cos * cos).sqrt().min(1.0 - 1e-9);
    f64::from(l.radiance.luminance())
        * irradiance::of_sphere(l.to_light.as_dvec3(), radius, DVec3::ZERO, n)
}

/// Midpoint rule over parts of equal solid angle.
fn of_sun(tables: &LightTables, l: &Sun, n: DVec3) -> f64 {
    const PARTS: u32 = 600;
    let one_minus_cos = f64::from(l.disk.one_minus_cos);
    let axis = l.disk.to_light.as_dvec3();
    let (x, y) = axis.any_orthonormal_pair();
    let part = |i: u32, j: u32| {
        let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(PARTS));
        let (height, (sin, cos)) = (u * one_minus_cos, (TAU * v).sin_cos());
        let away = (height * (2.0 - height)).sqrt();
        let d = axis * (1.0 - height) + (x * cos + y * sin) * away;
        f64::from(l.le_infinite(tables, Vec3::ZERO, d.as_vec3()).luminance()) * d.dot(n).max(0.0)
    };
    let sum: f64 =
        (0..PARTS).flat_map(|i| (0..PARTS).map(move |j| (i, j))).map(|(i, j)| part(i, j)).sum();
    sum * TAU * one_minus_cos / f64::from(PARTS * PARTS)
}

/// Midpoint rule over many parts of the rectangle.
fn of_portal(tables: &LightTables, l: &PortalSky, p: DVec3, n: DVec3) -> f64 {
    const PARTS: u32 = 600;
    let [corner, e1, e2] = tables.portals[l.portal as usize].sides();
    let across = e1.cross(e2) / f64::from(PARTS * PARTS);
    let of_part = |i: u32| {
        let [u, v] = [i % PARTS, i / PARTS].map(|k| (f64::from(k) + 0.5) / f64::from(PARTS));
        let to_part = corner + e1 * u + e2 * v - p;
        let (r2, d) = (to_part.length_squared(), to_part.normalize());
        let radiance = level_of(l.sky.le_infinite(tables, p.as_vec3(), d.as_vec3()));
        radiance * (-d.dot(across)).max(0.0) * d.dot(n).max(0.0) / r2
    };
    (0..PARTS * PARTS).map(of_part).sum()
}

fn level_of(s: Spectrum) -> f64 {
    f64::from(s.luminance())
}

/// cos θ / r².
fn inverse_square(position: Vec3, p: DVec3, n: DVec3) -> f64 {
    let d = position.as_dvec3() - p;
    d.normalize().dot(n).max(0.0) / d.length_squared()
}

/// Midpoint rule over many parts; radiance is linear over the triangles of the example.
fn of_textured_triangle(
    tables: &LightTables,
    t: &EmitterTriangle,
    laid: &TexturedTriangle,
    p: DVec3,
    n: DVec3,
) -> f64 {
    const PARTS: u16 = 64;
    let h = 1.0 / f32::from(PARTS);
    let part = |i: u16, j: u16, sign: f32| {
        let [b1, b2] = [i, j].map(|k| f32::from(k) * h);
        let p0 = t.p0 + t.e1 * b1 + t.e2 * b2;
        let small = EmitterTriangle { p0, e1: t.e1 * (h * sign), e2: t.e2 * (h * sign), ..*t };
        let middle = [b1 + sign * h / 3.0, b2 + sign * h / 3.0];
        let radiance = laid.radiance(&tables.textures, t, middle).luminance();
        f64::from(radiance) * of_triangle(&small, p, n)
    };
    let upright = (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| (i, j, 1.0)));
    let turned = (1..PARTS).flat_map(|i| (1..=PARTS - i).map(move |j| (i, j, -1.0)));
    upright.chain(turned).map(|(i, j, sign)| part(i, j, sign)).sum()
}

/// ∫ L cos θ cos θ′ / r² dA over the sphere, by the midpoint rule over parts of equal area.
fn of_textured_sphere(tables: &LightTables, l: &TexturedSphere, p: DVec3, n: DVec3) -> f64 {
    const PARTS: u32 = 400;
    let map = &tables.sphere_maps[l.map as usize];
    let (center, radius) = (l.sphere.center.as_dvec3(), f64::from(l.sphere.radius));
    let part = |i: u32, j: u32| {
        let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(PARTS));
        let (z, (sin, cos)) = (2.0 * x - 1.0, (TAU * y).sin_cos());
        let equator = (1.0 - z * z).sqrt();
        let outwards = DVec3::new(cos * equator, sin * equator, z);
        let d = center + outwards * radius - p;
        let (cos_light, cos_lit) = (-d.normalize().dot(outwards), d.normalize().dot(n));
        if cos_light <= 0.0 || cos_lit <= 0.0 {
            return 0.0;
        }
        let radiance = map.radiance(&tables.textures, &l.sphere, outwards.as_vec3()).luminance();
        f64::from(radiance) * cos_light * cos_lit / d.length_squared()
    };
    let sum: f64 =
        (0..PARTS).flat_map(|i| (0..PARTS).map(move |j| (i, j))).map(|(i, j)| part(i, j)).sum();
    sum * 2.0 * TAU * radius * radius / f64::from(PARTS * PARTS)
}

fn of_triangle(t: &EmitterTriangle, p: DVec3, n: DVec3) -> f64 {
    let [p0, e1, e2, front] = [t.p0, t.e1, t.e2, t.normal].map(Vec3::as_dvec3);
    let visible = (p - p0).dot(front) > 0.0;
    if visible { irradiance::of_polygon(&[p0, p0 + e1, p0 + e2], p, n) } else { 0.0 }
}

/// Inside of a sphere that emits inwards, radiance is equal from all directions.
fn of_sphere(l: &SphereLight, p: DVec3, n: DVec3) -> f64 {
    let (center, radius) = (l.center.as_dvec3(), f64::from(l.radius));
    match ((p - center).length() > radius, l.inward) {
        (true, false) => irradiance::of_sphere(center, radius, p, n),
        (false, true) => PI,
        _ => 0.0,
    }
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
        tables.environments.push(EnvironmentMap::new(w, h, texels));
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
