//! Costs of trees by the surface area heuristic, and the contract of searches for splits.

use wide::f32x4;

use crate::build::{Boxes, Halves, Item, SimdBounds};
use crate::node::Node;

/// Cost of visiting a node, relative to [`BLOCK_COST`].
pub(super) const NODE_COST: f32 = 1.0;

/// Cost of testing one block of primitives.
const BLOCK_COST: f32 = 1.0;

/// [`crate::BLOCK`]. The cost of a leaf is proportional to its number of blocks, of which the last
/// may be partly filled.
const BLOCK: u32 = crate::BLOCK as u32;

/// log₂ of [`BLOCK`].
pub(super) const LOG_BLOCK: u32 = BLOCK.trailing_zeros();

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

/// Search for the cheapest partition of the items of a node.
pub(super) trait Search {
    /// Kind of split.
    type Split: Copy;

    /// Returns the cheapest split with items on both sides, and its cost, given the boxes of the
    /// items; `None` if there is none. May reorder the items.
    fn best(items: &mut [Item], boxes: &Boxes) -> Option<(f32, Self::Split)>;

    /// Moves the left items to the front.
    fn part(items: &mut [Item], split: Self::Split) -> Halves;
}

/// Areas relative to that of a reference box, computed in units of its longest edge, so that they
/// neither overflow nor underflow.
#[derive(Clone, Copy)]
pub(super) struct RelativeArea {
    unit: f32,
    inverse: f32,
}

impl RelativeArea {
    pub(super) fn of(extent: SimdBounds) -> Self {
        let longest = extent.diagonal().into_iter().fold(0.0, f32::max);
        let unit = if longest > 0.0 { (1.0 / longest).min(f32::MAX) } else { 0.0 };
        let whole = Self { unit, inverse: 1.0 }.get(extent);
        Self { unit, inverse: if whole > 0.0 { 1.0 / whole } else { 0.0 } }
    }

    #[inline]
    pub(super) fn get(self, extent: SimdBounds) -> f32 {
        let [x, y, z] = extent.diagonal().map(|d| d * self.unit);
        (x * y + y * z + z * x) * self.inverse
    }

    /// Relative areas of three boxes, in the first three lanes.
    #[inline]
    pub(super) fn of_three(self, extents: [SimdBounds; 3]) -> f32x4 {
        let [a, b, c] = extents.map(SimdBounds::lanes_of_diagonal);
        let [x, y, z, _] = f32x4::transpose([a, b, c, f32x4::ZERO]);
        let unit = f32x4::splat(self.unit);
        let (x, y, z) = (x * unit, y * unit, z * unit);
        (x * y + y * z + z * x) * f32x4::splat(self.inverse)
    }
}
