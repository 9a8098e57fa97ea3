//! Energy, reciprocity, Fresnel's equations, and limits.

use std::collections::BTreeSet;
use std::f32::consts::PI;

use pt_math::{DVec3, Spectrum, Vec3, trig};
use pt_scene::material::Distribution;

use super::sampled_mean::{grid, mean, power};
use super::{ABOVE, AnyLobe, LobeLaws, close, for_all, for_all_smooth, unit_3d};
use crate::bsdf::mirror::reflect;
use crate::bsdf::{BsdfSample, Lobe};

/// No lobe scatters more power than arrives, from any direction, except those of Mitsuba, whose
/// gain [`gains`](super::gains) documents. (The course's models, which are not reciprocal, may gain
/// energy.)
#[test]
fn energy_is_conserved() {
    for_all(|lobe, wo, _| {
        if let Some(most) = lobe.laws().properties().max_albedo {
            let albedo = mean(lobe, wo, 256, power).max_channel();
            assert!(albedo <= most, "{lobe:?} {wo}: {albedo}");
        }
    });
}

/// White furnace: lobes without absorption scatter all incident light. The factor 1/η² of radiance
/// by refraction is due to the solid angle of the beam and is no loss.
#[test]
fn perfect_lobes_lose_nothing() {
    for_all(|lobe, wo, _| {
        if lobe.laws().is_lossless(wo) {
            let albedo = mean(lobe, wo, 64, power);
            assert!(close(albedo, Spectrum::ONE, 1e-5), "{lobe:?} {wo}: {albedo:?}");
        }
    });
    let examples = AnyLobe::examples();
    let kinds = |of: &dyn Fn(&dyn LobeLaws) -> bool| -> BTreeSet<u32> {
        let chosen = examples.iter().filter(|lobe| of(lobe.laws()));
        chosen.map(|lobe| lobe.record().kind).collect()
    };
    let lossless = kinds(&|laws| laws.is_lossless(Vec3::Z));
    let can_be = kinds(&|laws| laws.properties().can_be_lossless);
    assert_eq!(lossless, can_be, "an example of each lobe that can be lossless");
}

/// The albedo by samples agrees with the integral of `eval` over the sphere, by angles.
#[test]
fn weights_sum_to_the_integral_of_the_lobe() {
    for lobe in AnyLobe::examples().iter().filter(|l| !l.is_delta()) {
        for wo in &ABOVE[..3] {
            let evaluated = grid(512).map(|[u, v, _]| {
                let ((sin, cos), (s, c)) = (trig::sin_cos(u * PI), trig::sin_cos_tau(v));
                let wi = Vec3::new(sin * c, sin * s, cos);
                lobe.eval(*wo, wi).0.as_dvec3() * f64::from(2.0 * PI * PI * sin)
            });
            let integral = Spectrum((evaluated.sum::<DVec3>() / (512.0 * 512.0)).as_vec3());
            let smooth = |s: &BsdfSample| if s.pdf.is_some() { s.weight } else { Spectrum::ZERO };
            let sampled = mean(lobe, *wo, 512, smooth);
            assert!(close(integral, sampled, 2e-3), "{lobe:?} {wo}: {integral:?} {sampled:?}");
        }
    }
}

/// Helmholtz: f(wo, wi) = f(wi, wo), and f(wo, wi) η² = f(wi, wo) for light that is refracted on
/// its way from `wi`, where the index is η times that of `wo`. [Veach 1997, §5.2] For exceptions,
/// see [`LobeLaws::reciprocity`].
#[test]
fn scattering_is_reciprocal() {
    for_all_smooth(|lobe, wo, random| {
        if !lobe.laws().properties().is_reciprocal || wo.z <= 0.0 {
            return;
        }
        for _ in 0..500 {
            // Half of the directions where the lobe is large.
            let sampled = lobe.sample(wo, unit_3d(random)).map(|s| s.wi);
            for wi in sampled.into_iter().chain([random.direction()]) {
                let Some(eta_scale) = lobe.laws().reciprocity(wo, wi) else { continue };
                if wi.z.abs() <= 1e-3 {
                    continue;
                }
                let f = lobe.eval(wo, wi) * (eta_scale / wi.z.abs());
                let g = lobe.eval(wi, wo) * (1.0 / wo.z);
                // The smallest numbers have fewer digits, and so have those of facets that refract
                // at grazing angles, by cancellation in the difference of directions.
                let (least, share) =
                    if lobe.transmits() { (1e-5, 5e-3) } else { (f32::MIN_POSITIVE * 1e4, 1e-3) };
                let nothing = f.max_channel().max(g.max_channel()) < least;
                assert!(nothing || close(f, g, share), "{lobe:?} {wo} {wi}: {f:?} {g:?}");
            }
        }
    });
}

