//! Smooth shadows on meshes with interpolated normals.
//!
//! A mesh that approximates a round shape shadows itself where the shape is lit, so the terminator
//! shows the facets of the mesh. Rays therefore leave from the round shape that the normals
//! describe: a point is moved off its triangle to the mean of its projections onto the tangent
//! planes at the corners, weighted by its barycentric coordinates. [Hanika 2021, "Hacking the
//! Shadow Terminator", Ray Tracing Gems II, ch. 4] Here it is moved only along the normal at the
//! point, and not at all on the concave side of the shape.

use pt_math::{DVec3, Vec3};

use crate::interaction::SurfacePoint;

/// Cosine of the largest angle between the shading and the geometric normal at which points are
/// moved.
const MIN_COSINE: f32 = 0.1;

/// A point of a triangle, with the positions and normals of its corners.
pub(crate) struct Rounded {
    /// The point.
    pub(crate) p: DVec3,
    /// Corners of the triangle.
    pub(crate) corners: [DVec3; 3],
    /// Unit normals at the corners.
    pub(crate) normals: [Vec3; 3],
    /// Barycentric coordinates of the point.
    pub(crate) weights: [f32; 3],
}

impl Rounded {
    /// Returns the height of the round shape above the triangle along the unit normal at the point,
    /// on the side to which the vertex normals point (1) or on the other one (−1).
    fn height(&self, side: f64, normal: DVec3) -> f64 {
        let of_corner = |i: usize| {
            let n = self.normals[i].as_dvec3();
            let below = (self.corners[i] - self.p).dot(n) * side;
            f64::from(self.weights[i]) * below.max(0.0) * n.dot(normal)
        };
        (0..3).map(of_corner).sum::<f64>().max(0.0)
    }

    /// Returns the point from which rays leave on the side of the unit direction `wo`. `flat` is
    /// the point on the flat triangle, and `normal` the unit shading normal.
    pub(crate) fn point(&self, flat: SurfacePoint, normal: Vec3, wo: Vec3) -> SurfacePoint {
        let cosine = flat.normal.dot(normal);
        if cosine < MIN_COSINE {
            return flat;
        }
        let along = normal.as_dvec3();
        let [front, back] = [1.0, -1.0].map(|side| self.height(side, along));
        let is_front = wo.dot(flat.normal) > 0.0;
        let p = if is_front { self.p + along * front } else { self.p - along * back };
        let point = SurfacePoint::on(p, flat.normal);
        let [near, far] = [0.0, (front + back) as f32].map(|height| {
            let [offset, _] = point.offsets;
            height + offset / cosine
        });
        let offsets = if is_front { [near, far] } else { [far, near] };
        SurfacePoint { along: normal, offsets, ..point }
    }
}
