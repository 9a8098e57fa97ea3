//! Blocks of evaluations and samples of one lobe, which are computed together.
//!
//! The loops over all lanes become vector instructions if the formula of the lobe has no branches
//! and calls; see [`pt_math::lanes`].

use arrayvec::ArrayVec;
use pt_math::lanes::Vec3Lanes;
use pt_math::sampler::{LANES, Lanes};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::{Bsdf, BsdfSample, Lobe};

/// Least number of points with the same lobe for which a block takes less time than one point after
/// the other.
const MIN_POINTS: usize = 4;

/// Pairs of directions in the frame of a lobe.
pub(super) struct DirectionPairs {
    wo: Vec3Lanes,
    wi: Vec3Lanes,
}

/// Values of [`Lobe::eval_and_pdf`] for a block.
pub(super) struct Evaluations {
    f: Vec3Lanes,
    pdf: Lanes<f32>,
}

/// Viewing directions in the frame of a lobe, and random numbers.
pub(super) struct SampleNumbers {
    wo: Vec3Lanes,
    u: [Lanes<f32>; 3],
}

/// Values of [`Lobe::sample`] for a block, of a lobe in [blocks](Lobe::IN_BLOCKS).
pub(super) struct Samples {
    wi: Vec3Lanes,
    weight: Vec3Lanes,
    /// 0 if there is no sample.
    pdf: Lanes<f32>,
}

impl DirectionPairs {
    pub(super) const ZERO: Self = Self { wo: Vec3Lanes::ZERO, wi: Vec3Lanes::ZERO };

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, wo: Vec3, wi: Vec3) {
        self.wo.set(lane, wo);
        self.wi.set(lane, wi);
    }

    /// [`Lobe::eval_and_pdf`] of each lane.
    #[inline(never)]
    pub(super) fn evaluate<'t, L: Lobe<'t>>(&self, lobe: L, values: &mut Evaluations) {
        lobe.specialized(
            #[inline(always)]
            |lobe| {
                for lane in 0..LANES {
                    let (f, pdf) = lobe.eval_and_pdf(self.wo.get(lane), self.wi.get(lane));
                    values.f.set(lane, f.0);
                    values.pdf[lane] = pdf.get();
                }
            },
        );
    }
}

impl Evaluations {
    pub(super) const ZERO: Self = Self { f: Vec3Lanes::ZERO, pdf: [0.0; LANES] };

    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> (Spectrum, Pdf<SolidAngle>) {
        (Spectrum(self.f.get(lane)), Pdf::new(self.pdf[lane]))
    }
}

impl SampleNumbers {
    pub(super) const ZERO: Self = Self { wo: Vec3Lanes::ZERO, u: [[0.0; LANES]; 3] };

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, wo: Vec3, u: [f32; 3]) {
        self.wo.set(lane, wo);
        for (numbers, u) in self.u.iter_mut().zip(u) {
            numbers[lane] = u;
        }
    }

    /// [`Lobe::sample`] of each lane.
    #[inline(never)]
    pub(super) fn sample<'t, L: Lobe<'t>>(&self, lobe: L, samples: &mut Samples) {
        let Self { wo, u: [x, y, z] } = self;
        let none = BsdfSample::new(Vec3::ZERO, Spectrum::ZERO, None);
        lobe.specialized(
            #[inline(always)]
            |lobe| {
                for lane in 0..LANES {
                    let u = [x[lane], y[lane], z[lane]];
                    let sample = lobe.sample(wo.get(lane), u).unwrap_or(none);
                    samples.wi.set(lane, sample.wi);
                    samples.weight.set(lane, sample.weight.0);
                    samples.pdf[lane] = sample.pdf.map_or(0.0, Pdf::get);
                }
            },
        );
    }
}

impl Samples {
    pub(super) const ZERO: Self =
        Self { wi: Vec3Lanes::ZERO, weight: Vec3Lanes::ZERO, pdf: [0.0; LANES] };

    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Option<BsdfSample> {
        let pdf = Pdf::new(self.pdf[lane]);
        let [wi, weight] = [self.wi.get(lane), self.weight.get(lane)];
        pdf.is_positive().then(|| BsdfSample::new(wi, Spectrum(weight), Some(pdf)))
    }
}

