//! Test for triangles that cross a short segment, in double precision. Used for rays that begin
//! next to several surfaces, since a point in single precision may lie beyond one of them.

use pt_math::{Bounds3, DVec3, Vec3};
use wide::f32x8;

use super::{ChildRef, TriangleBlock, WideBvh};
use crate::geometry::{Primitive, outward};
use crate::traverse::List;
use crate::{Bvh, Kernel};

/// Square of the minimum sine of the angle between a triangle and the plane on which the segment
/// begins. Triangles below it do not count: they are its continuation, or lie on it.
const MIN_SINE_SQUARED: f64 = 1e-6;

/// Distance outside of its edges at which a triangle still counts as met, relative to its size.
const TOLERANCE: f64 = 1e-9;

/// Segment to be tested.
#[derive(Clone, Copy, Debug)]
struct ShadowSegment {
    from: DVec3,
    along: DVec3,
    /// Normal of the plane on which the segment begins, of any length.
    normal: DVec3,
    except: u32,
}

impl ShadowSegment {
    fn bounds(&self, center: DVec3) -> Bounds3 {
        let [a, b] = [self.from - center, self.from + self.along - center];
        outward(a.min(b), a.max(b))
    }

    /// Returns true if a triangle is met between the ends, or at one of them.
    fn meets(&self, corners: [Vec3; 3]) -> bool {
        let corners @ [a, b, c] = corners.map(|p| p.as_dvec3() - self.from);
        let normal = (b - a).cross(c - a);
        let (height, slope) = (normal.dot(a), normal.dot(self.along));
        let size = normal.length_squared();
        let across = normal.cross(self.normal).length_squared();
        if across <= MIN_SINE_SQUARED * size * self.normal.length_squared() {
            return false;
        }
        let t = height / slope;
        if !(0.0..=1.0).contains(&t) {
            return false;
        }
        let p = self.along * t;
        let is_left = |i: usize| {
            let [from, to] = [corners[i], corners[(i + 1) % 3]];
            (to - from).cross(p - from).dot(normal) >= -TOLERANCE * size
        };
        (0..3).all(is_left)
    }
}

impl Bvh {
    /// Returns true if a triangle other than number `except` meets the segment between two points.
    /// The segment begins on that triangle, whose `normal` may have any length. Triangles that are
    /// parallel to it, by an angle of less than 0.06°, do not count, and neither do spheres.
    pub fn is_crossed(&self, [from, to]: [DVec3; 2], normal: DVec3, except: u32) -> bool {
        let segment = ShadowSegment { from, along: to - from, normal, except };
        match &self.kernel {
            Kernel::Wide(wide) => wide.is_crossed(&segment),
            Kernel::List(list) => list.is_crossed(&segment),
        }
    }
}

impl List {
    fn is_crossed(&self, segment: &ShadowSegment) -> bool {
        self.primitives().iter().any(|(primitive, id)| match primitive {
            Primitive::Triangle(corners) => *id != segment.except && segment.meets(*corners),
            Primitive::Sphere(_) => false,
        })
    }
}

impl WideBvh {
    fn is_crossed(&self, segment: &ShadowSegment) -> bool {
        let center = Vec3::from(self.scene.center).as_dvec3();
        !self.nodes.is_empty() && self.is_crossed_below(0, segment, &segment.bounds(center))
    }

    /// Returns true if a triangle below a node meets the segment, which has the box `around` in the
    /// coordinates of the tree.
    fn is_crossed_below(&self, node: usize, segment: &ShadowSegment, around: &Bounds3) -> bool {
        let node = &self.nodes[node];
        let apart = |k: usize| {
            let [least, greatest] = node.planes[k];
            least.simd_gt(f32x8::splat(around.max[k]))
                | greatest.simd_lt(f32x8::splat(around.min[k]))
        };
        let apart = (apart(0) | apart(1) | apart(2)).to_bitmask();
        let met = (0..node.children.len()).filter(|lane| apart >> lane & 1 == 0);
        { met }.map(|lane| node.children[lane].0).any(|child| match child {
            child if child & ChildRef::TRIANGLES != 0 => {
                self.triangles[ChildRef::index(child)].is_crossed(segment)
            }
            child if child & ChildRef::SPHERES != 0 => false,
            child => {
                child != ChildRef::VACANT.0
                    && self.is_crossed_below(child as usize, segment, around)
            }
        })
    }
}

impl TriangleBlock {
    fn is_crossed(&self, segment: &ShadowSegment) -> bool {
        // Lanes without a triangle are never met.
        let other = self.ids.iter().enumerate().filter(|(_, id)| **id != segment.except);
        { other }.any(|(lane, _)| segment.meets(self.triangle(lane)))
    }
}
