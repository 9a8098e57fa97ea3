//! Choice of one of the triangles of a light, and of a point of it.

use pt_math::Vec3;
use pt_math::distribution::AliasTable;
use pt_math::sampler::LANES;

use super::emitter_triangle::EmitterTriangle;
use super::sample_block::SampleBlock;
use super::triangle_point::{LitTriangle, LitTriangles, TrianglePoint, TrianglePoints};
use super::{LightSample, LightSampleContext};

/// Triangles with the probabilities of their choice.
pub(super) struct TriangleChoice<'t> {
    pub(super) table: &'t AliasTable,
    /// Triangles of the table, from the first on.
    pub(super) triangles: &'t [EmitterTriangle],
    /// See [`NEAR`](super::triangle_point::NEAR).
    pub(super) near: f32,
}

/// A point of a chosen triangle.
pub(super) struct ChosenPoint<'t> {
    pub(super) point: TrianglePoint,
    pub(super) triangle: &'t EmitterTriangle,
    /// Index of the triangle.
    pub(super) index: usize,
    /// Probability of the triangle.
    pub(super) probability: f32,
}

impl<'t> TriangleChoice<'t> {
    /// Samples a point for the receiving point `p`.
    #[inline(always)]
    pub(super) fn sample(&self, p: Vec3, [x, y]: [f32; 2]) -> ChosenPoint<'t> {
        let (index, probability, x) = self.table.sample(x);
        let triangle = &self.triangles[index];
        let point = LitTriangle::new(triangle, p).sample(self.near, [x, y]);
        ChosenPoint { point, triangle, index, probability }
    }

    /// [`Self::sample`] for many receiving points, whose light samples `finish` makes.
    #[inline(always)]
    pub(super) fn sample_each(
        &self,
        mut points: impl Iterator<Item = (LightSampleContext, [f32; 2])>,
        samples: &mut Vec<Option<LightSample>>,
        finish: impl Fn(&ChosenPoint<'t>) -> Option<LightSample>,
    ) {
        while let Some(mut block) = SampleBlock::take(&mut points) {
            let (mut chosen, mut lit) = ([(0, 0.0); LANES], LitTriangles::ZERO);
            for (lane, chosen) in chosen[..block.count].iter_mut().enumerate() {
                let (index, probability, x) = self.table.sample(block.u[0][lane]);
                block.u[0][lane] = x;
                *chosen = (index, probability);
                lit.set(lane, LitTriangle::new(&self.triangles[index], block.p.get(lane)));
            }
            let mut found = TrianglePoints::ZERO;
            lit.sample(self.near, &block.u, &mut found);
            samples.extend((0..block.count).map(|lane| {
                let ((index, probability), point) = (chosen[lane], found.get(lane));
                let triangle = &self.triangles[index];
                finish(&ChosenPoint { point, triangle, index, probability })
            }));
        }
    }
}
