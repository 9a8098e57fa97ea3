//! Builders of the binary tree. All give the same tree for any number of threads.

mod bins;
mod mean;
mod reinsert;
mod sah;
mod split;
mod sweep;

pub(crate) use sah::tree_cost;
pub(crate) use split::Effort;

use bytemuck::{Pod, Zeroable};
use pt_math::{Bounds3, Vec3};
use rayon::prelude::*;
use wide::{f32x4, f32x8};

use self::sah::RelativeArea;
use crate::geometry::Geometry;
use crate::node::{Bvh2, Node};
use crate::{BuildError, BuildOptions, Builder, Quality};

/// More primitives than this do not fit the 30 bits of an index.
pub(crate) const MAX_PRIMITIVES: usize = 1 << 30;
/// Leaves never hold more, whatever the options say.
const LARGEST_LEAF: u32 = 64;
/// Boxes and bins of more items than this are computed in chunks of so many.
const CHUNK: usize = 32_768;

/// Gives back the memory of what was made on the way to a tree of so many primitives, if that is
/// much: it lies in pieces, in which nothing large finds room.
pub(crate) fn tidy(primitives: usize) {
    const LARGE: usize = 1 << 18;
    if primitives > LARGE {
        pt_memory::trim();
    }
}

/// A primitive while the tree is built: its box with the lower corner negated, so that the union
/// of two boxes is one maximum of eight lanes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
struct Item {
    negated_min: [f32; 3],
    /// The number of the primitive with [`NORMAL`] added.
    label: u32,
    max: [f32; 3],
    /// 1 for a sphere, 0 for a triangle.
    sphere: f32,
}

/// Makes a normal floating-point number of any number of a primitive: arithmetic of the lanes
/// beside takes it along, and processors are slow with subnormal ones.
const NORMAL: u32 = 1 << 30;
/// `label` of an item to leave out.
const SKIPPED: u32 = 0;

impl Item {
    fn new(geometry: &Geometry<'_>, id: u32) -> Self {
        let sphere = f32::from(u8::from(geometry.is_sphere(id)));
        match geometry.primitive(id).bounds() {
            Some(bounds) => Self { sphere, ..Self::of_box(bounds, id) },
            None => Self { label: SKIPPED, ..Self::of_box(Bounds3::EMPTY, id) },
        }
    }

    fn of_box(Bounds3 { min, max }: Bounds3, id: u32) -> Self {
        Self {
            negated_min: (-min).to_array(),
            label: NORMAL | id,
            max: max.to_array(),
            sphere: 0.0,
        }
    }

    /// The number of the primitive.
    #[inline]
    fn id(&self) -> u32 {
        self.label & !NORMAL
    }

    /// The same primitive, as far as it is in a box.
    fn within(&self, bounds: Bounds3) -> Self {
        Self { negated_min: (-bounds.min).to_array(), max: bounds.max.to_array(), ..*self }
    }

    /// The box; lanes 3 and 7 mean nothing.
    #[inline]
    fn extent(&self) -> Extent {
        Extent(bytemuck::cast(*self))
    }

    /// The area of the box.
    #[inline]
    fn area(&self, areas: RelativeArea) -> f32 {
        areas.get(self.extent())
    }

    /// Twice the centre of the box; lane 3 means nothing.
    #[inline]
    fn centroid(&self) -> f32x4 {
        let [low, high]: [f32x4; 2] = bytemuck::cast(*self);
        high - low
    }

    #[inline]
    fn centroid_along(&self, axis: usize) -> f32 {
        self.max[axis] - self.negated_min[axis]
    }
}

/// A box as (−min, ·, max, ·); lanes 3 and 7 mean nothing.
#[derive(Clone, Copy, Debug)]
struct Extent(f32x8);

impl Extent {
    const EMPTY: Self = Self(f32x8::new([f32::NEG_INFINITY; 8]));

    #[inline]
    fn union(self, other: Self) -> Self {
        Self(self.0.fast_max(other.0))
    }

    #[inline]
    fn point(p: f32x4) -> Self {
        Self(bytemuck::cast([-p, p]))
    }

    fn around(bounds: Bounds3) -> Self {
        let [low, high] = [-bounds.min, bounds.max].map(|v| [v.x, v.y, v.z, 0.0]);
        Self(bytemuck::cast([low, high]))
    }

    /// max − min; below 0 or NaN when empty.
    #[inline]
    fn diagonal(self) -> [f32; 3] {
        let [x, y, z, _] = self.lanes_of_diagonal().to_array();
        [x, y, z]
    }

