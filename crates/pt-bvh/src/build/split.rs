//! Pre-splitting of triangles that are much smaller than their boxes.
//!
//! A long thin triangle that runs across all axes fills little of its box, so most rays that enter
//! the box miss it. Cut in two, it has two boxes with half the total area. Pieces are cut in order
//! of the area saved, within a budget, and the builder then treats their boxes like any others.
//! [Ernst & Greiner 2007, "Early Split Clipping for Bounding Volume Hierarchies"; Karras & Aila
//! 2013, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", §4.4]
//!
//! **No point is lost.** The box of a half contains the hull of the triangle's vertices on that
//! side and of the points where its edges cross the plane, which are rounded outward by more than
//! their error. So every point of a triangle is in the box of one of its pieces, as the argument in
//! [`crate::ray`] requires.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use pt_math::{Bounds3, Vec3};
use rayon::prelude::*;

use super::cost::RelativeArea;
use super::{Item, SimdBounds, longest_axis};
use crate::Quality;
use crate::geometry::{Geometry, Primitive, outward};

/// Triangles per parallel task.
const CUT_CHUNK: usize = 128;

/// Limits of the cuts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplitLimits {
    /// References that may be added, as a fraction of the number of primitives.
    share: f32,
    /// Number of references that may be added to any scene, however small.
    least_budget: usize,
    /// Minimum area saved by a cut, in units of the area of the scene box divided by the number of
    /// references. The boxes of ordinary meshes have about ten such units.
    least_gain: f32,
    /// Minimum fraction of its area that a box must lose. It is ½ for a line across the box, and ¼
    /// for a right triangle in a plane of two axes, of which two fill a box that is best left
    /// whole.
    least_part: f32,
    /// Minimum number of boxes that the first cuts of all triangles must spare a random line
    /// through the scene; below it, nothing is cut.
    least_spared: f32,
}

impl SplitLimits {
    /// Returns the effort for a quality. Measured on a hall with and without ropes, and bumpy
    /// spheres: more cuts than with [`Quality::High`] make the tree larger, but queries no faster.
    pub(super) fn of(quality: Quality) -> Option<Self> {
        let balanced = Self {
            share: 0.3,
            least_budget: 1024,
            least_gain: 128.0,
            least_part: 0.35,
            least_spared: 2.0,
        };
        match quality {
            Quality::Fast => None,
            Quality::Balanced => Some(balanced),
            Quality::High => Some(Self { share: 0.5, least_gain: 32.0, ..balanced }),
        }
    }

    /// Cuts wherever possible, until there are five times as many references.
    #[cfg(test)]
    pub(crate) const EVERYTHING: Self =
        Self { share: 4.0, least_budget: 0, least_gain: 0.0, least_part: 0.01, least_spared: 0.0 };

    /// Returns the largest number of references that splits may add to `items` items.
    pub(super) fn budget(&self, items: usize) -> usize {
        ((items as f32 * self.share) as usize).max(self.least_budget)
    }
}

/// Item that may be cut.
#[derive(Clone, Copy)]
struct Candidate {
    /// Area saved, as a fraction of the area of the scene box.
    gain: f32,
    /// Index of the item.
    index: usize,
    halves: [Bounds3; 2],
}

