//! Split planes between bins of centroids. [Wald 2007, "On fast Construction of SAH-based Bounding
//! Volume Hierarchies"]

use rayon::prelude::*;
use wide::{f32x4, f32x8, i32x4};

use super::cost::{LOG_BLOCK, NODE_COST, RelativeArea, Search};
use super::{Boxes, CHUNK, Halves, Item, SimdBounds, partition};

/// Number of items whose bins are computed together.
const GROUP: usize = 32;

/// Search over the planes between `BINS` bins per axis, a power of two.
pub(super) struct Binned<const BINS: usize>;

impl<const BINS: usize> Search for Binned<BINS> {
    type Split = BinSplit;

    /// `None` when all centroids coincide.
    fn best(items: &mut [Item], boxes: &Boxes) -> Option<(f32, BinSplit)> {
        let bins = Bins::new(boxes.centroids, BINS);
        let histogram = if items.len() <= CHUNK {
            BinHistogram::<BINS>::of(items, bins)
        } else {
            let partial = items.par_chunks(CHUNK).map(|c| BinHistogram::of(c, bins));
            partial.reduce(|| BinHistogram::EMPTY, |a, b| a.merge(&b))
        };
        let (cost, axis, bin) = histogram.cheapest(RelativeArea::of(boxes.items))?;
        Some((cost, BinSplit { bins, axis, bin, sides: histogram.sides(axis, bin) }))
    }

    fn part(items: &mut [Item], split: BinSplit) -> Halves {
        let parted = if items.len() <= CHUNK {
            Parted::of(items, &split)
        } else {
            let chunks = items.par_chunks_mut(CHUNK).map(|chunk| Parted::of(chunk, &split));
            let chunks: Vec<Parted> = chunks.collect();
            bring_together(items, &chunks);
            chunks.into_iter().reduce(Parted::union).unwrap_or(Parted::NOTHING)
        };
        let [below, above] = parted.centroids;
        let [a, b] = split.sides;
        let boxes = [Boxes { items: a, centroids: below }, Boxes { items: b, centroids: above }];
        Halves { left: parted.left, boxes }
    }
}

/// Result of a partition: the items on the left come first.
#[derive(Clone, Copy)]
struct Parted {
    left: usize,
    /// Boxes of the (doubled) centroids of both sides.
    centroids: [SimdBounds; 2],
}

impl Parted {
    const NOTHING: Self = Self { left: 0, centroids: [SimdBounds::EMPTY; 2] };

    /// Partitions items by the plane of `split`.
    fn of(items: &mut [Item], split: &BinSplit) -> Self {
        let BinSplit { bins: Bins { base, scale, .. }, axis, bin, .. } = *split;
        // Along the other axes, no value is less than −∞.
        let mut end = [f32::NEG_INFINITY; 4];
        end[axis] = bin as f32;
        let end = f32x4::new(end);
        let [mut below, mut above] = [SimdBounds::EMPTY.0; 2];
        let left = partition(items, |item| {
            let centroid = item.centroid();
            let is_left = ((centroid - base) * scale).simd_lt(end).any();
            // The minimum of this and a point is the point, or empty.
            let keep = f32x8::splat([f32::NEG_INFINITY, f32::INFINITY][usize::from(is_left)]);
            let point = SimdBounds::point(centroid).0;
            below = below.fast_max(point.fast_min(keep));
            above = above.fast_max(point.fast_min(-keep));
            is_left
        });
        Self { left, centroids: [SimdBounds(below), SimdBounds(above)] }
    }

    fn union(self, other: Self) -> Self {
        let [a, b] = self.centroids;
        let [c, d] = other.centroids;
        Self { left: self.left + other.left, centroids: [a.union(c), b.union(d)] }
    }
}

/// Moves the left items of all chunks of [`CHUNK`] to the front.
fn bring_together(items: &mut [Item], chunks: &[Parted]) {
    let middle = chunks.iter().map(|chunk| chunk.left).sum();
    let starts = (0..).step_by(CHUNK);
    // Right items before the middle, and left items behind it; their numbers are equal.
    let wrong_rights = starts
        .clone()
        .zip(chunks)
        .flat_map(|(start, chunk)| start + chunk.left..(start + CHUNK).min(middle));
    let wrong_lefts =
        starts.zip(chunks).flat_map(|(start, chunk)| start.max(middle)..start + chunk.left);
    for (a, b) in wrong_rights.zip(wrong_lefts) {
        items.swap(a, b);
    }
}

/// Plane between two bins.
#[derive(Clone, Copy)]
pub(super) struct BinSplit {
    bins: Bins,
    axis: usize,
    /// Items in lower bins go left.
    bin: usize,
    /// Boxes around the items of both sides.
    sides: [SimdBounds; 2],
}

/// Mapping from centroids to bins.
#[derive(Clone, Copy)]
struct Bins {
    base: f32x4,
    scale: f32x4,
    /// Index of the last bin.
    last: f32x4,
}

impl Bins {
    fn new(centroids: SimdBounds, number: usize) -> Self {
        let low = centroids.bounds().min;
        let scale = centroids.diagonal().map(|d| {
            let scale = number as f32 * (1.0 - 1e-5) / d;
            // An axis without extent has one bin only.
            if scale.is_finite() { scale } else { 0.0 }
        });
        let four = |[x, y, z]: [f32; 3]| f32x4::new([x, y, z, 0.0]);
        let last = f32x4::splat((number - 1) as f32);
        Self { base: four(low.to_array()), scale: four(scale), last }
    }

    /// Bin index of a centroid along each axis.
    #[inline]
    fn index(&self, centroid: f32x4) -> [i32; 4] {
        let place = ((centroid - self.base) * self.scale).fast_max(f32x4::ZERO);
        place.fast_min(self.last).fast_trunc_int().to_array()
    }
}

