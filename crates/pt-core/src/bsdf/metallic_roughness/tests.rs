use pt_testing::Random;

use super::*;

fn plain() -> MetallicRoughness {
    MetallicRoughness::examples()[0]
}

fn above(random: &mut Random) -> Vec3 {
    let w = random.direction();
    Vec3::new(w.x, w.y, w.z.abs().max(0.3)).normalize()
}

/// D V cos θi of GGX facets of one roughness α, from the text of glTF 2.0, app. B.3.2, in double
/// precision.
fn facets_by_the_text(alpha: f64, [wo, wi, h]: [Vec3; 3]) -> f64 {
    let [wo, wi, h] = [wo, wi, h].map(Vec3::as_dvec3);
    let a2 = alpha * alpha;
    let d = a2 / (std::f64::consts::PI * ((h.z * h.z) * (a2 - 1.0) + 1.0).powi(2));
    let seen = |w: f64| (a2 + (1.0 - a2) * w * w).sqrt();
    let v = 0.5 / (wi.z * seen(wo.z) + wo.z * seen(wi.z));
    d * v * wi.z
}

/// F₀ + (F₉₀ − F₀)(1 − cos θ)⁵.
fn schlick_by_the_text(f0: f64, f90: f64, cos: f64) -> f64 {
    f0 + (f90 - f0) * (1.0 - cos).powi(5)
}

/// A black base under facets of low roughness, with little multiple scattering.
#[test]
fn reflections_of_dielectrics_are_those_of_the_text() {
    let lobe = MetallicRoughness {
        base_color: Spectrum::ZERO,
        roughness: 0.3,
        eta: 1.4,
        specular: 0.7,
        specular_color: Spectrum::rgb(2.0, 0.5, 0.1),
        ..plain()
    };
    let mut random = Random::new(4);
    for _ in 0..200 {
        let [wo, wi] = [0, 1].map(|_| above(&mut random));
        let h = (wo + wi).normalize();
        let cos = f64::from(wo.dot(h));
        let distribution = facets_by_the_text(0.09, [wo, wi, h]);
        let got = lobe.eval(wo, wi).to_array();
        for (c, color) in [2.0, 0.5, 0.1].into_iter().enumerate() {
            let f0 = 0.7 * ((0.4_f64 / 2.4).powi(2) * color).min(1.0);
            let want = schlick_by_the_text(f0, 0.7, cos) * distribution;
            let error = (f64::from(got[c]) - want).abs();
            assert!(error <= 2e-3 * want + 2e-4, "{wo} {wi} {c}: {} {want}", got[c]);
        }
    }
}

/// The reflection of metals does not depend on `specular`.
#[test]
fn reflections_of_metals_are_those_of_the_text() {
    let base_color = Spectrum::rgb(0.9, 0.5, 0.2);
    let lobe =
        MetallicRoughness { base_color, metallic: 1.0, roughness: 0.1, specular: 0.0, ..plain() };
    let mut random = Random::new(5);
    for _ in 0..200 {
        let [wo, wi] = [0, 1].map(|_| above(&mut random));
        let h = (wo + wi).normalize();
        let distribution = facets_by_the_text(0.01, [wo, wi, h]);
        for (c, f0) in [0.9, 0.5, 0.2].into_iter().enumerate() {
            let want = schlick_by_the_text(f0, 1.0, f64::from(wo.dot(h))) * distribution;
            let got = f64::from(lobe.eval(wo, wi).to_array()[c]);
            assert!((got - want).abs() <= 2e-3 * want + 1e-3, "{wo} {wi} {c}: {got} {want}");
        }
    }
}

/// Light transmitted by a sheet has the colour of the base, times 1 − F, and the direction of
/// reflection to the other side.
#[test]
fn what_goes_through_sheets_is_that_of_the_text() {
    let base_color = Spectrum::rgb(0.9, 0.5, 0.2);
    let lobe =
        MetallicRoughness { base_color, transmission: 1.0, roughness: 0.4, thin: true, ..plain() };
    let mut random = Random::new(6);
    for _ in 0..200 {
        let [wo, mirrored] = [0, 1].map(|_| above(&mut random));
        let wi = Vec3::new(mirrored.x, mirrored.y, -mirrored.z);
        let h = (wo + mirrored).normalize();
        let left = 1.0 - schlick_by_the_text(0.04, 1.0, f64::from(wo.dot(h)));
        let distribution = facets_by_the_text(0.16, [wo, mirrored, h]);
        for (wo, wi) in [(wo, wi), (-wo, -wi)] {
            for (c, color) in [0.9, 0.5, 0.2].into_iter().enumerate() {
                let (got, want) =
                    (f64::from(lobe.eval(wo, wi).to_array()[c]), color * left * distribution);
                assert!((got - want).abs() <= 2e-3 * want + 1e-5, "{wo} {wi} {c}: {got} {want}");
            }
        }
    }
}

/// Diffuse scattering without specular reflection is 1/π of its colour, on each side.
#[test]
fn diffuse_light_goes_to_both_sides() {
    let lobe = MetallicRoughness {
        base_color: Spectrum::rgb(0.8, 0.4, 0.2),
        specular: 0.0,
        diffuse_transmission: 0.25,
        diffuse_transmission_color: Spectrum::rgb(0.1, 0.9, 0.3),
        thin: true,
        ..plain()
    };
    let (wo, wi) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, 0.6));
    let below = Vec3::new(wi.x, wi.y, -wi.z);
    for (direction, share, color) in [(wi, 0.75, [0.8, 0.4, 0.2]), (below, 0.25, [0.1, 0.9, 0.3])] {
        let want = color.map(|c| share * c * 0.6 * std::f32::consts::FRAC_1_PI);
        let got = lobe.eval(wo, direction).to_array();
        for c in 0..3 {
            assert!((got[c] / want[c] - 1.0).abs() < 0.02, "{direction} {c}: {got:?} {want:?}");
        }
    }
}

/// Rotating the anisotropy is the inverse of rotating the surface; a direction given by a texture
/// is equivalent to an angle.
#[test]
fn highlights_turn_with_their_direction() {
    let brushed = MetallicRoughness { metallic: 1.0, roughness: 0.3, anisotropy: 0.8, ..plain() };
    let mut random = Random::new(7);
    for angle in [0.3_f32, 1.9, -2.5] {
        let (sin, cos) = angle.sin_cos();
        let by_angle = MetallicRoughness { rotation: angle, ..brushed };
        let direction = [0.5 + 0.4 * cos, 0.5 + 0.4 * sin];
        let by_direction = MetallicRoughness { direction, ..brushed };
        let turned = |w: Vec3| Vec3::new(w.x * cos - w.y * sin, w.x * sin + w.y * cos, w.z);
        for _ in 0..100 {
            let [wo, wi] = [0, 1].map(|_| above(&mut random));
            let want = brushed.eval(wo, wi).luminance();
            for lobe in [by_angle, by_direction] {
                let got = lobe.eval(turned(wo), turned(wi)).luminance();
                assert!((got - want).abs() <= 2e-3 * want + 1e-6, "{angle}: {got} {want}");
            }
        }
    }
    // Along the direction, α is interpolated to 1 by the square of the strength.
    let [along, across] = brushed.distribution().alpha;
    assert!((across - 0.09).abs() < 1e-6 && (along - (0.09 + 0.91 * 0.64)).abs() < 1e-6);
}
