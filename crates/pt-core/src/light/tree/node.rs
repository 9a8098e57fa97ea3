//! Nodes of eight children, whose importances are computed in parallel.

use bytemuck::Zeroable;
use pt_math::Vec3;
use wide::f32x8;

use super::super::{LightSampleContext, ReceiverSides};
use super::bounds::{LightBounds, MARGIN, across};

/// Number of children of a node.
pub(super) const WIDTH: usize = 8;

/// [`LightBounds`] of up to eight children in structure-of-arrays layout; missing children have
/// strength 0.
#[derive(Clone, Copy, Debug, Zeroable)]
#[repr(C)]
pub(super) struct LightTreeNode {
    center: [f32x8; 3],
    axis: [f32x8; 3],
    radius: f32x8,
    strength: f32x8,
    across: f32x8,
    cut: f32x8,
    /// Twice the index of the light or node, plus one for nodes.
    children: [u32; WIDTH],
}

/// Receiving point, broadcast to all lanes.
#[derive(Clone, Copy)]
pub(super) struct ReceiverLanes {
    p: [f32x8; 3],
    normal: [f32x8; 3],
    /// −1 if the absolute cosine counts, otherwise 1.
    sign: f32x8,
    /// Lower bound of the cosine; 1 without a surface.
    least: f32x8,
}

/// Lower bound of cosines of children that are not culled.
const MIN: f32 = 1e-3;
/// Upper bound of importances.
const MAX: f32 = 1e30;
/// Largest number below 1.
const BELOW_ONE: f32 = 1.0f32.next_down();

impl ReceiverLanes {
    #[inline(always)]
    pub(super) fn new(context: &LightSampleContext) -> Self {
        let splat = |v: Vec3| v.to_array().map(f32x8::splat);
        let sign = if context.sides == ReceiverSides::Both { -1.0 } else { 1.0 };
        let least = if context.sides == ReceiverSides::All { 1.0 } else { MIN };
        Self {
            p: splat(context.p),
            normal: splat(context.normal),
            sign: f32x8::splat(sign),
            least: f32x8::splat(least),
        }
    }
}

#[inline(always)]
fn dot(a: &[f32x8; 3], b: &[f32x8; 3]) -> f32x8 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl LightTreeNode {
    /// Creates a node of up to eight children.
    pub(super) fn new(children: &[LightBounds]) -> Self {
        let mut node = Self::zeroed();
        for (lane, child) in children.iter().enumerate() {
            for axis in 0..3 {
                node.center[axis].as_mut_array()[lane] = child.center[axis];
                node.axis[axis].as_mut_array()[lane] = child.axis[axis];
            }
            node.radius.as_mut_array()[lane] = child.radius;
            node.strength.as_mut_array()[lane] = child.strength;
            node.across.as_mut_array()[lane] = across(child.axis);
            node.cut.as_mut_array()[lane] = child.cut;
        }
        node
    }

    pub(super) fn set_child(&mut self, lane: usize, is_node: bool, number: u32) {
        self.children[lane] = 2 * number + u32::from(is_node);
    }

    /// Returns the kind of a child, true for nodes and false for lights, and its index.
    #[inline(always)]
    pub(super) fn child(&self, lane: usize) -> (bool, u32) {
        let child = self.children[lane];
        (child % 2 == 1, child / 2)
    }

    /// Returns the importance of each child for the receiving point; 0 only if it does not
    /// contribute.
    ///
    /// strength · c′ · c / (d² + r²/16), with the distance d of the centre of the lights, the
    /// radius r of the sphere around them, and approximate means c′ and c of the cosines
    /// max(0, cos θ′) at the lights and max(0, cos θ) at the receiving point. The directions to the
    /// lights differ by ρ = r/d, and their axes differ, so these means are positive at and below
    /// the horizon. Only if cos θ < −ρ, all of the sphere is below the horizon of the receiving
    /// point. Among slopes below the horizon of 1/10, 1/4 and 1/2, a quarter has the least noise in
    /// a hall with 10,000 lights. [as Conty Estevez & Kulla 2018, §4, with means instead of their
    /// bounds]
    #[inline(always)]
    pub(super) fn importances(&self, context: &ReceiverLanes) -> f32x8 {
        let splat = f32x8::splat;
        let quarter = splat(0.25);
        let to = [0, 1, 2].map(|i| self.center[i] - context.p[i]);
        let nearest = quarter * self.radius;
        let squared = (dot(&to, &to) + nearest * nearest).fast_max(splat(f32::MIN_POSITIVE));
        let inverse = splat(1.0) / squared.sqrt();
        let rho = self.radius * inverse;
        let spread = (quarter * rho).fast_min(quarter);
        let cos_light = -dot(&self.axis, &to) * inverse;
        let across = (self.across + spread).fast_min(quarter);
        let at_light = cos_light.fast_max(across + quarter * cos_light).fast_max(splat(MIN));
        let cos = dot(&context.normal, &to) * inverse;
        let cos = cos.fast_max(cos * context.sign);
        let at_lit = cos.fast_max(spread + quarter * cos).fast_max(context.least);
        let importance = self.strength * inverse * at_light * (inverse * at_lit);
        let is_dark = cos_light.simd_lt(self.cut) | cos.simd_lt(-(rho + splat(MARGIN)));
        (!is_dark & importance).fast_min(splat(MAX))
    }

    /// Chooses a child by a random number in [0, 1): returns its lane, its probability, and the
    /// remapped random number. `None` if no child contributes.
    #[inline(always)]
    pub(super) fn choose(&self, context: &ReceiverLanes, u: f32) -> Option<(usize, f32, f32)> {
        let importances = self.importances(context).to_array();
        let ends = running_sums(importances);
        let total = ends[WIDTH - 1];
        let target = u * total;
        if target.is_nan() || target >= total {
            return None;
        }
        let lane = ends.iter().filter(|&&end| end <= target).count();
        let (lane, importance) = (lane % WIDTH, importances[lane % WIDTH]);
        let start = ends[lane] - importance;
        let rest = ((target - start) / importance).clamp(0.0, BELOW_ONE);
        Some((lane, importance / total, rest))
    }

    /// Probability with which [`Self::choose`] chooses a child.
    pub(super) fn share(&self, context: &ReceiverLanes, lane: usize) -> f32 {
        let importances = self.importances(context).to_array();
        let total = running_sums(importances)[WIDTH - 1];
        if total > 0.0 { importances[lane] / total } else { 0.0 }
    }
}

/// Returns the prefix sums: of the first one, the first two, and so on.
#[inline(always)]
fn running_sums(numbers: [f32; WIDTH]) -> [f32; WIDTH] {
    let mut sum = 0.0;
    numbers.map(|x| {
        sum += x;
        sum
    })
}
