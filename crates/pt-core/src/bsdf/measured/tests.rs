//! Measured tables of known lobes.

use pt_scene::material::{Distribution, Masking};
use pt_scene::measured::Tables;
use pt_testing::Random;

use super::super::microfacet::MicrofacetDistribution;
use super::super::{Diffuse, RoughConductor, SmoothConductor};
use super::*;

/// An instrument of higher resolution than that of the examples.
const FINE: Gonioreflectometer = Gonioreflectometer {
    theta: 16,
    phi: 13,
    distribution: [96, 65],
    visible: [64, 49],
    reflected: 48,
};

/// A direction at most `most` radians from the normal.
fn direction(random: &mut Random, most: f32) -> Vec3 {
    let (sin, cos) = trig::sin_cos(random.between(0.0, most));
    let (s, c) = trig::sin_cos_tau(random.unit());
    Vec3::new(sin * c, sin * s, cos)
}

/// Mean difference of two lobes relative to the mean of the second, over directions of light within
/// 70 degrees from the normal, for views within `most`.
fn difference<'m, 'l>(measured: &impl Lobe<'m>, lobe: &impl Lobe<'l>, most: f32) -> f32 {
    let mut random = Random::new(1);
    let (mut sum, mut apart) = (0.0, 0.0);
    for _ in 0..20_000 {
        let wo = direction(&mut random, most);
        let wi = direction(&mut random, 1.2);
        let (f, g) = (measured.eval(wo, wi), lobe.eval(wo, wi));
        sum += g.mean();
        apart += (f.0 - g.0).abs().dot(Vec3::splat(1.0 / 3.0));
    }
    apart / sum
}

fn metal(alpha: [f32; 2]) -> (RoughConductor, MicrofacetDistribution) {
    let distribution = MicrofacetDistribution {
        distribution: Distribution::Ggx,
        masking: Masking::Correlated,
        alpha,
    };
    (RoughConductor { metal: SmoothConductor::gold(), distribution }, distribution)
}

fn measured(specimen: &TabulatedLobe<'_>) -> MeasuredTables {
    MeasuredTables::new(&FINE.measure(specimen))
}

/// An isotropic lobe with relative and with absolute values, and an anisotropic one: interpolation
/// between table entries has errors of 3 · 10⁻⁴, 2 · 10⁻³ and 8 · 10⁻⁴.
#[test]
fn tables_report_what_was_measured() {
    let (isotropic, distribution) = metal([0.3; 2]);
    let (brushed, of_brushed) = metal([0.5, 0.25]);
    let mut specimen = TabulatedLobe {
        description: "gold",
        eval: &|wo, wi| isotropic.eval(wo, wi),
        distribution: &|m| distribution.d(m),
        is_isotropic: true,
        is_relative: true,
    };
    let tables = measured(&specimen);
    let found = difference(&Measured::new(0, &tables), &isotropic, 1.2);
    assert!(found < 1e-3, "{found}");
    specimen.is_relative = false;
    let tables = measured(&specimen);
    let found = difference(&Measured::new(0, &tables), &isotropic, 1.2);
    assert!(found < 4e-3, "{found}");
    let specimen = TabulatedLobe {
        eval: &|wo, wi| brushed.eval(wo, wi),
        distribution: &|m| of_brushed.d(m),
        is_isotropic: false,
        ..specimen
    };
    let tables = measured(&TabulatedLobe { is_relative: true, ..specimen });
    let found = difference(&Measured::new(0, &tables), &brushed, 1.2);
    assert!(found < 2e-3, "{found}");
}

