//! Simple builder that splits at the mean of the centroids.

use super::{Item, SimdBounds, halvings, longest_axis, partition, push_leaf, split_at_median};
use crate::node::{MAX_DEPTH, Node};

/// Range of items whose node is still to be built.
struct Task {
    start: usize,
    end: usize,
    depth: usize,
    /// Inner node of which this is the right child.
    parent: Option<usize>,
}

/// Splits at the mean of the centroids, along the longest axis of their box, until at most
/// `largest_leaf` items are left. If the mean separates nothing, or the tree would become too deep,
/// splits at the median instead.
pub(super) fn build(items: &mut [Item], largest_leaf: usize, nodes: &mut Vec<Node>) {
    let mut stack = vec![Task { start: 0, end: items.len(), depth: 0, parent: None }];
    while let Some(Task { start, end, depth, parent }) = stack.pop() {
        let here = nodes.len();
        if let Some(parent) = parent {
            nodes[parent].offset = (here - parent) as u32;
        }
        let range = &mut items[start..end];
        let extent = SimdBounds::of(range);
        if range.len() <= largest_leaf {
            push_leaf(range, extent, start as u32, nodes);
            continue;
        }
        let bounds = extent.bounds();
        nodes.push(Node { min: bounds.min, offset: 0, max: bounds.max, count: 0 });
        let split = start + split(range, depth);
        stack.push(Task { start: split, end, depth: depth + 1, parent: Some(here) });
        stack.push(Task { start, end: split, depth: depth + 1, parent: None });
    }
}

fn split(items: &mut [Item], depth: usize) -> usize {
    if depth + 2 + halvings(items.len()) > MAX_DEPTH {
        return split_at_median(items);
    }
    let axis = longest_axis(SimdBounds::of_centroids(items).diagonal());
    let sum: f64 = items.iter().map(|i| f64::from(i.centroid_along(axis))).sum();
    let mean = sum / items.len() as f64;
    let split = partition(items, |i| f64::from(i.centroid_along(axis)) < mean);
    if split == 0 || split == items.len() { split_at_median(items) } else { split }
}
