//! Triangles that emit.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::Vec3;

/// A triangle that emits light on its front side.
#[derive(Clone, Copy, Debug)]
pub struct EmitterTriangle {
    /// First corner.
    pub p0: Vec3,
    /// Edge from the first corner to the second.
    pub e1: Vec3,
    /// Edge from the first corner to the third.
    pub e2: Vec3,
    /// Unit normal of the emitting side.
    pub normal: Vec3,
    /// Fraction of the area under a clear coat, which attenuates the emission; see
    /// [`emitted_through`](crate::bsdf::emitted_through).
    pub coat: f32,
}

impl EmitterTriangle {
    /// Surface area.
    pub fn area(&self) -> f32 {
        0.5 * self.e1.cross(self.e2).length()
    }
}

/// Irradiance of a triangle of radiance 1, if it faces the point.
#[cfg(test)]
pub(super) fn of_triangle(t: &EmitterTriangle, p: DVec3, n: DVec3) -> f64 {
    let [p0, e1, e2, front] = [t.p0, t.e1, t.e2, t.normal].map(Vec3::as_dvec3);
    let visible = (p - p0).dot(front) > 0.0;
    if visible { pt_testing::irradiance::of_polygon(&[p0, p0 + e1, p0 + e2], p, n) } else { 0.0 }
}
