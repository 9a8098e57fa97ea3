//! Tree over boxes that finds candidates for a ray. The caller tests their contents.
//!
//! **Why no box test misses a primitive.** Let R be the largest coordinate distance from the origin
//! to a corner of the scene box. A hit is at most `error_bound`·R outside of the box of its
//! primitive, by the contract of the primitives, and the box test errs by less than 16εR (see
//! [`crate::ray`]). So each node is widened by (`error_bound` + 16ε)·R, with the largest bound of
//! all primitives below it. With the default bound of 80ε that is twice the pad of nodes over
//! triangles. A node is skipped only if the ray enters it beyond the depth of the nearest hit so
//! far, rounded up. So every possible nearest hit is visited, and the tree returns the same hit as
//! a loop over all primitives.

use pt_math::{Bounds3, Ray};

use crate::geometry::in_range;
use crate::node::Bvh2;
use crate::ray::{BOX_TEST, PAD, PreparedRay};
use crate::traverse::{BinaryStack, STACK, Walk};
use crate::{BuildError, build};

/// Largest accepted error bound; primitives with a larger one are left out.
const MAX_ERROR_BOUND: f32 = 128.0;

/// Boxes of primitives, prepared for ray queries.
#[derive(Clone, Debug, Default)]
pub(crate) struct AabbTree {
    /// Binary tree with one primitive per leaf.
    tree: Bvh2,
    /// Factor per node by which the pad of the ray is multiplied.
    widening: Vec<f32>,
}

impl AabbTree {
    /// Builds the tree over `len` primitives, with a box and an error bound for each, as in
    /// [`UserPrimitives`](crate::UserPrimitives).
    ///
    /// # Errors
    /// Too many primitives.
    pub(crate) fn build(
        len: usize,
        bounds: impl Fn(u32) -> Option<Bounds3>,
        error_bound: impl Fn(u32) -> f32,
    ) -> Result<Self, BuildError> {
        build::check_number(len)?;
        let usable = |id| bounds(id).filter(|bounds| is_usable(bounds, error_bound(id)));
        let tree = Bvh2::over_boxes((0..len as u32).map(usable));
        let widening = widening(&tree, error_bound);
        Ok(Self { tree, widening })
    }

    /// Returns the hit of `test` with the least parameter `t` in (`t_min`, `t_max`); of hits with
    /// equal t, that on the primitive with the least number.
    #[inline]
    pub(crate) fn nearest<H>(
        &self,
        ray: &Ray,
        t: impl Fn(&H) -> f32,
        mut test: impl FnMut(u32, &Ray) -> Option<H>,
    ) -> Option<H> {
        let mut stack = STACK;
        let mut walk = self.walk(ray, &mut stack)?;
        let mut nearest = NearestUserHit::new(ray);
        while let Some(id) = self.next(&mut walk, nearest.ray.t_max) {
            if let Some(hit) = test(id, &nearest.ray) {
                nearest.offer(t(&hit), id, hit);
            }
        }
        nearest.hit.map(|(_, hit)| hit)
    }

    /// Returns true if `test` returns true for any primitive that the ray may hit with t in
    /// (`t_min`, `t_max`).
    #[inline]
    pub(crate) fn any(&self, ray: &Ray, mut test: impl FnMut(u32, &Ray) -> bool) -> bool {
        let mut stack = STACK;
        let Some(mut walk) = self.walk(ray, &mut stack) else { return false };
        let ray = from_zero(ray);
        while let Some(id) = self.next(&mut walk, ray.t_max) {
            if test(id, &ray) {
                return true;
            }
        }
        false
    }

    /// Starts a traversal, or `None` for a ray that cannot hit anything.
    #[inline]
    fn walk<'a, 'b>(&'a self, ray: &Ray, stack: &'b mut BinaryStack) -> Option<Walk<'a, 'b>> {
        Some(Walk::new(&self.tree, PreparedRay::new(ray, &self.tree.bounds())?, stack))
    }

    /// Returns the next primitive that may be hit with parameter up to `t`.
    #[inline]
    fn next(&self, walk: &mut Walk<'_, '_>, t: f32) -> Option<u32> {
        let ids = walk.next(t, |node| self.widening[node])?;
        Some(ids[0]) // each leaf has one primitive
    }

    /// Box around all primitives that can be hit; empty if there are none.
    pub(crate) fn bounds(&self) -> Bounds3 {
        self.tree.bounds()
    }

    /// Number of primitives left out because no ray can hit them.
    pub(crate) fn skipped(&self) -> u32 {
        self.tree.skipped
    }
}

/// Restricts a ray to t ≥ 0.
#[inline]
fn from_zero(ray: &Ray) -> Ray {
    Ray { t_min: ray.t_min.max(0.0), ..*ray }
}

/// Nearest hit so far with the number of its primitive, and the ray up to just beyond it.
struct NearestUserHit<H> {
    ray: Ray,
    hit: Option<(u32, H)>,
}

impl<H> NearestUserHit<H> {
    fn new(ray: &Ray) -> Self {
        Self { ray: from_zero(ray), hit: None }
    }

    /// Replaces the hit by one that is nearer; of two with equal t, the one with the lower
    /// primitive number wins.
    #[inline]
    fn offer(&mut self, t: f32, id: u32, hit: H) {
        // The ray ends just beyond the nearest hit.
        let is_equal = t.next_up() == self.ray.t_max;
        let is_later = is_equal && self.hit.as_ref().is_some_and(|(nearest, _)| *nearest < id);
        if t > self.ray.t_min && t < self.ray.t_max && !is_later {
            self.ray.t_max = t.next_up();
            self.hit = Some((id, hit));
        }
    }
}

/// Returns true if a primitive can be in a tree.
fn is_usable(bounds: &Bounds3, error_bound: f32) -> bool {
    let is_box = in_range(bounds.min) && in_range(bounds.max) && !bounds.is_empty();
    is_box && (0.0..=MAX_ERROR_BOUND).contains(&error_bound)
}

/// Factor per node by which the pad of a ray is multiplied: see the module.
fn widening(tree: &Bvh2, error_bound: impl Fn(u32) -> f32) -> Vec<f32> {
    let mut widening = vec![1f32; tree.nodes.len()];
    for (i, node) in tree.nodes.iter().enumerate().rev() {
        widening[i] = if node.is_leaf() {
            let id = tree.order[node.offset as usize];
            ((error_bound(id) + BOX_TEST) / PAD).max(1.0)
        } else {
            let [left, right] = tree.children(i);
            widening[left].max(widening[right])
        };
    }
    widening
}
