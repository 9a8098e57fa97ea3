//! Post-build optimization that moves subtrees to cheaper positions.
//!
//! A top-down builder does not foresee the cost of a split further below. In the finished tree,
//! each subtree can be considered by itself. If it is removed, its sibling takes the place of its
//! parent, and the boxes above shrink. If it is inserted beside another node, both get a new
//! parent, and the boxes above that one grow. Leaves do not change, so only the sum of the areas of
//! inner nodes does.
//!
//! A pass searches for the best position of each node in parallel, in the unmodified tree, and then
//! applies the moves in order of decreasing gain, skipping those that touch nodes already moved. So
//! the tree is the same for any number of threads. [Bittner, Hapala & Havran 2013, "Fast
//! Insertion-Based Optimization of Bounding Volume Hierarchies"; Meister & Bittner 2018, "Parallel
//! Reinsertion for Bounding Volume Hierarchy Optimization", §4]
//!
//! Most of the gain comes from the largest nodes, which are few. The others, with everything below
//! them, can be left unchanged.

use std::collections::BinaryHeap;

use pt_math::Bounds3;
use rayon::prelude::*;

use crate::Quality;
use crate::node::{Bvh2, MAX_DEPTH, Node};

/// Maximum number of positions that a search visits. In ordinary meshes searches end earlier, or
/// gain nothing by more; with large overlapping boxes they would visit all.
const MAX_VISITS: usize = 256;
/// Minimum number of searches per task.
const SEARCHES: usize = 32;
const ROOT: usize = 0;

/// Extent of the optimization.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReinsertionEffort {
    /// Number of nodes per large node: one node in `large` is optimized.
    large: usize,
    /// Maximum number of passes.
    passes: usize,
    /// Relative reduction of the area below which a pass is the last.
    least_gain: f64,
}

impl ReinsertionEffort {
    /// Returns the effort for a quality. Measured on a building, where the first planes of the
    /// builder cut through walls and floors: with one node of 32 trees cost 0.70 times as much.
    /// With all nodes they cost 0.65 times as much, but that takes longer than the rest of the
    /// build.
    pub(super) fn of(quality: Quality) -> Option<Self> {
        match quality {
            Quality::Fast => None,
            Quality::Balanced => Some(Self { large: 32, passes: 16, least_gain: 0.01 }),
            Quality::High => Some(Self { large: 1, passes: 16, least_gain: 0.001 }),
        }
    }
}

/// Moves subtrees that are cheaper elsewhere. If the tree would become deeper than [`MAX_DEPTH`],
/// it is returned unchanged.
pub(super) fn reinsert(bvh: Bvh2, effort: ReinsertionEffort) -> Bvh2 {
    let mut tree = LargeNodeTree::of(&bvh, bvh.nodes.len() / effort.large);
    let mut before = tree.area_of_inner_nodes();
    let mut is_changed = false;
    for _ in 0..effort.passes {
        if !tree.pass() {
            break;
        }
        is_changed = true;
        let after = tree.area_of_inner_nodes();
        if after > before * (1.0 - effort.least_gain) {
            break;
        }
        before = after;
    }
    if !is_changed {
        return bvh;
    }
    let new = tree.in_order(&bvh);
    if new.depth() as usize <= MAX_DEPTH { new } else { bvh }
}

/// Node with links to its parent and children.
#[derive(Clone, Copy)]
struct Link {
    bounds: Bounds3,
    /// Index of the parent; the root is its own parent.
    parent: usize,
    /// `None` for a leaf, and for a node that is left unchanged.
    children: Option<[usize; 2]>,
    /// Index in the binary tree, and the index after its whole subtree.
    places: [usize; 2],
}

/// Large nodes of a tree and their children; the root first.
struct LargeNodeTree(Vec<Link>);

/// Move of a node to a better position: as the sibling of `beside`.
#[derive(Clone, Copy)]
struct Move {
    node: usize,
    beside: usize,
    /// Area saved.
    gain: f64,
}

/// Half the area of a box; does not overflow.
fn area(bounds: Bounds3) -> f64 {
    let d = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    d.x * d.y + d.y * d.z + d.z * d.x
}

impl LargeNodeTree {
    /// Extracts the `large` inner nodes with the largest areas.
    fn of(bvh: &Bvh2, large: usize) -> Self {
        let link = |parent, places: [usize; 2]| Link {
            bounds: bvh.nodes[places[0]].bounds(),
            parent,
            children: None,
            places,
        };
        let mut links = vec![link(ROOT, [0, bvh.nodes.len()])];
        // Areas are nonnegative, so their bits have the same order.
        let key = |i: usize, link: &Link| (area(link.bounds).to_bits(), usize::MAX - i);
        let mut heap: BinaryHeap<(u64, usize)> = BinaryHeap::from([key(ROOT, &links[ROOT])]);
        for _ in 0..large {
            let Some((_, i)) = heap.pop() else { break };
            let i = usize::MAX - i;
            let [here, end] = links[i].places;
            let first = links.len();
            let [left, right] = bvh.children(here);
            links[i].children = Some([first, first + 1]);
            for (child, places) in [(first, [left, right]), (first + 1, [right, end])] {
                let link = link(i, places);
                if !bvh.nodes[places[0]].is_leaf() {
                    heap.push(key(child, &link));
                }
                links.push(link);
            }
        }
        Self(links)
    }

