//! Energy of materials with many parameters: layers scatter no more than arrives, and the gain of
//! Mitsuba's models is as documented.

use pt_math::{Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

use super::sampled_mean::{mean, power};
use crate::bsdf::microfacet::MicrofacetDistribution;
use crate::bsdf::{
    AnyLobe, CompensatedConductor, Lobe, MetallicRoughness, Principled, PrincipledThin,
    RoughConductor, SmoothConductor,
};

/// Number of integration points of an albedo, squared.
const GRID: u32 = 160;

/// Error of the albedos by the Kulla & Conty tables.
pub(super) const TABLES: f32 = 5e-3;

fn seen_at(cos: f32) -> Vec3 {
    Vec3::new(-0.8 * (1.0 - cos * cos).sqrt(), 0.6 * (1.0 - cos * cos).sqrt(), cos)
}

fn albedo<'t>(lobe: impl Into<AnyLobe<'t>>, cos: f32) -> f32 {
    mean(&lobe.into(), seen_at(cos), GRID, power).max_channel()
}

/// Error of the albedos of anisotropic facets, by the precision of the fit of
/// `multiscatter::across`.
const BRUSHED: f32 = 6e-3;

/// Adds a feature to a material.
type Add = fn(&mut MetallicRoughness);

/// Additions to a white material of glTF, each with the maximum brightness.
const ADDITIONS: [(&str, Add); 10] = [
    ("a coat", |m| (m.clearcoat, m.clearcoat_roughness) = (1.0, 0.4)),
    ("a smooth coat", |m| (m.clearcoat, m.clearcoat_roughness) = (1.0, 0.0)),
    ("sheen", |m| (m.sheen_color, m.sheen_roughness) = (Spectrum::ONE, 0.5)),
    ("narrow sheen", |m| (m.sheen_color, m.sheen_roughness) = (Spectrum::ONE, 0.1)),
    ("a bright reflection", |m| (m.specular_color, m.eta) = (Spectrum::splat(8.0), 1.7)),
    ("a film", |m| (m.iridescence, m.film_ior, m.film_thickness) = (1.0, 1.8, 250.0)),
    ("a direction", |m| (m.anisotropy, m.rotation) = (0.8, 0.5)),
    ("transmission", |m| m.transmission = 0.8),
    ("transmission of a sheet", |m| (m.transmission, m.thin) = (0.8, true)),
    ("diffuse transmission", |m| (m.diffuse_transmission, m.thin) = (0.5, true)),
];

/// White furnace: no two of the additions, nor one of them twice, gain energy on white dielectrics
/// and half-metallic white materials, to the precision of the tables.
#[test]
fn no_two_layers_of_gltf_gain_light() {
    let white = MetallicRoughness { base_color: Spectrum::ONE, ..MetallicRoughness::examples()[0] };
    for (first, add) in ADDITIONS {
        for (second, add_another) in ADDITIONS {
            for (metallic, roughness) in [(0.0, 0.2), (0.0, 0.8), (0.5, 0.4)] {
                let mut lobe = MetallicRoughness { metallic, roughness, ..white };
                add(&mut lobe);
                add_another(&mut lobe);
                let precision = if lobe.anisotropy > 0.0 { BRUSHED } else { TABLES };
                for cos in [1.0, 0.5, 0.1, -0.5] {
                    let albedo = mean(&lobe.into(), seen_at(cos), 64, power).max_channel();
                    assert!(
                        albedo <= 1.0 + precision,
                        "{first}, {second}, {metallic} metal, roughness {roughness}, {cos}: {albedo}"
                    );
                }
            }
        }
    }
}

