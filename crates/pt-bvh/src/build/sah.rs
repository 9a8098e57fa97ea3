//! The surface area heuristic: nodes are split where the expected cost of a query is least.
//! [Goldsmith & Salmon 1987, "Automatic Creation of Object Hierarchies for Ray Tracing"]

use pt_math::Bounds3;

use super::bins::Binned;
use super::sweep::Sweep;
use super::{Boxes, Halves, Item, halvings, push_leaf, split_at_median};
use crate::Quality;
use crate::build::cost::{NODE_COST, Search, leaf_cost};
use crate::node::{MAX_DEPTH, Node};

/// Minimum number of items for which the two halves are built in parallel.
const PARALLEL_SUBTREE: usize = 1024;

/// Builds the tree over all items, which have these boxes. Returns its nodes in consecutive pieces.
pub(super) fn build(
    items: &mut [Item],
    boxes: Boxes,
    quality: Quality,
    largest_leaf: usize,
) -> Vec<Vec<Node>> {
    let part = SubtreeItems { items, boxes, first: 0, depth: 0 };
    match quality {
        Quality::Fast => grow_apart::<Binned<8>>(part, largest_leaf),
        Quality::Balanced => grow_apart::<Binned<16>>(part, largest_leaf),
        Quality::High => grow_apart::<Sweep>(part, largest_leaf),
    }
}

/// Concatenates the nodes of all pieces.
pub(super) fn joined(pieces: Vec<Vec<Node>>) -> Vec<Node> {
    let mut nodes = pt_memory::with_capacity(pieces.iter().map(Vec::len).sum());
    for piece in pieces {
        nodes.extend(piece);
    }
    nodes
}

/// Items of a subtree.
struct SubtreeItems<'a> {
    items: &'a mut [Item],
    boxes: Boxes,
    /// Index of the first item in the order of the tree.
    first: u32,
    depth: usize,
}

/// Builds a subtree in parallel; returns its nodes in consecutive pieces.
fn grow_apart<S: Search>(mut part: SubtreeItems<'_>, largest: usize) -> Vec<Vec<Node>> {
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
fn grow<S: Search>(mut part: SubtreeItems<'_>, largest: usize, nodes: &mut Vec<Node>) {
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

impl<'a> SubtreeItems<'a> {
    /// Inner node of this part; the offset of its right child is still to be set.
    fn inner_node(&self) -> Node {
        let Bounds3 { min, max } = self.boxes.items.bounds();
        Node { min, offset: 0, max, count: 0 }
    }

    fn halves(self, halves: &Halves) -> [SubtreeItems<'a>; 2] {
        let Self { items, first, depth, .. } = self;
        let (left, right) = items.split_at_mut(halves.left);
        let middle = first + left.len() as u32;
        let [l, r] = halves.boxes;
        let depth = depth + 1;
        [
            SubtreeItems { items: left, boxes: l, first, depth },
            SubtreeItems { items: right, boxes: r, first: middle, depth },
        ]
    }
}

/// Partitions the items in two; `None` for a leaf.
fn choose<S: Search>(part: &mut SubtreeItems<'_>, largest: usize) -> Option<Halves> {
    let SubtreeItems { items, boxes, depth, .. } = part;
    let n = items.len();
    let leaf_allowed = n <= largest;
    let costs = leaf_cost(n as u32);
    // No split is cheaper than a single block.
    if leaf_allowed && costs <= NODE_COST {
        return None;
    }
    // Two levels are reserved for a leaf with both kinds of primitives.
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
