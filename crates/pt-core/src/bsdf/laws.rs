//! Laws that hold for every lobe in `lobes!`. A new lobe is tested without writing a test.
//!
//! This module checks that the methods of a lobe agree with one another. [`physics`]: agreement
//! with physical laws. [`gains`]: energy of layered and principled lobes. [`numbers`]: finite
//! results for all arguments. [`world`]: the same laws on surfaces in world space. [`spread`]:
//! reuse of directions by neighbouring viewers. [`blocks`]: the same bits in blocks.
//! [`properties`]: the statements of a lobe about itself that the laws need.

mod blocks;
mod gains;
mod numbers;
mod physics;
mod properties;
mod sampled_mean;
mod spread;
mod world;

use pt_math::{Spectrum, Vec3};
use pt_testing::{Chi2, Chi2Failure, Random, chi2_cone, chi2_sphere};

pub(super) use self::properties::{
    CONSERVING, CONSERVING_BY_TABLES, LobeLaws, LobeProperties, SamplingMaps,
};
pub(super) use self::sampled_mean::grid;
pub(super) use super::AnyLobe;
use super::LobeContext;
use super::mirror::reflect;

/// Directions above the surface, from the normal to grazing.
pub(super) const ABOVE: [Vec3; 4] = [
    Vec3::Z,
    Vec3::new(0.6, 0.0, 0.8),
    Vec3::new(-0.48, 0.64, 0.6),
    Vec3::new(0.768_374_9, -0.638_749_2, 0.04),
];
/// Cosines to the normal, down to values that only bugs and rounding produce.
const COSINES: [f32; 6] = [1.0, 0.5, 1e-3, 1e-6, 1e-12, 0.0];
/// Extremes of sampler values, and some values inside.
const CORNERS: [f32; 5] = [0.0, 1e-7, 0.5, 0.999_999, 0.999_999_94];

/// A point of the square with a third number, which is a hash of the point.
fn with_third([u, v]: [f32; 2]) -> [f32; 3] {
    let seed = u64::from(u.to_bits()) << 32 | u64::from(v.to_bits());
    [u, v, Random::new(seed).unit()]
}

fn unit_3d(random: &mut Random) -> [f32; 3] {
    let [u, v] = random.unit_2d();
    [u, v, random.unit()]
}

pub(super) fn below(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}

fn at_cosine(cos: f32) -> Vec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    Vec3::new(0.8 * sin, -0.6 * sin, cos)
}

/// The examples, and the rough ones again with the minimum and maximum practical roughness.
fn all_lobes() -> Vec<AnyLobe<'static>> {
    let examples = AnyLobe::examples();
    let extremes = [1e-3, 0.01, 1.0];
    let rough =
        extremes.iter().flat_map(|&a| examples.iter().filter_map(move |l| l.laws().with_alpha(a)));
    let rough: Vec<_> = rough.collect();
    [examples, rough].concat()
}

/// Runs a law on all lobes, from directions above and below the surface.
fn for_all(law: impl Fn(&AnyLobe, Vec3, &mut Random)) {
    for lobe in all_lobes() {
        for wo in ABOVE.iter().flat_map(|&w| [w, below(w)]) {
            law(&lobe, wo, &mut Random::new(1));
        }
    }
}

/// Runs a law on all lobes that are not Dirac deltas.
fn for_all_smooth(law: impl Fn(&AnyLobe, Vec3, &mut Random)) {
    for_all(|lobe, wo, random| {
        if !lobe.is_delta() {
            law(lobe, wo, random);
        }
    });
}

/// Returns true if two spectra agree to the relative error `share` of the larger one.
pub(super) fn close(a: Spectrum, b: Spectrum, share: f32) -> bool {
    (a.0 - b.0).abs().max_element() <= share * a.0.abs().max_element().max(b.0.abs().max_element())
}

