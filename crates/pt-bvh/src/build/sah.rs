//! Binned surface area heuristic. [Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"]

use rayon::prelude::*;
use wide::f32x4;

use super::{CHUNK, Extent, Item, halvings, partition, push_leaf, split_at_median};
use crate::node::{MAX_DEPTH, Node};

/// Bins per axis.
const BINS: usize = 16;
/// Cost of visiting a node, where testing a block of primitives costs [`BLOCK_COST`].
const NODE_COST: f32 = 1.0;
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

/// Builds the tree over all items.
pub(super) fn build(items: &mut [Item], largest_leaf: usize, nodes: &mut Vec<Node>) {
    grow(items, 0, 0, largest_leaf, nodes);
}

/// Appends the subtree over `items`, of which the first has place `first` in the order.
/// The recursion is at most [`MAX_DEPTH`] deep.
fn grow(items: &mut [Item], first: u32, depth: usize, largest: usize, nodes: &mut Vec<Node>) {
    let (extent, centroids) = measure(items);
    let Some(split) = choose(items, extent, centroids, depth, largest) else {
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
            || grow(left, first, depth + 1, largest, nodes),
            || grow(right, middle, depth + 1, largest, &mut rest),
        );
        nodes[here].offset = (nodes.len() - here) as u32;
        nodes.append(&mut rest);
    } else {
        grow(left, first, depth + 1, largest, nodes);
        nodes[here].offset = (nodes.len() - here) as u32;
        grow(right, middle, depth + 1, largest, nodes);
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
fn choose(
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
    let best = if too_deep { None } else { best_split(items, extent, centroids) };
    let leaf_allowed = n <= largest;
    match best {
        Some(best) if !leaf_allowed || best.cost < leaf_cost(n as u32) => {
            let bins = Bins::new(centroids);
            Some(partition(items, |i| bins.index(i.centroid())[best.axis] < best.bin))
        }
        _ if leaf_allowed => None,
        _ => Some(split_at_median(items)),
    }
}

/// A plane between two bins.
#[derive(Clone, Copy)]
struct Split {
    cost: f32,
    axis: usize,
    /// Items in lower bins go left.
    bin: i32,
}

/// How centroids map to bins.
#[derive(Clone, Copy)]
struct Bins {
    base: f32x4,
    scale: f32x4,
}

impl Bins {
    fn new(centroids: Extent) -> Self {
        let low = centroids.bounds().min;
        let scale = centroids.diagonal().map(|d| {
            let scale = BINS as f32 * (1.0 - 1e-5) / d;
            // An axis without extent has one bin only.
            if scale.is_finite() { scale } else { 0.0 }
        });
        let four = |[x, y, z]: [f32; 3]| f32x4::new([x, y, z, 0.0]);
        Self { base: four(low.to_array()), scale: four(scale) }
    }

    /// The bin per axis.
    #[inline]
    fn index(&self, centroid: f32x4) -> [i32; 4] {
        let last = f32x4::splat((BINS - 1) as f32);
        let place = ((centroid - self.base) * self.scale).fast_max(f32x4::ZERO).fast_min(last);
        place.fast_trunc_int().to_array()
    }
}

/// What falls into each bin, for the three axes.
struct Histogram {
    extents: [[Extent; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Histogram {
    const EMPTY: Self = Self { extents: [[Extent::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };

    fn of(items: &[Item], bins: Bins) -> Self {
        let mut h = Self::EMPTY;
        for item in items {
            let index = bins.index(item.centroid());
            let extent = item.extent();
            for (axis, &bin) in index.iter().enumerate().take(3) {
                let bin = bin as usize & (BINS - 1);
                h.extents[axis][bin] = h.extents[axis][bin].union(extent);
                h.counts[axis][bin] += 1;
            }
        }
        h
    }

    fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.extents[axis][bin] = self.extents[axis][bin].union(other.extents[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }
}

/// The cheapest plane that leaves items on both sides; `None` when all centroids coincide.
fn best_split(items: &[Item], extent: Extent, centroids: Extent) -> Option<Split> {
    let bins = Bins::new(centroids);
    let histogram = if items.len() <= CHUNK {
        Histogram::of(items, bins)
    } else {
        let partial = items.par_chunks(CHUNK).map(|c| Histogram::of(c, bins));
        partial.reduce(|| Histogram::EMPTY, |a, b| a.merge(&b))
    };
    let areas = RelativeArea::of(extent);
    (0..3)
        .filter_map(|axis| sweep(&histogram, axis, areas))
        .reduce(|best, s| if s.cost < best.cost { s } else { best })
}

/// The cheapest plane across one axis.
fn sweep(histogram: &Histogram, axis: usize, areas: RelativeArea) -> Option<Split> {
    let (extents, counts) = (&histogram.extents[axis], &histogram.counts[axis]);
    let mut right_cost = [0.0; BINS];
    let (mut extent, mut count) = (Extent::EMPTY, 0);
    for bin in (1..BINS).rev() {
        extent = extent.union(extents[bin]);
        count += counts[bin];
        right_cost[bin] = if count == 0 { f32::NAN } else { areas.get(extent) * leaf_cost(count) };
    }
    let mut best: Option<Split> = None;
    (extent, count) = (Extent::EMPTY, 0);
    for bin in 1..BINS {
        extent = extent.union(extents[bin - 1]);
        count += counts[bin - 1];
        let cost = NODE_COST + areas.get(extent) * leaf_cost(count) + right_cost[bin];
        let valid = count > 0 && !right_cost[bin].is_nan();
        if valid && best.is_none_or(|b| cost < b.cost) {
            best = Some(Split { cost, axis, bin: bin as i32 });
        }
    }
    best
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
