//! Tests of laws that hold for every light in `lights!`. A new light is tested without writing a
//! test. [`irradiance`]: samples against the closed form, whose shared parts are in
//! [`closed_form`]. [`near`]: triangles near the receiving point. [`properties`]: the statements of
//! a light about itself that the laws need.

mod closed_form;
mod irradiance;
mod near;
mod properties;

use pt_math::{DVec3, Spectrum, Vec3};
use pt_testing::{Chi2, Random, chi2_cone, chi2_sphere};

pub(super) use self::closed_form::{inverse_square, level, midpoints, of_infinite_light};
pub(super) use self::properties::{LightGeometry, LightLaws};
use super::{
    AnyLight, EmitterTriangle, EscapedRay, Light, LightHit, LightSample, LightSampleContext,
    LightTables, LightVisitor, MeshLight, SphereLight,
};

/// Receiving points: below the lights of the examples, off their axis, far away, above, and inside
/// some.
const POINTS: [Vec3; 6] = [
    Vec3::ZERO,
    Vec3::new(0.7, 0.3, -0.4),
    Vec3::new(0.2, 1.9, 0.1),
    Vec3::new(300.0, -20.0, 50.0),
    Vec3::new(0.1, 4.5, 0.3),
    Vec3::new(0.0, 3.2, 0.0),
];
/// Extreme values of a sampler, and values slightly inside.
const CORNERS: [f32; 5] = [0.0, 1e-7, 0.5, 0.999_999, 0.999_999_94];

type Example = (AnyLight, LightTables);

/// Returns the examples, and lights with large coordinates, for which rounding is coarse.
fn all_lights() -> Vec<Example> {
    let mut all = AnyLight::examples();
    let radiance = Spectrum::splat(2.0);
    let far = Vec3::new(-1000.0, 800.0, 3000.0);
    let sphere = SphereLight { center: far, radius: 7.0, radiance, inward: false, coat: 0.0 };
    all.push((sphere.into(), LightTables::default()));
    let (e1, e2) = (Vec3::new(20.0, 3.0, 0.0), Vec3::new(-1.0, 15.0, 8.0));
    let triangle = EmitterTriangle { p0: far, e1, e2, normal: e2.cross(e1).normalize(), coat: 0.0 };
    let mut tables = LightTables::default();
    let mesh = MeshLight::new(&mut tables, &[triangle], radiance).expect("it has an area");
    all.push((mesh.into(), tables));
    all
}

/// Returns receiving points. For lights that use the surface, also points on surfaces that face
/// them, are turned half away, and transmit light.
fn lit_points((light, _): &Example) -> Vec<LightSampleContext> {
    let surfaces: &[(Vec3, bool)] = if light.laws().depends_on_surface() {
        &[
            (Vec3::Y, false),
            (Vec3::new(0.8, 0.0, -0.6), false),
            (Vec3::new(0.0, 0.1, -0.994_987_4), true),
        ]
    } else {
        &[]
    };
    let at = |p| {
        let on = surfaces
            .iter()
            .map(move |&(normal, transmits)| LightSampleContext::on_surface(p, normal, transmits));
        std::iter::once(LightSampleContext::in_space(p)).chain(on)
    };
    POINTS.into_iter().flat_map(at).collect()
}

/// Runs a law for every light and receiving point.
fn for_all(law: impl Fn(&Example, &LightSampleContext, &mut Random)) {
    for example in all_lights() {
        for context in lit_points(&example) {
            law(&example, &context, &mut Random::new(3));
        }
    }
}

/// Rounding error of a unit direction, per unit of distance.
const DIRECTION_ERROR: f64 = 2e-7;

/// Returns the hits of a ray from `p` with the emitting side of a light's geometry, computed in
/// `f64`; `None` for lights without geometry.
///
/// Rims are extended by the rounding error of the direction, so there may be several hits.
fn hits((light, tables): &Example, p: Vec3, wi: Vec3) -> Option<Vec<LightHit>> {
    let (p, d) = (p.as_dvec3(), wi.as_dvec3().normalize());
    match light.laws().geometry(tables) {
        LightGeometry::None => None,
        LightGeometry::Triangles(triangles) => {
            let hit = |(t, primitive): &(EmitterTriangle, u32)| {
                hit_triangle(t, p, d).map(|hit| LightHit { primitive: *primitive, ..hit })
            };
            Some(triangles.iter().filter_map(hit).collect())
        }
        LightGeometry::Sphere(sphere) => Some(hit_sphere(&sphere, p, d).into_iter().collect()),
    }
}