/// Under a specular reflection of any brightness, a white base scatters all remaining light.
#[test]
fn white_of_gltf_loses_no_light() {
    for (roughness, specular_color, eta) in
        [(0.2, 1.0, 1.5), (0.6, 1.0, 1.5), (1.0, 1.0, 1.5), (0.5, 6.0, 1.8), (0.8, 0.0, 1.3)]
    {
        let lobe = MetallicRoughness {
            base_color: Spectrum::ONE,
            roughness,
            specular_color: Spectrum::splat(specular_color),
            eta,
            ..MetallicRoughness::examples()[0]
        };
        for cos in [1.0, 0.5, 0.15] {
            let albedo = albedo(lobe, cos);
            assert!((albedo - 1.0).abs() <= TABLES, "{roughness} {specular_color} {cos}: {albedo}");
        }
    }
}

/// White brushed metal with multiple scattering between facets scatters all incident light, at
/// every azimuth, to the precision of the fit in `multiscatter::across`.
#[test]
fn brushed_metal_gains_nothing_at_any_azimuth() {
    let metal =
        SmoothConductor { eta: Spectrum::ZERO, k: Spectrum::ONE, reflectance: Spectrum::ONE };
    for alpha in [[0.5, 0.25], [0.5, 0.031_25], [0.2, 0.04], [1.0, 0.1], [0.1, 0.8]] {
        let distribution = MicrofacetDistribution {
            distribution: Distribution::Ggx,
            masking: Masking::Correlated,
            alpha,
        };
        let lobe: AnyLobe =
            CompensatedConductor::new(RoughConductor { metal, distribution }).into();
        for cos in [0.04_f32, 0.15, 0.4, 0.8] {
            for azimuth in [0.0_f32, 22.5, 45.0, 67.5, 90.0] {
                let ((y, x), sin) = (azimuth.to_radians().sin_cos(), (1.0 - cos * cos).sqrt());
                let wo = Vec3::new(sin * x, sin * y, cos);
                let albedo = mean(&lobe, wo, GRID, power).max_channel();
                assert!((0.96..=1.006).contains(&albedo), "{alpha:?} {cos} {azimuth}: {albedo}");
            }
        }
    }
}

/// The figures of docs/formats.md: energy gain of Mitsuba's models, whose parts are added.
#[test]
fn gains_of_mitsuba_are_as_documented() {
    let plain = Principled { base_color: Spectrum::ONE, ..Principled::examples()[0] };
    let rough = Principled { roughness: 1.0, ..plain };
    let thin = PrincipledThin {
        base_color: Spectrum::ONE,
        roughness: 1.0,
        ..PrincipledThin::examples()[0]
    };
    let along = 1e-3;
    let cases: [(AnyLobe, f32, f32); 6] = [
        (rough.into(), along, 1.60),
        (plain.into(), along, 1.19),
        (plain.into(), 1.0, 1.04),
        (Principled { sheen: 1.0, ..rough }.into(), along, 1.69),
        (thin.into(), along, 1.56),
        (PrincipledThin { sheen: 1.0, ..thin }.into(), along, 1.65),
    ];
    for (lobe, cos, documented) in cases {
        let albedo = albedo(lobe, cos);
        assert!((albedo - documented).abs() <= 0.01, "{lobe:?} {cos}: {albedo}, {documented}");
    }
}

/// A smooth coat alone reflects 0.04 + 0.96 (1 − cos θ)⁵ at 0, 45, 70, 80 and 85 degrees.
/// [glTF 2.0, KHR_materials_clearcoat]
#[test]
fn coats_reflect_as_schlick_says() {
    let coat = MetallicRoughness {
        base_color: Spectrum::ZERO,
        specular: 0.0,
        clearcoat: 1.0,
        clearcoat_roughness: 0.0,
        ..MetallicRoughness::examples()[0]
    };
    for (degrees, wanted) in
        [(0.0_f32, 0.04), (45.0, 0.042), (70.0, 0.158), (80.0, 0.410), (85.0, 0.648)]
    {
        let albedo = albedo(coat, degrees.to_radians().cos());
        assert!((albedo - wanted).abs() < 1e-3, "{degrees}: {albedo}, {wanted}");
    }
}