    fn sibling(&self, node: usize) -> usize {
        let children = self.0[self.0[node].parent].children.unwrap_or([node; 2]);
        children[usize::from(children[0] == node)]
    }

    fn area_of_inner_nodes(&self) -> f64 {
        self.0.iter().filter(|link| link.children.is_some()).map(|link| area(link.bounds)).sum()
    }

    /// Moves nodes to better positions; returns true if any node has one.
    fn pass(&mut self) -> bool {
        let nodes = (0..self.0.len()).into_par_iter().with_min_len(SEARCHES);
        let moves = nodes.map_init(Vec::new, |stack, node| self.best_move(node, stack)).flatten();
        let mut moves: Vec<Move> = moves.collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut is_touched = vec![false; self.0.len()];
        for &Move { node, beside, .. } in &moves {
            let parent = self.0[node].parent;
            let parents = [parent, self.0[parent].parent, self.0[beside].parent];
            let [a, b, c] = parents;
            let touched = [node, beside, self.sibling(node), a, b, c];
            if !touched.iter().any(|&i| is_touched[i]) && !self.is_within(beside, node) {
                for i in touched {
                    is_touched[i] = true;
                }
                self.put_beside(node, beside);
            }
        }
        self.refit();
        !moves.is_empty()
    }

    /// Returns true if `node` is `other` or below it.
    fn is_within(&self, mut node: usize, other: usize) -> bool {
        while node != other && node != ROOT {
            node = self.0[node].parent;
        }
        node == other
    }

    /// Returns the move that saves most; `None` if no move saves area, and for the root and its
    /// children. `stack` is scratch space for the traversal.
    ///
    /// On the way up, the search accumulates the area saved by removing the node. On the way down
    /// into the siblings of its ancestors, it subtracts the growth of the boxes. It goes on while
    /// the remainder exceeds the least area of a new parent by more than the best gain.
    fn best_move(&self, node: usize, stack: &mut Vec<(usize, f64)>) -> Option<Move> {
        let Link { bounds, parent, .. } = self.0[node];
        if node == ROOT || parent == ROOT {
            return None;
        }
        let least = area(bounds);
        let own_sibling = self.sibling(node);
        let mut best = Move { node, beside: node, gain: 0.0 };
        let mut saved = area(self.0[parent].bounds);
        let (mut pivot, mut sibling) = (parent, own_sibling);
        // Box of the pivot without the node.
        let mut rest = self.0[own_sibling].bounds;
        let mut visits = 0;
        loop {
            stack.push((sibling, saved));
            while let Some((i, saved)) = stack.pop() {
                let link = &self.0[i];
                let both = area(link.bounds.union(bounds));
                if saved - both > best.gain && i != own_sibling {
                    best = Move { beside: i, gain: saved - both, ..best };
                }
                let below = saved - (both - area(link.bounds));
                visits += 1;
                let is_over = below - least <= best.gain || visits > MAX_VISITS;
                if let Some(children) = link.children.filter(|_| !is_over) {
                    stack.extend(children.map(|child| (child, below)));
                }
            }
            if pivot == ROOT {
                break;
            }
            // The ancestors shrink when the node is removed; it may then be inserted beside the
            // pivot.
            if pivot != parent {
                saved += area(self.0[pivot].bounds) - area(rest);
                let gain = saved - area(rest.union(bounds));
                if gain > best.gain {
                    best = Move { beside: pivot, gain, ..best };
                }
            }
            sibling = self.sibling(pivot);
            pivot = self.0[pivot].parent;
            rest = rest.union(self.0[sibling].bounds);
        }
        (best.gain > 0.0).then_some(best)
    }

    /// Removes a node and inserts it as the sibling of another.
    fn put_beside(&mut self, node: usize, beside: usize) {
        let (parent, sibling) = (self.0[node].parent, self.sibling(node));
        self.replace(parent, sibling);
        self.replace(beside, parent);
        self.0[parent].children = Some([beside, node]);
        self.0[beside].parent = parent;
    }

    /// Replaces a node by another in its parent.
    fn replace(&mut self, old: usize, new: usize) {
        let parent = self.0[old].parent;
        self.0[new].parent = parent;
        for child in self.0[parent].children.iter_mut().flatten().filter(|child| **child == old) {
            *child = new;
        }
    }

    fn refit(&mut self) {
        let mut above = Vec::with_capacity(self.0.len());
        let mut stack = vec![ROOT];
        while let Some(i) = stack.pop() {
            if let Some(children) = self.0[i].children {
                above.push((i, children));
                stack.extend(children);
            }
        }
        for (i, [left, right]) in above.into_iter().rev() {
            self.0[i].bounds = self.0[left].bounds.union(self.0[right].bounds);
        }
    }

