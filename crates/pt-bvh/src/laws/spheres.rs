//! Tiny and distant spheres, compared with exact arithmetic.

use pt_math::{Ray, Vec3};
use pt_testing::Random;

use super::Soup;
use crate::{BuildOptions, Bvh, Sphere};

fn one(center: Vec3, radius: f32) -> Bvh {
    let soup = Soup { spheres: vec![Sphere { center, radius }], ..Soup::default() };
    Bvh::build(soup.geometry(), &BuildOptions::default()).expect("there are no indices")
}

/// With a right triangle of edges 3s, 4s, 5s: a ray that passes the centre at 3s meets the sphere
/// of radius 5s at 4s before and after, which are exact in binary.
#[test]
fn tiny_and_far_spheres_are_hit_exactly_where_they_are() {
    for exponent in -30..=30 {
        let s = 2f32.powi(exponent);
        for distance in [16.0f32, 4096.0, 1_048_576.0, 3e9] {
            let t_exact = [-4.0, 4.0].map(|x| (f64::from(distance) + x * f64::from(s)) as f32);
            let bvh = one(Vec3::ZERO, 5.0 * s);
            for axis in 0..3 {
                let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
                (origin[axis], origin[(axis + 1) % 3]) = (-distance, 3.0 * s);
                direction[axis] = 1.0;
                let ray = Ray::new(Vec3::from_array(origin), Vec3::from_array(direction));
                let t = bvh.intersect(&ray).map(|h| h.t);
                let expected = t_exact.into_iter().find(|&t| t > 0.0);
                assert_eq!(t, expected, "size {s}, distance {distance}");
            }
        }
    }
}

/// Lines hit a sphere exactly where integer arithmetic finds it, for small integers:
/// (f·d)² − d·d (f·f − r²) > 0.
#[test]
fn hits_and_misses_are_those_of_integer_arithmetic() {
    let mut r = Random::new(9);
    let mut hits = 0;
    for _ in 0..100_000 {
        let mut vector = |n: i64| [0; 3].map(|_| r.below(2 * n as usize + 1) as i64 - n);
        let (o, d, c) = (vector(200), vector(100), vector(200));
        let radius = 1 + r.below(150) as i64;
        let dot = |a: [i64; 3], b: [i64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let f = [0, 1, 2].map(|k| o[k] - c[k]);
        let (a, b, power) = (dot(d, d), dot(f, d), dot(f, f) - radius * radius);
        let discriminant = i128::from(b) * i128::from(b) - i128::from(a) * i128::from(power);
        if a == 0 || discriminant == 0 || power == 0 {
            continue;
        }
        // The line is hit; the ray if its origin is inside, or the sphere ahead.
        let expected = discriminant > 0 && (power < 0 || b < 0);
        let real = |v: [i64; 3]| Vec3::from_array(v.map(|x| x as f32));
        let hit = one(real(c), radius as f32).intersect(&Ray::new(real(o), real(d)));
        assert_eq!(hit.is_some(), expected, "{o:?} {d:?} {c:?} {radius}");
        if let Some(hit) = hit {
            let at = real(o).as_dvec3() + real(d).as_dvec3() * f64::from(hit.t);
            let off = (at - real(c).as_dvec3()).length() - radius as f64;
            // t is rounded to f32; nothing else is lost.
            let rounding = f64::from(hit.t * f32::EPSILON) * real(d).as_dvec3().length();
            assert!(off.abs() <= rounding, "{off} {rounding}");
            hits += 1;
        }
    }
    assert!(hits > 5000, "{hits}");
}
