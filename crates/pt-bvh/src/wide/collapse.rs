//! From the binary tree to the wide one. Subtrees and leaves that fit a block become one; leaves
//! that do not are halved.

use pt_math::{Bounds3, Vec3};
use wide::f32x8;

use super::batch::STACK_MARGIN;
use super::forest::Forests;
use super::{
    BLOCK, Child, Lanes, NO_PRIMITIVE, SphereBlock, TriangleBlock, WIDTH, WideBvh, WideNode,
};
use crate::geometry::{Geometry, Primitive, Sphere};
use crate::node::Bvh2;

/// A part of the binary tree.
#[derive(Clone, Copy)]
struct Part {
    bounds: Bounds3,
    /// See [`Forests::urgency`].
    urgency: f32,
    content: Content,
}

#[derive(Clone, Copy)]
enum Content {
    /// The subtree of an inner node.
    Subtree(usize),
    /// Consecutive primitives, of one kind, in the order of the tree.
    Run { first: usize, count: usize },
}

/// Room for what a ray of a batch puts off in a tree with so many nodes on the longest way down.
pub(super) fn stack_size(levels: usize) -> usize {
    1 + (WIDTH - 1) * levels + STACK_MARGIN
}

struct Collapse<'a> {
    bvh: &'a Bvh2,
    geometry: &'a Geometry<'a>,
    forests: Forests<'a>,
    wide: WideBvh,
    /// Nodes on the longest way down so far.
    levels: usize,
}

impl WideBvh {
    /// Makes the wide tree.
    pub(crate) fn new(bvh: &Bvh2, geometry: &Geometry<'_>) -> Self {
        if bvh.nodes.is_empty() {
            return Self::default();
        }
        let wide = Self { center: bvh.bounds().center(), ..Self::default() };
        let forests = Forests::new(bvh, geometry);
        let mut collapse = Collapse { bvh, geometry, forests, wide, levels: 0 };
        collapse.reserve();
        let root = collapse.part(0);
        collapse.push_node(root, 1);
        let mut wide = collapse.wide;
        wide.stack_size = stack_size(collapse.levels);
        wide.nodes.shrink_to_fit();
        wide.triangles.shrink_to_fit();
        wide.spheres.shrink_to_fit();
        wide
    }
}