/// [Möller & Trumbore 1997]
fn hit_triangle(triangle: &EmitterTriangle, p: DVec3, d: DVec3) -> Option<LightHit> {
    let [p0, e1, e2, n] =
        [triangle.p0, triangle.e1, triangle.e2, triangle.normal].map(Vec3::as_dvec3);
    let (s, q) = (p - p0, d.cross(e2));
    let inverse = 1.0 / e1.dot(q);
    let r = s.cross(e1);
    let (b1, b2, t) = (inverse * s.dot(q), inverse * d.dot(r), inverse * e2.dot(r));
    let rim = DIRECTION_ERROR * (1.0 + s.length()) / e1.length().min(e2.length());
    let inside = b1 >= -rim && b2 >= -rim && b1 + b2 <= 1.0 + rim;
    let cos = -d.dot(n);
    let found = inside && t > 0.0 && cos > 0.0;
    let corners = [triangle.p0, triangle.p0 + triangle.e1, triangle.p0 + triangle.e2];
    found.then_some(LightHit {
        distance_squared: (t * t) as f32,
        cos: cos as f32,
        triangle: Some(corners),
        primitive: 0,
    })
}

fn hit_sphere(sphere: &SphereLight, p: DVec3, d: DVec3) -> Option<LightHit> {
    let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
    let to_center = center - p;
    let middle = to_center.dot(d);
    let rim = radius + DIRECTION_ERROR * (1.0 + to_center.length());
    let chord = rim * rim - (to_center - d * middle).length_squared();
    let outside = to_center.length() > radius;
    if chord < 0.0 || outside == sphere.inward || (outside && middle < 0.0) {
        return None;
    }
    let half = chord.max(0.0).sqrt();
    let t = if outside { middle - half } else { middle + half };
    let cos = d.dot((p + d * t - center).normalize()).abs();
    Some(LightHit {
        distance_squared: (t * t) as f32,
        cos: cos as f32,
        triangle: None,
        primitive: 0,
    })
}

/// Returns the density at a direction; several values at common rims of
/// triangles.
fn densities(example: &Example, context: &LightSampleContext, wi: Vec3) -> Vec<f32> {
    let (light, tables) = example;
    let of = |hit| light.pdf(tables, context, wi, hit).get();
    match hits(example, context.p, wi) {
        Some(hits) => hits.into_iter().map(|hit| of(Some(hit))).collect(),
        None => vec![of(None)],
    }
}

fn samples(
    (light, tables): &Example,
    context: &LightSampleContext,
    random: &mut Random,
    n: usize,
) -> Vec<LightSample> {
    (0..n).filter_map(|_| light.sample(tables, context, random.unit_2d())).collect()
}

/// Returns an axis, and 1 − cos of a cone around it that contains all samples; the whole sphere for
/// wide ones.
fn cone(samples: &[LightSample]) -> (Vec3, f32) {
    let axis = samples.iter().map(|s| s.wi).sum::<Vec3>().normalize_or(Vec3::Y);
    // 1 − cos θ = |a − b|²/2 for unit vectors, without cancellation.
    let widest = samples.iter().map(|s| 0.5 * (s.wi - axis).length_squared()).fold(0.0, f32::max);
    (axis, 1.2 * widest)
}

/// Panics unless the histogram of samples fits the density, as one of `tests` tests.
fn assert_density(
    example: &Example,
    context: &LightSampleContext,
    samples_each: u32,
    tests: usize,
) {
    let (axis, c) = cone(&samples(example, context, &mut Random::new(5), 1000));
    let name = format!("{:?} from {context:?}", example.0);
    let config = Chi2 { samples: samples_each, ..Chi2::new(&name) };
    let config = config.one_of(tests);
    let sample = |u| example.0.sample(&example.1, context, u).map(|s| s.wi);
    let pdf = |wi| densities(example, context, wi).first().copied().unwrap_or(0.0);
    let narrow = c > 0.0 && c < 0.2;
    let result = if narrow {
        chi2_cone(sample, pdf, axis, c, &config)
    } else {
        chi2_sphere(sample, pdf, &config)
    };
    result.unwrap_or_else(|e| panic!("{e}"));
}

