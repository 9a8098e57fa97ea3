use pt_testing::Random;

use super::*;
use crate::bsdf::{CompensatedConductor, RoughConductor, SmoothConductor};

/// What is scattered more than once is that of the metal that reflects all light.
#[test]
fn white_metal_is_the_perfect_conductor() {
    let (eta, k, reflectance) = (Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE);
    for (roughness, anisotropic) in [(0.3, 0.0), (0.7, 0.8), (1.0, 0.0)] {
        let lobe = Principled {
            base_color: Spectrum::ONE,
            roughness,
            anisotropic,
            metallic: 1.0,
            multiple_scattering: true,
            ..Principled::examples()[0]
        };
        let metal = SmoothConductor { eta, k, reflectance };
        let conductor = CompensatedConductor::new(RoughConductor { metal, facets: lobe.facets() });
        let mut random = Random::new(3);
        for _ in 0..1000 {
            let [wo, wi] = [0, 1].map(|_| random.direction()).map(|w| w * w.z.signum());
            let (got, want) = (lobe.eval(wo, wi).0, conductor.eval(wo, wi).0);
            assert!((got / want - 1.0).abs().max_element() < 1e-3, "{wo} {wi}: {got} {want}");
        }
    }
}

/// Under a gloss, a white base sends back all light that the gloss does not, whatever the roughness and the index.
#[test]
fn layers_of_white_lose_no_light() {
    const SAMPLES: u32 = 100_000;
    let mut random = Random::new(5);
    for (roughness, eta) in [
        (0.1, 1.5),
        (0.5, 1.5),
        (0.8, 1.33),
        (1.0, 2.0),
        (0.6, 1.0),
        (0.2, 1.5),
        (0.3, 1.5),
        (0.03, 1.5),
    ] {
        let lobe = Principled {
            base_color: Spectrum::ONE,
            roughness,
            eta,
            multiple_scattering: true,
            layered: true,
            ..Principled::examples()[0]
        };
        for cos in [0.05, 0.3, 0.7, 1.0_f32] {
            let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let light = (0..SAMPLES).map(|_| {
                let u = [0; 3].map(|_| random.unit());
                f64::from(lobe.sample(wo, u).map_or(0.0, |s| s.weight.luminance()))
            });
            let mean = light.sum::<f64>() / f64::from(SAMPLES);
            assert!((mean - 1.0).abs() < 0.005, "{roughness} {eta} {cos}: {mean}");
        }
    }
}

/// Values of Mitsuba 3.9.1 for the base colour (0.8, 0.4, 0.2), of all parts and from both sides.
#[test]
fn values_are_those_of_mitsuba() {
    let plain = Principled {
        base_color: Spectrum::rgb(0.8, 0.4, 0.2),
        roughness: 0.5,
        ..Principled::examples()[0]
    };
    let rough = |roughness| Principled { roughness, ..plain };
    let glass = Principled { spec_trans: 0.8, metallic: 0.3, ..rough(0.4) };
    let (above, there) = ([0.6, 0.0, 0.8], [-0.48, 0.36, 0.8]);
    let cases = [
        (plain, above, there, [0.224_497, 0.122_627, 0.071_691_4]),
        (
            Principled { flatness: 0.7, sheen: 0.6, sheen_tint: 0.4, ..rough(0.8) },
            above,
            [0.48, 0.64, 0.6],
            [0.144_654, 0.073_811_8, 0.038_390_8],
        ),
        (
            Principled { metallic: 0.75, anisotropic: 0.8, ..rough(0.4) },
            above,
            there,
            [0.090_208_5, 0.045_453_7, 0.023_076_3],
        ),
        (
            Principled { spec_tint: 0.9, eta: 1.8, ..rough(0.3) },
            above,
            [-0.64, -0.192, 0.744],
            [0.378_794, 0.195_926, 0.104_491],
        ),
        (
            Principled { clearcoat: 1.0, clearcoat_gloss: 0.2, ..rough(0.6) },
            above,
            [-0.6, 0.0, 0.8],
            [0.313_464, 0.211_587, 0.160_649],
        ),
        (glass, above, [-0.36, 0.0, -0.933], [7.037_11, 4.975_99, 3.518_55]),
        (glass, [0.36, 0.48, -0.8], [-0.48, -0.64, 0.6], [6.922_93, 4.895_25, 3.461_47]),
        (
            Principled { spec_trans: 1.0, eta: 1.3, ..plain },
            [0.6, 0.0, -0.8],
            [-0.48, 0.36, -0.8],
            [0.012_740_3; 3],
        ),
        (
            Principled { metallic: 0.5, clearcoat: 0.5, eta: 0.7, spec_tint: 0.3, ..plain },
            above,
            there,
            [0.315_793, 0.167_515, 0.093_375_9],
        ),
    ];
    for (lobe, wo, wi, want) in cases {
        let [wo, wi] = [wo, wi].map(|w| Vec3::from_array(w).normalize());
        for (lobe, sign) in [(lobe, 1.0), (Principled { inside_out: true, ..lobe }, -1.0)] {
            let got = lobe.eval(wo * sign, wi * sign);
            let error = (got.0 / Vec3::from_array(want) - 1.0).abs().max_element();
            assert!(error < 1e-4, "{lobe:?} {wo} {wi}: {got:?} {want:?}");
        }
    }
}
