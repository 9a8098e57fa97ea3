//! Conversion of the binary tree to the wide one. Subtrees and leaves that fit a block become one
//! block; leaves that do not fit are halved.

use pt_math::{Bounds3, Vec3};
use rayon::prelude::*;
use wide::f32x8;

use super::batch::STACK_MARGIN;
use super::batch::avx512::Avx512;
use super::collapse_cost::CollapseCosts;
use super::{
    BLOCK, BlockLanes, ChildRef, NO_PRIMITIVE, SizeClass, SphereBlock, TriangleBlock, WIDTH,
    WideBvh, WideNode,
};
use crate::build::tidy;
use crate::geometry::{Geometry, Primitive, Sphere};
use crate::node::Bvh2;
use crate::ray::SceneExtent;

/// Part of the binary tree.
#[derive(Clone, Copy)]
struct TreePart {
    bounds: Bounds3,
    content: PartContent,
}

#[derive(Clone, Copy)]
enum PartContent {
    /// Subtree of an inner node.
    Subtree(usize),
    /// Consecutive primitives, of one kind, in the order of the tree.
    Run { first: usize, count: usize },
}

/// Stack size for a ray of a batch in a tree with `levels` nodes on the longest path.
pub(super) fn stack_size(levels: usize) -> usize {
    1 + (WIDTH - 1) * levels + STACK_MARGIN
}

/// Partition of a part into up to eight others.
struct TreePartition {
    parts: [TreePart; WIDTH],
    count: usize,
}

impl TreePartition {
    const NONE: Self = {
        let content = PartContent::Run { first: 0, count: 0 };
        Self { parts: [TreePart { bounds: Bounds3::EMPTY, content }; WIDTH], count: 0 }
    };

    fn push(&mut self, part: TreePart) {
        self.parts[self.count] = part;
        self.count += 1;
    }
}

/// Converter from parts of the binary tree to wide nodes.
struct Collapse<'a> {
    bvh: &'a Bvh2,
    geometry: &'a Geometry<'a>,
    forests: CollapseCosts<'a>,
    scene: SceneExtent,
}

/// Consecutive nodes, the first of which is the root of the others, and their blocks. Nodes refer
/// to nodes and blocks by index within the piece.
#[derive(Default)]
struct SubtreePiece {
    nodes: Vec<WideNode>,
    /// First index in the order of the binary tree, and number of primitives, of each block.
    triangles: Vec<(usize, usize)>,
    spheres: Vec<(usize, usize)>,
    /// Number of nodes on the longest path from the root so far.
    levels: usize,
}

/// Minimum number of primitives of a subtree that is split into several pieces, which are built in
/// parallel.
const LARGE_PART: usize = 8192;

impl WideBvh {
    /// Converts a binary tree.
    pub(crate) fn new(bvh: &Bvh2, geometry: &Geometry<'_>) -> Self {
        if bvh.nodes.is_empty() {
            return Self::default();
        }
        let forests = CollapseCosts::new(bvh, geometry);
        let collapse = Collapse { bvh, geometry, forests, scene: SceneExtent::new(&bvh.bounds()) };
        let whole = joined(&collapse.pieces(collapse.part(0), 1));
        let Collapse { forests, scene, .. } = collapse;
        // Frees memory for the blocks, the largest part of the tree.
        drop(forests);
        tidy(bvh.order.len());
        let ids = |&(first, count): &(usize, usize)| lanes(&bvh.order[first..first + count]);
        let mut triangles = pt_memory::with_capacity(whole.triangles.len());
        let blocks = whole.triangles.par_iter().map(|run| triangle_block(geometry, ids(run)));
        blocks.collect_into_vec(&mut triangles);
        let spheres = whole.spheres.par_iter().map(|run| sphere_block(geometry, ids(run)));
        let mut wide = Self {
            nodes: whole.nodes,
            triangles,
            spheres: spheres.collect(),
            scene,
            stack_size: stack_size(whole.levels),
            avx512: Avx512::detect(),
            size: SizeClass::Empty,
        };
        wide.set_size();
        wide.sort_children();
        wide
    }
}

