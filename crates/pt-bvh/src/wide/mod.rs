//! Eight-wide tree for fast queries on the CPU: layout, and what the kernels share.
//!
//! A node holds the boxes of eight children as six rows of eight numbers, so that one instruction
//! treats all of them; a leaf is one block of triangles in the same form. [Wald, Benthin & Boulos
//! 2008, "Getting Rid of Packets"; Woop et al.'s Embree and Bikker's tinybvh use the same shape]

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
use crate::geometry::Sphere;
use crate::ray::Scene;

/// Children per node.
pub(crate) const WIDTH: usize = 8;
/// Primitives per leaf block.
pub(crate) const BLOCK: usize = 8;
/// One number for each triangle of a block.
pub(crate) type Lanes = f32x8;

/// `id` of a lane without a primitive.
pub(crate) const NO_PRIMITIVE: u32 = u32::MAX;

/// What a slot of a node refers to: two bits of kind, and an index into the array of that kind.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub(crate) struct Child(u32);

impl Child {
    const TRIANGLES: u32 = 1 << 31;
    const SPHERES: u32 = 1 << 30;
    /// Nothing: the end of a query.
    const DONE: u32 = u32::MAX;
    /// In slots without a child: the root, which is nobody's child.
    const VACANT: Self = Self::node(0);

    /// Number of bits below those of the kind.
    const KIND_SHIFT: u32 = 30;

    /// The two bits of kind.
    const fn kind(child: u32) -> usize {
        (child >> Self::KIND_SHIFT) as usize
    }

    /// The index into the array of its kind.
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

/// Eight children. Slots without one have a box that is inside out, which no ray hits.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    /// Per axis: least and greatest coordinate of each child's box, relative to
    /// the middle of the scene and rounded outward.
    planes: [[f32x8; 2]; 3],
    children: [Child; WIDTH],
}

/// Triangles of one leaf. Lanes without one hold NaN, which passes no comparison.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// Axis, vertex.
    coordinates: [[Lanes; 3]; 3],
    ids: [u32; BLOCK],
}

/// Spheres of one leaf. Lanes without one hold NaN, which no ray hits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereBlock {
    spheres: [Sphere; BLOCK],
    ids: [u32; BLOCK],
}

/// How large a tree is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Size {
    /// Without nodes.
    #[default]
    Empty,
    Usual,
    /// So large that it pays to say early what will be visited (`prefetch.rs`).
    Large,
}

/// The tree. The root is node 0; without primitives there are no nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideBvh {
    nodes: Vec<WideNode>,
    triangles: Vec<TriangleBlock>,
    spheres: Vec<SphereBlock>,
    /// Boxes are stored relative to the middle of the scene, so that their rounding depends on the
    /// size of the scene and not on where it is.
    scene: Scene,
    /// Room for all children that a ray of a batch can put off.
    stack_size: usize,
    /// By which batches test the root and nodes next to it, and their packets triangles, where the
    /// processor has it.
    avx512: Option<Avx512>,
    size: Size,
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
    /// The vertices in a lane.
    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        let corner = |v: usize| self.coordinates.each_ref().map(|x| x[v].as_array()[lane % BLOCK]);
        [0, 1, 2].map(|v| Vec3::from_array(corner(v)))
    }

    fn len(&self) -> u64 {
        self.ids.iter().filter(|&&id| id != NO_PRIMITIVE).count() as u64
    }
}

impl SphereBlock {
    /// The spheres with their numbers.
    #[inline]
    fn iter(&self) -> impl Iterator<Item = (&Sphere, &u32)> {
        self.spheres.iter().zip(&self.ids).filter(|(_, id)| **id != NO_PRIMITIVE)
    }

    fn len(&self) -> u64 {
        self.iter().count() as u64
    }
}
