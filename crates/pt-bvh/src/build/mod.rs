//! Builders of the binary tree. Each gives the same tree for any number of threads.

mod bins;
mod cost;
mod mean;
mod reinsert;
mod sah;
mod split;
mod sweep;

use bytemuck::{Pod, Zeroable};
pub(crate) use cost::tree_cost;
use pt_math::{Bounds3, Vec3};
use rayon::prelude::*;
pub(crate) use split::SplitLimits;
use wide::{f32x4, f32x8};

use self::cost::RelativeArea;
use crate::geometry::Geometry;
use crate::node::{Bvh2, Node};
use crate::{BuildError, BuildOptions, Builder, Quality};

/// Maximum number of primitives: an index has 30 bits.
pub(crate) const MAX_PRIMITIVES: usize = 1 << 30;
/// Upper limit of [`BuildOptions::max_leaf_size`].
const LARGEST_LEAF: u32 = 64;
/// Boxes and bins of more items than this are computed in chunks of this size.
const CHUNK: usize = 32_768;

/// Returns the freed memory of a build of `primitives` primitives to the system, if it is large: it
/// is fragmented, so large allocations cannot reuse it.
pub(crate) fn tidy(primitives: usize) {
    const LARGE: usize = 1 << 18;
    if primitives > LARGE {
        pt_memory::trim();
    }
}

/// Primitive during the build: its box with the lower corner negated, so that the union of two
/// boxes is one maximum of eight lanes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(32))]
struct Item {
    negated_min: [f32; 3],
    /// Number of the primitive plus [`NORMAL`].
    label: u32,
    max: [f32; 3],
    /// 1 for a sphere, 0 for a triangle.
    sphere: f32,
}

/// Offset that turns the number of any primitive into the bits of a normal floating-point number.
/// The lane takes part in vector arithmetic, which is slow for subnormal numbers.
const NORMAL: u32 = 1 << 30;
/// `label` of an item that is left out.
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

    /// Number of the primitive.
    #[inline]
    fn id(&self) -> u32 {
        self.label & !NORMAL
    }

    /// The same primitive, restricted to a box.
    fn within(&self, bounds: Bounds3) -> Self {
        Self { negated_min: (-bounds.min).to_array(), max: bounds.max.to_array(), ..*self }
    }

    /// Box of the item; lanes 3 and 7 are undefined.
    #[inline]
    fn extent(&self) -> SimdBounds {
        SimdBounds(bytemuck::cast(*self))
    }

    /// Area of the box.
    #[inline]
    fn area(&self, areas: RelativeArea) -> f32 {
        areas.get(self.extent())
    }

    /// Twice the centre of the box; lane 3 is undefined.
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

/// A box as (−min, ·, max, ·); lanes 3 and 7 are undefined.
#[derive(Clone, Copy, Debug)]
struct SimdBounds(f32x8);

impl SimdBounds {
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

    /// max − min; negative or NaN if empty.
    #[inline]
    fn diagonal(self) -> [f32; 3] {
        let [x, y, z, _] = self.lanes_of_diagonal().to_array();
        [x, y, z]
    }

    /// [`Self::diagonal`] as a vector; lane 3 is undefined.
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

    /// Box of the (doubled) centroids.
    fn of_centroids(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |e, i| e.union(Self::point(i.centroid())))
    }
}

/// Boxes around some items and around their (doubled) centroids.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    items: SimdBounds,
    centroids: SimdBounds,
}

impl Boxes {
    const EMPTY: Self = Self { items: SimdBounds::EMPTY, centroids: SimdBounds::EMPTY };

    fn of(items: &[Item]) -> Self {
        if items.len() <= CHUNK {
            return items.iter().fold(Self::EMPTY, Self::with);
        }
        let chunks = items.par_chunks(CHUNK).map(|c| c.iter().fold(Self::EMPTY, Self::with));
        chunks.reduce(|| Self::EMPTY, Self::union)
    }