/// A surface point in a lane of a block of the caller, with the argument of its evaluation.
#[derive(Clone, Copy)]
struct Point<'b, T> {
    lane: usize,
    bsdf: &'b Bsdf<'b>,
    argument: T,
}

/// Calls `compute` with groups of points that have the same lobe; points of small groups, those
/// whose lobe is not in blocks, and those without an argument are left out.
#[inline(always)]
fn for_each_group<'b, T: Copy>(
    bsdfs: impl Iterator<Item = Option<&'b Bsdf<'b>>>,
    argument: impl Fn(usize) -> Option<T>,
    mut compute: impl FnMut(&[Point<'b, T>]),
) {
    let points = bsdfs.take(LANES).enumerate().filter_map(|(lane, bsdf)| {
        let bsdf = bsdf.filter(|bsdf| bsdf.lobe.is_in_blocks())?;
        Some(Point { lane, bsdf, argument: argument(lane)? })
    });
    let mut waiting: ArrayVec<_, LANES> = points.collect();
    while waiting.len() >= MIN_POINTS {
        let lobe = waiting[0].bsdf.lobe;
        let is_member = |point: &Point<T>| std::ptr::eq(point.bsdf.lobe, lobe);
        let group: ArrayVec<_, LANES> = waiting.iter().copied().filter(is_member).collect();
        waiting.retain(|point| !is_member(point));
        if group.len() >= MIN_POINTS {
            compute(&group);
        }
    }
}

impl Bsdf<'_> {
    /// [`Self::eval_and_pdf`] of each lane for the `wi` of the lane, if it is computed together
    /// with others.
    #[inline]
    pub fn eval_and_pdf_each<'b>(
        bsdfs: impl Iterator<Item = Option<&'b Bsdf<'b>>>,
        wi: impl Fn(usize) -> Option<Vec3>,
    ) -> Lanes<Option<(Spectrum, Pdf<SolidAngle>)>> {
        let mut found = [None; LANES];
        for_each_group(bsdfs, wi, |group| {
            let (mut pairs, mut values) = (DirectionPairs::ZERO, Evaluations::ZERO);
            for (i, &Point { bsdf, argument: wi, .. }) in group.iter().enumerate() {
                pairs.set(i, bsdf.wo, bsdf.frame().to_local(wi));
            }
            let Bsdf { lobe, context, .. } = *group[0].bsdf;
            lobe.eval_and_pdf_each(context, &pairs, &mut values);
            for (i, &Point { lane, bsdf, argument: wi }) in group.iter().enumerate() {
                found[lane] = Some(bsdf.seen_value(wi, pairs.wi.get(i), || values.get(i)));
            }
        });
        found
    }

    /// [`Self::sample`] of each lane with the numbers `u` of the lane, if it is computed together
    /// with others.
    #[inline]
    pub fn sample_each<'b>(
        bsdfs: impl Iterator<Item = Option<&'b Bsdf<'b>>>,
        u: impl Fn(usize) -> [f32; 3],
    ) -> Lanes<Option<Option<BsdfSample>>> {
        let mut found = [None; LANES];
        for_each_group(
            bsdfs,
            |lane| Some(u(lane)),
            |group| {
                let (mut numbers, mut samples) = (SampleNumbers::ZERO, Samples::ZERO);
                for (i, &Point { bsdf, argument: u, .. }) in group.iter().enumerate() {
                    numbers.set(i, bsdf.wo, u);
                }
                let Bsdf { lobe, context, .. } = *group[0].bsdf;
                lobe.sample_each(context, &numbers, &mut samples);
                for (i, &Point { lane, bsdf, .. }) in group.iter().enumerate() {
                    found[lane] = Some(samples.get(i).and_then(|sample| bsdf.seen_sample(sample)));
                }
            },
        );
        found
    }
}
