//! From the binary tree to the wide one. Subtrees and leaves that fit a block become one; leaves
//! that do not are halved.

use pt_math::{Bounds3, Vec3};
use rayon::prelude::*;
use wide::f32x8;

use super::batch::STACK_MARGIN;
use super::batch::avx512::Avx512;
use super::forest::Forests;
use super::{
    BLOCK, Child, Lanes, NO_PRIMITIVE, Size, SphereBlock, TriangleBlock, WIDTH, WideBvh, WideNode,
};
use crate::geometry::{Geometry, Primitive, Sphere};
use crate::memory;
use crate::node::Bvh2;
use crate::ray::Scene;

/// A part of the binary tree.
#[derive(Clone, Copy)]
struct Part {
    bounds: Bounds3,
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

/// Up to eight parts, which make up another.
struct Parts {
    parts: [Part; WIDTH],
    count: usize,
}

impl Parts {
    const NONE: Self = {
        let content = Content::Run { first: 0, count: 0 };
        Self { parts: [Part { bounds: Bounds3::EMPTY, content }; WIDTH], count: 0 }
    };

    fn push(&mut self, part: Part) {
        self.parts[self.count] = part;
        self.count += 1;
    }
}

struct Collapse<'a> {
    bvh: &'a Bvh2,
    geometry: &'a Geometry<'a>,
    forests: Forests<'a>,
    scene: Scene,
    nodes: Vec<WideNode>,
    /// Where the primitives of each block are in the order of the binary tree, and how many.
    triangles: Vec<(usize, usize)>,
    spheres: Vec<(usize, usize)>,
    /// Nodes on the longest way down so far.
    levels: usize,
}

impl WideBvh {
    /// Makes the wide tree.
    pub(crate) fn new(bvh: &Bvh2, geometry: &Geometry<'_>) -> Self {
        if bvh.nodes.is_empty() {
            return Self::default();
        }
        let mut collapse = Collapse {
            bvh,
            geometry,
            forests: Forests::new(bvh, geometry),
            scene: Scene::new(&bvh.bounds()),
            nodes: Vec::new(),
            triangles: Vec::new(),
            spheres: Vec::new(),
            levels: 0,
        };
        let root = collapse.part(0);
        collapse.push_node(root, 1);
        let Collapse { forests, scene, nodes, triangles, spheres, levels, .. } = collapse;
        // Makes room for the blocks, the largest part of the tree.
        drop(forests);
        let ids = |&(first, count): &(usize, usize)| lanes(&bvh.order[first..first + count]);
        let mut blocks = memory::with_capacity(triangles.len());
        let triangles = triangles.par_iter().map(|run| triangle_block(geometry, ids(run)));
        triangles.collect_into_vec(&mut blocks);
        let spheres = spheres.par_iter().map(|run| sphere_block(geometry, ids(run)));
        let mut wide = Self {
            nodes,
            triangles: blocks,
            spheres: spheres.collect(),
            scene,
            stack_size: stack_size(levels),
            avx512: Avx512::detect(),
            size: Size::Empty,
        };
        wide.set_size();
        wide.sort_children();
        wide
    }
}

