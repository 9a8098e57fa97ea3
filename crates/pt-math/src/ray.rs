//! Rays, and origins that do not hit the surface they leave.

use glam::Vec3;

/// A half line o + t·d with t in (`t_min`, `t_max`).
///
/// The direction need not have unit length for queries; `t` is measured in its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin o.
    pub origin: Vec3,
    /// Direction d.
    pub direction: Vec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f32,
    /// Hits at or after this parameter do not count.
    pub t_max: f32,
}

impl Ray {
    /// A ray that ends nowhere.
    #[inline]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// A ray that ends at `t_max`.
    #[inline]
    pub const fn to(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_min: 0.0, t_max }
    }

    /// o + t·d.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// The origin of a ray that leaves the computed surface point `p` in direction `w`.
///
/// `error` bounds the absolute error of each coordinate of `p`, and `n` is the geometric normal.
/// The result lies on the side of the surface to which `w` points, outside of the box of possible
/// true positions, and each coordinate is rounded away from it. [Pharr, Jakob & Humphreys,
/// Physically Based Rendering, 3rd ed., §3.9.5]
#[inline]
pub fn offset_origin(p: Vec3, error: Vec3, n: Vec3, w: Vec3) -> Vec3 {
    let d = n.abs().dot(error);
    let offset = if w.dot(n) < 0.0 { n * -d } else { n * d };
    let q = p + offset;
    Vec3::new(round_away(q.x, offset.x), round_away(q.y, offset.y), round_away(q.z, offset.z))
}

/// The neighbour of `x` in the direction of the sign of `towards`; `x` itself when that is 0.
#[inline]
fn round_away(x: f32, towards: f32) -> f32 {
    if towards > 0.0 {
        x.next_up()
    } else if towards < 0.0 {
        x.next_down()
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_leaves_the_error_box_on_the_side_of_the_direction() {
        let p = Vec3::new(100.0, -3.0, 1e-3);
        let error = p.abs() * crate::interval::gamma(7);
        let n = Vec3::new(0.6, -0.48, 0.64);
        for side in [1.0, -1.0] {
            let q = offset_origin(p, error, n, n * side);
            for corner in 0..8 {
                let sign = |bit: i32| if corner & bit == 0 { 1.0 } else { -1.0 };
                let e = error * Vec3::new(sign(1), sign(2), sign(4));
                assert!((q - (p + e)).as_dvec3().dot(n.as_dvec3()) * f64::from(side) > -1e-9);
            }
        }
    }
}