impl Candidate {
    /// Pieces of the item after the cut: two, unless one has no extent.
    fn pieces(&self, item: &Item) -> [Option<Item>; 2] {
        self.halves.map(|b| (!b.is_empty()).then(|| item.within(b)))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    /// Orders by the area saved; of equal ones, the lower index is greater.
    fn cmp(&self, other: &Self) -> Ordering {
        self.gain.total_cmp(&other.gain).then_with(|| other.index.cmp(&self.index))
    }
}

/// Cuts triangles while a cut saves enough and the budget lasts. Leaves the items unchanged if few
/// triangles are badly bounded. `whole` is the box around all; returns true if any item was
/// changed.
pub(super) fn split(
    items: &mut Vec<Item>,
    whole: SimdBounds,
    geometry: &Geometry<'_>,
    effort: &SplitLimits,
) -> bool {
    let areas = RelativeArea::of(whole);
    let budget = effort.budget(items.len());
    let least = effort.least_gain / (items.len() + budget) as f32;
    let clipper = Clipper { geometry, areas, least, least_part: effort.least_part };
    let first = items.par_iter().enumerate().filter(|(_, item)| item.area(areas) > least);
    let first = first.filter_map(|(index, item)| clipper.candidate(index, item));
    let first: Vec<Candidate> = first.collect();
    if first.iter().map(|c| c.gain).sum::<f32>() < effort.least_spared {
        return false;
    }
    match clipper.all_cuts(&first, items, budget) {
        Some(cuts) => apply(cuts, items),
        None => clipper.best_cuts(first, items, budget),
    }
    true
}

/// Clipper of triangles, with the thresholds for cuts.
struct Clipper<'a> {
    geometry: &'a Geometry<'a>,
    areas: RelativeArea,
    /// Minimum area saved by a cut, as a fraction of that of the scene box.
    least: f32,
    /// [`SplitLimits::least_part`].
    least_part: f32,
}

/// Pieces of some items.
#[derive(Default)]
struct Cuts {
    /// One piece of each item, with the index of the item.
    replaced: Vec<(usize, Item)>,
    /// All other pieces.
    added: Vec<Item>,
}

impl Clipper<'_> {
    /// Returns the cut of an item across the middle of the longest edge of its box; `None` for
    /// spheres, and if the box loses too little.
    fn candidate(&self, index: usize, item: &Item) -> Option<Candidate> {
        let Primitive::Triangle(p) = self.geometry.primitive(item.id()) else { return None };
        let bounds = item.extent().bounds();
        let axis = longest_axis(item.extent().diagonal());
        let plane = bounds.min[axis] + 0.5 * (bounds.max[axis] - bounds.min[axis]);
        let halves = halves(p, bounds, axis, plane);
        let area =
            |b: &Bounds3| if b.is_empty() { 0.0 } else { self.areas.get(SimdBounds::around(*b)) };
        let whole = item.area(self.areas);
        let gain = whole - area(&halves[0]) - area(&halves[1]);
        (gain > 0.0 && gain >= self.least_part * whole).then_some(Candidate { gain, index, halves })
    }

    /// Returns all cuts that save enough; `None` if they would exceed the budget.
    fn all_cuts(&self, first: &[Candidate], items: &[Item], budget: usize) -> Option<Vec<Cuts>> {
        let left = AtomicUsize::new(budget);
        let cuts = |candidates: &[Candidate]| {
            let mut cuts = Cuts::default();
            for candidate in candidates.iter().filter(|c| c.gain >= self.least) {
                self.cut_up(*candidate, items[candidate.index], &mut cuts.added, &left)?;
                cuts.replaced.extend(cuts.added.pop().map(|piece| (candidate.index, piece)));
            }
            Some(cuts)
        };
        first.par_chunks(CUT_CHUNK).map(cuts).collect()
    }

    /// Appends the pieces of an item after all cuts that save enough; `None` if the budget is
    /// spent.
    fn cut_up(
        &self,
        candidate: Candidate,
        item: Item,
        pieces: &mut Vec<Item>,
        budget: &AtomicUsize,
    ) -> Option<()> {
        let mut todo = vec![(candidate, item)];
        while let Some((candidate, item)) = todo.pop() {
            let both = candidate.pieces(&item);
            match both {
                [None, None] => pieces.push(item),
                [Some(_), Some(_)] => {
                    budget.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).ok()?;
                }
                _ => {}
            }
            for piece in both.into_iter().flatten() {
                match self.candidate(candidate.index, &piece).filter(|c| c.gain >= self.least) {
                    Some(next) => todo.push((next, piece)),
                    None => pieces.push(piece),
                }
            }
        }
        Some(())
    }

    /// Applies the cuts that save most, one after the other, until the budget is spent.
    fn best_cuts(&self, first: Vec<Candidate>, items: &mut Vec<Item>, budget: usize) {
        let most = items.len() + budget;
        let mut heap = BinaryHeap::from(first);
        while items.len() < most
            && let Some(candidate) = heap.pop()
            && candidate.gain >= self.least
        {
            let index = candidate.index;
            let mut pieces = candidate.pieces(&items[index]).into_iter().flatten();
            let (Some(piece), other) = (pieces.next(), pieces.next()) else { continue };
            items[index] = piece;
            heap.extend(self.candidate(index, &piece));
            if let Some(other) = other {
                heap.extend(self.candidate(items.len(), &other));
                items.push(other);
            }
        }
    }
}

