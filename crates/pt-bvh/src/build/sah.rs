//! The surface area heuristic: nodes are split where the expected cost of a query is least.
//! [Goldsmith & Salmon 1987, "Automatic Creation of Object Hierarchies for Ray Tracing"]

use rayon::prelude::*;

use super::bins::Binned;
use super::sweep::Sweep;
use super::{CHUNK, Extent, Item, halvings, push_leaf, split_at_median};
use crate::Quality;
use crate::node::{MAX_DEPTH, Node};

/// Cost of visiting a node, where testing a block of primitives costs [`BLOCK_COST`].
pub(super) const NODE_COST: f32 = 1.0;
/// Cost of testing one block.
const BLOCK_COST: f32 = 1.0;
/// Primitives tested at once: a leaf costs as many blocks as it fills, the last maybe in part.
const BLOCK: u32 = crate::wide::BLOCK as u32;
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
    /// items and of their centroids; `None` when it finds none. It may reorder the items.
    fn best(items: &mut [Item], extent: Extent, centroids: Extent) -> Option<(f32, Self::Split)>;

    /// Moves the items that go left to the front, and returns how many there are.
    fn part(items: &mut [Item], split: Self::Split, centroids: Extent) -> usize;
}

/// Builds the tree over all items.
pub(super) fn build(
    items: &mut [Item],
    quality: Quality,
    largest_leaf: usize,
    nodes: &mut Vec<Node>,
) {
    match quality {
        Quality::Fast => grow::<Binned<8>>(items, 0, 0, largest_leaf, nodes),
        Quality::Balanced => grow::<Binned<16>>(items, 0, 0, largest_leaf, nodes),
        Quality::High => grow::<Sweep>(items, 0, 0, largest_leaf, nodes),
    }
}

/// Appends the subtree over `items`, of which the first has place `first` in the order.
/// The recursion is at most [`MAX_DEPTH`] deep.
fn grow<S: Search>(
    items: &mut [Item],
    first: u32,
    depth: usize,
    largest: usize,
    nodes: &mut Vec<Node>,
) {
    let (extent, centroids) = measure(items);
    let Some(split) = choose::<S>(items, extent, centroids, depth, largest) else {
        push_leaf(items, first, nodes);
        return;
    };
    let here = nodes.len();
    let bounds = extent.bounds();
    nodes.push(Node { min: bounds.min, offset: 0, max: bounds.max, count: 0 });
    let parallel = items.len() >= PARALLEL_SUBTREE;
    let (left, right) = items.split_at_mut(split);
    let middle = first + split as u32;
    if parallel {
        let mut rest = Vec::new();
        rayon::join(
            || grow::<S>(left, first, depth + 1, largest, nodes),
            || grow::<S>(right, middle, depth + 1, largest, &mut rest),
        );
        nodes[here].offset = (nodes.len() - here) as u32;
        nodes.append(&mut rest);
    } else {
        grow::<S>(left, first, depth + 1, largest, nodes);
        nodes[here].offset = (nodes.len() - here) as u32;
        grow::<S>(right, middle, depth + 1, largest, nodes);
    }
}

/// The boxes of the items and of their centroids.
fn measure(items: &[Item]) -> (Extent, Extent) {
    let one = |items: &[Item]| {
        items.iter().fold((Extent::EMPTY, Extent::EMPTY), |(e, c), i| {
            (e.union(i.extent()), c.union(Extent::point(i.centroid())))
        })
    };
    if items.len() <= CHUNK {
        return one(items);
    }
    items
        .par_chunks(CHUNK)
        .map(one)
        .reduce(|| (Extent::EMPTY, Extent::EMPTY), |a, b| (a.0.union(b.0), a.1.union(b.1)))
}

/// Splits the items in two, and returns how many are on the left; `None` for a leaf.
fn choose<S: Search>(
    items: &mut [Item],
    extent: Extent,
    centroids: Extent,
    depth: usize,
    largest: usize,
) -> Option<usize> {
    let n = items.len();
    if n == 1 {
        return None;
    }
    // Two levels are kept for a leaf of both kinds.
    let too_deep = depth + 2 + halvings(n) > MAX_DEPTH;
    let best = if too_deep { None } else { S::best(items, extent, centroids) };
    let leaf_allowed = n <= largest;
    match best {
        Some((cost, split)) if !leaf_allowed || cost < leaf_cost(n as u32) => {
            Some(S::part(items, split, centroids))
        }
        _ if leaf_allowed => None,
        _ => Some(split_at_median(items)),
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
}
