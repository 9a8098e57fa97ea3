//! Binary tree, from which all other layouts are made.

use pt_math::{Bounds3, Vec3};

/// Maximum depth of leaves, with the root at depth 0.
pub const MAX_DEPTH: usize = 62;

/// Node of a [`Bvh2`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Node {
    /// Least corner of the box.
    pub min: Vec3,
    /// Leaf: index of its first primitive in [`Bvh2::order`]. Inner node: distance to the right
    /// child in nodes.
    pub offset: u32,
    /// Greatest corner of the box.
    pub max: Vec3,
    /// Number of primitives; 0 for an inner node.
    pub count: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

impl Node {
    /// Returns true if the node is a leaf.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.count > 0
    }

    /// Box around everything below the node.
    #[inline]
    pub fn bounds(&self) -> Bounds3 {
        Bounds3 { min: self.min, max: self.max }
    }
}

/// A binary bounding volume hierarchy, from which other layouts are made.
///
/// Invariants ([`check::verify`](crate::check::verify) tests them):
///
/// * Nodes are in depth-first order, the root first. The left child of node `i` is `i + 1` and the
///   right child `i + nodes[i].offset`.
/// * Every usable sphere is in exactly one leaf, every usable triangle in at least one. Each point
///   of a triangle is in the box of a leaf that refers to it.
/// * Leaves are in the order of `order` and contain either triangles or spheres.
/// * The box of an inner node is the union of those of its children. The box of a leaf without
///   pieces of triangles is the union of those of its primitives.
/// * No leaf is deeper than [`MAX_DEPTH`].
#[derive(Clone, Debug, Default)]
pub struct Bvh2 {
    /// All nodes; empty without primitives.
    pub nodes: Vec<Node>,
    /// Primitives in the order of the leaves; cut triangles occur several times.
    pub order: Vec<u32>,
    /// Number of primitives left out because no ray can hit them.
    pub skipped: u32,
}

impl Bvh2 {
    /// Box around all primitives; empty if there are none.
    pub fn bounds(&self) -> Bounds3 {
        self.nodes.first().map_or(Bounds3::EMPTY, Node::bounds)
    }

    /// Indices of the children of inner node `i`.
    #[inline]
    pub fn children(&self, i: usize) -> [usize; 2] {
        [i + 1, i + self.nodes[i].offset as usize]
    }

    /// Depth of the deepest leaf; the root alone has depth 0.
    pub fn depth(&self) -> u32 {
        let mut deepest = 0;
        let mut stack: Vec<(usize, u32)> = self.nodes.first().map(|_| (0, 0)).into_iter().collect();
        while let Some((i, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            if !self.nodes[i].is_leaf() {
                stack.extend(self.children(i).map(|child| (child, depth + 1)));
            }
        }
        deepest
    }
}
