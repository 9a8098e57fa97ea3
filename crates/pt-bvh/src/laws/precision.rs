//! Hits in single precision are as good as the module of the triangle test says.

use pt_math::interval::EPSILON;
use pt_math::{Bounds3, Ray};

use super::Random;
use crate::ray::Prepared;
use crate::triangle::{Verdict, confirm, judge, shear};

/// What the module says about the errors of single precision, and that the verdict about the
/// sides of the edges is that of double precision.
#[test]
fn single_precision_errs_as_little_as_it_says() {
    let mut random = Random(5);
    let (mut hits, mut unclear) = (0, 0);
    for i in 0..400_000 {
        // From fat triangles to needles, near and far.
        let size = 2f32.powi(i % 12 - 8);
        let corner = random.vector();
        let p = [corner, corner + random.vector() * size, corner + random.vector() * size];
        let target = (p[0] + p[1] * 0.7 + p[2] * 1.3) / 3.0;
        let origin = random.vector() * 4.0;
        let ray = {
            let scene: Bounds3 = p.into_iter().collect();
            Prepared::new(&Ray::new(origin, target - origin), &scene).expect("a usable ray")
        };
        let at = p.map(|v| shear(&ray, v));
        let exact = confirm(ray.scale, ray.origin_size, at);
        let hit = match judge(&ray, at) {
            Verdict::Unclear => {
                unclear += 1;
                continue;
            }
            Verdict::Miss => {
                let near = at.iter().any(|v| v[2] < 0.01);
                assert!(exact.is_none() || near, "{ray:?} {p:?}");
                continue;
            }
            Verdict::Hit(hit) => hit,
        };
        let exact = exact.expect("single precision says so");
        hits += 1;
        let epsilon = f64::from(EPSILON);
        let depth = f64::from(exact.t) * f64::from(ray.scale);
        let range = at.iter().map(|v| (f64::from(v[2]) - depth).abs()).fold(0.0, f64::max);
        let error = (f64::from(hit.t) - f64::from(exact.t)).abs() * f64::from(ray.scale);
        assert!(error <= epsilon * (48.0 * range + 12.0 * depth), "{hit:?} {exact:?}");
        for (b, exact) in [(hit.b1, exact.b1), (hit.b2, exact.b2)] {
            assert!(f64::from((b - exact).abs()) <= 100.0 * epsilon, "{hit:?} {exact:?}");
        }
    }
    assert!(hits > 200_000 && unclear > 10_000, "{hits} hits, {unclear} unclear");
}