    /// [`Self::diagonal`]; lane 3 means nothing.
    #[inline]
    fn lanes_of_diagonal(self) -> f32x4 {
        let [low, high]: [f32x4; 2] = bytemuck::cast(self.0);
        low + high
    }

    fn bounds(self) -> Bounds3 {
        let [x0, y0, z0, _, x1, y1, z1, _] = self.0.to_array();
        Bounds3 { min: -Vec3::new(x0, y0, z0), max: Vec3::new(x1, y1, z1) }
    }

    fn of(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |e, i| e.union(i.extent()))
    }

    /// The box of the (doubled) centroids.
    fn of_centroids(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |e, i| e.union(Self::point(i.centroid())))
    }
}

/// The boxes around some items and around their (doubled) centroids.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    items: Extent,
    centroids: Extent,
}

impl Boxes {
    const EMPTY: Self = Self { items: Extent::EMPTY, centroids: Extent::EMPTY };

    fn of(items: &[Item]) -> Self {
        if items.len() <= CHUNK {
            return items.iter().fold(Self::EMPTY, Self::with);
        }
        let chunks = items.par_chunks(CHUNK).map(|c| c.iter().fold(Self::EMPTY, Self::with));
        chunks.reduce(|| Self::EMPTY, Self::union)
    }

    #[inline]
    fn with(self, item: &Item) -> Self {
        let centroids = self.centroids.union(Extent::point(item.centroid()));
        Self { items: self.items.union(item.extent()), centroids }
    }

    fn union(self, other: Self) -> Self {
        let items = self.items.union(other.items);
        Self { items, centroids: self.centroids.union(other.centroids) }
    }
}

/// Items parted in two: how many are in the first part, and the boxes of both.
struct Halves {
    left: usize,
    boxes: [Boxes; 2],
}

impl Halves {
    /// Items whose order says where they go.
    fn at(items: &[Item], left: usize) -> Self {
        let (a, b) = items.split_at(left);
        Self { left, boxes: [a, b].map(Boxes::of) }
    }
}

/// ⌈log₂ n⌉: the depth of a tree of `n` items that is halved at every node.
fn halvings(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// The axis of the largest number.
fn longest_axis(d: [f32; 3]) -> usize {
    (1..3).fold(0, |best, k| if d[k] > d[best] { k } else { best })
}

/// Moves the items for which `is_left` holds to the front, and returns how many there are. Nothing
/// branches on what holds, which a processor could not foretell.
fn partition(items: &mut [Item], mut is_left: impl FnMut(&Item) -> bool) -> usize {
    let mut left = 0;
    for i in 0..items.len() {
        let item = items[i];
        items.swap(i, left);
        left += usize::from(is_left(&item));
    }
    left
}

/// Splits at the median of the centroids along the longest axis.
fn split_at_median(items: &mut [Item]) -> usize {
    let axis = longest_axis(Extent::of_centroids(items).diagonal());
    let key = |i: &Item| i.centroid_along(axis);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        key(a).total_cmp(&key(b)).then_with(|| a.label.cmp(&b.label))
    });
    middle
}

/// Appends a leaf of items with this box, or two when there are both triangles and spheres.
/// `first` is the place of the first item in the order of the tree.
fn push_leaf(items: &mut [Item], extent: Extent, first: u32, nodes: &mut Vec<Node>) {
    let triangles = partition(items, |i| i.sphere == 0.0);
    let leaf = |items: &[Item], extent: Extent, offset: u32| {
        let Bounds3 { min, max } = extent.bounds();
        Node { min, offset, max, count: items.len() as u32 }
    };
    if triangles != 0 && triangles != items.len() {
        let Bounds3 { min, max } = extent.bounds();
        let (triangles, spheres) = items.split_at(triangles);
        nodes.push(Node { min, offset: 2, max, count: 0 });
        nodes.push(leaf(triangles, Extent::of(triangles), first));
        nodes.push(leaf(spheres, Extent::of(spheres), first + triangles.len() as u32));
    } else {
        nodes.push(leaf(items, extent, first));
    }
}

/// An error if so many primitives are too many.
pub(crate) fn check_number(primitives: usize) -> Result<(), BuildError> {
    let is_allowed = primitives <= MAX_PRIMITIVES;
    is_allowed.then_some(()).ok_or(BuildError::TooManyPrimitives { primitives })
}

