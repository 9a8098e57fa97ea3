//! Examples for the laws: each part of the lobe, and the brightest material.

use pt_math::Spectrum;

use super::MetallicRoughness;

pub(super) fn all() -> Vec<MetallicRoughness> {
    let plain = MetallicRoughness {
        base_color: Spectrum::rgb(0.3, 0.2, 0.1),
        metallic: 0.0,
        roughness: 0.5,
        eta: 1.5,
        specular: 1.0,
        specular_color: Spectrum::ONE,
        transmission: 0.0,
        diffuse_transmission: 0.0,
        diffuse_transmission_color: Spectrum::ONE,
        anisotropy: 0.0,
        direction: [1.0, 0.5],
        rotation: 0.0,
        iridescence: 0.0,
        film_ior: 1.3,
        film_thickness: 400.0,
        sheen_color: Spectrum::ZERO,
        sheen_roughness: 0.0,
        clearcoat: 0.0,
        clearcoat_roughness: 0.0,
        coat_normal: [0.0; 2],
        thin: false,
    };
    let gold = Spectrum::rgb(1.0, 0.77, 0.34);
    vec![
        plain,
        MetallicRoughness {
            base_color: gold,
            metallic: 1.0,
            anisotropy: 0.7,
            direction: [0.2, 0.9],
            rotation: 0.4,
            ..plain
        },
        MetallicRoughness {
            specular_color: Spectrum::rgb(1.5, 0.4, 0.1),
            specular: 0.8,
            eta: 1.8,
            iridescence: 0.6,
            film_thickness: 300.0,
            metallic: 0.3,
            ..plain
        },
        MetallicRoughness {
            sheen_color: Spectrum::rgb(0.8, 0.5, 0.9),
            sheen_roughness: 0.4,
            roughness: 0.9,
            clearcoat: 0.9,
            clearcoat_roughness: 0.5,
            ..plain
        },
        MetallicRoughness {
            clearcoat: 1.0,
            clearcoat_roughness: 0.4,
            coat_normal: [0.3, -0.5],
            anisotropy: 0.5,
            rotation: 1.0,
            ..plain
        },
        MetallicRoughness {
            base_color: gold,
            transmission: 0.8,
            roughness: 0.4,
            eta: 1.33,
            metallic: 0.2,
            ..plain
        },
        MetallicRoughness {
            base_color: gold,
            transmission: 0.4,
            diffuse_transmission: 0.6,
            roughness: 0.45,
            clearcoat: 0.5,
            clearcoat_roughness: 0.6,
            thin: true,
            ..plain
        },
        // Maximum albedo.
        MetallicRoughness {
            base_color: Spectrum::ONE,
            roughness: 0.8,
            sheen_color: Spectrum::ONE,
            sheen_roughness: 0.6,
            clearcoat: 1.0,
            clearcoat_roughness: 0.6,
            iridescence: 0.5,
            ..plain
        },
    ]
}