impl Collapse<'_> {
    fn part(&self, i: usize) -> Part {
        let node = &self.bvh.nodes[i];
        let is_run = node.is_leaf() || self.forests.is_small(i);
        let content = if is_run { self.all_below(i) } else { Content::Subtree(i) };
        Part { bounds: node.bounds(), content }
    }

    /// The primitives below node `i`.
    fn all_below(&self, i: usize) -> Content {
        let mut leftmost = i;
        while !self.bvh.nodes[leftmost].is_leaf() {
            leftmost = self.bvh.children(leftmost)[0];
        }
        let first = self.bvh.nodes[leftmost].offset as usize;
        Content::Run { first, count: self.forests.count(i) }
    }

    /// Some of the primitives of a leaf with this box, which may hold pieces of them only.
    fn run(&self, first: usize, count: usize, within: Bounds3) -> Part {
        let ids = &self.bvh.order[first..first + count];
        let bounds = ids.iter().filter_map(|&id| self.geometry.primitive(id).bounds());
        let all = bounds.fold(Bounds3::EMPTY, Bounds3::union);
        let bounds = Bounds3 { min: all.min.max(within.min), max: all.max.min(within.max) };
        Part { bounds, content: Content::Run { first, count } }
    }

    /// Adds the node for a part, and everything below it; returns its index. The recursion is no
    /// deeper than the binary tree, plus the few halvings of a large leaf.
    fn push_node(&mut self, part: Part, level: usize) -> usize {
        self.levels = self.levels.max(level);
        let parts = self.open(part);
        let index = self.nodes.len();
        self.nodes.push(empty_node());
        for (slot, part) in parts.parts[..parts.count].iter().enumerate() {
            self.nodes[index].set_box(slot, relative_bounds(&part.bounds, &self.scene));
            let child = match part.content {
                Content::Run { first, count } if count <= BLOCK => self.push_block(first, count),
                _ => Child::node(self.push_node(*part, level + 1)),
            };
            self.nodes[index].children[slot] = child;
        }
        index
    }

    /// Up to eight parts that make up this one.
    fn open(&self, part: Part) -> Parts {
        let mut parts = Parts::NONE;
        match part.content {
            Content::Subtree(i) => self.forests.each_root(i, |root| parts.push(self.part(root))),
            Content::Run { first, count } => self.eighths(first, count, part.bounds, &mut parts),
        }
        parts
    }

    /// A run that does not fit a block, halved and halved again; or one that does.
    fn eighths(&self, first: usize, count: usize, within: Bounds3, parts: &mut Parts) {
        let mut runs = vec![(first, count)];
        while runs.len() < WIDTH && runs.iter().any(|&(_, count)| count > BLOCK) {
            let halves = |(first, count): (usize, usize)| {
                let half = if count > BLOCK { count / 2 } else { 0 };
                [(first, half), (first + half, count - half)]
            };
            runs = runs.into_iter().flat_map(halves).filter(|run| run.1 > 0).collect();
        }
        for (first, count) in runs {
            parts.push(self.run(first, count, within));
        }
    }

    fn push_block(&mut self, first: usize, count: usize) -> Child {
        if self.geometry.is_sphere(self.bvh.order[first]) {
            self.spheres.push((first, count));
            Child::spheres(self.spheres.len() - 1)
        } else {
            self.triangles.push((first, count));
            Child::triangles(self.triangles.len() - 1)
        }
    }
}

/// The numbers of a block's primitives, in ascending order, so that of equal hits the first lane
/// has the one that counts.
fn lanes(ids: &[u32]) -> [u32; BLOCK] {
    let mut lanes = [NO_PRIMITIVE; BLOCK];
    let mut used = 0;
    for &id in ids {
        // Of pieces of one triangle, one stands for all.
        if !lanes[..used].contains(&id) {
            lanes[used] = id;
            used += 1;
        }
    }
    lanes[..used].sort_unstable();
    lanes
}

/// The box relative to the centre of the scene, widened and rounded outward; one that is inside out
/// stays so.
pub(super) fn relative_bounds(bounds: &Bounds3, scene: &Scene) -> ([f32; 3], [f32; 3]) {
    if bounds.is_empty() {
        return ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    }
    // Covers the rounding of both differences as well.
    let slack = |v: Vec3| v.abs() * f32::EPSILON + scene.padded;
    let center = Vec3::from(scene.center);
    let (low, high) = (bounds.min - center, bounds.max - center);
    ((low - slack(low)).to_array(), (high + slack(high)).to_array())
}

impl WideNode {
    /// Sets the box of a child: its least and greatest corner.
    fn set_box(&mut self, slot: usize, (low, high): ([f32; 3], [f32; 3])) {
        for (axis, [least, greatest]) in self.planes.iter_mut().enumerate() {
            least.as_mut_array()[slot] = low[axis];
            greatest.as_mut_array()[slot] = high[axis];
        }
    }
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
