//! Blocks of light samples, which are computed together.

use pt_math::lanes::Vec3Lanes;
use pt_math::sampler::{LANES, Lanes};

use super::LightSampleContext;

/// Receiving points and random numbers of a block of samples.
pub(super) struct SampleBlock {
    /// Receiving points.
    pub(super) p: Vec3Lanes,
    /// Both random numbers of each sample.
    pub(super) u: [Lanes<f32>; 2],
    /// Number of samples, in the first lanes.
    pub(super) count: usize,
}

impl SampleBlock {
    /// Takes as many points as there are lanes, or the rest; `None` if none is left.
    #[inline(always)]
    pub(super) fn take(
        points: &mut impl Iterator<Item = (LightSampleContext, [f32; 2])>,
    ) -> Option<Self> {
        let mut block = Self { p: Vec3Lanes::ZERO, u: [[0.0; LANES]; 2], count: 0 };
        for (context, [x, y]) in points.take(LANES) {
            block.p.set(block.count, context.p);
            [block.u[0][block.count], block.u[1][block.count]] = [x, y];
            block.count += 1;
        }
        (block.count > 0).then_some(block)
    }
}
