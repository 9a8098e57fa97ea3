//! Lobes return finite, non-negative numbers for all arguments.

use pt_math::{Pdf, Spectrum, Vec3};
use pt_testing::Random;

use super::{AnyLobe, CORNERS, all_lobes, below, unit_3d};
use crate::bsdf::mirror::reflect;
use crate::bsdf::{BsdfSample, LobeContext, LobeRecord};

/// Number of calls of lobes per round.
const CALLS: u64 = 5;

/// A random one of the lobes, which are sorted by kind. Each parameter may be replaced by or
/// interpolated with that of a neighbour of the same kind.
fn between(lobes: &[LobeRecord], random: &mut Random) -> AnyLobe<'static> {
    let first = random.below(lobes.len());
    let mut record = lobes[first];
    let other = lobes[(first + random.below(6)).min(lobes.len() - 1)];
    if other.kind != record.kind {
        return AnyLobe::from_record(&record, LobeContext::examples());
    }
    for (number, other) in record.p.iter_mut().zip(other.p) {
        let t = match random.below(4) {
            0 => 1.0,
            1 => random.unit(),
            _ => 0.0,
        };
        *number = *number * (1.0 - t) + other * t;
    }
    AnyLobe::from_record(&record, LobeContext::examples())
}

/// A direction on either side, half of the time at grazing angles.
pub(super) fn direction(random: &mut Random) -> Vec3 {
    let w = random.direction();
    if random.below(2) == 0 {
        return w;
    }
    let z = w.z * pt_math::trig::powf(10.0, random.between(-12.0, 0.0));
    let across = ((1.0 - z * z) / (w.x * w.x + w.y * w.y)).sqrt();
    let grazing = Vec3::new(w.x * across, w.y * across, z);
    if grazing.is_normalized() { grazing } else { w }
}

/// Sampler values, sometimes extremes.
pub(super) fn numbers(random: &mut Random) -> [f32; 3] {
    let corner = random.below(8) == 0;
    unit_3d(random).map(|u| if corner { CORNERS[random.below(CORNERS.len())] } else { u })
}

/// A direction, in most cases one with a special relation to `wo`.
pub(super) fn partner(wo: Vec3, random: &mut Random) -> Vec3 {
    match random.below(5) {
        0 => reflect(wo),
        1 => -wo,
        2 => wo,
        3 => below(reflect(wo)),
        _ => direction(random),
    }
}

fn is_light(f: Spectrum) -> bool {
    f.is_finite() && f.0.min_element() >= 0.0
}

fn is_good(sample: &BsdfSample) -> bool {
    let p = sample.pdf.map_or(1.0, Pdf::get);
    is_light(sample.weight)
        && sample.wi.is_normalized()
        && sample.eta_scale > 0.0
        && sample.eta_scale.is_finite()
        && p > 0.0
        && p.is_finite()
}

/// Evaluates and samples random lobes for random directions, with `calls` calls in all.
fn ask(calls: u64) {
    let mut lobes: Vec<_> = all_lobes().iter().map(AnyLobe::record).collect();
    lobes.sort_by_key(|lobe| lobe.kind);
    let mut random = Random::new(11);
    for _ in 0..calls / CALLS {
        let lobe = between(&lobes, &mut random);
        let (wo, u) = (direction(&mut random), numbers(&mut random));
        let sample = lobe.sample(wo, u);
        assert!(sample.as_ref().is_none_or(is_good), "{lobe:?} {wo:?} {u:?}: {sample:?}");
        let drawn = sample.map_or_else(|| direction(&mut random), |s| s.wi);
        for wi in [drawn, partner(wo, &mut random)] {
            let (f, p) = (lobe.eval(wo, wi), lobe.pdf(wo, wi).get());
            let good = is_light(f) && p >= 0.0 && p.is_finite();
            assert!(good, "{lobe:?} {wo:?} {wi:?}: {f:?} {p}");
            let both = lobe.eval_and_pdf(wo, wi);
            assert_eq!((both.0, both.1.get()), (f, p), "{lobe:?} {wo:?} {wi:?}");
        }
    }
}

/// Results are never NaN, infinite or negative, and do not depend on whether they are computed
/// together.
#[test]
fn lobes_answer_with_numbers() {
    ask(4_000_000);
}

/// The same with a hundred million calls: `cargo test --release -p pt-core hundred_million --
/// --ignored`.
#[test]
#[ignore = "takes a minute or more"]
fn lobes_answer_a_hundred_million_times_with_numbers() {
    ask(100_000_000);
}
