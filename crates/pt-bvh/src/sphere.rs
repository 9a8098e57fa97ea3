//! The sphere test.

use pt_math::Vec3;

use crate::geometry::Sphere;

/// How far f·f − r² may be from 0, relative to f·f + r², for an origin to count as on the sphere.
const ON_SPHERE: f64 = 8.0 * f64::EPSILON;

/// The least root after `t_min`, at least 0, of |o + t·d − c|² = r², without regard to `t_max`.
///
/// With f = o − c, a = d·d, b = −f·d: the discriminant is taken from the vector
/// l = f + (b/a)·d between centre and line, as r² − l·l, which cancels least, and the roots are
/// q/a and (f·f − r²)/q with q = b ± √(a(r² − l·l)). In double precision. [Haines, Günther &
/// Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
/// ch. 7]
///
/// An origin on the sphere, within the rounding of double precision, has a root 0, which is no
/// hit.
#[inline]
pub(crate) fn intersect(origin: Vec3, direction: Vec3, t_min: f32, sphere: &Sphere) -> Option<f32> {
    let (o, d, c) = (origin.as_dvec3(), direction.as_dvec3(), sphere.center.as_dvec3());
    let r2 = f64::from(sphere.radius) * f64::from(sphere.radius);
    let f = o - c;
    let (a, b) = (d.dot(d), -f.dot(d));
    let l = f + d * (b / a);
    let discriminant = r2 - l.dot(l);
    if discriminant < 0.0 {
        return None;
    }
    let f2 = f.dot(f);
    let power = if (f2 - r2).abs() <= ON_SPHERE * (f2 + r2) { 0.0 } else { f2 - r2 };
    let q = b + (a * discriminant).sqrt().copysign(b);
    let (t0, t1) = ((q / a) as f32, (power / q) as f32);
    let after = |t: f32| t > t_min;
    match (after(t0), after(t1)) {
        (true, true) => Some(t0.min(t1)),
        (true, false) => Some(t0),
        (false, true) => Some(t1),
        (false, false) => None,
    }
}
