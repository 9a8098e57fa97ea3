//! Queries in plain scalar code: the loop over all primitives, and the binary tree. They define the
//! results of the fast kernels.

use pt_math::{Bounds3, Ray};

use crate::counter::Counter;
use crate::geometry::{Geometry, Hit, Primitive};
use crate::node::{Bvh2, MAX_DEPTH};
use crate::ray::PreparedRay;
use crate::{sphere, triangle};

/// Nearest hit so far: the least t, and of equal ones the least primitive number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestHit {
    hit: Hit,
    found: bool,
    t_min: f32,
}

impl NearestHit {
    #[inline]
    pub(crate) fn new(ray: &PreparedRay) -> Self {
        // No primitive has a number below 0, so a hit at t_max itself never wins.
        let hit = Hit { t: ray.t_max, b1: 0.0, b2: 0.0, primitive: 0 };
        Self { hit, found: false, t_min: ray.t_min }
    }

    /// Replaces the hit if the new one is inside of the interval and nearer; returns true if so.
    #[inline]
    pub(crate) fn offer(&mut self, hit: Hit) -> bool {
        let nearer =
            hit.t < self.hit.t || (hit.t == self.hit.t && hit.primitive < self.hit.primitive);
        let better = hit.t > self.t_min && nearer;
        if better {
            self.hit = hit;
            self.found = true;
        }
        better
    }

    /// Upper bound of the parameter of nearer hits.
    #[inline]
    pub(crate) fn t(&self) -> f32 {
        self.hit.t
    }

    #[inline]
    pub(crate) fn get(&self) -> Option<Hit> {
        self.found.then_some(self.hit)
    }
}

/// Intersection of a ray with one primitive, without regard to `t_max`.
#[inline]
pub(crate) fn intersect_primitive(
    ray: &PreparedRay,
    primitive: &Primitive,
    id: u32,
) -> Option<Hit> {
    match primitive {
        Primitive::Triangle(p) => {
            triangle::intersect(ray, *p).map(|h| Hit { t: h.t, b1: h.b1, b2: h.b2, primitive: id })
        }
        Primitive::Sphere(s) => sphere::intersect(ray.origin, ray.direction, ray.t_min, s)
            .map(|t| Hit { t, b1: 0.0, b2: 0.0, primitive: id }),
    }
}

/// All usable primitives in a list without a tree, for comparison with trees.
#[derive(Clone, Debug)]
pub(crate) struct List {
    primitives: Vec<(Primitive, u32)>,
    bounds: Bounds3,
}

impl List {
    /// Collects primitives; also returns the number of those left out.
    pub(crate) fn new(geometry: &Geometry<'_>) -> (Self, u32) {
        let all = (0..geometry.len() as u32).map(|id| (geometry.primitive(id), id));
        let usable: Vec<_> = all.filter(|(primitive, _)| primitive.bounds().is_some()).collect();
        let skipped = (geometry.len() - usable.len()) as u32;
        (Self::of(usable), skipped)
    }

    /// List of usable primitives with their numbers.
    pub(crate) fn of(primitives: Vec<(Primitive, u32)>) -> Self {
        let bounds = primitives.iter().filter_map(|(primitive, _)| primitive.bounds());
        let bounds = bounds.fold(Bounds3::EMPTY, Bounds3::union);
        Self { primitives, bounds }
    }

    pub(crate) fn primitives(&self) -> &[(Primitive, u32)] {
        &self.primitives
    }

    pub(crate) fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.primitives.as_slice())
    }

    /// Returns the nearest hit.
    pub(crate) fn intersect(&self, ray: &Ray, counter: &mut impl Counter) -> Option<Hit> {
        let ray = PreparedRay::new(ray, &self.bounds)?;
        let mut nearest = NearestHit::new(&ray);
        for (primitive, id) in &self.primitives {
            counter.add(|| 1);
            if let Some(hit) = intersect_primitive(&ray, primitive, *id) {
                nearest.offer(hit);
            }
        }
        nearest.get()
    }

    /// Returns true if there is a hit.
    pub(crate) fn occluded(&self, ray: &Ray, counter: &mut impl Counter) -> bool {
        let Some(ray) = PreparedRay::new(ray, &self.bounds) else { return false };
        let mut nearest = NearestHit::new(&ray);
        self.primitives.iter().any(|(primitive, id)| {
            counter.add(|| 1);
            intersect_primitive(&ray, primitive, *id).is_some_and(|hit| nearest.offer(hit))
        })
    }
}

/// Nodes to visit, with the depths at which the ray enters them: the root, or the children of one
/// node per level.
pub(crate) type BinaryStack = [(u32, f32); MAX_DEPTH + 2];
pub(crate) const STACK: BinaryStack = [(0, 0.0); MAX_DEPTH + 2];

/// Traversal of a binary tree by a ray.
#[derive(Debug)]
pub(crate) struct Walk<'a, 'b> {
    tree: &'a Bvh2,
    ray: PreparedRay,
    start: f32,
    stack: &'b mut BinaryStack,
    /// Number of entries on the stack.
    size: usize,
}

impl<'a, 'b> Walk<'a, 'b> {
    /// Starts at the root of `tree`, which must not be empty; the contents of the stack are
    /// overwritten.
    #[inline]
    pub(crate) fn new(tree: &'a Bvh2, ray: PreparedRay, stack: &'b mut BinaryStack) -> Self {
        let start = ray.depth_start();
        stack[0] = (0, start);
        Self { tree, ray, start, stack, size: 1 }
    }

    /// Returns the primitives of the next leaf, near to far, that may contain a hit with parameter
    /// up to `t`. The box of node `i` is widened by the pad of the ray times `widening(i)`.
    #[inline]
    pub(crate) fn next(&mut self, t: f32, widening: impl Fn(usize) -> f32) -> Option<&'a [u32]> {
        let limit = self.ray.depth_limit(t);
        while self.size > 0 {
            self.size -= 1;
            let (i, entry) = self.stack[self.size];
            if entry > limit {
                continue;
            }
            let node = &self.tree.nodes[i as usize];
            if node.is_leaf() {
                let first = node.offset as usize;
                return Some(&self.tree.order[first..first + node.count as usize]);
            }
            let mut children = self.tree.children(i as usize).map(|child| {
                let bounds = self.tree.nodes[child].bounds();
                let (near, far) = self.ray.slab_interval(&bounds, self.ray.pad * widening(child));
                (child as u32, near.max(self.start), far)
            });
            if children[0].1 < children[1].1 {
                children.swap(0, 1);
            }
            for (child, near, far) in children {
                if near <= far {
                    self.stack[self.size] = (child, near);
                    self.size += 1;
                }
            }
        }
        None
    }
}

impl Bvh2 {
    /// Returns the nearest hit, by scalar code: a slow reference for the fast kernels. `geometry`
    /// must be the one over which the tree was built.
    pub fn intersect(&self, geometry: &Geometry<'_>, ray: &Ray) -> Option<Hit> {
        let ray = PreparedRay::new(ray, &self.bounds())?;
        let mut nearest = NearestHit::new(&ray);
        let mut stack = STACK;
        let mut walk = Walk::new(self, ray, &mut stack);
        while let Some(leaf) = walk.next(nearest.t(), |_| 1.0) {
            for &id in leaf {
                if let Some(hit) = intersect_primitive(&ray, &geometry.primitive(id), id) {
                    nearest.offer(hit);
                }
            }
        }
        nearest.get()
    }
}