/// Replaces cut items by their first pieces and appends the others.
fn apply(cuts: Vec<Cuts>, items: &mut Vec<Item>) {
    for Cuts { replaced, added } in cuts {
        for (index, piece) in replaced {
            items[index] = piece;
        }
        items.extend(added);
    }
}

/// Boxes around the parts of a triangle within `bounds` on either side of a plane; empty for a side
/// without any.
fn halves(p: [Vec3; 3], bounds: Bounds3, axis: usize, plane: f32) -> [Bounds3; 2] {
    let [mut below, mut above] = [Bounds3::EMPTY; 2];
    for (a, b) in [(p[0], p[1]), (p[1], p[2]), (p[2], p[0])] {
        if a[axis] <= plane {
            below.grow(a);
        }
        if a[axis] >= plane {
            above.grow(a);
        }
        if (a[axis] < plane) != (b[axis] < plane) {
            let crossing = crossing(a, b, axis, plane);
            below = below.union(crossing);
            above = above.union(crossing);
        }
    }
    below.max[axis] = below.max[axis].min(plane);
    above.min[axis] = above.min[axis].max(plane);
    [below, above]
        .map(|half| Bounds3 { min: half.min.max(bounds.min), max: half.max.min(bounds.max) })
}

/// Box around the point where an edge crosses a plane. With u = 2⁻⁵³ the rounding of double
/// precision and M the largest coordinate: the parameter has an error of 3u, its product with a
/// difference up to 2M one of 10uM, and the sum adds 2uM.
fn crossing(a: Vec3, b: Vec3, axis: usize, plane: f32) -> Bounds3 {
    let (from, to) = (a.as_dvec3(), b.as_dvec3());
    let t = (f64::from(plane) - from[axis]) / (to[axis] - from[axis]);
    let point = from + (to - from) * t;
    let error_bound = from.abs().max(to.abs()) * (8.0 * f64::EPSILON);
    outward(point - error_bound, point + error_bound)
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;
    use crate::build::{Boxes, gather};

    #[test]
    fn all_cuts_are_the_best_cuts_where_the_budget_suffices() {
        let mut random = Random::new(5);
        let mut corners = |_| {
            let (a, b) = (random.in_cube(), random.in_cube());
            [a, b, a.lerp(b, 0.5) + random.in_cube() * 1e-2]
        };
        let positions: Vec<Vec3> = (0..500).flat_map(&mut corners).collect();
        let triangles: Vec<_> = (0..500).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
        let whole = gather(&geometry, 0);
        let areas = RelativeArea::of(Boxes::of(&whole).items);
        let clipper = Clipper { geometry: &geometry, areas, least: 0.01, least_part: 0.35 };
        let first = whole.iter().enumerate().filter_map(|(i, item)| clipper.candidate(i, item));
        let first: Vec<Candidate> = first.collect();

        let mut best = whole.clone();
        clipper.best_cuts(first.clone(), &mut best, usize::MAX / 2);
        let added = best.len() - whole.len();
        assert!(added > 500, "{added}");
        let mut all = whole.clone();
        apply(clipper.all_cuts(&first, &whole, added).expect("the budget suffices"), &mut all);
        let sorted = |items: Vec<Item>| {
            let mut bits: Vec<[u32; 8]> = items.into_iter().map(bytemuck::cast).collect();
            bits.sort_unstable();
            bits
        };
        assert_eq!(sorted(all), sorted(best));
        assert!(clipper.all_cuts(&first, &whole, added - 1).is_none());
    }
}
