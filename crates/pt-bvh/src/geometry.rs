//! Input of a build, and result of a query.

use pt_math::{Bounds3, DVec3, Vec3};

/// Largest usable magnitude of coordinates, radii and ray origins, 2⁶⁰ ≈ 1.15·10¹⁸: no product of
/// two distances overflows. Primitives and rays beyond it are ignored.
pub const LARGEST_COORDINATE: f32 = (1u64 << 60) as f32;

/// A sphere; rays hit it from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: Vec3,
    /// Radius, above 0.
    pub radius: f32,
}

/// Primitives of a scene. Primitive `i` is triangle `i` if `i < triangles.len()`, and sphere
/// `i − triangles.len()` otherwise.
#[derive(Clone, Copy, Debug, Default)]
pub struct Geometry<'a> {
    /// Vertices.
    pub positions: &'a [Vec3],
    /// Three indices into `positions` for each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Spheres.
    pub spheres: &'a [Sphere],
}

/// Nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter: the point is o + t·d.
    pub t: f32,
    /// Weight of the triangle's second vertex: the point is (1 − b₁ − b₂) p₀ + b₁ p₁ + b₂ p₂.
    /// 0 for a sphere.
    pub b1: f32,
    /// Weight of the triangle's third vertex; 0 for a sphere.
    pub b2: f32,
    /// Number of the primitive: triangles first, then spheres, as in [`Geometry`].
    pub primitive: u32,
}

/// Triangle or sphere, by value.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Primitive {
    Triangle([Vec3; 3]),
    Sphere(Sphere),
}

impl Geometry<'_> {
    /// Number of primitives.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// Returns true if there are no primitives.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Primitive `id`, which must be below `len()`, with indices in range.
    #[inline]
    pub(crate) fn primitive(&self, id: u32) -> Primitive {
        let i = id as usize;
        match self.triangles.get(i) {
            Some(t) => Primitive::Triangle(t.map(|v| self.positions[v as usize])),
            None => Primitive::Sphere(self.spheres[i - self.triangles.len()]),
        }
    }

    /// Returns true if primitive `id` is a sphere.
    #[inline]
    pub(crate) fn is_sphere(&self, id: u32) -> bool {
        id as usize >= self.triangles.len()
    }
}

impl Primitive {
    /// Box around the primitive; `None` if no ray can hit it: coordinates that are not finite or
    /// too large, a triangle without area, a sphere without positive radius.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> Option<Bounds3> {
        match *self {
            Self::Triangle(p) => (p.iter().all(|&v| in_range(v)) && has_area(p))
                .then(|| p.into_iter().collect::<Bounds3>()),
            Self::Sphere(Sphere { center, radius }) => {
                let usable = in_range(center) && radius > 0.0 && radius <= LARGEST_COORDINATE;
                let (c, r) = (center.as_dvec3(), f64::from(radius));
                usable.then(|| outward(c - r, c + r))
            }
        }
    }
}

/// Box around two corners, rounded outward.
pub(crate) fn outward(min: DVec3, max: DVec3) -> Bounds3 {
    let down = min.as_vec3().to_array().map(f32::next_down);
    let up = max.as_vec3().to_array().map(f32::next_up);
    Bounds3 { min: Vec3::from_array(down), max: Vec3::from_array(up) }
}

/// Returns true if all coordinates are finite and not too large.
#[inline]
pub(crate) fn in_range(v: Vec3) -> bool {
    // NaN compares false.
    v.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all()
}

/// Returns true if the cross product of two edges is not zero, in double precision.
#[inline]
fn has_area(p: [Vec3; 3]) -> bool {
    let [a, b, c] = p.map(Vec3::as_dvec3);
    (b - a).cross(c - a) != DVec3::ZERO
}
