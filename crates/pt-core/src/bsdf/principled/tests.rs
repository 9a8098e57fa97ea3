use super::*;

/// Values of Mitsuba 3.9.1 for the base colour (0.8, 0.4, 0.2), for all parts and from both sides.
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
        let got = lobe.eval(wo, wi);
        let error = (got.0 / Vec3::from_array(want) - 1.0).abs().max_element();
        assert!(error < 1e-4, "{lobe:?} {wo} {wi}: {got:?} {want:?}");
    }
}
