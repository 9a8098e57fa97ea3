//! The surface area heuristic: nodes are split where the expected cost of a query is least.
//! [Goldsmith & Salmon 1987, "Automatic Creation of Object Hierarchies for Ray Tracing"]

use pt_math::Bounds3;
use wide::f32x4;

use super::bins::Binned;
use super::sweep::Sweep;
use super::{Boxes, Extent, Halves, Item, halvings, push_leaf, split_at_median};
use crate::Quality;
use crate::node::{MAX_DEPTH, Node};

/// Cost of visiting a node, where testing a block of primitives costs [`BLOCK_COST`].
pub(super) const NODE_COST: f32 = 1.0;
/// Cost of testing one block.
const BLOCK_COST: f32 = 1.0;
/// Primitives tested at once: a leaf costs as many blocks as it fills, the last maybe in part.
const BLOCK: u32 = crate::wide::BLOCK as u32;
/// log₂ of that.
pub(super) const LOG_BLOCK: u32 = BLOCK.trailing_zeros();
/// Subtrees at least this large are built by two threads.
const PARALLEL_SUBTREE: usize = 1024;

/// Cost of a leaf of `n` primitives.
#[inline]
pub(super) fn leaf_cost(n: u32) -> f32 {
    BLOCK_COST * n.div_ceil(BLOCK) as f32
}

/// Expected cost of a query in the tree, for a random line through the root box, in units of
/// [`NODE_COST`].  Σ A(node)/A(root) · cost(node)
pub(crate) fn tree_cost(nodes: &[Node]) -> f32 {
    let area = |n: &Node| f64::from(n.bounds().half_area());
    let Some(root) = nodes.first().map(area).filter(|&a| a > 0.0) else { return 0.0 };
    let cost = |n: &Node| if n.is_leaf() { leaf_cost(n.count) } else { NODE_COST };
    (nodes.iter().map(|n| area(n) * f64::from(cost(n))).sum::<f64>() / root) as f32
}

/// How to look for the cheapest way to part the items of a node.
pub(super) trait Search {
    /// Kind of split.
    type Split: Copy;

    /// The cheapest split that leaves items on both sides, and its cost, given the boxes of the
    /// items; `None` when it finds none. It may reorder the items.
    fn best(items: &mut [Item], boxes: &Boxes) -> Option<(f32, Self::Split)>;

    /// Moves the items that go left to the front.
    fn part(items: &mut [Item], split: Self::Split) -> Halves;
}

/// Builds the tree over all items, which have these boxes: its nodes, in pieces that follow one
/// another.
pub(super) fn build(
    items: &mut [Item],
    boxes: Boxes,
    quality: Quality,
    largest_leaf: usize,
) -> Vec<Vec<Node>> {
    let part = Part { items, boxes, first: 0, depth: 0 };
    match quality {
        Quality::Fast => grow_apart::<Binned<8>>(part, largest_leaf),
        Quality::Balanced => grow_apart::<Binned<16>>(part, largest_leaf),
        Quality::High => grow_apart::<Sweep>(part, largest_leaf),
    }
}

/// The nodes of all pieces.
pub(super) fn joined(pieces: Vec<Vec<Node>>) -> Vec<Node> {
    let mut nodes = pt_memory::with_capacity(pieces.iter().map(Vec::len).sum());
    for piece in pieces {
        nodes.extend(piece);
    }
    nodes
}

/// The items of a subtree.
struct Part<'a> {
    items: &'a mut [Item],
    boxes: Boxes,
    /// The place of the first item in the order of the tree.
    first: u32,
    depth: usize,
}

/// The nodes of a subtree, in pieces that follow one another: threads grow them side by side.
fn grow_apart<S: Search>(mut part: Part<'_>, largest: usize) -> Vec<Vec<Node>> {
    let halves = (part.items.len() >= PARALLEL_SUBTREE).then(|| choose::<S>(&mut part, largest));
    let Some(Some(halves)) = halves else {
        let mut nodes = Vec::new();
        grow::<S>(part, largest, &mut nodes);
        return vec![nodes];
    };
    let mut root = part.inner_node();
    let [left, right] = part.halves(&halves);
    let (left, right) =
        rayon::join(|| grow_apart::<S>(left, largest), || grow_apart::<S>(right, largest));
    root.offset = 1 + left.iter().map(Vec::len).sum::<usize>() as u32;
    let mut pieces = vec![vec![root]];
    pieces.extend(left);
    pieces.extend(right);
    pieces
}

