//! The surface area heuristic: nodes are split where the expected cost of a query is least.
//! [Goldsmith & Salmon 1987, "Automatic Creation of Object Hierarchies for Ray Tracing"]

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
const PARALLEL_SUBTREE: usize = 4096;

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
    /// What to do.
    type Split: Copy;

    /// The cheapest split that leaves items on both sides, and its cost, given the boxes of the
    /// items; `None` when it finds none. It may reorder the items.
    fn best(items: &mut [Item], boxes: &Boxes) -> Option<(f32, Self::Split)>;

    /// Moves the items that go left to the front.
    fn part(items: &mut [Item], split: Self::Split, boxes: &Boxes) -> Halves;
}

/// Builds the tree over all items.
pub(super) fn build(
    items: &mut [Item],
    quality: Quality,
    largest_leaf: usize,
    nodes: &mut Vec<Node>,
) {
    let boxes = Boxes::of(items);
    let part = Part { items, boxes, first: 0, depth: 0 };
    match quality {
        Quality::Fast => grow::<Binned<8>>(part, largest_leaf, nodes),
        Quality::Balanced => grow::<Binned<16>>(part, largest_leaf, nodes),
        Quality::High => grow::<Sweep>(part, largest_leaf, nodes),
    }
}

/// The items of a subtree.
struct Part<'a> {
    items: &'a mut [Item],
    boxes: Boxes,
    /// The place of the first item in the order of the tree.
    first: u32,
    depth: usize,
}

/// Appends a subtree. The recursion is at most [`MAX_DEPTH`] deep.
fn grow<S: Search>(mut part: Part<'_>, largest: usize, nodes: &mut Vec<Node>) {
    let Some(halves) = choose::<S>(&mut part, largest) else {
        push_leaf(part.items, part.boxes.items, part.first, nodes);
        return;
    };
    let parallel = part.items.len() >= PARALLEL_SUBTREE;
    let here = nodes.len();
    let bounds = part.boxes.items.bounds();
    nodes.push(Node { min: bounds.min, offset: 0, max: bounds.max, count: 0 });
    let [left, right] = part.halves(&halves);
    if parallel {
        let mut rest = Vec::new();
        rayon::join(|| grow::<S>(left, largest, nodes), || grow::<S>(right, largest, &mut rest));
        nodes[here].offset = (nodes.len() - here) as u32;
        nodes.append(&mut rest);
    } else {
        grow::<S>(left, largest, nodes);
        nodes[here].offset = (nodes.len() - here) as u32;
        grow::<S>(right, largest, nodes);
    }
}

impl<'a> Part<'a> {
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
        Some((cost, split)) if !leaf_allowed || cost < costs => Some(S::part(items, split, boxes)),
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
