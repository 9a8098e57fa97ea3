//! Verification of the invariants of a [`Bvh2`].

use pt_math::{Bounds3, Vec3};
use thiserror::Error;

use crate::geometry::{Geometry, Primitive};
use crate::node::{Bvh2, MAX_DEPTH};

/// Violated invariant of a tree.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Fault {
    /// A usable triangle is in no leaf, a usable sphere not in exactly one, or an unusable
    /// primitive in any.
    #[error("primitive {primitive} occurs {times} times, which is wrong")]
    Occurrence {
        /// Number of the primitive.
        primitive: u32,
        /// Number of its references in leaves.
        times: u32,
    },
    /// A point of a triangle is in no box of a leaf that refers to it.
    #[error("triangle {triangle} is not covered at {point:?}")]
    Uncovered {
        /// Number of the triangle.
        triangle: u32,
        /// Uncovered point.
        point: [f64; 3],
    },
    /// Wrong box of a node: an inner node's box is not the union of its children's, or a leaf's box
    /// is not between the union of its uncut primitives' boxes and the union of all its primitives'
    /// boxes.
    #[error("node {node} has the box {actual:?} instead of {expected:?}")]
    Bounds {
        /// Index of the node.
        node: usize,
        /// Box of the node.
        actual: Bounds3,
        /// Union of the boxes below it.
        expected: Bounds3,
    },
    /// Nodes or leaves that are not in depth-first order.
    #[error("node {node} is out of order")]
    Order {
        /// Index of the node.
        node: usize,
    },
    /// A leaf with both triangles and spheres.
    #[error("leaf {node} has both triangles and spheres")]
    MixedLeaf {
        /// Index of the node.
        node: usize,
    },
    /// A leaf below the allowed depth.
    #[error("node {node} is at depth {depth}, below {MAX_DEPTH}")]
    TooDeep {
        /// Index of the node.
        node: usize,
        /// Depth of the leaf.
        depth: usize,
    },
}

/// Points along each edge at which cut triangles are tested.
const SAMPLES: u32 = 24;

/// Tests all invariants of a tree that was built over `geometry`. For triangles that are in several
/// leaves, it tests a grid of points.
///
/// # Errors
/// The first invariant that does not hold.
pub fn verify(bvh: &Bvh2, geometry: &Geometry<'_>) -> Result<(), Fault> {
    let occurrences = occurrences(bvh, geometry)?;
    let (mut next_node, mut next_place) = (0, 0);
    let mut pieces = Vec::new();
    let mut stack: Vec<(usize, usize)> = bvh.nodes.first().map(|_| (0, 0)).into_iter().collect();
    while let Some((i, depth)) = stack.pop() {
        let node = &bvh.nodes[i];
        if node.is_leaf() {
            let places = node.offset as usize..node.offset as usize + node.count as usize;
            if places.start != next_place || places.end > bvh.order.len() {
                return Err(Fault::Order { node: i });
            }
            next_place = places.end;
            let ids = &bvh.order[places];
            verify_leaf(i, node.bounds(), ids, geometry, &occurrences)?;
            let cut = ids.iter().filter(|&&id| occurrences[id as usize] > 1);
            pieces.extend(cut.map(|&id| (id, node.bounds())));
        } else {
            let [left, right] = bvh.children(i);
            if right <= left || right >= bvh.nodes.len() {
                return Err(Fault::Order { node: i });
            }
            stack.extend([(right, depth + 1), (left, depth + 1)]);
            let expected = bvh.nodes[left].bounds().union(bvh.nodes[right].bounds());
            if node.bounds() != expected {
                return Err(Fault::Bounds { node: i, actual: node.bounds(), expected });
            }
        }
        if i != next_node {
            return Err(Fault::Order { node: i });
        }
        next_node += 1;
        if depth > MAX_DEPTH {
            return Err(Fault::TooDeep { node: i, depth });
        }
    }
    if next_node != bvh.nodes.len() || next_place != bvh.order.len() {
        return Err(Fault::Order { node: next_node });
    }
    pieces.sort_by_key(|&(id, _)| id);
    pieces.chunk_by(|a, b| a.0 == b.0).try_for_each(|pieces| verify_cover(pieces, geometry))
}

/// Counts the references to each primitive.
fn occurrences(bvh: &Bvh2, geometry: &Geometry<'_>) -> Result<Vec<u32>, Fault> {
    let mut occurrences = vec![0; geometry.len()];
    for &id in &bvh.order {
        match occurrences.get_mut(id as usize) {
            Some(times) => *times += 1,
            None => return Err(Fault::Occurrence { primitive: id, times: 1 }),
        }
    }
    for (primitive, &times) in (0..).zip(&occurrences) {
        let right = match geometry.primitive(primitive).bounds() {
            None => times == 0,
            Some(_) if geometry.is_sphere(primitive) => times == 1,
            Some(_) => times >= 1,
        };
        if !right {
            return Err(Fault::Occurrence { primitive, times });
        }
    }
    Ok(occurrences)
}

/// Tests that a leaf has one kind of primitives, and that its box is the union of theirs. If the
/// leaf has pieces of triangles, its box must be within that union and contain all uncut
/// primitives.
fn verify_leaf(
    node: usize,
    actual: Bounds3,
    ids: &[u32],
    geometry: &Geometry<'_>,
    occurrences: &[u32],
) -> Result<(), Fault> {
    let spheres = ids.iter().filter(|&&id| geometry.is_sphere(id)).count();
    if spheres != 0 && spheres != ids.len() {
        return Err(Fault::MixedLeaf { node });
    }
    let union = |most: u32| {
        let counted = ids.iter().filter(|&&id| occurrences[id as usize] <= most);
        let bounds = counted.filter_map(|&id| geometry.primitive(id).bounds());
        bounds.fold(Bounds3::EMPTY, Bounds3::union)
    };
    let (all, whole) = (union(u32::MAX), union(1));
    if actual.is_empty() || actual.union(whole) != actual || actual.union(all) != all {
        return Err(Fault::Bounds { node, actual, expected: all });
    }
    Ok(())
}

/// Tests a grid of points of a triangle, given the boxes of its pieces.
fn verify_cover(pieces: &[(u32, Bounds3)], geometry: &Geometry<'_>) -> Result<(), Fault> {
    let triangle = pieces[0].0;
    let Primitive::Triangle(p) = geometry.primitive(triangle) else { return Ok(()) };
    let [a, b, c] = p.map(Vec3::as_dvec3);
    // Rounding error of the points themselves.
    let size = p.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max);
    let error_bound = f64::from(size) * 8.0 * f64::EPSILON;
    for (i, j) in (0..=SAMPLES).flat_map(|i| (0..=SAMPLES - i).map(move |j| (i, j))) {
        let [u, v] = [i, j].map(|n| f64::from(n) / f64::from(SAMPLES));
        let point = a * (1.0 - u - v) + b * u + c * v;
        let holds = |(_, bounds): &(u32, Bounds3)| {
            point.cmpge(bounds.min.as_dvec3() - error_bound).all()
                && point.cmple(bounds.max.as_dvec3() + error_bound).all()
        };
        if !pieces.iter().any(holds) {
            return Err(Fault::Uncovered { triangle, point: point.to_array() });
        }
    }
    Ok(())
}
