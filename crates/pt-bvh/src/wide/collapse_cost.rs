//! Optimal collapse: selects the nodes of the binary tree that become children of one wide node,
//! such that the whole tree has the least expected cost.
//!
//! A subtree can be represented in a wide node as a forest of up to i roots. With C(n, i) the least
//! cost of that for node n, and its children l and r:
//!
//! C(n, i) = min(C(n, 1), D(n, i)), D(n, i) = min over k of C(l, k) + C(r, i − k),
//!
//! C(n, 1) = area · cost of a block if the primitives fit one, else area · cost of a node +
//! D(n, 8).
//!
//! [Ylitie, Karras & Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
//! Wide BVHs", §3.1, with eight-wide blocks as leaves]

use bytemuck::Zeroable;

use super::{BLOCK, WIDTH};
use crate::geometry::Geometry;
use crate::node::{Bvh2, Node};

/// Subtrees with at least this many nodes are processed by two threads.
const PARALLEL_SUBTREE: usize = 1024;
/// Cost of visiting a wide node, and of testing a block.
pub(super) const NODE_COST: f32 = 1.0;
pub(super) const BLOCK_COST: f32 = 1.5;

/// Cheapest forests of all subtrees of a binary tree.
pub(super) struct CollapseCosts<'a> {
    bvh: &'a Bvh2,
    subtrees: Vec<Subtree>,
}

/// Costs and contents of a subtree.
#[derive(Clone, Copy, Zeroable)]
struct Subtree {
    /// Costs C for up to 1, 2, … roots.
    costs: [f32; WIDTH - 1],
    /// Number of primitives.
    count: u32,
    /// True if there are triangles, spheres.
    kinds: [bool; 2],
}

impl Subtree {
    /// Returns true if the primitives fit a block.
    fn is_small(&self) -> bool {
        self.count as usize <= BLOCK && self.kinds != [true, true]
    }
}

impl<'a> CollapseCosts<'a> {
    pub(super) fn new(bvh: &'a Bvh2, geometry: &Geometry<'_>) -> Self {
        let mut subtrees = pt_memory::zeros(bvh.nodes.len());
        fill(&bvh.nodes, &mut subtrees, &|leaf: &Node| {
            let is_sphere = geometry.is_sphere(bvh.order[leaf.offset as usize]);
            let blocks = leaf.count.div_ceil(BLOCK as u32) as f32;
            let costs = [leaf.bounds().half_area() * blocks * BLOCK_COST; WIDTH - 1];
            Subtree { costs, count: leaf.count, kinds: [!is_sphere, is_sphere] }
        });
        Self { bvh, subtrees }
    }

    /// Returns the number of primitives of a subtree.
    pub(super) fn count(&self, node: usize) -> usize {
        self.subtrees[node].count as usize
    }

    /// Returns true if the primitives of a subtree fit a block.
    pub(super) fn is_small(&self, node: usize) -> bool {
        self.subtrees[node].is_small()
    }

    /// Calls `found` with the roots that replace an inner node, in the order of their primitives.
    pub(super) fn each_root(&self, node: usize, mut found: impl FnMut(usize)) {
        self.each_of(node, WIDTH, &mut found);
    }

    /// Calls `found` with the roots of the cheapest forest of up to `room` roots.
    fn each_of(&self, node: usize, room: usize, found: &mut impl FnMut(usize)) {
        if room == 1 || self.bvh.nodes[node].is_leaf() {
            return found(node);
        }
        let [left, right] = self.bvh.children(node);
        let (cost, k) = cheapest(&self.subtrees[left], &self.subtrees[right], room);
        if room < WIDTH && self.subtrees[node].costs[0] <= cost {
            return found(node);
        }
        self.each_of(left, k, found);
        self.each_of(right, room - k, found);
    }
}

/// Computes the subtrees of a tree with these nodes, from the leaves, which come last, to the root.
fn fill(nodes: &[Node], subtrees: &mut [Subtree], leaf: &(impl Fn(&Node) -> Subtree + Sync)) {
    if nodes.len() < PARALLEL_SUBTREE {
        for (i, node) in nodes.iter().enumerate().rev() {
            subtrees[i] = if node.is_leaf() {
                leaf(node)
            } else {
                let right = i + node.offset as usize;
                inner(node.bounds().half_area(), &subtrees[i + 1], &subtrees[right])
            };
        }
        return;
    }
    // The root is an inner node, as there are many; the nodes before its right child are its left
    // subtree.
    let (root, right) = (&nodes[0], nodes[0].offset as usize);
    let (left_nodes, right_nodes) = nodes.split_at(right);
    let (left, right) = subtrees.split_at_mut(right);
    rayon::join(|| fill(&left_nodes[1..], &mut left[1..], leaf), || fill(right_nodes, right, leaf));
    left[0] = inner(root.bounds().half_area(), &left[1], &right[0]);
}

/// Cost D for up to `room` roots, and the number of them in the left child.
fn cheapest(l: &Subtree, r: &Subtree, room: usize) -> (f32, usize) {
    let splits = (1..room).map(|k| (l.costs[k - 1] + r.costs[room - k - 1], k));
    splits.fold((f32::INFINITY, 1), |best, split| if split.0 < best.0 { split } else { best })
}

