//! Serialization of the wide tree. The reader trusts only data that it has verified.

use pt_math::{Bounds3, Vec3};
use wide::f32x8;

use super::batch::avx512::Avx512;
use super::collapse::stack_size;
use super::{
    BLOCK, BlockLanes, ChildRef, NO_PRIMITIVE, SizeClass, SphereBlock, TriangleBlock, WIDTH,
    WideBvh, WideNode,
};
use crate::BuildSource;
use crate::codec::{ByteReader, ByteWriter, ReadError, ensure, ensure_scene};
use crate::geometry::{Primitive, Sphere, in_range};
use crate::node::MAX_DEPTH;
use crate::ray::SceneExtent;

/// Bytes of a node: six planes and a child for each slot.
const NODE_BYTES: usize = 4 * 7 * WIDTH;
/// Bytes of a block of triangles, and of a block of spheres.
const TRIANGLES_BYTES: usize = 4 * 10 * BLOCK;
const SPHERES_BYTES: usize = 4 * 5 * BLOCK;
/// Maximum number of nodes on a path from the root for which the stacks of all kernels have room. A
/// large leaf of the binary tree adds a few to its depth.
const MAX_LEVELS: usize = MAX_DEPTH + 6;

impl WideBvh {
    pub(crate) fn write(&self, w: &mut ByteWriter) {
        w.vector(self.scene.center.into());
        w.u64(self.nodes.len() as u64);
        for node in &self.nodes {
            node.planes.as_flattened().iter().for_each(|row| w.f32s(row.as_array()));
            w.u32s(&node.children.map(|child| child.0));
        }
        w.u64(self.triangles.len() as u64);
        for block in &self.triangles {
            block.coordinates.as_flattened().iter().for_each(|row| w.f32s(row.as_array()));
            w.u32s(&block.ids);
        }
        w.u64(self.spheres.len() as u64);
        for block in &self.spheres {
            for sphere in &block.spheres {
                w.vector(sphere.center);
                w.f32(sphere.radius);
            }
            w.u32s(&block.ids);
        }
    }

    /// Reads a tree over primitives with these numbers, in a scene with this box.
    ///
    /// # Errors
    /// A tree that is cut off, or that is unsafe for queries.
    pub(crate) fn read(
        r: &mut ByteReader<'_>,
        source: &BuildSource,
        bounds: &Bounds3,
    ) -> Result<Self, ReadError> {
        let center = r.vector()?;
        let nodes = many(r, NODE_BYTES, WideNode::read)?;
        let triangles = many(r, TRIANGLES_BYTES, |r| TriangleBlock::read(r, source))?;
        let spheres = many(r, SPHERES_BYTES, |r| SphereBlock::read(r, source))?;
        let scene = SceneExtent::around(center, bounds);
        let avx512 = Avx512::detect();
        let mut bvh = Self {
            nodes,
            triangles,
            spheres,
            scene,
            stack_size: 0,
            avx512,
            size: SizeClass::Empty,
        };
        bvh.set_size();
        if bvh.nodes.is_empty() {
            ensure(*bounds == Bounds3::EMPTY, "a scene without nodes")?;
            ensure(bvh.triangles.is_empty() && bvh.spheres.is_empty(), "blocks without nodes")?;
            return Ok(Self::default());
        }
        ensure_scene(bounds)?;
        ensure(in_range(center / 4.0), "a centre out of range")?;
        bvh.stack_size = stack_size(bvh.levels()?);
        Ok(bvh)
    }

    /// Number of nodes on the longest path from the root.
    ///
    /// # Errors
    /// Nodes and blocks that are not a tree, in which children come after their parents and each is
    /// the child of one; or a tree that is too deep.
    fn levels(&self) -> Result<usize, ReadError> {
        let mut level = vec![0; self.nodes.len()];
        let mut has_parent = [&self.triangles.len(), &self.spheres.len()].map(|&n| vec![false; n]);
        level[0] = 1;
        for (i, node) in self.nodes.iter().enumerate() {
            ensure(level[i] != 0, "a node without a parent")?;
            ensure(level[i] <= MAX_LEVELS, "a tree that is too deep")?;
            for (slot, child) in node.children.iter().enumerate() {
                if *child == ChildRef::VACANT {
                    ensure(node.is_vacant(slot), "a way back to the root")?;
                    continue;
                }
                let index = ChildRef::index(child.0);
                let is_new = match child.0 & (ChildRef::TRIANGLES | ChildRef::SPHERES) {
                    0 => {
                        let is_new = index > i && level.get(index) == Some(&0);
                        if is_new {
                            level[index] = level[i] + 1;
                        }
                        is_new
                    }
                    ChildRef::TRIANGLES => take(&mut has_parent[0], index),
                    ChildRef::SPHERES => take(&mut has_parent[1], index),
                    _ => false,
                };
                ensure(is_new, "a child that does not exist, or has two parents")?;
            }
        }
        let all = has_parent.iter().all(|blocks| blocks.iter().all(|&has| has));
        ensure(all, "a block without a parent")?;
        Ok(level.into_iter().max().unwrap_or(0))
    }
}

