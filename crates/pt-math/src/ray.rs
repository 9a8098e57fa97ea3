//! Rays, and ray origins that avoid self-intersection.

use glam::Vec3;

use crate::float_error::EPSILON;

/// Ray o + t·d with t in (`t_min`, `t_max`).
///
/// The direction need not have unit length for queries; `t` is in units of its length.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Origin o.
    pub origin: Vec3,
    /// Direction d.
    pub direction: Vec3,
    /// Hits at or before this parameter are ignored.
    pub t_min: f32,
    /// Hits at or after this parameter are ignored.
    pub t_max: f32,
}

impl Ray {
    /// Ray without end.
    #[inline]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// Ray that ends at `t_max`.
    #[inline]
    pub const fn to(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_min: 0.0, t_max }
    }

    /// Point o + t·d.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Origin of a ray that leaves the computed surface point `p` in direction `w`.
///
/// `error` bounds the absolute error of each coordinate of `p`, and `n` is the geometric normal.
/// The result lies on the side of the surface to which `w` points, outside of the box of possible
/// true positions: the offset along the normal is the half extent of that box, enlarged by the
/// possible loss by rounding the sum, which is at most ε(|p| + |offset|) per coordinate. [after
/// Pharr, Jakob & Humphreys, Physically Based Rendering, 3rd ed., §3.9.5, where each coordinate is
/// rounded up instead]
#[inline]
pub fn offset_origin(p: Vec3, error: Vec3, n: Vec3, w: Vec3) -> Vec3 {
    offset_by(p, offset(p, error, n), n, w)
}

/// Distance by which [`offset_origin`] moves a point, for points that many rays leave.
#[inline]
pub fn offset(p: Vec3, error: Vec3, n: Vec3) -> f32 {
    let d = n.abs().dot(error * (1.0 + 8.0 * EPSILON) + p.abs() * (2.0 * EPSILON));
    (d * (1.0 + 8.0 * EPSILON)).max(f32::MIN_POSITIVE)
}

/// [`offset_origin`] by a distance from [`offset`].
#[inline]
pub fn offset_by(p: Vec3, offset: f32, n: Vec3, w: Vec3) -> Vec3 {
    p + n * offset.copysign(w.dot(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_leaves_the_error_box_on_the_side_of_the_direction() {
        let p = Vec3::new(100.0, -3.0, 1e-3);
        let error = p.abs() * crate::float_error::gamma(7);
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
