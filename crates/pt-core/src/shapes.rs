//! Tables of triangles and spheres, and what there is to know of a point on one.

use pt_bvh::{Hit, Sphere};
use pt_math::interval::gamma;
use pt_math::{Mat3, Vec2, Vec3};

use crate::id::Id;
use crate::scene::SurfaceRecord;

/// Three indices that mark a triangle without normals, or texture coordinates.
pub const FLAT: [u32; 3] = [u32::MAX; 3];

/// Triangles and spheres in one system of coordinates.
#[derive(Debug, Default)]
pub struct ShapeTables {
    /// Vertex positions of all meshes.
    pub positions: Vec<Vec3>,
    /// Corners of all triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals of all meshes.
    pub normals: Vec<Vec3>,
    /// Normals at the corners of each triangle, or [`FLAT`]; empty if all are flat.
    pub triangle_normals: Vec<[u32; 3]>,
    /// Texture coordinates of all meshes whose triangles have some that are needed.
    pub uvs: Vec<Vec2>,
    /// Texture coordinates at the corners of each triangle, or [`FLAT`]; may end early.
    pub triangle_uvs: Vec<[u32; 3]>,
    /// Spheres; their primitive numbers follow those of the triangles.
    pub spheres: Vec<Sphere>,
    /// The axes of each sphere.
    pub sphere_axes: Vec<Mat3>,
    /// Surface of each primitive.
    pub primitive_surface: Vec<Id<SurfaceRecord>>,
}

/// A point of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapePoint {
    /// Where.
    pub(crate) p: Vec3,
    /// A bound of the error of each coordinate.
    pub(crate) error: Vec3,
    /// Unit normal of the true surface, on the side of `normal`.
    pub(crate) geometric_normal: Vec3,
    /// Shading normal.
    pub(crate) normal: Vec3,
}

impl ShapeTables {
    /// Whether a primitive is a triangle that is seen as flat.
    #[inline]
    pub(crate) fn is_flat(&self, primitive: usize) -> bool {
        let corners = self.triangle_normals.get(primitive).copied().unwrap_or(FLAT);
        primitive < self.triangles.len() && corners == FLAT
    }

    /// p = Σ bᵢ pᵢ, with |error| ≤ γ₇ Σ |bᵢ pᵢ|. [Pharr, Jakob & Humphreys, Physically Based
    /// Rendering, 3rd ed., §3.9.4]
    ///
    /// Normals are those that `turn` makes of the unit normals in the tables; if they are `plain`,
    /// what is interpolated between corners stays shorter than 1.
    #[inline(always)]
    pub(crate) fn triangle_point(
        &self,
        i: usize,
        hit: &Hit,
        plain: bool,
        turn: impl Fn(Vec3) -> Vec3,
    ) -> ShapePoint {
        let [p0, p1, p2] = self.triangles[i].map(|v| self.positions[v as usize]);
        let b0 = 1.0 - hit.b1 - hit.b2;
        let (q0, q1, q2) = (p0 * b0, p1 * hit.b1, p2 * hit.b2);
        let p = q0 + q1 + q2;
        let error = (q0.abs() + q1.abs() + q2.abs()) * gamma(7);
        let flat = turn((p1 - p0).cross(p2 - p0).normalize());
        let as_flat = ShapePoint { p, error, geometric_normal: flat, normal: flat };
        let corners = self.triangle_normals.get(i).copied().unwrap_or(FLAT);
        if corners == FLAT {
            return as_flat;
        }
        let [n0, n1, n2] = corners.map(|v| turn(self.normals[v as usize]));
        let sum = n0 * b0 + n1 * hit.b1 + n2 * hit.b2;
        let length_squared = sum.length_squared();
        if length_squared < 1e-12 {
            return as_flat;
        }
        let normal = if plain { sum } else { sum / length_squared.sqrt() };
        let geometric_normal = if flat.dot(normal) < 0.0 { -flat } else { flat };
        ShapePoint { geometric_normal, normal, ..as_flat }
    }

    /// The point moved onto the sphere, with an error of γ₅ of its coordinates. [ibid., §3.9.4]
    #[inline(always)]
    pub(crate) fn sphere_point(&self, i: usize, p: Vec3) -> ShapePoint {
        let Sphere { center, radius } = self.spheres[i];
        let n = (p - center).normalize();
        let offset = n * radius.abs();
        let p = center + offset;
        let error = (center.abs() + offset.abs()) * gamma(5);
        let n = if radius < 0.0 { -n } else { n };
        ShapePoint { p, error, geometric_normal: n, normal: n }
    }
}