/// Appends a subtree. The recursion is at most [`MAX_DEPTH`] deep.
fn grow<S: Search>(mut part: Part<'_>, largest: usize, nodes: &mut Vec<Node>) {
    let Some(halves) = choose::<S>(&mut part, largest) else {
        push_leaf(part.items, part.boxes.items, part.first, nodes);
        return;
    };
    let here = nodes.len();
    nodes.push(part.inner_node());
    let [left, right] = part.halves(&halves);
    grow::<S>(left, largest, nodes);
    nodes[here].offset = (nodes.len() - here) as u32;
    grow::<S>(right, largest, nodes);
}

impl<'a> Part<'a> {
    /// Its node, which is not yet told where the right child is.
    fn inner_node(&self) -> Node {
        let Bounds3 { min, max } = self.boxes.items.bounds();
        Node { min, offset: 0, max, count: 0 }
    }

    fn halves(self, halves: &Halves) -> [Part<'a>; 2] {
        let Self { items, first, depth, .. } = self;
        let (left, right) = items.split_at_mut(halves.left);
        let middle = first + left.len() as u32;
        let [l, r] = halves.boxes;
        let depth = depth + 1;
        [
            Part { items: left, boxes: l, first, depth },
            Part { items: right, boxes: r, first: middle, depth },
        ]
    }
}

/// Parts the items in two; `None` for a leaf.
fn choose<S: Search>(part: &mut Part<'_>, largest: usize) -> Option<Halves> {
    let Part { items, boxes, depth, .. } = part;
    let n = items.len();
    let leaf_allowed = n <= largest;
    let costs = leaf_cost(n as u32);
    // No split is cheaper than a single block.
    if leaf_allowed && costs <= NODE_COST {
        return None;
    }
    // Two levels are kept for a leaf of both kinds.
    let too_deep = *depth + 2 + halvings(n) > MAX_DEPTH;
    let best = if too_deep { None } else { S::best(items, boxes) };
    match best {
        Some((cost, split)) if !leaf_allowed || cost < costs => Some(S::part(items, split)),
        _ if leaf_allowed => None,
        _ => {
            let left = split_at_median(items);
            Some(Halves::at(items, left))
        }
    }
}

/// Areas as parts of that of one box, in units of its longest edge, so that they neither overflow
/// nor vanish.
#[derive(Clone, Copy)]
pub(super) struct RelativeArea {
    unit: f32,
    inverse: f32,
}

impl RelativeArea {
    pub(super) fn of(extent: Extent) -> Self {
        let longest = extent.diagonal().into_iter().fold(0.0, f32::max);
        let unit = if longest > 0.0 { (1.0 / longest).min(f32::MAX) } else { 0.0 };
        let whole = Self { unit, inverse: 1.0 }.get(extent);
        Self { unit, inverse: if whole > 0.0 { 1.0 / whole } else { 0.0 } }
    }

    #[inline]
    pub(super) fn get(self, extent: Extent) -> f32 {
        let [x, y, z] = extent.diagonal().map(|d| d * self.unit);
        (x * y + y * z + z * x) * self.inverse
    }

    /// Of three boxes, in the first three lanes.
    #[inline]
    pub(super) fn of_three(self, extents: [Extent; 3]) -> f32x4 {
        let [a, b, c] = extents.map(Extent::lanes_of_diagonal);
        let [x, y, z, _] = f32x4::transpose([a, b, c, f32x4::ZERO]);
        let unit = f32x4::splat(self.unit);
        let (x, y, z) = (x * unit, y * unit, z * unit);
        (x * y + y * z + z * x) * f32x4::splat(self.inverse)
    }
}