pub(crate) fn check(geometry: &Geometry<'_>) -> Result<(), BuildError> {
    check_number(geometry.triangles.len().saturating_add(geometry.spheres.len()))?;
    let vertices = geometry.positions.len();
    let is_inside = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < vertices);
    let chunks = geometry.triangles.par_chunks(CHUNK);
    if chunks.all(|chunk| chunk.iter().fold(true, |all, t| all & is_inside(t))) {
        return Ok(());
    }
    let outside = |t: &[u32; 3]| t.iter().copied().find(|&v| v as usize >= vertices);
    match geometry.triangles.iter().enumerate().find_map(|(i, t)| Some((i, outside(t)?))) {
        Some((triangle, index)) => Err(BuildError::IndexOutOfRange { triangle, index, vertices }),
        None => Ok(()),
    }
}

/// The usable primitives, in order of their number, with room for so many more.
fn gather(geometry: &Geometry<'_>, room: usize) -> Vec<Item> {
    let mut items: Vec<Item> = pt_memory::with_capacity(geometry.len() + room);
    (0..geometry.len() as u32)
        .into_par_iter()
        .map(|id| Item::new(geometry, id))
        .collect_into_vec(&mut items);
    if items.par_chunks(CHUNK).any(|chunk| chunk.iter().any(|i| i.label == SKIPPED)) {
        items.retain(|i| i.label != SKIPPED);
    }
    items
}

/// The numbers of the items.
fn order(items: &[Item]) -> Vec<u32> {
    let mut order = pt_memory::with_capacity(items.len());
    items.par_iter().with_min_len(CHUNK).map(Item::id).collect_into_vec(&mut order);
    order
}

impl Bvh2 {
    /// Builds the tree. [`Builder::None`] puts everything into leaves as [`Builder::Mean`] does:
    /// leaving the tree out is for the caller to do.
    ///
    /// # Errors
    /// An index out of range, or too many primitives.
    pub fn build(geometry: &Geometry<'_>, options: &BuildOptions) -> Result<Self, BuildError> {
        Self::with_effort(geometry, *options, Effort::of(options.quality))
    }

    /// [`Self::build`], with this effort to cut triangles.
    pub(crate) fn with_effort(
        geometry: &Geometry<'_>,
        options: BuildOptions,
        effort: Option<Effort>,
    ) -> Result<Self, BuildError> {
        check(geometry)?;
        let is_sah = options.builder == Builder::Sah;
        let effort = effort.filter(|_| is_sah);
        // Spheres are not cut.
        let cut = effort.filter(|_| !geometry.triangles.is_empty());
        let mut items = gather(geometry, cut.map_or(0, |e| e.budget(geometry.len())));
        let skipped = (geometry.len() - items.len()) as u32;
        let largest_leaf = options.max_leaf_size.clamp(1, LARGEST_LEAF) as usize;
        let bvh = if is_sah && !items.is_empty() {
            let mut boxes = Boxes::of(&items);
            if effort.is_some_and(|e| split::split(&mut items, boxes.items, geometry, &e)) {
                boxes = Boxes::of(&items);
            }
            let pieces = sah::build(&mut items, boxes, options.quality, largest_leaf);
            let order = order(&items);
            // The nodes are put together where the items were, so that memory is never there for
            // both.
            drop(items);
            let nodes = sah::joined(pieces);
            tidy(order.len());
            Self { nodes, order, skipped }
        } else {
            let mut nodes = Vec::new();
            if !items.is_empty() {
                mean::build(&mut items, largest_leaf, &mut nodes);
            }
            Self { nodes, order: order(&items), skipped }
        };
        let effort = reinsert::Effort::of(options.quality);
        Ok(match effort.filter(|_| is_sah && bvh.nodes.len() > 1) {
            Some(effort) => reinsert::reinsert(bvh, effort),
            None => bvh,
        })
    }

    /// The tree over boxes, numbered in their order, each in a leaf of its own; those that are
    /// `None` are left out and counted.
    pub(crate) fn over_boxes(boxes: impl Iterator<Item = Option<Bounds3>>) -> Self {
        let (mut items, mut skipped) = (Vec::new(), 0);
        for (id, bounds) in (0..).zip(boxes) {
            match bounds {
                Some(bounds) => items.push(Item::of_box(bounds, id)),
                None => skipped += 1,
            }
        }
        let nodes = if items.is_empty() {
            Vec::new()
        } else {
            let boxes = Boxes::of(&items);
            sah::joined(sah::build(&mut items, boxes, Quality::Balanced, 1))
        };
        Self { nodes, order: order(&items), skipped }
    }
}
