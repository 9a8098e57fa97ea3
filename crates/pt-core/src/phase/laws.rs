//! Laws that hold for every phase function in `phases!`.

use pt_math::Vec3;
use pt_testing::{Chi2, Random, chi2_cone, chi2_sphere, mean_z_test, sidak};

use super::{AnyPhase, HenyeyGreenstein, Isotropic, PhaseFunction};

const VIEWS: [Vec3; 3] = [Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(-0.48, 0.64, 0.6)];

/// The histogram of samples agrees with the density, which integrates to 1.
#[test]
fn samples_follow_their_density() {
    let phases = AnyPhase::examples();
    for phase in &phases {
        for wo in VIEWS {
            let name = format!("{phase:?} {wo}");
            let config = Chi2::new(&name).one_of(phases.len() * VIEWS.len());
            chi2_sphere(|u| Some(phase.sample(wo, u)), |wi| phase.pdf(wo, wi).get(), &config)
                .unwrap();
        }
    }
}

/// Strongly forward or backward scattering agrees with its density, in a cone that contains most of
/// it.
#[test]
fn samples_of_narrow_phase_functions_follow_their_density() {
    for g in [0.995, -0.995] {
        let phase = HenyeyGreenstein { g };
        for wo in VIEWS {
            let name = format!("{phase:?} {wo}");
            let config = Chi2::new(&name).one_of(2 * VIEWS.len());
            let axis = -wo * g.signum();
            let sample = |u| Some(phase.sample(wo, u));
            chi2_cone(sample, |wi| phase.pdf(wo, wi).get(), axis, 1e-3, &config).unwrap();
        }
    }
}

#[test]
fn light_may_go_backwards() {
    let mut random = Random::new(3);
    for phase in AnyPhase::examples() {
        for _ in 0..1000 {
            let (wo, wi) = (random.direction(), random.direction());
            let towards = |wo, wi| phase.area(wo) * phase.pdf(wo, wi).get();
            let (there, back) = (towards(wo, wi), towards(wi, wo));
            assert!(there > 0.0 && (there - back).abs() <= 1e-5 * there, "{phase:?} {wo} {wi}");
        }
    }
}

/// The corners of the unit square give directions with a density, for all g.
#[test]
fn extremes_give_directions() {
    let narrow = [0.9999, -0.9999, 0.5, -0.5].map(|g| HenyeyGreenstein { g }.into());
    for phase in AnyPhase::examples().into_iter().chain(narrow) {
        for x in [0.0, 1e-7, 0.5, 0.999_999, 0.999_999_94] {
            for y in [0.0, 0.25, 0.999_999_94] {
                for wo in VIEWS {
                    let wi = phase.sample(wo, [x, y]);
                    assert!((wi.length() - 1.0).abs() < 1e-5, "{phase:?} {x} {y}: {wi}");
                    assert!(phase.pdf(wo, wi).is_positive(), "{phase:?} {x} {y}: {wi}");
                }
            }
        }
    }
}

/// The mean cosine of the scattering angle is g.
#[test]
fn the_mean_cosine_is_g() {
    const N: u32 = 100_000;
    let phases = HenyeyGreenstein::examples();
    for phase in &phases {
        let mut random = Random::new(5);
        let cosines =
            (0..N).map(|_| f64::from(-Vec3::Z.dot(phase.sample(Vec3::Z, random.unit_2d()))));
        let cosines: Vec<_> = cosines.collect();
        let result = mean_z_test(&cosines, f64::from(phase.g), sidak(1e-4, phases.len()));
        result.unwrap_or_else(|e| panic!("{phase:?}: {e}"));
    }
}

#[test]
fn without_a_preference_it_is_isotropic() {
    let (flat, even) = (HenyeyGreenstein { g: 0.0 }, Isotropic);
    let mut random = Random::new(6);
    for _ in 0..100 {
        let (wo, wi) = (random.direction(), random.direction());
        assert!((flat.pdf(wo, wi).get() - even.pdf(wo, wi).get()).abs() < 1e-7);
    }
}
