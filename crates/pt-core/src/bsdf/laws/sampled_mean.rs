//! Means over samples of a lobe.

use pt_math::{DVec3, Spectrum, Vec3};

use crate::bsdf::{AnyLobe, BsdfSample};

/// Mean of a function of samples over n × n points; absorbed samples count as black.
pub(super) fn mean(
    lobe: &AnyLobe,
    wo: Vec3,
    n: u32,
    f: impl Fn(&BsdfSample) -> Spectrum,
) -> Spectrum {
    // In f64: sums of equal weights must not lose digits.
    let samples = grid(n).filter_map(|u| lobe.sample(wo, u));
    let sum = samples.map(|s| f(&s).0.as_dvec3()).sum::<DVec3>();
    Spectrum((sum / f64::from(n * n)).as_vec3())
}

/// Scattered fraction of the incident power: the weight of a sample without the factor by which
/// refraction scales radiance.
pub(super) fn power(s: &BsdfSample) -> Spectrum {
    s.weight * s.eta_scale
}

/// Midpoints of n × n cells of the unit square, each with a third number; these are spread
/// uniformly over the interval in every neighbourhood (multiples of the golden ratio).
pub(in crate::bsdf) fn grid(n: u32) -> impl Iterator<Item = [f32; 3]> {
    let middle = move |i: u32| (i as f32 + 0.5) / n as f32;
    let third = |i: u32| (i.wrapping_mul(0x9E37_79B9) >> 8) as f32 / (1 << 24) as f32;
    (0..n * n).map(move |i| [middle(i % n), middle(i / n), third(i)])
}
