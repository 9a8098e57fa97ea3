//! Full sweep: all partitions of the items in the order of their centroids along an axis.
//! [MacDonald & Booth 1990, "Heuristics for ray tracing using space subdivision"; Wald, Boulos &
//! Shirley 2007, "Ray Tracing Deformable Scenes using Dynamic Bounding Volume Hierarchies", §4]

use super::bins::{self, Binned};
use super::cost::{NODE_COST, RelativeArea, Search, leaf_cost};
use super::{Boxes, Halves, Item, SimdBounds};

/// Above this number of items, planes between bins are as good, and the items are binned.
const MAX: usize = 128;

/// Search for more items.
type Coarse = Binned<32>;

/// Search over all partitions in the order along each axis, for few items.
pub(super) struct Sweep;

#[derive(Clone, Copy)]
pub(super) enum SweepSplit {
    /// At a plane between bins.
    Plane(bins::BinSplit),
    /// The first `left` items in the order along `axis` go left.
    Order { axis: usize, left: usize },
}

impl Search for Sweep {
    type Split = SweepSplit;

    fn best(items: &mut [Item], boxes: &Boxes) -> Option<(f32, SweepSplit)> {
        if items.len() > MAX {
            let best = Coarse::best(items, boxes);
            return best.map(|(cost, split)| (cost, SweepSplit::Plane(split)));
        }
        let areas = RelativeArea::of(boxes.items);
        let mut costs = vec![0.0; items.len()];
        let mut best: Option<(f32, SweepSplit)> = None;
        for axis in 0..3 {
            sort(items, axis);
            let (cost, left) = cheapest(items, areas, &mut costs)?;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, SweepSplit::Order { axis, left }));
            }
        }
        best
    }

    fn part(items: &mut [Item], split: SweepSplit) -> Halves {
        match split {
            SweepSplit::Plane(split) => Coarse::part(items, split),
            SweepSplit::Order { axis, left } => {
                sort(items, axis);
                Halves::at(items, left)
            }
        }
    }
}

/// Sorts the items by their centroids along an axis, and those with equal centroids by all their
/// bits, so that the result does not depend on the initial order.
fn sort(items: &mut [Item], axis: usize) {
    let bits = |item: &Item| bytemuck::cast::<Item, [u32; 8]>(*item);
    items.sort_unstable_by(|a, b| {
        let order = a.centroid_along(axis).total_cmp(&b.centroid_along(axis));
        order.then_with(|| bits(a).cmp(&bits(b)))
    });
}

/// Returns the least cost of a partition of the items in their order, and the number in the first
/// part. `costs` has room for a number for each item.
fn cheapest(items: &[Item], areas: RelativeArea, costs: &mut [f32]) -> Option<(f32, usize)> {
    let mut extent = SimdBounds::EMPTY;
    for ((item, cost), count) in items.iter().zip(&mut *costs).rev().zip(1..) {
        extent = extent.union(item.extent());
        *cost = areas.get(extent) * leaf_cost(count);
    }
    extent = SimdBounds::EMPTY;
    let mut best: Option<(f32, usize)> = None;
    for ((item, right), count) in items.iter().zip(&costs[1..]).zip(1..) {
        extent = extent.union(item.extent());
        let cost = NODE_COST + areas.get(extent) * leaf_cost(count) + right;
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, count as usize));
        }
    }
    best
}