/// Costs D for up to 2, 3, … roots.
fn cheapest_costs(l: &Subtree, r: &Subtree) -> [f32; WIDTH - 1] {
    let mut costs = [f32::INFINITY; WIDTH - 1];
    for (i, a) in l.costs.iter().enumerate() {
        for (cost, b) in costs[i..].iter_mut().zip(&r.costs) {
            *cost = cost.min(a + b);
        }
    }
    costs
}

fn inner(area: f32, l: &Subtree, r: &Subtree) -> Subtree {
    let kinds = [0, 1].map(|k| l.kinds[k] || r.kinds[k]);
    let mut subtree = Subtree { costs: [0.0; WIDTH - 1], count: l.count + r.count, kinds };
    let forests = cheapest_costs(l, r);
    let whole =
        if subtree.is_small() { area * BLOCK_COST } else { area * NODE_COST + forests[WIDTH - 2] };
    subtree.costs[0] = whole;
    for (cost, forest) in subtree.costs[1..].iter_mut().zip(forests) {
        *cost = forest.min(whole);
    }
    subtree
}

#[cfg(test)]
mod tests {
    use pt_math::Vec3;
    use pt_testing::Random;

    use super::*;
    use crate::BuildOptions;

    /// Calls `check` with trees over triangles of many sizes.
    fn with_trees(check: impl Fn(&Bvh2, &CollapseCosts<'_>)) {
        for n in [9, 20, 100, 3000] {
            let mut random = Random::new(n);
            let mut corners = |_| {
                let (p, size) = (random.in_cube(), 0.3 * random.unit().powi(4));
                [p, p + random.direction() * size, p + random.direction() * size]
            };
            let positions: Vec<Vec3> = (0..n).flat_map(&mut corners).collect();
            let triangles: Vec<_> = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
            for max_leaf_size in [1, 8] {
                let options = BuildOptions { max_leaf_size, ..BuildOptions::default() };
                let bvh = Bvh2::build(&geometry, &options).expect("it builds");
                check(&bvh, &CollapseCosts::new(&bvh, &geometry));
            }
        }
    }

    /// Cost of the wide tree of a subtree, if `open` returns the replacements of a node.
    fn cost(
        bvh: &Bvh2,
        forests: &CollapseCosts<'_>,
        i: usize,
        open: &dyn Fn(usize) -> Vec<usize>,
    ) -> f64 {
        let area = f64::from(bvh.nodes[i].bounds().half_area());
        if bvh.nodes[i].is_leaf() || forests.is_small(i) {
            return area * f64::from(BLOCK_COST);
        }
        let below: f64 = open(i).into_iter().map(|root| cost(bvh, forests, root, open)).sum();
        area * f64::from(NODE_COST) + below
    }

    fn roots(forests: &CollapseCosts<'_>, node: usize) -> Vec<usize> {
        let mut roots = Vec::new();
        forests.each_root(node, |root| roots.push(root));
        roots
    }

    /// Greedy alternative: opens the largest node while there is room.
    fn greedy(bvh: &Bvh2, forests: &CollapseCosts<'_>, node: usize) -> Vec<usize> {
        let mut roots = bvh.children(node).to_vec();
        while roots.len() < WIDTH {
            let is_large = |&i: &usize| !bvh.nodes[i].is_leaf() && !forests.is_small(i);
            let area = |i: &usize| bvh.nodes[*i].bounds().half_area();
            let large = roots.iter().copied().filter(is_large);
            let Some(i) = large.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            roots.retain(|&root| root != i);
            roots.extend(bvh.children(i));
        }
        roots
    }

    #[test]
    fn the_tree_costs_what_was_foretold_and_less_than_a_greedy_one() {
        with_trees(|bvh, forests| {
            let foretold = f64::from(forests.subtrees[0].costs[0]);
            let best = cost(bvh, forests, 0, &|i| roots(forests, i));
            assert!((best / foretold - 1.0).abs() < 1e-4, "{best} {foretold}");
            let other = cost(bvh, forests, 0, &|i| greedy(bvh, forests, i));
            assert!(best <= other * (1.0 + 1e-6), "{best} {other}");
            assert!(best < other || bvh.order.len() < 1000, "{best} {other}");
        });
    }

    #[test]
    fn roots_are_few_and_cover_the_subtree_in_order() {
        with_trees(|bvh, forests| {
            let first_below = |mut i: usize| {
                while !bvh.nodes[i].is_leaf() {
                    i = bvh.children(i)[0];
                }
                bvh.nodes[i].offset
            };
            for (i, _) in bvh.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
                let roots = roots(forests, i);
                assert!((2..=WIDTH).contains(&roots.len()), "{}", roots.len());
                let mut next = first_below(i);
                for root in roots {
                    assert_eq!(first_below(root), next);
                    next += forests.subtrees[root].count;
                }
                assert_eq!(next, first_below(i) + forests.subtrees[i].count);
            }
        });
    }
}
