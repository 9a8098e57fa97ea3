//! Rays that leave a surface do not hit it again.

use pt_math::float_error::gamma;
use pt_math::ray::offset_origin;
use pt_math::{DVec3, Frame, Ray, Vec3};
use pt_testing::Random;

use super::Soup;
use crate::{BuildOptions, Builder, Bvh, Sphere};

const CASES: usize = 200_000;

/// A direction at an angle to the plane whose sine is 1, 0.1, … 10⁻⁷, on either side.
fn leaving(n: Vec3, r: &mut Random) -> Vec3 {
    let frame = Frame::from_normal(n);
    let along = r.direction().as_dvec3();
    let sine = (0..r.below(8)).fold(1.0, |s, _| s * 0.1) * if r.unit() < 0.5 { 1.0 } else { -1.0 };
    let flat = DVec3::new(along.x, along.y, 0.0).normalize_or(DVec3::X).as_vec3();
    let local = flat * (1.0f32 - sine * sine).max(0.0).sqrt() + Vec3::Z * sine;
    frame.to_world(local)
}

/// The point of a triangle with given weights, and the bound of its error that users of hits
/// compute. [Pharr, Jakob & Humphreys, §3.9.4]
fn point(p: [Vec3; 3], b1: f32, b2: f32) -> (Vec3, Vec3) {
    let terms = [p[0] * (1.0 - b1 - b2), p[1] * b1, p[2] * b2];
    let magnitude = terms[0].abs() + terms[1].abs() + terms[2].abs();
    (terms[0] + terms[1] + terms[2], magnitude * gamma(7))
}

fn normal(p: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = p.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize()
}

/// A triangle of any size, position and shape, including slivers.
fn triangle(r: &mut Random) -> [Vec3; 3] {
    let size = 10f32.powi(r.below(9) as i32 - 4);
    let place = r.in_cube() * 10f32.powi(r.below(6) as i32 - 2) * size;
    let stretch = Vec3::ONE + r.in_cube() * [0.0, 0.9, 0.9999][r.below(3)];
    [0; 3].map(|_| place + r.in_cube() * stretch * size)
}

fn tree(soup: &Soup) -> Bvh {
    let options = BuildOptions { builder: Builder::Mean, ..BuildOptions::default() };
    Bvh::build(soup.geometry(), &options).expect("indices are in range")
}

#[test]
fn no_ray_hits_the_triangle_that_it_leaves() {
    let mut r = Random::new(1);
    let mut spawned = 0;
    for _ in 0..CASES {
        let p = triangle(&mut r);
        let n = normal(p);
        if !n.is_finite() {
            continue;
        }
        let soup = Soup { positions: p.to_vec(), triangles: vec![[0, 1, 2]], spheres: Vec::new() };
        let bvh = tree(&soup);
        let (u, v) = (r.unit(), r.unit());
        let (b1, b2) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let (b1, b2) = match r.below(4) {
            0 => (0.0, 0.0),
            1 => (b1, 0.0),
            _ => (b1, b2),
        };
        let (x, error) = point(p, b1, b2);
        let normal = n.as_vec3();
        let w = leaving(normal, &mut r);
        // A direction that leaves the rounded plane but enters the true one may hit it.
        if n.dot(w.as_dvec3()) * f64::from(normal.dot(w)) <= 0.0 {
            continue;
        }
        let ray = Ray::new(offset_origin(x, error, normal, w), w);
        assert_eq!(bvh.intersect(&ray), None, "{p:?} from {x} along {w}");
        assert!(!bvh.occluded(&ray));
        spawned += 1;
    }
    assert!(spawned > CASES / 2, "{spawned}");
}

/// Two triangles of a square in a plane across the axis `k`, which is exact in f32.
fn square(k: usize, height: f32, size: f32) -> Soup {
    let corner = |u: f32, v: f32| {
        let mut p = [0.0; 3];
        (p[k], p[(k + 1) % 3], p[(k + 2) % 3]) = (height, u * size, v * size);
        Vec3::from_array(p)
    };
    let positions =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Soup { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], spheres: Vec::new() }
}

#[test]
fn no_ray_hits_the_plane_that_it_leaves() {
    let mut r = Random::new(2);
    for i in 0..CASES / 4 {
        let size = 10f32.powi(r.below(7) as i32 - 3);
        let soup = square(i % 3, r.between(-1.0, 1.0) * size, size);
        let bvh = tree(&soup);
        let p = soup.corners(r.below(2));
        let (b1, b2) = (r.unit() * 0.5, r.unit() * 0.5);
        let (x, error) = point(p, b1, b2);
        let n = normal(p).as_vec3();
        let w = leaving(n, &mut r);
        let ray = Ray::new(offset_origin(x, error, n, w), w);
        assert_eq!(bvh.intersect(&ray), None, "{p:?} from {x} along {w}");
    }
}

#[test]
fn no_ray_hits_the_outside_of_the_sphere_that_it_leaves() {
    let mut r = Random::new(3);
    for _ in 0..CASES {
        let radius = 10f32.powi(r.below(9) as i32 - 4) * (0.5 + r.unit());
        let center = r.in_cube() * 10f32.powi(r.below(6) as i32 - 3) * radius;
        let soup = Soup { spheres: vec![Sphere { center, radius }], ..Soup::default() };
        let bvh = tree(&soup);
        let n = r.direction().as_dvec3().normalize().as_vec3();
        let local = n * radius;
        let x = center + local;
        // Components of n err by ε each: when computed in double precision and rounded, and again
        // in the product and the sum.
        let error = (local.abs() + center.abs()) * gamma(5);
        let w = leaving(n, &mut r);
        let ray = Ray::new(offset_origin(x, error, n, w), w);
        let hit = bvh.intersect(&ray);
        let cosine = n.dot(w);
        if cosine > 0.0 {
            assert_eq!(hit, None, "{center} {radius} from {x} along {w}");
        } else if cosine < -0.05 && center.length() < 10.0 * radius {
            // Inside, the ray meets the far side, 2r|cos| away.
            let t = hit.map_or(0.0, |h| h.t);
            let expected = -2.0 * radius * cosine;
            assert!((t / expected - 1.0).abs() < 1e-2, "{t} {expected}");
        }
    }
}