    #[inline]
    fn with(self, item: &Item) -> Self {
        let centroids = self.centroids.union(SimdBounds::point(item.centroid()));
        Self { items: self.items.union(item.extent()), centroids }
    }

    fn union(self, other: Self) -> Self {
        let items = self.items.union(other.items);
        Self { items, centroids: self.centroids.union(other.centroids) }
    }
}

/// Items partitioned in two: the number in the first part, and the boxes of both.
struct Halves {
    left: usize,
    boxes: [Boxes; 2],
}

impl Halves {
    /// Splits items in their current order.
    fn at(items: &[Item], left: usize) -> Self {
        let (a, b) = items.split_at(left);
        Self { left, boxes: [a, b].map(Boxes::of) }
    }
}

/// ⌈log₂ n⌉: the depth of a tree over `n` items that are halved at every node.
fn halvings(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// Index of the largest component.
fn longest_axis(d: [f32; 3]) -> usize {
    (1..3).fold(0, |best, k| if d[k] > d[best] { k } else { best })
}

/// Moves the items for which `is_left` returns true to the front, and returns their number.
/// Branch-free, since the outcome is unpredictable.
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
    let axis = longest_axis(SimdBounds::of_centroids(items).diagonal());
    let key = |i: &Item| i.centroid_along(axis);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        key(a).total_cmp(&key(b)).then_with(|| a.label.cmp(&b.label))
    });
    middle
}

/// Appends a leaf with this box, or two leaves if the items contain both triangles and spheres.
/// `first` is the index of the first item in the order of the tree.
fn push_leaf(items: &mut [Item], extent: SimdBounds, first: u32, nodes: &mut Vec<Node>) {
    let triangles = partition(items, |i| i.sphere == 0.0);
    let leaf = |items: &[Item], extent: SimdBounds, offset: u32| {
        let Bounds3 { min, max } = extent.bounds();
        Node { min, offset, max, count: items.len() as u32 }
    };
    if triangles != 0 && triangles != items.len() {
        let Bounds3 { min, max } = extent.bounds();
        let (triangles, spheres) = items.split_at(triangles);
        nodes.push(Node { min, offset: 2, max, count: 0 });
        nodes.push(leaf(triangles, SimdBounds::of(triangles), first));
        nodes.push(leaf(spheres, SimdBounds::of(spheres), first + triangles.len() as u32));
    } else {
        nodes.push(leaf(items, extent, first));
    }
}

/// Returns an error if there are too many primitives.
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

/// Usable primitives in ascending order, with capacity for `room` more.
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

/// Numbers of the items.
fn order(items: &[Item]) -> Vec<u32> {
    let mut order = pt_memory::with_capacity(items.len());
    items.par_iter().with_min_len(CHUNK).map(Item::id).collect_into_vec(&mut order);
    order
}

impl Bvh2 {
    /// Builds the tree. [`Builder::None`] puts all primitives into leaves like [`Builder::Mean`];
    /// the caller then omits the tree.
    ///
    /// # Errors
    /// An index out of range, or too many primitives.
    pub fn build(geometry: &Geometry<'_>, options: &BuildOptions) -> Result<Self, BuildError> {
        Self::with_effort(geometry, *options, SplitLimits::of(options.quality))
    }

    /// [`Self::build`] with a given effort for cutting triangles.
    pub(crate) fn with_effort(
        geometry: &Geometry<'_>,
        options: BuildOptions,
        effort: Option<SplitLimits>,
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
            // The items are freed before the nodes are joined, so that they are never in memory
            // together.
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
        let effort = reinsert::ReinsertionEffort::of(options.quality);
        Ok(match effort.filter(|_| is_sah && bvh.nodes.len() > 1) {
            Some(effort) => reinsert::reinsert(bvh, effort),
            None => bvh,
        })
    }

    /// Builds the tree over boxes, numbered in their order, one per leaf. Boxes that are `None` are
    /// left out and counted.
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
