//! Smooth shadows on meshes with interpolated normals.
//!
//! A mesh that stands for a round shape is in its own shadow where the shape itself is lit: the
//! terminator has the corners of the mesh. So rays leave from the round shape that the normals
//! belong to: a point is moved out of its triangle to the mean of its projections onto the tangent
//! planes at the corners, by their weights. [Hanika 2021, "Hacking the Shadow Terminator", Ray
//! Tracing Gems II, ch. 4] Here only along the normal at the point, on which it lies then; and on
//! the hollow side of the shape not at all.

use pt_math::{DVec3, Vec3};

use crate::scene::SurfacePoint;

/// Points where the normal is farther from that of the triangle stay as they are (the cosine).
const MIN_COSINE: f32 = 0.1;

/// A point of a triangle with what its corners are.
pub(crate) struct Rounded {
    /// The point.
    pub(crate) p: DVec3,
    /// The corners.
    pub(crate) corners: [DVec3; 3],
    /// Unit normals there.
    pub(crate) normals: [Vec3; 3],
    /// How much of each corner there is in the point.
    pub(crate) weights: [f32; 3],
}

impl Rounded {
    /// How far above the triangle the shape is, on the side to which its normals point (1), or on
    /// the other one (−1), along the unit normal at the point.
    fn height(&self, side: f64, normal: DVec3) -> f64 {
        let of_corner = |i: usize| {
            let n = self.normals[i].as_dvec3();
            let below = (self.corners[i] - self.p).dot(n) * side;
            f64::from(self.weights[i]) * below.max(0.0) * n.dot(normal)
        };
        (0..3).map(of_corner).sum::<f64>().max(0.0)
    }

    /// Where rays leave that are seen from the unit direction `wo`: `flat` is the same point of the
    /// flat triangle, and `normal` the unit shading normal.
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
