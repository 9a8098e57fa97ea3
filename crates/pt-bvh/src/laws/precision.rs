//! The error bounds in the module of the triangle test hold in single precision.

use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, DVec3, Ray, Vec3, Vec3A};
use pt_testing::Random;

use crate::ray::{PreparedRay, SceneExtent};
use crate::triangle::{FilterVerdict, intersect, judge, shear};

/// Weights and depth of a sheared triangle in double precision.
fn exact([a, b, c]: [[f32; 3]; 3]) -> ([f64; 3], f64) {
    let edge = |p: [f32; 3], q: [f32; 3]| {
        f64::from(q[0]) * f64::from(p[1]) - f64::from(q[1]) * f64::from(p[0])
    };
    let edges = [edge(b, c), edge(c, a), edge(a, b)];
    let det = edges.iter().sum::<f64>();
    let weights = edges.map(|e| e / det);
    let depths = [a, b, c].map(|v| f64::from(v[2]));
    (weights, weights.iter().zip(depths).map(|(w, z)| w * z).sum())
}

fn prepared(ray: &Ray, triangle: [Vec3; 3]) -> PreparedRay {
    let scene: Bounds3 = triangle.into_iter().collect();
    PreparedRay::new(ray, &scene).expect("a usable ray")
}

/// Tests the error bounds of single precision in the module documentation, and that the verdict
/// about the sides of the edges is that of double precision: for fat triangles, needles and
/// triangles seen edge-on, near and far, and for rays that pass anywhere or next to an edge.
#[test]
fn single_precision_errs_as_little_as_it_says() {
    let mut random = Random::new(5);
    let (mut hits, mut misses, mut flat, mut unclear) = (0, 0, 0, 0);
    for i in 0..400_000 {
        let (size, width) = (2f32.powi(i % 12 - 8), 2f32.powi(-(i / 12 % 22)));
        let corner = random.in_cube();
        let edges @ [long, wide] =
            [random.in_cube() * size, (random.in_cube() + random.in_cube() * width) * size * width];
        let p = [corner, corner + long, corner + long * random.unit() + wide];
        let share = random.unit() * 2f32.powi(-(i % 7) * 3);
        let target = p[0] * (1.0 - share) * 0.4 + p[1] * (1.0 - share) * 0.6 + p[2] * share;
        let is_along = i % 5 == 0;
        let direction = if is_along {
            edges[0] * random.between(-1.0, 1.0)
                + edges[1] * random.between(-1.0, 1.0)
                + random.in_cube() * size * width * 0.01
        } else {
            random.in_cube()
        };
        let distance = (4.0 * random.unit() - 0.5) / direction.length();
        let ray = prepared(&Ray::new(target - direction * distance, direction), p);
        let at = p.map(|v| shear(&ray, v));
        let ([w0, w1, w2], depth) = exact(at);
        let inside = w0 >= 0.0 && w1 >= 0.0 && w2 >= 0.0;
        let epsilon = f64::from(EPSILON);
        let farthest = at.iter().map(|v| f64::from(v[2].abs())).fold(0.0, f64::max);
        let depth_error = 14.0 * epsilon * farthest;
        match judge(&ray, at) {
            FilterVerdict::Unclear => unclear += 1,
            FilterVerdict::Miss => {
                misses += 1;
                assert!(!inside || depth <= depth_error, "{ray:?} {p:?}");
            }
            FilterVerdict::Hit(hit) => {
                hits += 1;
                assert!(inside, "{ray:?} {p:?}");
                let error = (f64::from(hit.t) * f64::from(ray.scale) - depth).abs();
                assert!(error <= depth_error, "{error:e} of {depth}: {hit:?}");
                for (b, w) in [(hit.b1, w1), (hit.b2, w2)] {
                    assert!((f64::from(b) - w).abs() <= 10.0 * epsilon * w, "{w}: {hit:?}");
                }
                flat += u32::from(is_flat(at));
            }
        }
    }
    let each = [hits, misses, flat, unclear];
    assert!(hits > 100_000 && each.iter().all(|&n| n > 10_000), "{each:?}");
}

