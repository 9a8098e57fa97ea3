//! Packets of coherent rays: they visit the same nodes, which are tested once for all of them.
//!
//! A packet has bounds: the intervals of its rays' origins and inverse slopes. A node's boxes are
//! tested against the bounds, all eight at once; a triangle is tested against eight rays at once.
//! [Wald, Slusallek, Benthin & Wagner 2001, "Interactive Rendering with Coherent Ray Tracing";
//! Boulos, Wald & Shirley 2006, "Geometric and Arithmetic Culling Methods for Entire Ray Packets"]
//!
//! The box test of the bounds is that of the rays (see [`crate::ray`]) with intervals for origins
//! and slopes, and the greatest pad among them. It rounds a difference and a product, which is
//! covered by the pad; so no box is missed in which one of the rays has a hit.

use pt_math::Vec3;
use wide::{f32x8, u32x8};

use super::frustum_cull::{FrustumCull, Met};
use super::group::{GroupColumn, RayGroup, bits, eight, of_eight};
use super::ray_slots::RaySlotChunks;
use super::{Queues, Stacks};
use crate::counter::Counter;
use crate::ray::{AXES, MIN_SLOPE, PAD, SceneExtent};
use crate::wide::depths::{after, earlier, later};
use crate::wide::triangles::ShearedTriangles;
use crate::wide::{ChildRef, SizeClass, TriangleBlock, WIDTH, WideBvh, lanes};

/// Rays per packet.
pub(super) const PACKET: usize = 16;

/// If a packet of a whole section tests more triangles than this, small packets are faster, and
/// most likely also for the next [`PAUSE`] packets.
pub(super) const MAX: u32 = 24;
pub(super) const PAUSE: u32 = 128;

/// Maximum number of tests of eight boxes, or of a triangle and eight rays, for each ray of a
/// packet. Of 16, 32, 64 and 128, the first is slower where boxes overlap, and the last where
/// triangles are dense.
const MOST_PER_RAY: u32 = 32;

/// If a small packet is given up, the next ones most likely take too much work, too: only the last
/// of this many is begun.
pub(super) const LONE: u32 = 32;

/// Maximum difference of slopes; beyond it, single rays are faster.
const WIDEST: f32 = 0.25;

/// Maximum difference of origins, as a fraction of half of the scene's extent.
const FARTHEST: f32 = 0.04;

/// Work of a packet: numbers of visited nodes and blocks, and of tested triangles.
#[derive(Clone, Copy, Default)]
pub(super) struct Work {
    pub(super) visits: u32,
    pub(super) tests: u32,
}

impl Work {
    /// Returns true if this many rays most likely take less work one by one.
    #[inline(always)]
    pub(super) fn exceeds_single_rays(self, rays: usize) -> bool {
        let eights = (rays / WIDTH) as u32;
        self.visits + self.tests * eights > MOST_PER_RAY * rays as u32
    }
}

/// Bounds of the rays of a packet.
pub(super) struct PacketBounds {
    /// Per axis: the origin nearest to the planes that are met first, and the one farthest from the
    /// planes that are met last, moved by the pad.
    near_origin: [f32x8; 3],
    far_origin: [f32x8; 3],
    /// Least and greatest inverse slope.
    inverse: [[f32x8; 2]; 3],
    /// Index per axis of the plane that the rays meet first.
    first: [usize; 3],
    start: f32x8,
    /// Frustum of rays that have one origin.
    pub(super) fan: Option<FrustumCull>,
    /// True if occlusion rays visit children near to far.
    pub(super) near_first: bool,
}

/// Reduces the numbers of `N` rays in a column to eight.
#[inline(always)]
fn fold<const N: usize>(
    column: &GroupColumn,
    first: usize,
    of: fn(f32x8, f32x8) -> f32x8,
) -> f32x8 {
    let eights = (first + WIDTH..first + N).step_by(WIDTH);
    eights.fold(eight(column, first), |x, first| of(x, eight(column, first)))
}

/// Maximum over `N` rays of a column of positive numbers.
#[inline(always)]
fn greatest<const N: usize>(column: &GroupColumn, first: usize) -> f32 {
    let greatest = bits(fold::<N>(column, first, later)).to_array();
    f32::from_bits(greatest.into_iter().fold(0, u32::max))
}

/// Returns true if `N` rays have the same entry.
#[inline(always)]
fn is_uniform<const N: usize>(column: &GroupColumn<u32>, first: usize) -> bool {
    let value = u32x8::splat(column[first]);
    let differ = |differ, first| differ | (of_eight(column, first) ^ value);
    (first..first + N).step_by(WIDTH).fold(u32x8::ZERO, differ) == u32x8::ZERO
}