/// The histogram of samples agrees with the density; the deficit to 1 is absorption.
#[test]
fn samples_follow_their_density() {
    let lobes: Vec<_> = AnyLobe::examples().into_iter().filter(|l| !l.is_delta()).collect();
    let rough = lobes.iter().filter_map(|l| l.laws().with_alpha(1.0));
    let lobes: Vec<_> = lobes.iter().copied().chain(rough).collect();
    let mut failures = Vec::new();
    for lobe in &lobes {
        for wo in ABOVE.iter().flat_map(|&w| [w, below(w)]) {
            let name = format!("{lobe:?} {wo}");
            let config = Chi2 { samples: 100_000, ..Chi2::new(&name) };
            let result = chi2_sphere(
                |u| lobe.sample(wo, with_third(u)).filter(|s| s.pdf.is_some()).map(|s| s.wi),
                |wi| lobe.pdf(wo, wi).get(),
                &config.one_of(8 * lobes.len()),
            );
            failures.extend(result.err());
        }
    }
    assert_none(&failures);
}

/// Panics with all failures, if there are any.
fn assert_none(failures: &[Chi2Failure]) {
    let lines: Vec<_> = failures.iter().map(Chi2Failure::to_string).collect();
    assert!(lines.is_empty(), "{} failures:\n{}", lines.len(), lines.join("\n"));
}

/// Lobes too narrow for the bins of the sphere agree with their density in a cone around the mirror
/// direction.
#[test]
fn samples_of_narrow_lobes_follow_their_density() {
    let lobes: Vec<_> =
        AnyLobe::examples().iter().filter_map(|l| l.laws().with_alpha(1e-3)).collect();
    let views = &ABOVE[..3];
    let mut failures = Vec::new();
    for lobe in &lobes {
        for &wo in views {
            // Facets within tan θ = 4α reflect within twice the angle, 1 − cos 8α ≈ 32 α².
            let name = format!("{lobe:?} {wo}");
            let result = chi2_cone(
                |u| lobe.sample(wo, with_third(u)).map(|s| s.wi),
                |wi| lobe.pdf(wo, wi).get(),
                reflect(wo),
                3.2e-5,
                &Chi2::new(&name).one_of(views.len() * lobes.len()),
            );
            failures.extend(result.err());
        }
    }
    assert_none(&failures);
}

/// weight · pdf = eval, and the density of a sample equals that of its direction: the three methods
/// describe one function.
#[test]
fn weight_times_pdf_is_eval() {
    for_all_smooth(|lobe, wo, random| {
        for _ in 0..1000 {
            let Some(s) = lobe.sample(wo, unit_3d(random)) else { continue };
            let Some(pdf) = s.pdf.map(pt_math::Pdf::get) else {
                assert!(lobe.laws().properties().has_delta_part, "only deltas have no density");
                continue;
            };
            assert!(pdf > 0.0 && pdf.is_finite(), "{lobe:?} {wo} {s:?}");
            let again = lobe.pdf(wo, s.wi).get();
            assert!((pdf - again).abs() <= 2e-3 * pdf, "{lobe:?} {wo} {s:?}: {again}");
            let f = lobe.eval(wo, s.wi);
            assert!(close(s.weight * pdf, f, 2e-3), "{lobe:?} {wo} {s:?}: {f:?}");
        }
    });
}

/// A Dirac delta has no density, and evaluates to 0 everywhere.
#[test]
fn delta_lobes_are_found_by_sampling_only() {
    for_all(|lobe, wo, random| {
        if !lobe.is_delta() {
            return;
        }
        let sampled = lobe.sample(wo, unit_3d(random));
        assert!(sampled.is_none_or(|s| s.pdf.is_none()), "{lobe:?}");
        for wi in sampled.map(|s| s.wi).into_iter().chain([random.direction()]) {
            assert!(lobe.eval(wo, wi).is_black() && lobe.pdf(wo, wi).get() == 0.0, "{lobe:?}");
        }
    });
}

/// The density is positive in all directions into which light is scattered.
#[test]
fn density_covers_what_is_evaluated() {
    for_all_smooth(|lobe, wo, random| {
        for _ in 0..2000 {
            let wi = random.direction();
            let (f, p) = (lobe.eval(wo, wi), lobe.pdf(wo, wi).get());
            assert!(f.0.min_element() >= 0.0 && p >= 0.0, "{lobe:?} {wo} {wi}: {f:?} {p}");
            assert!(f.is_black() || p > 0.0, "{lobe:?} {wo} {wi}: {f:?}");
            let allowed = lobe.transmits() || (wo.z > 0.0 && wi.z > 0.0);
            assert!(allowed || (f.is_black() && p == 0.0), "{lobe:?} {wo} {wi} is below");
        }
    });
}