impl Collapse<'_> {
    /// Makes room for as many blocks as there may be, so that arrays do not grow by copying.
    fn reserve(&mut self) {
        let (mut triangles, mut spheres) = (0, 0);
        for leaf in self.bvh.nodes.iter().filter(|n| n.is_leaf()) {
            // Halving a run until it fits leaves blocks at least half full.
            let count = leaf.count as usize;
            let blocks = if count <= BLOCK { 1 } else { count.div_ceil(BLOCK).next_power_of_two() };
            let is_sphere = self.geometry.is_sphere(self.bvh.order[leaf.offset as usize]);
            *(if is_sphere { &mut spheres } else { &mut triangles }) += blocks;
        }
        self.wide.triangles.reserve_exact(triangles);
        self.wide.spheres.reserve_exact(spheres);
    }

    fn part(&self, i: usize) -> Part {
        let node = &self.bvh.nodes[i];
        let is_run = node.is_leaf() || self.forests.is_small(i);
        let content = if is_run { self.all_below(i) } else { Content::Subtree(i) };
        Part { bounds: node.bounds(), urgency: self.forests.urgency(i), content }
    }

    /// The primitives below node `i`.
    fn all_below(&self, i: usize) -> Content {
        let nodes = &self.bvh.nodes;
        let (mut leftmost, mut rightmost) = (i, i);
        while !nodes[leftmost].is_leaf() {
            leftmost = self.bvh.children(leftmost)[0];
        }
        while !nodes[rightmost].is_leaf() {
            rightmost = self.bvh.children(rightmost)[1];
        }
        let first = nodes[leftmost].offset as usize;
        let end = (nodes[rightmost].offset + nodes[rightmost].count) as usize;
        Content::Run { first, count: end - first }
    }

    /// Some of the primitives of a leaf with this box, which may hold pieces of them only.
    fn run(&self, first: usize, count: usize, within: Bounds3) -> Part {
        let ids = &self.bvh.order[first..first + count];
        let bounds = ids.iter().filter_map(|&id| self.geometry.primitive(id).bounds());
        let all = bounds.fold(Bounds3::EMPTY, Bounds3::union);
        let bounds = Bounds3 { min: all.min.max(within.min), max: all.max.min(within.max) };
        Part { bounds, urgency: 0.0, content: Content::Run { first, count } }
    }

    /// Adds the node for a part, and everything below it; returns its index. The recursion is no
    /// deeper than the binary tree, plus the few halvings of a large leaf.
    fn push_node(&mut self, part: Part, level: usize) -> usize {
        self.levels = self.levels.max(level);
        let mut parts = self.open(part);
        // The most urgent last, where queries for any hit begin.
        parts.sort_by(|a, b| a.urgency.total_cmp(&b.urgency));
        let index = self.wide.nodes.len();
        self.wide.nodes.push(empty_node());
        let mut planes = [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3];
        for (slot, part) in parts.iter().enumerate() {
            let (low, high) = relative_bounds(&part.bounds, self.wide.center);
            for axis in 0..3 {
                planes[axis][0][slot] = low[axis];
                planes[axis][1][slot] = high[axis];
            }
            let child = match part.content {
                Content::Run { first, count } if count <= BLOCK => self.push_block(first, count),
                _ => Child::node(self.push_node(*part, level + 1)),
            };
            self.wide.nodes[index].children[slot] = child;
        }
        self.wide.nodes[index].planes = planes.map(|rows| rows.map(f32x8::new));
        index
    }

    /// Up to eight parts that make up this one.
    fn open(&self, part: Part) -> Vec<Part> {
        match part.content {
            Content::Subtree(i) => self.forests.of(i).into_iter().map(|i| self.part(i)).collect(),
            Content::Run { first, count } => self.eighths(first, count, part.bounds),
        }
    }

    /// A run that does not fit a block, halved and halved again; or one that does.
    fn eighths(&self, first: usize, count: usize, within: Bounds3) -> Vec<Part> {
        let mut runs = vec![(first, count)];
        while runs.len() < WIDTH && runs.iter().any(|&(_, count)| count > BLOCK) {
            let halves = |(first, count): (usize, usize)| {
                let half = if count > BLOCK { count / 2 } else { 0 };
                [(first, half), (first + half, count - half)]
            };
            runs = runs.into_iter().flat_map(halves).filter(|run| run.1 > 0).collect();
        }
        runs.into_iter().map(|(first, count)| self.run(first, count, within)).collect()
    }

    fn push_block(&mut self, first: usize, count: usize) -> Child {
        let ids = &self.bvh.order[first..first + count];
        let mut lanes = [NO_PRIMITIVE; BLOCK];
        let mut used = 0;
        for &id in ids {
            // Of pieces of one triangle, one stands for all.
            if !lanes[..used].contains(&id) {
                lanes[used] = id;
                used += 1;
            }
        }
        // In ascending order, so that of equal hits the first lane has the one that counts.
        lanes[..used].sort_unstable();
        if self.geometry.is_sphere(ids[0]) {
            self.wide.spheres.push(sphere_block(self.geometry, lanes));
            Child::spheres(self.wide.spheres.len() - 1)
        } else {
            self.wide.triangles.push(triangle_block(self.geometry, lanes));
            Child::triangles(self.wide.triangles.len() - 1)
        }
    }
}

/// The box relative to the centre, rounded outward; one that is inside out stays so.
pub(super) fn relative_bounds(bounds: &Bounds3, center: Vec3) -> ([f32; 3], [f32; 3]) {
    if bounds.is_empty() {
        return ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    }
    // Covers the rounding of the difference, and keeps away from subnormal numbers.
    let slack = |v: Vec3| v.abs() * f32::EPSILON + f32::MIN_POSITIVE;
    let (low, high) = (bounds.min - center, bounds.max - center);
    ((low - slack(low)).to_array(), (high + slack(high)).to_array())
}

fn empty_node() -> WideNode {
    let row = [f32x8::splat(f32::INFINITY), f32x8::splat(f32::NEG_INFINITY)];
    WideNode { planes: [row; 3], children: [Child::node(0); WIDTH] }
}

/// A block of the triangles with these numbers.
pub(super) fn triangle_block(geometry: &Geometry<'_>, ids: [u32; BLOCK]) -> TriangleBlock {
    let mut coordinates = [[[f32::NAN; BLOCK]; 3]; 3];
    for (lane, &id) in ids.iter().enumerate().filter(|(_, id)| **id != NO_PRIMITIVE) {
        if let Primitive::Triangle(p) = geometry.primitive(id) {
            for (axis, rows) in coordinates.iter_mut().enumerate() {
                for (row, vertex) in rows.iter_mut().zip(p) {
                    row[lane] = vertex[axis];
                }
            }
        }
    }
    TriangleBlock { coordinates: coordinates.map(|rows| rows.map(Lanes::new)), ids }
}

/// A block of the spheres with these numbers.
pub(super) fn sphere_block(geometry: &Geometry<'_>, ids: [u32; BLOCK]) -> SphereBlock {
    let nothing = Sphere { center: Vec3::ZERO, radius: f32::NAN };
    let spheres = ids.map(|id| match (id != NO_PRIMITIVE).then(|| geometry.primitive(id)) {
        Some(Primitive::Sphere(s)) => s,
        _ => nothing,
    });
    SphereBlock { spheres, ids }
}
