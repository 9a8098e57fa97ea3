//! Tree over primitives of any kind, which implement their own intersection. [Modelled on the user
//! geometries of Embree: a box, a nearest hit and any hit for each primitive]

use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, Ray};

use crate::BuildError;
use crate::aabb_tree::AabbTree;

/// The [error bound](UserPrimitives::error_bound) of primitives whose hits are computed carefully
/// in single precision: 80ε ≈ 4.8·10⁻⁶.
pub const DEFAULT_ERROR_BOUND: f32 = 80.0 * EPSILON;

/// A set of primitives, numbered from 0, with boxes and ray intersections.
///
/// Queries must be functions of primitive and ray, in which `t_max` does nothing but exclude hits.
/// They receive rays with finite coordinates, a nonzero direction of any length, and `t_min` at
/// least 0.
pub trait UserPrimitives {
    /// Description of a hit.
    type Hit: Copy;

    /// Number of primitives, at most 2³⁰.
    fn len(&self) -> usize;

    /// Returns true if there are no primitives.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Box around a primitive; `None` if no ray can hit it.
    fn bounds(&self, primitive: u32) -> Option<Bounds3>;

    /// Maximum distance by which o + t·d may be outside of the box for any hit of the primitive,
    /// due to rounding, along each axis; in units of the largest coordinate distance from o to a
    /// corner of the box. In [0, 128]; larger bounds lead to more boxes entered without a hit.
    fn error_bound(&self, _primitive: u32) -> f32 {
        DEFAULT_ERROR_BOUND
    }

    /// Returns the hit of a primitive with the least t in (`t_min`, `t_max`).
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<Self::Hit>;

    /// Ray parameter t of a hit.
    fn t(hit: &Self::Hit) -> f32;

    /// Returns true if a primitive is hit with t in (`t_min`, `t_max`), consistently with
    /// [`Self::intersect`].
    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.intersect(primitive, ray).is_some()
    }
}

/// [`UserPrimitives`], prepared for ray queries.
///
/// Of several hits with the least t, queries return that on the primitive with the least number,
/// like a loop over all primitives.
///
/// ```
/// use pt_bvh::{UserBvh, UserPrimitives};
/// use pt_math::{Bounds3, Ray, Vec3};
///
/// /// Unit squares across the z axis, each at a height, with their least corner on the axis.
/// struct Shelves(Vec<f32>);
///
/// impl UserPrimitives for Shelves {
///     type Hit = (f32, u32);
///
///     fn len(&self) -> usize {
///         self.0.len()
///     }
///
///     fn bounds(&self, i: u32) -> Option<Bounds3> {
///         let corner = Vec3::Z * self.0[i as usize];
///         Some(Bounds3 { min: corner, max: corner + Vec3::new(1.0, 1.0, 0.0) })
///     }
///
///     fn intersect(&self, i: u32, ray: &Ray) -> Option<(f32, u32)> {
///         let t = (self.0[i as usize] - ray.origin.z) / ray.direction.z;
///         let [x, y, _] = ray.at(t).to_array();
///         let is_inside = (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y);
///         (is_inside && t > ray.t_min && t < ray.t_max).then_some((t, i))
///     }
///
///     fn t(hit: &(f32, u32)) -> f32 {
///         hit.0
///     }
/// }
///
/// let bvh = UserBvh::build(Shelves(vec![5.0, 2.0, 3.0]))?;
/// let ray = Ray::new(Vec3::new(0.5, 0.5, 0.0), Vec3::Z);
/// assert_eq!(bvh.intersect(&ray), Some((2.0, 1)));
/// assert!(!bvh.occluded(&Ray { t_max: 2.0, ..ray }));
/// # Ok::<(), pt_bvh::BuildError>(())
/// ```
#[derive(Clone, Debug)]
pub struct UserBvh<P> {
    primitives: P,
    tree: AabbTree,
}

impl<P: UserPrimitives> UserBvh<P> {
    /// Builds a tree over the primitives. Primitives without a box, with an empty box or one beyond
    /// [`LARGEST_COORDINATE`](crate::LARGEST_COORDINATE), and those with an error bound out of
    /// range are left out and counted.
    ///
    /// # Errors
    /// Too many primitives.
    pub fn build(primitives: P) -> Result<Self, BuildError> {
        let mut bvh = Self { primitives, tree: AabbTree::default() };
        bvh.rebuild()?;
        Ok(bvh)
    }

    /// Applies arbitrary changes to the primitives and rebuilds the tree; returns the result of
    /// `change`. There is no refit: a build takes about a microsecond per primitive, and queries of
    /// a refitted tree are the slower the farther the primitives move.
    ///
    /// # Errors
    /// Too many primitives; no ray hits anything then.
    pub fn update<R>(&mut self, change: impl FnOnce(&mut P) -> R) -> Result<R, BuildError> {
        let result = change(&mut self.primitives);
        self.rebuild()?;
        Ok(result)
    }

    fn rebuild(&mut self) -> Result<(), BuildError> {
        let primitives = &self.primitives;
        self.tree = AabbTree::default();
        let bounds = |id| primitives.bounds(id);
        self.tree = AabbTree::build(primitives.len(), bounds, |id| primitives.error_bound(id))?;
        Ok(())
    }

    /// Returns the nearest hit with t in (`t_min`, `t_max`); of hits with equal t, that on the
    /// primitive with the least number.
    pub fn intersect(&self, ray: &Ray) -> Option<P::Hit> {
        self.tree.nearest(ray, P::t, |id, ray| self.primitives.intersect(id, ray))
    }

    /// Returns true if anything is hit with t in (`t_min`, `t_max`).
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.tree.any(ray, |id, ray| self.primitives.occluded(id, ray))
    }

    /// Replaces the contents of `hits` by the results of [`Self::intersect`] for each ray, in
    /// order.
    pub fn intersect_batch(&self, rays: &[Ray], hits: &mut Vec<Option<P::Hit>>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.intersect(ray)));
    }

    /// Replaces the contents of `occluded` by the results of [`Self::occluded`] for each ray, in
    /// order.
    pub fn occluded_batch(&self, rays: &[Ray], occluded: &mut Vec<bool>) {
        occluded.clear();
        occluded.extend(rays.iter().map(|ray| self.occluded(ray)));
    }

    /// Primitives of the tree.
    pub fn primitives(&self) -> &P {
        &self.primitives
    }

    /// Box around all primitives that can be hit; empty if there are none.
    pub fn bounds(&self) -> Bounds3 {
        self.tree.bounds()
    }

    /// Number of primitives left out because no ray can hit them.
    pub fn skipped(&self) -> u32 {
        self.tree.skipped()
    }
}