/// The histogram of samples fits the density. The difference of its integral from 1 is the
/// probability that sampling fails, so the integral is tested too.
#[test]
fn samples_follow_their_density() {
    let extended: Vec<_> = all_lights().into_iter().filter(|l| !l.0.is_delta()).collect();
    let tests = extended.iter().map(|example| lit_points(example).len()).sum();
    for example in &extended {
        for context in lit_points(example) {
            assert_density(example, &context, 100_000, tests);
        }
    }
}

/// The density returned with a sample is that of its direction.
#[test]
fn density_of_a_sample_is_that_of_its_direction() {
    for_all(|example, context, random| {
        let all = samples(example, context, random, 5000);
        for s in &all {
            let Some(pdf) = s.pdf else { continue };
            let pdf = pdf.get();
            assert!(pdf > 0.0 && pdf.is_finite(), "{:?} {context:?}: {s:?}", example.0);
            let again = densities(example, context, s.wi);
            let is_same = again.iter().any(|again| (pdf - again).abs() < 2e-3 * pdf);
            assert!(is_same, "{:?} {context:?}: {s:?} {again:?}", example.0);
        }
    });
}

/// Samples of many points have the bits of samples of one, near the light and far from it, also in
/// blocks that are not full.
#[test]
fn samples_of_many_points_are_those_of_each() {
    const NUMBER: usize = 20_003;
    for_all(|(light, tables), context, random| {
        let points: Vec<_> = (0..NUMBER)
            .map(|_| {
                let p = context.p + random.in_cube() * random.unit().powi(3) * 4.0;
                (LightSampleContext { p, ..*context }, random.unit_2d())
            })
            .collect();
        let together = light.visit(Together { tables, points: &points });
        assert_eq!(together.len(), NUMBER);
        for ((context, u), found) in points.iter().zip(&together) {
            let alone = light.sample(tables, context, *u);
            assert_eq!(bits(alone.as_ref()), bits(found.as_ref()), "{light:?} {context:?} {u:?}");
        }
    });
}

/// Samples a light for all points at once.
struct Together<'a> {
    tables: &'a LightTables,
    points: &'a [(LightSampleContext, [f32; 2])],
}

impl LightVisitor for Together<'_> {
    type Output = Vec<Option<LightSample>>;

    fn visit<L: Light>(self, light: &L) -> Self::Output {
        let mut samples = Vec::new();
        light.sample_each(self.tables, self.points.iter().copied(), &mut samples);
        samples
    }
}

fn bits(sample: Option<&LightSample>) -> Option<Vec<u32>> {
    let LightSample { wi, distance, end, radiance, pdf } = sample?;
    let end = end.map_or([0.0; 3], |end| end.to_array());
    let numbers = [&wi.to_array()[..], &[*distance], &end, &radiance.to_array()].concat();
    let pdf = pdf.map_or(0.0, pt_math::Pdf::get);
    Some(numbers.into_iter().chain([pdf]).map(f32::to_bits).collect())
}

/// A delta light has one direction and no density; only light sampling finds it.
#[test]
fn delta_lights_have_no_density() {
    for_all(|example, context, random| {
        let (light, tables) = example;
        let all = samples(example, context, random, 10);
        assert!(all.iter().all(|s| s.pdf.is_none() == light.is_delta()), "{light:?}");
        if light.is_delta() {
            assert!(all.windows(2).all(|w| w[0].wi == w[1].wi), "{light:?}");
            let d = random.direction();
            assert!(
                light.le_infinite(tables, EscapedRay::new(context.p, d)).is_black(),
                "{light:?}"
            );
            assert_eq!(light.pdf(tables, context, d, None).get(), 0.0, "{light:?}");
        }
    });
}