/// Marks the entry; returns true if it exists and was not marked.
fn take(marks: &mut [bool], index: usize) -> bool {
    marks.get_mut(index).is_some_and(|mark| !std::mem::replace(mark, true))
}

/// Reads a count and that many entries, which have `size` bytes each.
fn many<T>(
    r: &mut ByteReader<'_>,
    size: usize,
    mut read: impl FnMut(&mut ByteReader<'_>) -> Result<T, ReadError>,
) -> Result<Vec<T>, ReadError> {
    let count = r.count(size)?;
    (0..count).map(|_| read(r)).collect()
}

fn rows<const N: usize>(r: &mut ByteReader<'_>) -> Result<[f32x8; N], ReadError> {
    let mut rows = [f32x8::ZERO; N];
    for row in &mut rows {
        *row = f32x8::new(r.f32s()?);
    }
    Ok(rows)
}

impl WideNode {
    fn read(r: &mut ByteReader<'_>) -> Result<Self, ReadError> {
        let [a, b, c, d, e, f] = rows(r)?;
        let planes = [[a, b], [c, d], [e, f]];
        let is_number = |row: &f32x8| row.as_array().iter().all(|x| !x.is_nan());
        ensure(planes.as_flattened().iter().all(is_number), "a plane that is nowhere")?;
        Ok(Self { planes, children: r.u32s()?.map(ChildRef) })
    }

    /// Returns true if no ray hits the box of the slot.
    fn is_vacant(&self, slot: usize) -> bool {
        self.planes.iter().all(|[low, high]| {
            low.as_array()[slot] == f32::INFINITY && high.as_array()[slot] == f32::NEG_INFINITY
        })
    }
}

impl TriangleBlock {
    fn read(r: &mut ByteReader<'_>, source: &BuildSource) -> Result<Self, ReadError> {
        let [a, b, c, d, e, f, g, h, i]: [BlockLanes; 9] = rows(r)?;
        let block = Self { coordinates: [[a, b, c], [d, e, f], [g, h, i]], ids: r.u32s()? };
        for (lane, &id) in block.ids.iter().enumerate() {
            let corners = block.triangle(lane);
            let is_empty = corners.iter().all(|v| v.to_array().iter().all(|x| x.is_nan()));
            ensure_lane(&Primitive::Triangle(corners), id, is_empty, source)?;
        }
        Ok(block)
    }
}

impl SphereBlock {
    fn read(r: &mut ByteReader<'_>, source: &BuildSource) -> Result<Self, ReadError> {
        let mut spheres = [Sphere { center: Vec3::ZERO, radius: f32::NAN }; BLOCK];
        for sphere in &mut spheres {
            *sphere = Sphere { center: r.vector()?, radius: r.f32()? };
        }
        let block = Self { spheres, ids: r.u32s()? };
        for (sphere, &id) in block.spheres.iter().zip(&block.ids) {
            ensure_lane(&Primitive::Sphere(*sphere), id, sphere.radius.is_nan(), source)?;
        }
        Ok(block)
    }
}

/// Tests that a lane is empty, or has a usable primitive that exists. Lanes of primitives that were
/// unusable when the tree was refitted are empty but have a number.
fn ensure_lane(
    primitive: &Primitive,
    id: u32,
    is_empty: bool,
    source: &BuildSource,
) -> Result<(), ReadError> {
    ensure(is_empty || primitive.bounds().is_some(), "an unusable primitive")?;
    let exists = source.has(primitive, id) || (is_empty && id == NO_PRIMITIVE);
    ensure(exists, "a primitive that does not exist")
}