impl PacketBounds {
    /// Bounds of the `N` rays from position `first` on, if they are coherent.
    #[inline(always)]
    pub(super) fn new<const N: usize>(
        group: &RayGroup,
        first: usize,
        scene: &SceneExtent,
    ) -> Option<Self> {
        if !is_uniform::<N>(&group.octant, first) || !is_uniform::<N>(&group.axis, first) {
            return None;
        }
        let [ox, oy, oz] = &group.origin;
        let [sx, sy] = &group.slopes;
        let columns = [ox, oy, oz, sx, sy, &group.start];
        let extremes = |of: fn(f32x8, f32x8) -> f32x8| {
            let [a, b, c, d, e, f] = columns.map(|column| fold::<N>(column, first, of));
            // Eight rows, of which the last two only fill the transposition.
            let [a, b, c, d, e, f, g, h] = f32x8::transpose([a, b, c, d, e, f, f, f]);
            of(of(of(a, b), of(c, d)), of(of(e, f), of(g, h))).to_array()
        };
        let (least, greatest) = (extremes(f32x8::fast_min), extremes(f32x8::fast_max));
        let slopes_apart = (greatest[3] - least[3]).max(greatest[4] - least[4]);
        let (center, half) = (Vec3::from(scene.center), Vec3::from(scene.half));
        let axes = AXES[group.axis[first] as usize % AXES.len()];
        // Origins and slopes are in the cyclic order of the axes.
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        let (mut flattest, mut steepest) = (Vec3::ONE, Vec3::ONE);
        for place in 0..3 {
            low[axes[place]] = least[place];
            high[axes[place]] = greatest[place];
        }
        for place in 0..2 {
            let [a, b] = [least[3 + place].abs(), greatest[3 + place].abs()];
            flattest[axes[place]] = a.min(b);
            steepest[axes[place]] = a.max(b);
        }
        if slopes_apart > WIDEST || (high - low).max_element() > FARTHEST * half.max_element() {
            return None;
        }
        let reach = (center - low).abs().max((center - high).abs()) + half;
        let pad = (PAD * reach.max_element() - scene.padded).max(0.0);
        let octant = group.octant[first] as usize;
        let falls = [0, 1, 2].map(|k| (octant >> k) & 1);
        let (low, high) = (low - center - pad, high - center + pad);
        // All slopes along an axis have the same sign.
        let [small, large] =
            [steepest, flattest].map(|slope| slope.max(Vec3::splat(MIN_SLOPE)).recip());
        let splat = f32x8::splat;
        Some(Self {
            near_origin: [0, 1, 2].map(|k| splat(if falls[k] == 0 { high[k] } else { low[k] })),
            far_origin: [0, 1, 2].map(|k| splat(if falls[k] == 0 { low[k] } else { high[k] })),
            inverse: [0, 1, 2].map(|k| {
                let sign = if falls[k] == 0 { 1.0 } else { -1.0 };
                [splat(sign * small[k]), splat(sign * large[k])]
            }),
            first: falls,
            start: splat(least[5]),
            fan: (least[..3] == greatest[..3])
                .then(|| FrustumCull::new(group, first, &least, &greatest)),
            near_first: false,
        })
    }

    /// Returns lower bounds of the depths at which rays enter each child's box, and a mask of the
    /// children that they may enter before `limit`.
    #[inline(always)]
    fn test(&self, planes: &[[f32x8; 2]; 3], limit: f32) -> (f32x8, f32x8) {
        let [nx, ny, nz] = [0, 1, 2].map(|k: usize| {
            let distance = planes[k][self.first[k] & 1] - self.near_origin[k];
            let [a, b] = self.inverse[k];
            earlier(distance * a, distance * b)
        });
        let [fx, fy, fz] = [0, 1, 2].map(|k: usize| {
            let distance = planes[k][1 ^ (self.first[k] & 1)] - self.far_origin[k];
            let [a, b] = self.inverse[k];
            later(distance * a, distance * b)
        });
        let near = later(later(nx, ny), later(nz, self.start));
        let far = earlier(earlier(fx, fy), earlier(fz, f32x8::splat(limit)));
        (near, !after(near, far))
    }
}