/// Bins along the three axes.
struct BinHistogram<const BINS: usize>([Bin; BINS]);

/// Item counts and boxes of one bin, or of several consecutive bins, along each axis.
#[derive(Clone, Copy)]
struct Bin {
    extents: [SimdBounds; 3],
    counts: [i32; 4],
}

impl Bin {
    const EMPTY: Self = Self { extents: [SimdBounds::EMPTY; 3], counts: [0; 4] };

    #[inline]
    fn union(&self, other: &Self) -> Self {
        let [x, y, z] = self.extents;
        let [u, v, w] = other.extents;
        let counts = i32x4::new(self.counts) + i32x4::new(other.counts);
        Self { extents: [x.union(u), y.union(v), z.union(w)], counts: counts.to_array() }
    }

    /// Cost of the items as one leaf, per axis; NaN without items.
    #[inline]
    fn cost(&self, areas: RelativeArea) -> f32x4 {
        let blocks = (i32x4::new(self.counts) + i32x4::splat((1 << LOG_BLOCK) - 1)) >> LOG_BLOCK;
        areas.of_three(self.extents) * blocks.round_float()
    }
}

impl<const BINS: usize> BinHistogram<BINS> {
    const EMPTY: Self = Self([Bin::EMPTY; BINS]);

    /// Bins the items in groups. The bin indices of a group are computed before any item is added,
    /// so that reading an item does not wait for the store of the one before.
    fn of(items: &[Item], bins: Bins) -> Self {
        let mut histogram = Self::EMPTY;
        let mut places = [[0; 4]; GROUP];
        for group in items.chunks(GROUP) {
            for (place, item) in places.iter_mut().zip(group) {
                *place = bins.index(item.centroid());
            }
            for (place, item) in places.iter().zip(group) {
                histogram.add(item, place);
            }
        }
        histogram
    }

    #[inline(always)]
    fn add(&mut self, item: &Item, place: &[i32; 4]) {
        let extent = item.extent();
        for (axis, &bin) in place.iter().enumerate().take(3) {
            let bin = &mut self.0[bin as usize & (BINS - 1)];
            bin.extents[axis] = bin.extents[axis].union(extent);
            bin.counts[axis] += 1;
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a = a.union(b);
        }
        self
    }

    /// Returns the cheapest plane over all axes: its cost, its axis, and the bin above it.
    fn cheapest(&self, areas: RelativeArea) -> Option<(f32, usize, usize)> {
        let mut right_costs = [f32x4::ZERO; BINS];
        let mut side = Bin::EMPTY;
        for (bin, cost) in self.0.iter().zip(&mut right_costs).skip(1).rev() {
            side = side.union(bin);
            *cost = side.cost(areas);
        }
        let (mut least, mut place) = (f32x4::splat(f32::INFINITY), f32x4::ZERO);
        side = Bin::EMPTY;
        for (bin, right) in (1..BINS).zip(&right_costs[1..]) {
            side = side.union(&self.0[bin - 1]);
            // NaN, which is never less, if a side is empty.
            let cost = f32x4::splat(NODE_COST) + side.cost(areas) + *right;
            let is_less = cost.simd_lt(least);
            least = is_less.select(cost, least);
            place = is_less.select(f32x4::splat(bin as f32), place);
        }
        let (least, place) = (least.to_array(), place.to_array());
        let axis = (1..3).fold(0, |best, k| if least[k] < least[best] { k } else { best });
        let bin = place[axis] as usize;
        (bin > 0).then_some((least[axis], axis, bin))
    }

    /// Boxes on both sides of a plane.
    fn sides(&self, axis: usize, bin: usize) -> [SimdBounds; 2] {
        let (left, right) = self.0.split_at(bin);
        [left, right]
            .map(|bins| bins.iter().fold(SimdBounds::EMPTY, |e, b| e.union(b.extents[axis])))
    }
}

#[cfg(test)]
mod tests {
    use pt_math::{Bounds3, Vec3};
    use pt_testing::Random;

    use super::*;

    #[test]
    fn parts_hold_all_items_on_their_sides_with_their_boxes() {
        for n in [10, CHUNK, CHUNK + 1, 3 * CHUNK, 3 * CHUNK + 77] {
            let mut random = Random::new(n as u64);
            let item = |id| {
                let min = random.in_cube();
                Item::of_box(Bounds3 { min, max: min + Vec3::splat(0.1 * random.unit()) }, id)
            };
            let mut items: Vec<Item> = (0..n as u32).map(item).collect();
            let boxes = Boxes::of(&items);
            let (_, split) = Binned::<16>::best(&mut items, &boxes).expect("it splits");
            let BinSplit { bins, axis, bin, .. } = split;
            let Halves { left, boxes } = Binned::<16>::part(&mut items, split);
            let is_left = |item: &Item| bins.index(item.centroid())[axis] < bin as i32;
            let (lower, upper) = items.split_at(left);
            assert!(lower.iter().all(is_left) && !upper.iter().any(is_left), "{n}");
            for (side, boxes) in [lower, upper].into_iter().zip(boxes) {
                let bits = |e: SimdBounds| (e.bounds().min, e.bounds().max);
                assert_eq!(bits(boxes.items), bits(SimdBounds::of(side)), "{n}");
                assert_eq!(bits(boxes.centroids), bits(SimdBounds::of_centroids(side)), "{n}");
            }
            let mut ids: Vec<u32> = items.iter().map(Item::id).collect();
            ids.sort_unstable();
            assert!(ids.into_iter().eq(0..n as u32), "{n}");
        }
    }
}