    /// All nodes in depth-first order.
    fn in_order(&self, bvh: &Bvh2) -> Bvh2 {
        let mut new = Bvh2 {
            nodes: pt_memory::with_capacity(bvh.nodes.len()),
            order: pt_memory::with_capacity(bvh.order.len()),
            skipped: bvh.skipped,
        };
        // Nodes to visit, and the inner node of which each is the right child.
        let mut stack: Vec<(usize, Option<usize>)> = vec![(ROOT, None)];
        while let Some((i, left)) = stack.pop() {
            let here = new.nodes.len();
            if let Some(parent) = left {
                new.nodes[parent].offset = (here - parent) as u32;
            }
            let Link { bounds: Bounds3 { min, max }, children, places: [start, end], .. } =
                self.0[i];
            if let Some([left, right]) = children {
                new.nodes.push(Node { min, offset: 0, max, count: 0 });
                stack.extend([(right, Some(here)), (left, None)]);
            } else {
                new.append(bvh, &bvh.nodes[start..end]);
            }
        }
        new
    }
}

impl Bvh2 {
    /// Appends a subtree of another tree.
    fn append(&mut self, other: &Self, nodes: &[Node]) {
        let mut leaves = nodes.iter().filter(|node| node.is_leaf());
        let first = leaves.next().map_or(0, |leaf| leaf.offset);
        let end = leaves.next_back().map_or_else(
            || first + nodes.iter().map(|node| node.count).sum::<u32>(),
            |leaf| leaf.offset + leaf.count,
        );
        let start = self.order.len() as u32;
        self.nodes.extend(nodes.iter().map(|node| {
            let offset = if node.is_leaf() { node.offset - first + start } else { node.offset };
            Node { offset, ..*node }
        }));
        self.order.extend(&other.order[first as usize..end as usize]);
    }
}

#[cfg(test)]
mod tests {
    use pt_math::Vec3;
    use pt_testing::Random;

    use super::*;
    use crate::{BuildOptions, Builder, Geometry, check};

    /// Calls `check` with a tree of the mean builder over many triangles of many sizes.
    fn with_tree(n: usize, check: impl Fn(Bvh2, &Geometry<'_>)) {
        let mut random = Random::new(n as u64);
        let mut corners = |_| {
            let (p, size) = (random.in_cube(), 0.5 * random.unit().powi(3));
            [p, p + random.direction() * size, p + random.direction() * size]
        };
        let positions: Vec<Vec3> = (0..n).flat_map(&mut corners).collect();
        let triangles: Vec<_> = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
        let options =
            BuildOptions { builder: Builder::Mean, max_leaf_size: 2, ..BuildOptions::default() };
        check(Bvh2::build(&geometry, &options).expect("it builds"), &geometry);
    }

    #[test]
    fn the_move_found_saves_most_of_all_and_what_was_foretold() {
        with_tree(60, |bvh, _| {
            let tree = LargeNodeTree::of(&bvh, bvh.nodes.len());
            let before = tree.area_of_inner_nodes();
            let (mut moves, mut stack) = (0, Vec::new());
            for node in 0..tree.0.len() {
                let parent = tree.0[node].parent;
                if node == ROOT || parent == ROOT {
                    assert!(tree.best_move(node, &mut stack).is_none());
                    continue;
                }
                let saved = |beside: usize| {
                    let mut moved = LargeNodeTree(tree.0.clone());
                    moved.put_beside(node, beside);
                    moved.refit();
                    before - moved.area_of_inner_nodes()
                };
                let is_place = |&beside: &usize| {
                    !tree.is_within(beside, node)
                        && ![ROOT, parent, tree.sibling(node)].contains(&beside)
                };
                let most = (0..tree.0.len()).filter(is_place).map(saved).fold(0.0, f64::max);
                let found = tree.best_move(node, &mut stack);
                let gain = found.map_or(0.0, |found| found.gain);
                assert!((gain - most).abs() < 1e-9 * before, "{node}: {gain} {most}");
                if let Some(Move { beside, gain, .. }) = found {
                    assert!((gain - saved(beside)).abs() < 1e-9 * before, "{node}");
                    moves += 1;
                }
            }
            assert!(moves > 20, "{moves}");
        });
    }

    #[test]
    fn trees_are_sound_and_cost_less_the_more_of_them_is_large() {
        with_tree(5000, |bvh, geometry| {
            let cost = |large| {
                let effort = ReinsertionEffort { large, passes: 16, least_gain: 0.001 };
                let new = reinsert(bvh.clone(), effort);
                assert_eq!(check::verify(&new, geometry), Ok(()), "{large}");
                assert_eq!(new.nodes.len(), bvh.nodes.len());
                crate::build::tree_cost(&new.nodes)
            };
            let costs = [usize::MAX, 32, 4, 1].map(cost);
            assert_eq!(costs[0], crate::build::tree_cost(&bvh.nodes));
            assert!(costs.is_sorted_by(|a, b| a > b), "{costs:?}");
            assert!(costs[3] < 0.85 * costs[0], "{costs:?}");
        });
    }
}
