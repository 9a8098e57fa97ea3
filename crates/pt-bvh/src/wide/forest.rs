//! Which nodes of the binary tree become children of one wide node: those by which the whole tree
//! has the least expected cost.
//!
//! A subtree can stand in a wide node as a forest of up to i roots. With C(n, i) the least cost of
//! that for node n, and its children l and r:
//!
//! C(n, i) = min(C(n, 1), D(n, i)),  D(n, i) = min over k of C(l, k) + C(r, i − k),
//!
//! C(n, 1) = area · cost of a block if the primitives fit one, else area · cost of a node + D(n, 8).
//! [Ylitie, Karras & Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed
//! Wide BVHs", §3.1, with eight-wide blocks as leaves]

use std::f32::consts::PI;

use super::{BLOCK, WIDTH};
use crate::geometry::{Geometry, Primitive};
use crate::node::{Bvh2, Node};

/// Cost of visiting a wide node, and of testing a block.
const NODE_COST: f32 = 1.0;
const BLOCK_COST: f32 = 1.5;

/// Added to the cost of looking for a hit in a subtree, or rays would first go through all small
/// ones. Between 2 and 12 it hardly matters.
const DETOUR_COST: f32 = 5.0;

/// The cheapest forests of all subtrees of a binary tree.
pub(super) struct Forests<'a> {
    bvh: &'a Bvh2,
    subtrees: Vec<Subtree>,
}

/// What is known of a subtree.
#[derive(Clone, Copy)]
struct Subtree {
    /// C for up to 1, 2, … roots.
    costs: [f32; WIDTH - 1],
    /// The chance that a random line through the box meets a primitive.
    opacity: f32,
    /// How many primitives it has.
    count: u32,
    /// Whether there are triangles, spheres.
    kinds: [bool; 2],
}

impl Subtree {
    /// Whether its primitives fit a block.
    fn is_small(&self) -> bool {
        self.count as usize <= BLOCK && self.kinds != [true, true]
    }
}

impl<'a> Forests<'a> {
    /// From the leaves, which come last, to the root.
    pub(super) fn new(bvh: &'a Bvh2, geometry: &Geometry<'_>) -> Self {
        let nothing =
            Subtree { costs: [0.0; WIDTH - 1], opacity: 0.0, count: 0, kinds: [false; 2] };
        let mut subtrees = vec![nothing; bvh.nodes.len()];
        for (i, node) in bvh.nodes.iter().enumerate().rev() {
            let area = node.bounds().half_area();
            subtrees[i] = if node.is_leaf() {
                let is_sphere = geometry.is_sphere(bvh.order[node.offset as usize]);
                let blocks = node.count.div_ceil(BLOCK as u32) as f32;
                let costs = [area * blocks * BLOCK_COST; WIDTH - 1];
                let opacity = (met_area(bvh, geometry, node) / area).min(1.0);
                Subtree { costs, opacity, count: node.count, kinds: [!is_sphere, is_sphere] }
            } else {
                let [l, r] = bvh.children(i).map(|child| subtrees[child]);
                let missed = |child: usize| {
                    let part = bvh.nodes[child].bounds().half_area() / area;
                    1.0 - subtrees[child].opacity * part
                };
                let opacity = 1.0 - bvh.children(i).map(missed).into_iter().product::<f32>();
                Subtree { opacity, ..inner(area, &l, &r) }
            };
        }
        Self { bvh, subtrees }
    }

    /// Whether the primitives of a subtree fit a block.
    pub(super) fn is_small(&self, node: usize) -> bool {
        self.subtrees[node].is_small()
    }

    /// How early a query for any hit should come to a subtree whose box it meets: the chance of a
    /// hit by the cost of looking. [Ize & Hansen 2011, "RTSAH Traversal Order for Occlusion Rays";
    /// Ogaki & Derouet-Jourdan 2016, "An N-ary BVH Child Node Sorting Technique for Occlusion
    /// Tests"]
    pub(super) fn urgency(&self, node: usize) -> f32 {
        let subtree = &self.subtrees[node];
        let cost = subtree.costs[0] / self.bvh.nodes[node].bounds().half_area();
        subtree.opacity / (cost + DETOUR_COST)
    }

    /// The roots that take the place of an inner node, in the order of their primitives.
    pub(super) fn of(&self, node: usize) -> Vec<usize> {
        let mut roots = Vec::with_capacity(WIDTH);
        let mut todo = vec![(node, WIDTH)];
        while let Some((node, room)) = todo.pop() {
            let is_whole = || {
                let [l, r] = self.bvh.children(node).map(|child| &self.subtrees[child]);
                self.subtrees[node].costs[0] <= cheapest(l, r, room).0
            };
            if room == 1 || self.bvh.nodes[node].is_leaf() || (room < WIDTH && is_whole()) {
                roots.push(node);
                continue;
            }
            let [left, right] = self.bvh.children(node);
            let (_, k) = cheapest(&self.subtrees[left], &self.subtrees[right], room);
            todo.extend([(right, room - k), (left, k)]);
        }
        roots
    }
}

/// D for up to `room` roots, and how many of them the left child has.
fn cheapest(l: &Subtree, r: &Subtree, room: usize) -> (f32, usize) {
    let cost = |k: usize| l.costs[k - 1] + r.costs[room - k - 1];
    let splits = (1..room).map(|k| (cost(k), k));
    splits.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f32::INFINITY, 0))
}

/// Half of the surface of a leaf's primitives: random lines meet convex bodies in proportion to that,
/// and a triangle has two sides.
fn met_area(bvh: &Bvh2, geometry: &Geometry<'_>, leaf: &Node) -> f32 {
    let first = leaf.offset as usize;
    let ids = &bvh.order[first..first + leaf.count as usize];
    let half_surface = |&id: &u32| match geometry.primitive(id) {
        Primitive::Triangle([a, b, c]) => 0.5 * (b - a).cross(c - a).length(),
        Primitive::Sphere(sphere) => 2.0 * PI * sphere.radius * sphere.radius,
    };
    ids.iter().map(half_surface).sum()
}

fn inner(area: f32, l: &Subtree, r: &Subtree) -> Subtree {
    let kinds = [0, 1].map(|k| l.kinds[k] || r.kinds[k]);
    let mut subtree =
        Subtree { costs: [0.0; WIDTH - 1], opacity: 0.0, count: l.count + r.count, kinds };
    let whole = if subtree.is_small() {
        area * BLOCK_COST
    } else {
        area * NODE_COST + cheapest(l, r, WIDTH).0
    };
    subtree.costs[0] = whole;
    for room in 2..WIDTH {
        subtree.costs[room - 1] = cheapest(l, r, room).0.min(whole);
    }
    subtree
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BuildOptions;
    use pt_math::Vec3;
    use pt_testing::Random;

    /// Trees over triangles of many sizes.
    fn with_trees(check: impl Fn(&Bvh2, &Forests<'_>)) {
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
                check(&bvh, &Forests::new(&bvh, &geometry));
            }
        }
    }

    /// The cost of the wide tree of a subtree, if `open` says what takes a node's place.
    fn cost(
        bvh: &Bvh2,
        forests: &Forests<'_>,
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

    /// The children of the largest, for as long as there is room.
    fn greedy(bvh: &Bvh2, forests: &Forests<'_>, node: usize) -> Vec<usize> {
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
            let best = cost(bvh, forests, 0, &|i| forests.of(i));
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
                let roots = forests.of(i);
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