/// Returns true if a triangle, as seen by the ray, fills less than 1/1000 of its bounding
/// rectangle.
fn is_flat(at: [[f32; 3]; 3]) -> bool {
    let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = at.map(|v| v.map(f64::from));
    let area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    let across = [ax, bx, cx].map(f64::abs).into_iter().fold(0.0, f64::max);
    let up = [ay, by, cy].map(f64::abs).into_iter().fold(0.0, f64::max);
    area.abs() < 1e-3 * across * up
}

/// Large triangles, and rays that start next to them at all angles: they hit on one side of the
/// plane and miss on the other.
#[test]
fn hits_next_to_the_origin_are_as_real_as_others() {
    let mut random = Random::new(9);
    let mut near = [0; 2];
    for i in 0..200_000 {
        let p = [random.in_cube(), random.in_cube(), random.in_cube()].map(|v| v * 30.0);
        let weights = [0.1 + 0.3 * random.unit(), 0.1 + 0.3 * random.unit()];
        let target = p[0] + (p[1] - p[0]) * weights[0] + (p[2] - p[0]) * weights[1];
        let direction = random.in_cube().normalize();
        let origin = target - direction * (random.unit() - 0.3) * 10f32.powi(-(i % 5));
        let [o, d] = [origin, direction].map(Vec3::as_dvec3);
        let [a, b, c] = p.map(|v| v.as_dvec3() - o);
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a) / normal.dot(d);
        // Well inside, and not along the plane.
        let at =
            |q: DVec3, r: DVec3| (q - d * t).cross(r - d * t).dot(normal) / normal.length_squared();
        let inside = [at(a, b), at(b, c), at(c, a)].into_iter().all(|w| w > 0.01);
        let cos = normal.normalize().dot(d).abs();
        if !inside || cos < 0.01 || t.abs() < 1e-9 {
            continue;
        }
        let hit = intersect(&prepared(&Ray::new(origin, direction), p), p);
        assert_eq!(hit.is_some(), t > 0.0, "{t}: {origin} {direction} {p:?}");
        if let Some(hit) = hit {
            let error = (f64::from(hit.t) - t).abs();
            // Vertices are rounded when they are translated: by 3ε of 60, in each of a few steps.
            assert!(error <= 1000.0 * f64::from(EPSILON) / cos, "{t}: {hit:?}");
            near[usize::from(t < 0.01)] += 1;
        }
    }
    assert!(near.iter().all(|&n| n > 10_000), "{near:?}");
}

/// Premise of all box tests: a hit is within 31εR of the box around its triangle, at any distance,
/// even for triangles seen edge-on.
#[test]
fn hits_are_near_their_triangles() {
    let mut random = Random::new(83);
    let mut hits = 0;
    for i in 0..400_000 {
        let stretch = Vec3::new(1.0, 10f32.powi(-(i % 4)), 10f32.powi(i / 4 % 5));
        let p = [random.in_cube(), random.in_cube(), random.in_cube()].map(|v| v * stretch);
        let [a, b, c] = p.map(Vec3::as_dvec3);
        let weights =
            [random.below(3), random.below(3)].map(|n| f64::from(random.unit()) * n as f64);
        let target = a
            + (b - a) * weights[0] * 0.5
            + (c - a) * (1.0 - weights[0] * 0.5).min(weights[1] * 0.5);
        let along = (b - a) * f64::from(random.between(-1.0, 1.0))
            + (c - a) * f64::from(random.between(-1.0, 1.0));
        let across =
            (b - a).cross(c - a).normalize_or_zero() * 10f64.powi(-(random.below(9) as i32));
        let direction = along.normalize_or_zero() + across * f64::from(random.between(-1.0, 1.0));
        let origin = target - direction * 10f64.powi(random.below(10) as i32);
        let (origin, direction) = (origin.as_vec3(), direction.as_vec3());
        let bounds: Bounds3 = p.into_iter().collect();
        let Some(ray) = PreparedRay::new(&Ray::new(origin, direction), &bounds) else { continue };
        let Some(hit) = intersect(&ray, p) else { continue };
        hits += 1;
        let reach = (bounds.min - origin).abs().max((bounds.max - origin).abs()).max_element();
        let at = origin.as_dvec3() + direction.as_dvec3() * f64::from(hit.t);
        let off = (bounds.min.as_dvec3() - at).max(at - bounds.max.as_dvec3()).max_element();
        let off = off / f64::from(reach * EPSILON);
        assert!(off <= 31.0, "{off}: {hit:?} {origin} {direction} {p:?}");
    }
    assert!(hits > 100_000, "{hits}");
}

