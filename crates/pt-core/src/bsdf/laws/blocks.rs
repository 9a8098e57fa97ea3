//! Evaluations and samples of many points have the bits of those of one.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_testing::Random;

use super::all_lobes;
use super::numbers::{direction, numbers, partner};
use crate::bsdf::{AnyLobe, Bsdf, BsdfSample, LobeContext, LobeRecord};

/// Number of points for each lobe in a million.
const POINTS: usize = 1 << 20;
/// Number of lanes of a block.
const LANES: usize = pt_math::sampler::LANES;

/// Viewers and sources of light on either side of a surface with one of two lobes, and random
/// numbers.
fn points<'a>(lobes: &'a [LobeRecord; 2], random: &mut Random) -> Vec<(Bsdf<'a>, Vec3, [f32; 3])> {
    let count = 1 + random.below(LANES);
    let point = |_| {
        let wo = direction(random);
        let lobe = &lobes[random.below(2)];
        let normal = if random.below(4) == 0 { direction(random) } else { Vec3::Z };
        let bsdf = Bsdf::new(lobe, LobeContext::examples(), false, normal, Vec3::Z, wo);
        let wi = if random.below(2) == 0 { direction(random) } else { partner(wo, random) };
        (bsdf, wi, numbers(random))
    };
    (0..count).map(point).collect()
}

fn value_bits((f, pdf): (Spectrum, Pdf<SolidAngle>)) -> [u32; 4] {
    let [r, g, b] = f.to_array();
    [r, g, b, pdf.get()].map(f32::to_bits)
}

fn sample_bits(sample: Option<BsdfSample>) -> Option<Vec<u32>> {
    let BsdfSample { wi, weight, pdf, eta_scale } = sample?;
    let numbers = [&wi.to_array()[..], &weight.to_array(), &[eta_scale]].concat();
    let pdf = pdf.map_or(0.0, Pdf::get);
    Some(numbers.into_iter().chain([pdf]).map(f32::to_bits).collect())
}

#[test]
fn points_in_blocks_have_the_bits_of_single_ones() {
    let lobes: Vec<_> = all_lobes().iter().map(AnyLobe::record).collect();
    let in_blocks: Vec<_> = lobes.iter().filter(|lobe| lobe.is_in_blocks()).collect();
    assert!(!in_blocks.is_empty());
    let mut random = Random::new(5);
    for lobe in &in_blocks {
        let kinds = in_blocks.iter().filter(|other| other.kind == lobe.kind).count();
        let other = in_blocks[random.below(in_blocks.len())];
        let (pair, mut together) = ([**lobe, *other], 0);
        while together < POINTS / kinds {
            let points = points(&pair, &mut random);
            let bsdfs = points.iter().map(|(bsdf, ..)| Some(bsdf));
            let values = Bsdf::eval_and_pdf_each(bsdfs.clone(), |lane| Some(points[lane].1));
            for (value, (bsdf, wi, _)) in values.iter().zip(&points) {
                let alone = bsdf.eval_and_pdf(*wi);
                let name = bsdf.lobe_name();
                if let Some(value) = *value {
                    together += 1;
                    assert_eq!(value_bits(value), value_bits(alone), "{name} {bsdf:?} {wi}");
                }
            }
            let samples = Bsdf::sample_each(bsdfs, |lane| points[lane].2);
            for (sample, (bsdf, _, u)) in samples.iter().zip(&points) {
                if let Some(sample) = *sample {
                    assert_eq!(sample_bits(sample), sample_bits(bsdf.sample(*u)), "{bsdf:?} {u:?}");
                }
            }
        }
    }
}
