//! Eight-wide tree for fast queries on the CPU: layout and common code of the kernels.
//!
//! A node stores the boxes of eight children as six rows of eight numbers, so that one instruction
//! processes all of them; a leaf is one block of triangles in the same layout. [Wald, Benthin &
//! Boulos 2008, "Getting Rid of Packets"; Woop et al.'s Embree and Bikker's tinybvh use the same
//! shape]

mod batch;
mod bytes;
mod collapse;
mod collapse_cost;
mod depths;
mod occlusion_order;
pub(crate) mod prefetch;
mod refit;
mod segment;
mod traverse;
mod triangles;

use pt_math::Vec3;
use wide::f32x8;

use self::batch::avx512::Avx512;
use crate::BLOCK;
use crate::geometry::Sphere;
use crate::ray::SceneExtent;

/// Children per node.
pub(crate) const WIDTH: usize = 8;
/// One number for each triangle of a block.
pub(crate) type BlockLanes = f32x8;

/// `id` of a lane without a primitive.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

/// Reference in a slot of a node: two bits of kind, and an index into the array of that kind.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub(crate) struct ChildRef(u32);

impl ChildRef {
    const TRIANGLES: u32 = 1 << 31;
    const SPHERES: u32 = 1 << 30;
    /// Sentinel: the end of a query.
    const DONE: u32 = u32::MAX;
    /// Value of slots without a child: the root, which is no node's child.
    const VACANT: Self = Self::node(0);

    /// Number of bits below those of the kind.
    const KIND_SHIFT: u32 = 30;

    /// The two bits of kind.
    const fn kind(child: u32) -> usize {
        (child >> Self::KIND_SHIFT) as usize
    }

    /// Index into the array of its kind.
    const fn index(child: u32) -> usize {
        (child & !(Self::TRIANGLES | Self::SPHERES)) as usize
    }

    const fn node(index: usize) -> Self {
        Self(index as u32)
    }

    const fn triangles(index: usize) -> Self {
        Self(index as u32 | Self::TRIANGLES)
    }

    const fn spheres(index: usize) -> Self {
        Self(index as u32 | Self::SPHERES)
    }
}

/// Node with eight children. Slots without a child have an empty box, which no ray hits.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Per axis: least and greatest coordinate of each child's box, relative to the centre of the
    /// scene and rounded outward.
    planes: [[f32x8; 2]; 3],
    children: [ChildRef; WIDTH],
}

/// Triangles of one leaf. Lanes without a triangle contain NaN, which fails every comparison.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// Axis, vertex.
    coordinates: [[BlockLanes; 3]; 3],
    ids: [u32; BLOCK],
}

/// Spheres of one leaf. Lanes without a sphere contain NaN, which no ray hits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereBlock {
    spheres: [Sphere; BLOCK],
    ids: [u32; BLOCK],
}

/// Size class of a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum SizeClass {
    /// Without nodes.
    #[default]
    Empty,
    Usual,
    /// So large that prefetching pays (`prefetch.rs`).
    Large,
}

/// Eight-wide tree. The root is node 0; without primitives there are no nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideBvh {
    nodes: Vec<WideNode>,
    triangles: Vec<TriangleBlock>,
    spheres: Vec<SphereBlock>,
    /// Boxes are stored relative to the centre of the scene, so that their rounding depends on the
    /// size of the scene and not on its position.
    scene: SceneExtent,
    /// Stack size for all children that a ray of a batch can defer.
    stack_size: usize,
    /// If the processor supports it: used by batches for tests at the root and nodes next to it,
    /// and by their packets for tests of triangles.
    avx512: Option<Avx512>,
    size: SizeClass,
}

impl WideBvh {
    /// Returns true if batches use AVX-512.
    pub(crate) fn has_avx512(&self) -> bool {
        self.avx512.is_some()
    }

    #[cfg(test)]
    pub(crate) fn leave_out_avx512(&mut self) {
        self.avx512 = None;
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.spheres.as_slice())
    }
}

impl TriangleBlock {
    /// Vertices in a lane.
    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        let corner = |v: usize| self.coordinates.each_ref().map(|x| x[v].as_array()[lane % BLOCK]);
        [0, 1, 2].map(|v| Vec3::from_array(corner(v)))
    }

    fn len(&self) -> u64 {
        self.ids.iter().filter(|&&id| id != NO_PRIMITIVE).count() as u64
    }
}

impl SphereBlock {
    /// Spheres with their numbers.
    #[inline]
    fn iter(&self) -> impl Iterator<Item = (&Sphere, &u32)> {
        self.spheres.iter().zip(&self.ids).filter(|(_, id)| **id != NO_PRIMITIVE)
    }

    fn len(&self) -> u64 {
        self.iter().count() as u64
    }
}

/// Lanes of the bits, lowest first.
#[inline]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (bits != 0).then(|| {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            lane
        })
    })
}