/// |∂ω/∂u × ∂ω/∂v| by central differences; `None` where the map has an edge or a kink.
fn stretch(lobe: &AnyLobe, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<f32> {
    const H: f32 = 2e-3;
    let at =
        |du: f32, dv: f32| Some(lobe.sample(wo, [u + du * H, v + dv * H, choice])?.wi.as_dvec3());
    let w = at(0.0, 0.0)?;
    let derivative = |du: f32, dv: f32| {
        let (forward, back) = (at(du, dv)? - w, w - at(-du, -dv)?);
        let bent = (forward - back).length() > 0.05 * (forward + back).length();
        (!bent).then_some((forward + back) / (2.0 * f64::from(H)))
    };
    Some(derivative(1.0, 0.0)?.cross(derivative(0.0, 1.0)?).length() as f32)
}

/// The sampling map stretches area by 1/pdf: |∂ω/∂u × ∂ω/∂v| · pdf = 1. There is no random error,
/// so a wrong density fails at the first point.
#[test]
fn stretch_is_one_over_the_density() {
    for lobe in AnyLobe::examples().iter().filter(|lobe| !lobe.is_delta()) {
        let one_map = match lobe.laws().properties().maps {
            SamplingMaps::Disjoint => true,
            SamplingMaps::Overlapping => false,
            SamplingMaps::OfThreeNumbers => continue,
        };
        let mut checked = 0;
        for wo in ABOVE {
            let mut random = Random::new(2);
            for _ in 0..200 {
                let u = unit_3d(&mut random).map(|x| 0.02 + 0.9 * x);
                let sample = lobe.sample(wo, u).filter(|s| s.pdf.is_some());
                let (Some(area), Some(s)) = (stretch(lobe, wo, u), sample) else {
                    continue;
                };
                let probability = lobe.laws().map_probability(wo, s.wi, u[2]);
                let product = area * lobe.pdf(wo, s.wi).get() / probability;
                let right = if one_map { (product - 1.0).abs() < 0.01 } else { product > 0.99 };
                assert!(right, "{lobe:?} {wo} at {u:?}: {product}");
                checked += 1;
            }
        }
        assert!(checked > 400, "{lobe:?}: {checked}");
    }
}

/// Packed parameters are read back unchanged.
#[test]
fn records_round_trip() {
    for lobe in all_lobes() {
        let record = lobe.record();
        let again = AnyLobe::from_record(&record, LobeContext::examples());
        assert_eq!(again.record(), record);
        assert_eq!(format!("{again:?}"), format!("{lobe:?}"));
    }
}

/// The corners of the unit square and grazing directions give finite results.
#[test]
fn extremes_give_numbers() {
    let views = || COSINES.iter().map(|&c| at_cosine(c)).flat_map(|w| [w, below(w)]);
    let is_number = |f: Spectrum| f.is_finite() && f.0.min_element() >= 0.0;
    for lobe in all_lobes() {
        for wo in views() {
            for [a, b] in CORNERS.iter().flat_map(|&a| CORNERS.map(|b| [a, b])) {
                for u in CORNERS.map(|c| [a, b, c]) {
                    let Some(s) = lobe.sample(wo, u) else { continue };
                    assert!(is_number(s.weight), "{lobe:?} {wo} {u:?}: {s:?}");
                    assert!((s.wi.length() - 1.0).abs() < 1e-5, "{lobe:?} {wo} {u:?}: {s:?}");
                    assert!(
                        s.eta_scale > 0.0 && s.eta_scale.is_finite(),
                        "{lobe:?} {wo} {u:?}: {s:?}"
                    );
                    let p = s.pdf.map_or(1.0, pt_math::Pdf::get);
                    assert!(p > 0.0 && p.is_finite(), "{lobe:?} {wo} {u:?}: {s:?}");
                }
            }
            for wi in views().chain([reflect(wo)]) {
                let (f, p) = (lobe.eval(wo, wi), lobe.pdf(wo, wi).get());
                assert!(is_number(f) && p >= 0.0 && p.is_finite(), "{lobe:?} {wo} {wi}: {f:?} {p}");
            }
        }
    }
}
