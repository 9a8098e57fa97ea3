//! Points at which rays meet surfaces, and rays that leave them.

use pt_math::float_error::EPSILON;
use pt_math::{DVec3, Ray, Vec3, ray};

use crate::id::SurfaceId;

/// Primitive as an element of an object of the source scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveRef {
    /// Index of the object; see [`RenderScene::object`](crate::RenderScene::object).
    pub object: u32,
    /// Index among the triangles of the object, or among its spheres.
    pub index: u32,
    /// True for spheres, false for triangles.
    pub is_sphere: bool,
}

/// A point on a surface from which rays are spawned.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// World-space position.
    pub p: Vec3,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Unit vector along which the origins of rays are offset, and which divides directions into
    /// the two sides of the surface: `normal`, or the shading normal with smooth shadows.
    pub along: Vec3,
    /// Offsets of the origins of rays along `along` and against it, since `p` is not exact: see
    /// [`pt_math::ray::offset`].
    pub offsets: [f32; 2],
}

/// Fraction of the distance to a light or point at which visibility rays end.
pub(crate) const SHADOW_EPSILON: f32 = 1.0 - 1.0 / 16384.0;

impl SurfacePoint {
    /// Creates a point that is not on a surface; the origins of rays are not offset.
    #[inline]
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::Z, along: Vec3::Z, offsets: [0.0; 2] }
    }

    /// Creates a point of a surface with a unit normal, exact up to the rounding of double
    /// precision.
    #[inline(always)]
    pub(crate) fn on(p: DVec3, normal: Vec3) -> Self {
        let p = p.as_vec3();
        Self::off(p, normal, ray::offset(p, p.abs() * EPSILON, normal))
    }

    /// Creates a point of a surface with a unit normal and this offset of the origins of rays.
    #[inline(always)]
    pub(crate) fn off(p: Vec3, normal: Vec3, offset: f32) -> Self {
        Self { p, normal, along: normal, offsets: [offset; 2] }
    }

    /// Increases the offsets by `margin`.
    #[inline(always)]
    pub(crate) fn raised(self, margin: f32) -> Self {
        Self { offsets: self.offsets.map(|offset| offset + margin), ..self }
    }

    /// Returns an upper bound on the distance from the exact point to the origins of rays, due to
    /// the offset and two roundings.
    #[inline(always)]
    pub(crate) fn reach(&self) -> f32 {
        self.offsets[0] + self.p.abs().element_sum() * (2.0 * EPSILON)
    }

    /// Returns the origins of rays on both sides.
    pub(crate) fn origins(&self) -> [DVec3; 2] {
        [self.along, -self.along].map(|w| self.origin(w).as_dvec3())
    }

    /// Returns the origin of a ray in direction `w`.
    #[inline(always)]
    pub(crate) fn origin(&self, w: Vec3) -> Vec3 {
        let [front, back] = self.offsets;
        self.p + self.along * if w.dot(self.along).is_sign_negative() { -back } else { front }
    }

    /// Returns a ray in the unit direction `w`.
    #[inline(always)]
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.origin(w), w)
    }

    /// Returns the ray that tests visibility between this point and another one in the unit
    /// direction `w`. It hits neither surface.
    #[inline(always)]
    pub fn spawn_at(&self, other: &Self, w: Vec3) -> Ray {
        let origin = self.origin(w);
        Ray::to(origin, other.origin(-w) - origin, SHADOW_EPSILON)
    }
}

/// A point at which a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Point on the surface; its normal is on the side of `normal`.
    pub point: SurfacePoint,
    /// Shading normal; of unit length unless
    /// [`crate::scene::RenderScene::unnormalized_shading_normals`].
    pub normal: Vec3,
    /// Unit direction towards the origin of the ray.
    pub wo: Vec3,
    /// Distance from the origin of the ray.
    pub distance: f32,
    /// Surface of the primitive.
    pub surface: SurfaceId,
    /// Number of the primitive.
    pub primitive: u32,
}