impl WideBvh {
    /// Traces the `N` rays from position `first` on from the root to their hits, unless that
    /// exceeds the work of single rays. Then the rays have the nearest of the hits that were found,
    /// and begin again at the root.
    #[inline(never)]
    pub(super) fn trace<const ANY: bool, const N: usize>(
        &self,
        group: &mut RayGroup,
        stacks: &mut Stacks,
        beam: &PacketBounds,
        first: usize,
        sections: &RaySlotChunks<'_>,
        counter: &mut impl Counter,
    ) -> Work {
        let mut top = group.top[first] as usize;
        let mut child = group.child[first];
        let mut limit = greatest::<N>(&group.limit, first);
        let mut work = Work::default();
        // Bit mask of the groups of eight rays that are still active.
        let mut looking = (1u32 << (N / WIDTH)) - 1;
        while child != ChildRef::DONE {
            let tested = match ChildRef::kind(child) {
                Queues::NODES => {
                    let node = &self.nodes[child as usize];
                    let (near, hit) = beam.test(&node.planes, limit);
                    work.visits += 1;
                    if ANY && !beam.near_first {
                        stacks.push(&mut top, hit, node);
                    } else {
                        stacks.push_sorted(&mut top, near, hit, node);
                    }
                    if self.size == SizeClass::Large && N == PACKET {
                        self.prefetch_those(node, hit.to_bitmask());
                    }
                    false
                }
                Queues::TRIANGLES => {
                    let block = &self.triangles[ChildRef::index(child)];
                    let packet = RayPacket { first, looking, sections, block };
                    let (met, any) = if let Some(fan) = &beam.fan {
                        let met = fan.test(block, limit);
                        let any = match self.avx512 {
                            Some(avx512) => avx512.test_fan::<ANY>(group, packet, &met),
                            None => group.test_fan::<ANY>(packet, &met),
                        };
                        (met.triangles, any)
                    } else {
                        let (_, met) = beam.test(&self.boxes(block), limit);
                        let met = met.to_bitmask();
                        let any = match self.avx512 {
                            Some(avx512) => avx512.test_triangles::<ANY>(group, packet, met),
                            None => group.test_triangles::<ANY>(packet, met),
                        };
                        (met, any)
                    };
                    work.visits += 1;
                    work.tests += met.count_ones();
                    counter.add(|| u64::from(met.count_ones()) * N as u64);
                    any
                }
                _ => {
                    for i in first..first + N {
                        self.visit_sphere(group, sections, i, child, counter);
                    }
                    true
                }
            };
            if tested && ANY {
                for eight in lanes(looking) {
                    let all_hit = group.all_hit(first + eight * WIDTH);
                    looking &= !(u32::from(all_hit) << eight);
                }
                if looking == 0 {
                    break;
                }
            } else if tested {
                limit = greatest::<N>(&group.limit, first);
            }
            if work.exceeds_single_rays(N) {
                break;
            }
            child = stacks.pop::<ANY>(&mut top, limit);
        }
        work
    }

    /// Boxes of a block's triangles, in the layout of a node.
    #[inline(always)]
    fn boxes(&self, block: &TriangleBlock) -> [[f32x8; 2]; 3] {
        [0, 1, 2].map(|k: usize| {
            let [a, b, c] = block.coordinates[k];
            let low_and_high = [a.fast_min(b).fast_min(c), a.fast_max(b).fast_max(c)];
            low_and_high.map(|x| x - f32x8::splat(self.scene.center[k]))
        })
    }
}

/// Rays of a packet that are tested against a block of triangles.
#[derive(Clone, Copy)]
pub(super) struct RayPacket<'a> {
    /// Position of the first ray.
    pub(super) first: usize,
    /// Bit mask of the active groups of eight rays.
    pub(super) looking: u32,
    pub(super) sections: &'a RaySlotChunks<'a>,
    pub(super) block: &'a TriangleBlock,
}

impl RayPacket<'_> {
    /// Positions of the active groups of eight rays.
    #[inline(always)]
    fn eights(&self) -> impl Iterator<Item = usize> + use<> {
        let first = self.first;
        lanes(self.looking).map(move |eight| first + eight * WIDTH)
    }
}

impl RayGroup {
    /// Tests the rays of a packet, which have the same axis, against some of the block's triangles;
    /// returns true if any passed the filter.
    #[inline(always)]
    fn test_triangles<const ANY: bool>(&mut self, packet: RayPacket<'_>, triangles: u32) -> bool {
        let mut any = false;
        for first in packet.eights() {
            let shear = self.shear_of_eight(first);
            for lane in lanes(triangles) {
                let along = |axis: usize| {
                    let [a, b, c] = &packet.block.coordinates[axis];
                    [a, b, c].map(|x| f32x8::splat(x.as_array()[lane % WIDTH]))
                };
                let (set, sheared) = shear.filter(along, eight(&self.limit, first));
                any |= set != 0;
                self.test_lane::<ANY>(packet, first, lane, set, &sheared);
            }
        }
        any
    }

    /// [`Self::test_triangles`] for rays of one origin, and the triangles that they may hit.
    #[inline(always)]
    fn test_fan<const ANY: bool>(&mut self, packet: RayPacket<'_>, met: &Met) -> bool {
        let mut any = false;
        for lane in lanes(met.triangles) {
            let corners = met.corners(lane);
            for first in packet.eights() {
                let slopes = [eight(&self.slopes[0], first), eight(&self.slopes[1], first)];
                let sheared = corners.shear(slopes);
                let (start, limit) = (eight(&self.start, first), eight(&self.limit, first));
                let set = sheared.may_be_hit(start, limit);
                any |= set != 0;
                self.test_lane::<ANY>(packet, first, lane, set, &sheared);
            }
        }
        any
    }

    /// Tests eight rays from `first` on against a triangle that passed the filter in a set of
    /// lanes.
    #[inline(always)]
    fn test_lane<const ANY: bool>(
        &mut self,
        packet: RayPacket<'_>,
        first: usize,
        lane: usize,
        set: u32,
        sheared: &ShearedTriangles,
    ) {
        if set == 0 {
            return;
        }
        let RayPacket { sections, block, .. } = packet;
        let id = block.ids[lane % WIDTH];
        for k in lanes(self.test::<ANY>(first, set, sheared, id)) {
            let i = first + k % WIDTH;
            self.confirm(i, &sections.ray(i), sheared.triangle(k), block.triangle(lane), id);
        }
    }
}
