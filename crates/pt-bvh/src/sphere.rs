//! The sphere test.

use pt_math::float_error::EPSILON;
use pt_math::{DVec3, Ray, Vec3};

use crate::geometry::Sphere;

/// Maximum |f·f − r²|, relative to f·f + r², for which an origin counts as on the sphere.
const ON_SPHERE: f64 = 8.0 * f64::EPSILON;

/// Relative error of a parameter: of two roots within it, the first was hit.
const ROUNDED: f64 = 4.0 * EPSILON as f64;

/// Least root after `t_min`, at least 0, of |o + t·d − c|² = r², without regard to `t_max`.
///
/// With f = o − c, a = d·d, b = −f·d: the discriminant is computed from the vector l = f + (b/a)·d
/// between centre and line, as r² − l·l, which cancels least, and the roots are q/a and (f·f −
/// r²)/q with q = b ± √(a(r² − l·l)). In double precision. [Haines, Günther & Akenine-Möller 2019,
/// "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems ch. 7]
///
/// An origin on the sphere, within the rounding of double precision, has a root 0, which is not a
/// hit.
#[inline]
pub(crate) fn intersect(origin: Vec3, direction: Vec3, t_min: f32, sphere: &Sphere) -> Option<f32> {
    let [t0, t1] = roots(origin, direction, sphere)?.map(|t| t as f32);
    let after = |t: f32| t > t_min;
    match (after(t0), after(t1)) {
        (true, true) => Some(t0.min(t1)),
        (true, false) => Some(t0),
        (false, true) => Some(t1),
        (false, false) => None,
    }
}

/// Both roots, in any order.
#[inline]
fn roots(origin: Vec3, direction: Vec3, sphere: &Sphere) -> Option<[f64; 2]> {
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
    Some([q / a, power / q])
}

impl Sphere {
    /// Unit vector from the centre to the point where a ray hits the sphere at parameter `t`, in
    /// double precision: its accuracy does not depend on the distance of the ray's origin.
    #[inline]
    pub fn normal_at(&self, ray: &Ray, t: f32) -> DVec3 {
        let t = f64::from(t);
        let near = |[a, b]: [f64; 2]| {
            let (first, second) = (a.min(b), a.max(b));
            let is_first = (first - t).abs() <= (second - t).abs() + t * ROUNDED;
            if is_first { first } else { second }
        };
        let t = roots(ray.origin, ray.direction, self).map_or(t, near);
        let from_center = ray.origin.as_dvec3() - self.center.as_dvec3();
        (from_center + ray.direction.as_dvec3() * t).normalize_or(DVec3::Z)
    }
}
