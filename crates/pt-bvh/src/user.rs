//! A tree over primitives of any kind, which say themselves where rays hit them. [The user
//! geometries of Embree are the model: a box, a nearest hit and any hit for each primitive]

use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, Ray};

use crate::BuildError;
use crate::aabb_tree::AabbTree;

/// The [slack](UserPrimitives::error_bound) of primitives whose hits are computed in single
/// precision with some care: 80ε ≈ 4.8·10⁻⁶.
pub const DEFAULT_ERROR_BOUND: f32 = 80.0 * EPSILON;

/// A set of primitives, numbered from 0, that know their boxes and where rays hit them.
///
/// Queries must be functions of primitive and ray, in which `t_max` does nothing but leave hits
/// out. They get rays with finite coordinates, a direction of any length but 0, and `t_min` at
/// least 0.
pub trait UserPrimitives {
    /// What is known of a hit.
    type Hit: Copy;

    /// Number of primitives, at most 2³⁰.
    fn len(&self) -> usize;

    /// Returns true if there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box around a primitive; `None` when no ray can hit it.
    fn bounds(&self, primitive: u32) -> Option<Bounds3>;

    /// How far o + t·d may be outside of the box for any hit of the primitive, by rounding, along
    /// each axis; in units of the largest coordinate distance from o to a corner of the box. From 0
    /// to 128; the more, the more boxes are entered in vain.
    fn error_bound(&self, _primitive: u32) -> f32 {
        DEFAULT_ERROR_BOUND
    }

    /// The hit of a primitive with the least t in (`t_min`, `t_max`).
    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<Self::Hit>;

    /// The ray parameter t of a hit.
    fn t(hit: &Self::Hit) -> f32;

    /// Returns true if a primitive is hit with t in (`t_min`, `t_max`), as [`Self::intersect`] has
    /// it.
    fn occluded(&self, primitive: u32, ray: &Ray) -> bool {
        self.intersect(primitive, ray).is_some()
    }
}

/// [`UserPrimitives`], ready for ray queries.
///
/// Of several hits with the least t, queries return that on the primitive with the least number:
/// the same as a loop over all primitives.
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
    /// Makes the primitives ready for queries. Those without a box, with one that is inside out or
    /// beyond [`LARGEST_COORDINATE`](crate::LARGEST_COORDINATE), and those with a slack out of
    /// range are left out and counted.
    ///
    /// # Errors
    /// Too many primitives.
    pub fn build(primitives: P) -> Result<Self, BuildError> {
        let mut bvh = Self { primitives, tree: AabbTree::default() };
        bvh.rebuild()?;
        Ok(bvh)
    }

    /// Changes the primitives, as many and as much as it takes, and builds the tree over them anew;
    /// returns what `change` returns. There is no refit: a build takes about a microsecond for each
    /// primitive, and a tree that is only refitted answers the slower the farther they move.
    ///
    /// # Errors
    /// Too many primitives; nothing is hit then.
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

    /// The nearest hit with t in (`t_min`, `t_max`); of hits with equal t that on the primitive
    /// with the least number.
    pub fn intersect(&self, ray: &Ray) -> Option<P::Hit> {
        self.tree.nearest(ray, P::t, |id, ray| self.primitives.intersect(id, ray))
    }

    /// Returns true if anything is hit with t in (`t_min`, `t_max`).
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.tree.any(ray, |id, ray| self.primitives.occluded(id, ray))
    }

    /// [`Self::intersect`] of each ray, in order, in place of what `hits` held.
    pub fn intersect_batch(&self, rays: &[Ray], hits: &mut Vec<Option<P::Hit>>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.intersect(ray)));
    }

    /// [`Self::occluded`] of each ray, in order, in place of what `occluded` held.
    pub fn occluded_batch(&self, rays: &[Ray], occluded: &mut Vec<bool>) {
        occluded.clear();
        occluded.extend(rays.iter().map(|ray| self.occluded(ray)));
    }

    /// The primitives.
    pub fn primitives(&self) -> &P {
        &self.primitives
    }

    /// The box around everything that can be hit; empty when nothing can.
    pub fn bounds(&self) -> Bounds3 {
        self.tree.bounds()
    }

    /// Primitives left out because no ray can hit them.
    pub fn skipped(&self) -> u32 {
        self.tree.skipped()
    }
}
