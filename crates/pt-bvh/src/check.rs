//! The invariants of a [`Bvh2`], tested.

use pt_math::Bounds3;
use thiserror::Error;

use crate::geometry::Geometry;
use crate::node::{Bvh2, MAX_DEPTH};

/// What is wrong with a tree.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Fault {
    /// A usable primitive is not in exactly one leaf, or an unusable one is in any.
    #[error("primitive {primitive} occurs {times} times instead of {expected}")]
    Occurrence {
        /// Which.
        primitive: u32,
        /// In how many leaves it is.
        times: u32,
        /// In how many it should be.
        expected: u32,
    },
    /// A box that is not the union of what it should contain.
    #[error("node {node} has the box {actual:?} instead of {expected:?}")]
    Bounds {
        /// Index of the node.
        node: usize,
        /// Its box.
        actual: Bounds3,
        /// The union of the boxes below it.
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
        /// Its depth.
        depth: usize,
    },
}

/// Tests all invariants of a tree that was built over `geometry`.
///
/// # Errors
/// The first invariant that does not hold.
pub fn verify(bvh: &Bvh2, geometry: &Geometry<'_>) -> Result<(), Fault> {
    verify_occurrences(bvh, geometry)?;
    let (mut next_node, mut next_place) = (0, 0);
    let mut stack: Vec<(usize, usize)> = bvh.nodes.first().map(|_| (0, 0)).into_iter().collect();
    while let Some((i, depth)) = stack.pop() {
        let node = &bvh.nodes[i];
        let expected = if node.is_leaf() {
            let first = node.offset as usize;
            if first != next_place {
                return Err(Fault::Order { node: i });
            }
            next_place += node.count as usize;
            leaf_bounds(bvh, geometry, i)?
        } else {
            let [left, right] = bvh.children(i);
            if right <= left || right >= bvh.nodes.len() {
                return Err(Fault::Order { node: i });
            }
            stack.extend([(right, depth + 1), (left, depth + 1)]);
            bvh.nodes[left].bounds().union(bvh.nodes[right].bounds())
        };
        if i != next_node {
            return Err(Fault::Order { node: i });
        }
        next_node += 1;
        if depth > MAX_DEPTH {
            return Err(Fault::TooDeep { node: i, depth });
        }
        if node.bounds() != expected {
            return Err(Fault::Bounds { node: i, actual: node.bounds(), expected });
        }
    }
    if next_node != bvh.nodes.len() || next_place != bvh.order.len() {
        return Err(Fault::Order { node: next_node });
    }
    Ok(())
}

fn verify_occurrences(bvh: &Bvh2, geometry: &Geometry<'_>) -> Result<(), Fault> {
    let mut occurrences = vec![0; geometry.len()];
    for &id in &bvh.order {
        match occurrences.get_mut(id as usize) {
            Some(times) => *times += 1,
            None => return Err(Fault::Occurrence { primitive: id, times: 1, expected: 0 }),
        }
    }
    for (id, &times) in occurrences.iter().enumerate() {
        let primitive = id as u32;
        let expected = u32::from(geometry.primitive(primitive).bounds().is_some());
        if times != expected {
            return Err(Fault::Occurrence { primitive, times, expected });
        }
    }
    Ok(())
}

fn leaf_bounds(bvh: &Bvh2, geometry: &Geometry<'_>, i: usize) -> Result<Bounds3, Fault> {
    let node = &bvh.nodes[i];
    let first = node.offset as usize;
    let ids = &bvh.order[first..first + node.count as usize];
    let spheres = ids.iter().filter(|&&id| geometry.is_sphere(id)).count();
    if spheres != 0 && spheres != ids.len() {
        return Err(Fault::MixedLeaf { node: i });
    }
    Ok(ids
        .iter()
        .filter_map(|&id| geometry.primitive(id).bounds())
        .fold(Bounds3::EMPTY, Bounds3::union))
}