/// Concatenates all pieces.
fn joined(pieces: &[SubtreePiece]) -> SubtreePiece {
    let mut whole = SubtreePiece {
        nodes: pt_memory::with_capacity(pieces.iter().map(|piece| piece.nodes.len()).sum()),
        ..SubtreePiece::default()
    };
    for piece in pieces {
        let before = [whole.nodes.len(), whole.triangles.len(), whole.spheres.len()];
        whole.nodes.extend(piece.nodes.iter().map(|node| node.moved(before)));
        whole.triangles.extend(&piece.triangles);
        whole.spheres.extend(&piece.spheres);
        whole.levels = whole.levels.max(piece.levels);
    }
    whole
}

impl SubtreePiece {
    fn push_block(&mut self, collapse: &Collapse<'_>, first: usize, count: usize) -> ChildRef {
        if collapse.geometry.is_sphere(collapse.bvh.order[first]) {
            self.spheres.push((first, count));
            ChildRef::spheres(self.spheres.len() - 1)
        } else {
            self.triangles.push((first, count));
            ChildRef::triangles(self.triangles.len() - 1)
        }
    }

    /// Appends the node of a part, and everything below it; returns its index. The recursion is no
    /// deeper than the binary tree, plus the few halvings of a large leaf.
    fn push_node(&mut self, collapse: &Collapse<'_>, part: TreePart, level: usize) -> usize {
        self.levels = self.levels.max(level);
        let parts = collapse.open(part);
        let index = self.nodes.len();
        self.nodes.push(collapse.node(&parts));
        for (slot, part) in parts.parts[..parts.count].iter().enumerate() {
            let child = match part.block() {
                Some((first, count)) => self.push_block(collapse, first, count),
                None => ChildRef::node(self.push_node(collapse, *part, level + 1)),
            };
            self.nodes[index].children[slot] = child;
        }
        index
    }
}

impl TreePart {
    /// Primitives of the part, if they fit a block.
    fn block(&self) -> Option<(usize, usize)> {
        match self.content {
            PartContent::Run { first, count } if count <= BLOCK => Some((first, count)),
            _ => None,
        }
    }
}

impl Collapse<'_> {
    /// Builds the nodes of a part, and everything below it.
    fn pieces(&self, part: TreePart, level: usize) -> Vec<SubtreePiece> {
        let is_large =
            matches!(part.content, PartContent::Subtree(i) if self.forests.count(i) >= LARGE_PART);
        let mut top = SubtreePiece { levels: level, ..SubtreePiece::default() };
        if !is_large {
            top.push_node(self, part, level);
            return vec![top];
        }
        let parts = self.open(part);
        let mut node = self.node(&parts);
        let parts = &parts.parts[..parts.count];
        let below = |part: &TreePart| match part.block() {
            Some(_) => Vec::new(),
            None => self.pieces(*part, level + 1),
        };
        let below: Vec<Vec<SubtreePiece>> = parts.par_iter().map(below).collect();
        let mut nodes = 1;
        for (slot, (part, below)) in parts.iter().zip(&below).enumerate() {
            node.children[slot] = match part.block() {
                Some((first, count)) => top.push_block(self, first, count),
                None => ChildRef::node(nodes),
            };
            nodes += below.iter().map(|piece| piece.nodes.len()).sum::<usize>();
        }
        top.nodes.push(node);
        std::iter::once(top).chain(below.into_iter().flatten()).collect()
    }

    /// Node of some parts, without its children.
    fn node(&self, parts: &TreePartition) -> WideNode {
        let mut node = empty_node();
        for (slot, part) in parts.parts[..parts.count].iter().enumerate() {
            node.set_box(slot, relative_bounds(&part.bounds, &self.scene));
        }
        node
    }

    fn part(&self, i: usize) -> TreePart {
        let node = &self.bvh.nodes[i];
        let is_run = node.is_leaf() || self.forests.is_small(i);
        let content = if is_run { self.all_below(i) } else { PartContent::Subtree(i) };
        TreePart { bounds: node.bounds(), content }
    }

    /// Primitives below node `i`.
    fn all_below(&self, i: usize) -> PartContent {
        let mut leftmost = i;
        while !self.bvh.nodes[leftmost].is_leaf() {
            leftmost = self.bvh.children(leftmost)[0];
        }
        let first = self.bvh.nodes[leftmost].offset as usize;
        PartContent::Run { first, count: self.forests.count(i) }
    }

    /// Some of the primitives of a leaf with this box, which may contain only pieces of them.
    fn run(&self, first: usize, count: usize, within: Bounds3) -> TreePart {
        let ids = &self.bvh.order[first..first + count];
        let bounds = ids.iter().filter_map(|&id| self.geometry.primitive(id).bounds());
        let all = bounds.fold(Bounds3::EMPTY, Bounds3::union);
        let bounds = Bounds3 { min: all.min.max(within.min), max: all.max.min(within.max) };
        TreePart { bounds, content: PartContent::Run { first, count } }
    }

    /// Partitions a part into up to eight.
    fn open(&self, part: TreePart) -> TreePartition {
        let mut parts = TreePartition::NONE;
        match part.content {
            PartContent::Subtree(i) => {
                self.forests.each_root(i, |root| parts.push(self.part(root)));
            }
            PartContent::Run { first, count } => {
                self.eighths(first, count, part.bounds, &mut parts);
            }
        }
        parts
    }

    /// Halves a run repeatedly until the parts fit blocks, or there are eight.
    fn eighths(&self, first: usize, count: usize, within: Bounds3, parts: &mut TreePartition) {
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
}