/// A reversed ray ends where it began, and L/η² is reciprocal: reflection or refraction from `wo`
/// to `wi` equals that from `wi` to `wo`, except for the scaling of radiance.
/// [Veach 1997, eq. 5.30]
#[test]
fn light_takes_the_same_way_back() {
    for_all(|lobe, wo, random| {
        if !lobe.is_delta() || !lobe.laws().properties().is_reciprocal {
            return;
        }
        let towards = |from: Vec3, up: bool| {
            let one_side =
                move |s: &BsdfSample| if (s.wi.z > 0.0) == up { power(s) } else { Spectrum::ZERO };
            mean(lobe, from, 256, one_side)
        };
        for _ in 0..4 {
            let Some(s) = lobe.sample(wo, unit_3d(random)) else { continue };
            let there = towards(wo, s.wi.z > 0.0);
            let back = towards(s.wi, wo.z > 0.0);
            assert!(close(there, back, 5e-3), "{lobe:?} {wo}: {there:?} {back:?}");
            let home = |b: &BsdfSample| (b.wi.z > 0.0) == (wo.z > 0.0);
            let returned = grid(64).find_map(|u| lobe.sample(s.wi, u).filter(home));
            let returned = returned.expect("what goes there comes back").wi;
            assert!((returned - wo).length() < 1e-3, "{lobe:?} {wo}: {returned}");
        }
    });
}

/// Reflectance of a dielectric by Fresnel's sine and tangent formulas, in f64.
fn fresnel_by_angles(cos_i: f64, eta: f64) -> f64 {
    let i = cos_i.acos();
    let sin_t = i.sin() / eta;
    if sin_t >= 1.0 {
        return 1.0;
    }
    let t = sin_t.asin();
    if i < 1e-4 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let perpendicular = (i - t).sin() / (i + t).sin();
    let parallel = (i - t).tan() / (i + t).tan();
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// A dielectric reflects by Fresnel's equations, and refracts by Snell's law.
#[test]
fn glass_obeys_fresnel_and_snell() {
    for_all(|lobe, wo, _| {
        let AnyLobe::Dielectric(glass) = lobe else { return };
        let eta = f64::from(if wo.z > 0.0 { glass.eta } else { 1.0 / glass.eta });
        let reflected =
            |s: &BsdfSample| if s.wi == reflect(wo) { Spectrum::ONE } else { Spectrum::ZERO };
        // One number makes the choice: n cells measure the fraction to half a cell.
        let share = f64::from(mean(lobe, wo, 512, reflected).0.x);
        let want = fresnel_by_angles(f64::from(wo.z.abs()), eta);
        assert!((share - want).abs() <= 0.51 / 512.0, "{lobe:?} {wo}: {share} {want}");
        if let Some(s) = glass.sample(wo, [0.999_999, 0.0, 0.0]).filter(|s| s.wi.z * wo.z < 0.0) {
            let (i, t) = (wo.as_dvec3(), s.wi.as_dvec3());
            let sines = DVec3::new(i.x + eta * t.x, i.y + eta * t.y, 0.0);
            assert!(sines.length() < 1e-6, "{lobe:?} {wo}: {}", s.wi);
            assert!((f64::from(s.eta_scale) - eta * eta).abs() < 1e-6);
        }
    });
}

/// As the roughness vanishes, a rough metal approaches the smooth one.
#[test]
fn rough_metal_becomes_a_mirror() {
    const ALPHA: f32 = 1e-3;
    for lobe in AnyLobe::examples() {
        let AnyLobe::RoughConductor(rough) = lobe else { continue };
        let nearly = lobe.laws().with_alpha(ALPHA).expect("rough");
        for wo in &ABOVE[..3] {
            let smooth = rough.metal.sample(*wo, [0.5; 3]).expect("above").weight;
            let albedo = mean(&nearly, *wo, 64, power);
            assert!(close(albedo, smooth, 1e-2), "{rough:?} {wo}: {albedo:?} {smooth:?}");
            // A facet rotated by the angle a rotates the reflection by 2a. For Beckmann, a is at
            // most α √(ln 2²⁴); for GGX with 64 numbers each, α √(2·64), and more for facets of
            // greater visibility.
            let furthest = match rough.distribution.distribution {
                Distribution::Beckmann => 2.0 * ALPHA * 16.64f32.sqrt() * 1.01,
                Distribution::Ggx => 4.0 * ALPHA * 128f32.sqrt(),
            };
            for s in grid(64).filter_map(|u| nearly.sample(*wo, u)) {
                assert!((s.wi - reflect(*wo)).length() <= furthest, "{rough:?} {wo}: {s:?}");
            }
        }
    }
}