/// A diffuse surface, with facets of all orientations, reflects the same fraction of light from all
/// viewing directions.
#[test]
fn a_matte_surface_is_one() {
    let rho = Spectrum::rgb(0.2, 0.5, 0.8);
    let specimen = TabulatedLobe {
        description: "paper",
        eval: &|wo, wi| Diffuse { rho }.eval(wo, wi),
        distribution: &|_| std::f32::consts::FRAC_1_PI,
        is_isotropic: true,
        is_relative: true,
    };
    let tables = measured(&specimen);
    let lobe = Measured::new(0, &tables);
    let mut random = Random::new(2);
    for degrees in [0.0f32, 20.0, 40.0, 60.0] {
        let (sin, cos) = trig::sin_cos(degrees.to_radians());
        let wo = Vec3::new(sin, 0.0, cos);
        let count = 40_000;
        let weights = (0..count).filter_map(|_| {
            let [u, v] = random.unit_2d();
            lobe.sample(wo, [u, v, 0.0]).map(|s| s.weight)
        });
        let albedo = weights.sum::<Spectrum>() * (1.0 / count as f32);
        let error = (albedo.0 / rho.0 - Vec3::ONE).abs().max_element();
        assert!(error < 0.02, "{degrees}: {albedo:?}");
    }
}

/// Tables over a half circle are completed by a rotation of half a turn, and those over a quarter
/// by mirroring: the lobe is equal for light and view rotated or mirrored together, and a quarter
/// table of a brushed metal, which is mirror symmetric, is equal to the half table.
#[test]
fn parts_of_a_turn_are_repeated() {
    let (brushed, distribution) = metal([0.5, 0.25]);
    let specimen = TabulatedLobe {
        description: "brushed",
        eval: &|wo, wi| brushed.eval(wo, wi),
        distribution: &|m| distribution.d(m),
        is_isotropic: false,
        is_relative: true,
    };
    let half = FINE.measure(&specimen);
    let tables = half.tables();
    // The first 7 of 13 angles.
    let quarter = Measurements::new(Tables {
        phi: tables.phi[..7].to_vec(),
        vndf: part(&tables.vndf, 7, 13),
        luminance: part(&tables.luminance, 7, 13),
        colors: tables.colors[..tables.colors.len() / 13 * 7].to_vec(),
        ..tables.clone()
    })
    .expect("a quarter");
    assert_eq!((half.repeats(), quarter.repeats()), (2, 4));
    let (half, quarter) = (MeasuredTables::new(&half), MeasuredTables::new(&quarter));
    let (half, quarter) = (Measured::new(0, &half), Measured::new(1, &quarter));
    let mut random = Random::new(3);
    for _ in 0..2000 {
        let (wo, wi) = (direction(&mut random, 1.5), direction(&mut random, 1.5));
        let turned = Vec3::new(-1.0, -1.0, 1.0);
        assert_eq!(half.eval(wo, wi), half.eval(wo * turned, wi * turned), "{wo} {wi}");
        let other = Vec3::new(1.0, -1.0, 1.0);
        assert_eq!(half.eval(wo, wi), half.mirrored().eval(wo * other, wi * other), "{wo} {wi}");
        for mirror in [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), turned] {
            assert_eq!(quarter.eval(wo, wi), quarter.eval(wo * mirror, wi * mirror), "{wo} {wi}");
            let pdf = |wo, wi| quarter.pdf(wo, wi).get();
            assert_eq!(pdf(wo, wi), pdf(wo * mirror, wi * mirror), "{wo} {wi}");
        }
    }
    let found = difference(&quarter, &half, 1.2);
    assert!(found < 1e-3, "{found}");
}

/// The first `count` of the tables of `of` azimuths.
fn part(planes: &measured::Planes, count: usize, of: usize) -> measured::Planes {
    let values = planes.values[..planes.values.len() / of * count].to_vec();
    measured::Planes { values, ..*planes }
}

/// The lobe width is about α of the facets.
#[test]
fn roughness_is_that_of_facets() {
    for alpha in [0.1f32, 0.2, 0.4] {
        let (lobe, distribution) = metal([alpha; 2]);
        let specimen = TabulatedLobe {
            description: "gold",
            eval: &|wo, wi| lobe.eval(wo, wi),
            distribution: &|m| distribution.d(m),
            is_isotropic: true,
            is_relative: true,
        };
        let found = measured(&specimen).spread;
        assert!((found / alpha - 1.0).abs() < 0.15, "{alpha}: {found}");
    }
}
