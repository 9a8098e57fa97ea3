//! Tables of triangles and spheres, and the geometry of points on them.

use std::ops::Deref;
use std::sync::Arc;

use pt_bvh::{Hit, Sphere};
use pt_math::float_error::EPSILON;
use pt_math::{DVec3, Mat3, Ray, Vec2, Vec3};

use crate::id::SurfaceId;
use crate::terminator::Rounded;

/// Indices that mark a triangle without vertex normals or texture coordinates.
pub const FLAT: [u32; 3] = [u32::MAX; 3];

/// Triangles and spheres in a common coordinate system, with their surfaces.
#[derive(Clone, Debug)]
pub struct ShapeTables {
    /// Triangles and spheres, which edited scenes may share.
    pub arrays: Arc<ShapeArrays>,
    /// Surface of each primitive.
    pub primitive_surface: Arc<[SurfaceId]>,
}

impl Deref for ShapeTables {
    type Target = ShapeArrays;

    #[inline(always)]
    fn deref(&self) -> &ShapeArrays {
        &self.arrays
    }
}

/// Triangles and spheres in a common coordinate system.
#[derive(Clone, Debug, Default)]
pub struct ShapeArrays {
    /// Vertex positions of all meshes.
    pub positions: Vec<Vec3>,
    /// Vertex indices of all triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals of all meshes.
    pub normals: Vec<Vec3>,
    /// Normal indices of each triangle, or [`FLAT`]; empty if all triangles are flat.
    pub triangle_normals: Vec<[u32; 3]>,
    /// Texture coordinates of all meshes whose triangles need them.
    pub uvs: Vec<Vec2>,
    /// Texture coordinate indices of each triangle, or [`FLAT`]; trailing triangles without may be
    /// missing.
    pub triangle_uvs: Vec<[u32; 3]>,
    /// Spheres; their primitive numbers follow those of the triangles.
    pub spheres: Vec<Sphere>,
    /// Axes of each sphere; trailing spheres with the axes of the world may be missing.
    pub sphere_axes: Vec<Mat3>,
}

/// A point of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapePoint {
    /// Position, exact up to the rounding of double precision.
    pub(crate) p: DVec3,
    /// Length of the longest edge of its triangle; 0 for spheres.
    pub(crate) size: f32,
    /// Lower bound of the distance to the edges of its triangle; infinite for spheres.
    pub(crate) to_edge: f32,
    /// Unit geometric normal, on the side of `normal`.
    pub(crate) geometric_normal: Vec3,
    /// Shading normal.
    pub(crate) normal: Vec3,
}

impl ShapeArrays {
    /// Returns true if a primitive is a triangle without vertex normals.
    #[inline]
    pub(crate) fn is_flat(&self, primitive: usize) -> bool {
        let corners = self.triangle_normals.get(primitive).copied().unwrap_or(FLAT);
        primitive < self.triangles.len() && corners == FLAT
    }

    /// Returns true if all triangles and spheres have the same places, bit for bit.
    pub(crate) fn has_same_places(&self, other: &Self) -> bool {
        let at = |p: &Vec3| p.to_array().map(f32::to_bits);
        let of = |sphere: &Sphere| (at(&sphere.center), sphere.radius.to_bits());
        std::ptr::eq(self, other)
            || self.triangles == other.triangles
                && self.positions.iter().map(at).eq(other.positions.iter().map(at))
                && self.spheres.iter().map(of).eq(other.spheres.iter().map(of))
    }

    /// Returns the corners of a triangle.
    #[inline(always)]
    pub(crate) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// Returns the point p = p₀ + b₁(p₁ − p₀) + b₂(p₂ − p₀) of a triangle. It is computed in double
    /// precision, so that it lies on the triangle however large the coordinates are.
    ///
    /// `turn` transforms the unit normals of the tables. If `plain` is true, interpolated normals
    /// are not normalised, so their length is below 1 between different vertex normals.
    #[inline(always)]
    pub(crate) fn triangle_point(
        &self,
        i: usize,
        hit: &Hit,
        plain: bool,
        turn: impl Fn(Vec3) -> Vec3,
    ) -> ShapePoint {
        let [p0, p1, p2] = self.corners(i);
        let b0 = 1.0 - hit.b1 - hit.b2;
        let origin = p0.as_dvec3();
        let (e1, e2) = (p1.as_dvec3() - origin, p2.as_dvec3() - origin);
        let p = origin + e1 * f64::from(hit.b1) + e2 * f64::from(hit.b2);
        let normal = e1.cross(e2);
        let double_area = normal.length();
        let edges = [e1, e2, e2 - e1].map(DVec3::length_squared);
        let longest = edges[0].max(edges[1]).max(edges[2]);
        // Minus the rounding error that b₀ may have.
        let least_share = b0.min(hit.b1).min(hit.b2) - 4.0 * EPSILON;
        let size = longest.sqrt();
        let to_edge = least_share * (double_area / size) as f32;
        let size = size as f32;
        let flat = turn((normal / double_area).as_vec3());
        let as_flat = ShapePoint { p, size, to_edge, geometric_normal: flat, normal: flat };
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

    /// Returns a point of a triangle with the positions and normals of its corners; `None` if it
    /// has no vertex normals.
    pub(crate) fn rounded(&self, i: usize, hit: &Hit, p: DVec3) -> Option<Rounded> {
        let corners = self.triangle_normals.get(i).copied().filter(|corners| *corners != FLAT)?;
        Some(Rounded {
            p,
            corners: self.corners(i).map(Vec3::as_dvec3),
            normals: corners.map(|v| self.normals[v as usize]),
            weights: [1.0 - hit.b1 - hit.b2, hit.b1, hit.b2],
        })
    }

    /// Returns the point at which a ray meets a sphere at parameter `t`.
    #[inline(always)]
    pub(crate) fn sphere_point(&self, i: usize, ray: &Ray, t: f32) -> ShapePoint {
        let sphere = self.spheres[i];
        let from_center = sphere.normal_at(ray, t);
        let p = sphere.center.as_dvec3() + from_center * f64::from(sphere.radius.abs());
        let n = from_center.as_vec3();
        let n = if sphere.radius < 0.0 { -n } else { n };
        ShapePoint { p, size: 0.0, to_edge: f32::INFINITY, geometric_normal: n, normal: n }
    }
}