/// A ray that leaves the scene has the radiance that is sampled, and wherever that is not black,
/// the sampling density is positive. Lights in the scene contribute nothing to such rays.
#[test]
fn the_sky_is_what_is_sampled() {
    for_all(|example, context, random| {
        let (light, tables) = example;
        for s in samples(example, context, random, 1000) {
            let seen = light.le_infinite(tables, EscapedRay::new(context.p, s.wi));
            let sky = s.end.is_none() && !light.is_delta();
            assert_eq!(s.end.is_none(), s.distance.is_infinite(), "{light:?}");
            assert_eq!(seen, if sky { s.radiance } else { Spectrum::ZERO }, "{light:?} {}", s.wi);
        }
        for _ in 0..1000 {
            let d = random.direction();
            let found = light.pdf(tables, context, d, None).get() > 0.0;
            assert!(
                found || light.le_infinite(tables, EscapedRay::new(context.p, d)).is_black(),
                "{light:?} {d}"
            );
        }
    });
}

/// Samples have unit directions, which lead to their end points.
#[test]
fn samples_point_at_the_light() {
    for_all(|example, context, random| {
        for s in samples(example, context, random, 1000) {
            assert!((s.wi.length() - 1.0).abs() < 1e-5, "{:?}: {s:?}", example.0);
            if let Some(end) = s.end {
                let reached = context.p + s.wi * s.distance;
                let size = context.p.abs().max(end.abs()).max_element();
                assert!(
                    (reached - end).length() < 2e-5 * size,
                    "{:?} {context:?}: {s:?}",
                    example.0
                );
            }
        }
    });
}

/// Returns the distance of a point in front of the emitting surface to which it belongs, computed
/// in `f64`.
fn in_front((light, tables): &Example, end: Vec3) -> f64 {
    let end = end.as_dvec3();
    match light.laws().geometry(tables) {
        LightGeometry::None => f64::INFINITY,
        LightGeometry::Triangles(triangles) => {
            let height = |(t, _): &(EmitterTriangle, u32)| {
                let n = t.e1.as_dvec3().cross(t.e2.as_dvec3()).normalize();
                let n = n * n.dot(t.normal.as_dvec3()).signum();
                (end - t.p0.as_dvec3()).dot(n)
            };
            triangles.iter().map(height).fold(f64::INFINITY, f64::min)
        }
        LightGeometry::Sphere(sphere) => in_front_of_sphere(&sphere, end),
    }
}

fn in_front_of_sphere(s: &SphereLight, p: DVec3) -> f64 {
    let outside = (p - s.center.as_dvec3()).length() - f64::from(s.radius);
    if s.inward { -outside } else { outside }
}

/// Shadow rays end before they hit the light: `end` is on the side of the light that faces the
/// receiving point.
#[test]
fn shadow_rays_end_before_the_light() {
    for_all(|example, context, random| {
        for s in samples(example, context, random, 5000) {
            let Some(end) = s.end else { continue };
            let height = in_front(example, end);
            assert!(height > 0.0, "{:?} {context:?}: {s:?} is {height}", example.0);
        }
    });
}

/// The corners of the unit square, and points on, in and at the centre of lights, produce finite
/// values.
#[test]
fn extremes_give_numbers() {
    let on_lights = [
        Vec3::new(0.0, 2.0, 0.0),
        Vec3::new(0.5, 2.0, 0.2),
        Vec3::new(1.0, 2.0, 1.0),
        Vec3::new(0.0, 3.0, 0.0),
        Vec3::new(0.0, 1.999_999_9, 0.0),
        Vec3::new(0.0, 0.5, 0.0),
        Vec3::new(1e6, -1e6, 1e5),
    ];
    for (light, tables) in all_lights() {
        for p in POINTS.into_iter().chain(on_lights) {
            for u in CORNERS.iter().flat_map(|&a| CORNERS.map(|b| [a, b])) {
                let Some(s) = light.sample(&tables, &LightSampleContext::in_space(p), u) else {
                    continue;
                };
                let pdf = s.pdf.map_or(1.0, pt_math::Pdf::get);
                let numbers = s.radiance.is_finite() && pdf > 0.0 && pdf.is_finite();
                let place = s.end.is_none_or(Vec3::is_finite) && s.distance > 0.0;
                let unit = (s.wi.length() - 1.0).abs() < 1e-5;
                assert!(numbers && place && unit, "{light:?} {p} {u:?}: {s:?}");
            }
        }
    }
}