/// Numbers of a block's primitives, in ascending order, so that of equal hits the first lane has
/// the primitive that wins.
fn lanes(ids: &[u32]) -> [u32; BLOCK] {
    let mut lanes = [NO_PRIMITIVE; BLOCK];
    let mut used = 0;
    for &id in ids {
        // Pieces of one triangle need a single entry.
        if !lanes[..used].contains(&id) {
            lanes[used] = id;
            used += 1;
        }
    }
    lanes[..used].sort_unstable();
    lanes
}

/// Box relative to the centre of the scene, widened and rounded outward; an empty box stays empty.
pub(super) fn relative_bounds(bounds: &Bounds3, scene: &SceneExtent) -> ([f32; 3], [f32; 3]) {
    if bounds.is_empty() {
        return ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    }
    // Also covers the rounding of both differences.
    let error_bound = |v: Vec3| v.abs() * f32::EPSILON + scene.padded;
    let center = Vec3::from(scene.center);
    let (low, high) = (bounds.min - center, bounds.max - center);
    ((low - error_bound(low)).to_array(), (high + error_bound(high)).to_array())
}

impl WideNode {
    /// The same node after `nodes` other nodes and these numbers of blocks.
    fn moved(&self, [nodes, triangles, spheres]: [usize; 3]) -> Self {
        let children =
            self.children.map(|child| match child.0 & (ChildRef::TRIANGLES | ChildRef::SPHERES) {
                _ if child == ChildRef::VACANT => child,
                ChildRef::TRIANGLES => ChildRef(child.0 + triangles as u32),
                ChildRef::SPHERES => ChildRef(child.0 + spheres as u32),
                _ => ChildRef(child.0 + nodes as u32),
            });
        Self { children, ..*self }
    }

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
    WideNode { planes: [row; 3], children: [ChildRef::VACANT; WIDTH] }
}

/// Block of the triangles with these numbers.
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
    TriangleBlock { coordinates: coordinates.map(|rows| rows.map(BlockLanes::new)), ids }
}

/// Block of the spheres with these numbers.
pub(super) fn sphere_block(geometry: &Geometry<'_>, ids: [u32; BLOCK]) -> SphereBlock {
    let nothing = Sphere { center: Vec3::ZERO, radius: f32::NAN };
    let spheres = ids.map(|id| match (id != NO_PRIMITIVE).then(|| geometry.primitive(id)) {
        Some(Primitive::Sphere(s)) => s,
        _ => nothing,
    });
    SphereBlock { spheres, ids }
}