/// Triangles far longer than wide, next to the origin of rays that do not run along them.
#[test]
fn hits_next_to_the_origin_on_slivers_are_found() {
    let mut random = Random::new(8);
    let mut found = 0;
    for i in 0..100_000 {
        let (length, width) = (30.0, 0.3 * 2f32.powi(-(i % 6)));
        let along = random.direction();
        let across = along.cross(random.direction()).normalize();
        let corner = random.in_cube() * 20.0;
        // With an acute angle at the corner, a right one, or an obtuse one.
        let lean = along * (length * random.unit());
        let p = [corner, corner + along * length, corner + lean + across * width];
        let weights = [0.2 + 0.2 * random.unit(), 0.2 + 0.2 * random.unit()];
        let target = p[0] + (p[1] - p[0]) * weights[0] + (p[2] - p[0]) * weights[1];
        let direction = random.direction();
        let distance = 0.02 + 0.5 * random.unit();
        let ray = Ray::new(target - direction * distance, direction);
        let [a, b, c] = p.map(|v| (v - ray.origin).as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let slope = normal.dot(direction.as_dvec3());
        if slope.abs() < 0.1 {
            continue;
        }
        let want = normal.dot(a) / slope;
        let hit = intersect(&prepared(&ray, p), p);
        let t = f64::from(hit.unwrap_or_else(|| panic!("{want} {ray:?} {p:?}")).t);
        // Positions are rounded to 2·10⁻⁶.
        assert!((t - want).abs() < 1e-4, "{t} instead of {want}: {ray:?} {p:?}");
        found += 1;
    }
    assert!(found > 80_000, "{found}");
}

/// Ordinary rays are usable, boxes are padded enough for them, and their depths in boxes are
/// positive numbers: for scenes and directions of any size.
#[test]
fn ordinary_rays_need_no_pad_of_their_own() {
    let mut random = Random::new(29);
    let mut count = [0; 2];
    for _ in 0..400_000 {
        let mut power = |most: usize| 2f32.powi(random.below(2 * most) as i32 - most as i32);
        let (size, away, length) = (power(58), power(4), power(110));
        let corners = [random.in_cube(), random.in_cube() * random.in_cube()].map(|v| v * size);
        let bounds: Bounds3 = corners.into_iter().collect();
        let origin = bounds.center() + random.in_cube() * (size * away);
        let ray = Ray::new(origin, random.in_cube() * random.in_cube() * length);
        let scene = SceneExtent::new(&bounds);
        let ordinary = PreparedRay::ordinary(&ray, &scene);
        count[usize::from(ordinary.is_some())] += 1;
        let Some(ordinary) = ordinary else { continue };
        let any = PreparedRay::in_scene(&ray, &scene).expect("a usable ray");
        assert!(any.pad <= scene.padded * (1.0 + 2.0 * EPSILON), "{ray:?} {bounds:?}");
        assert_eq!(
            (any.axes, any.scale, any.slopes, any.falls, any.unit, any.inverse),
            (ordinary.axes, ordinary.scale, ordinary.slopes, ordinary.falls, 1.0, ordinary.inverse),
        );
        let farthest = (scene.center - any.origin.to_vec3a()).abs() + scene.half + scene.padded;
        let depths = [farthest, Vec3A::splat(scene.padded)].map(|v| v * any.inverse.abs());
        assert!(depths[0].is_finite() && depths[1].min_element() >= 2f32.powi(-101), "{depths:?}");
    }
    assert!(count.iter().all(|&n| n > 50_000), "{count:?}");
}
