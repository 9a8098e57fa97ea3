//! Fresnel reflectance.

use pt_math::Spectrum;

/// Reflectance of a smooth dielectric for unpolarised light, and the cosine of the refracted
/// direction; `None` for total internal reflection.
///
/// `cos_i` ≥ 0 is the cosine on the side of incidence, and `eta` the index of refraction of the
/// other side over that of this side. [Born & Wolf, Principles of Optics, §1.5.2]
#[inline]
pub fn dielectric(cos_i: f32, eta: f32) -> Option<(f32, f32)> {
    let sin2_t = (1.0 - cos_i * cos_i).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((refracted(cos_i, cos_t, eta), cos_t))
}

/// Reflectance for two known cosines. Near total reflection, computing the refracted cosine from
/// the incident one loses precision.
#[inline]
pub fn refracted(cos_i: f32, cos_t: f32, eta: f32) -> f32 {
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Reflectance of a conductor with index η + ik against vacuum, for unpolarised light.
/// [Born & Wolf, Principles of Optics, §14.2]
#[inline(always)]
pub fn conductor(cos_i: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
    let channel = |eta: f32, k: f32| {
        let cos2 = cos_i * cos_i;
        let sin2 = (1.0 - cos2).max(0.0);
        let t0 = eta * eta - k * k - sin2;
        let a2_b2 = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
        let a = (0.5 * (a2_b2 + t0)).max(0.0).sqrt();
        let s = 2.0 * a * cos_i;
        let perpendicular = (a2_b2 + cos2 - s) / (a2_b2 + cos2 + s);
        let t = s * sin2;
        let whole = cos2 * a2_b2 + sin2 * sin2 + t;
        // An index of 0 at normal incidence reflects all light in both polarizations.
        let ratio = if whole > 0.0 { (whole - 2.0 * t) / whole } else { 1.0 };
        0.5 * (perpendicular * ratio + perpendicular)
    };
    Spectrum::rgb(channel(eta.0.x, k.0.x), channel(eta.0.y, k.0.y), channel(eta.0.z, k.0.z))
}

/// (1 − cos θ)⁵. [Schlick 1994]
#[inline]
pub fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    (m * m) * (m * m) * m
}

/// F = F₀ + (1 − F₀)(1 − cos θ)⁵. [Schlick 1994]
#[inline]
pub fn schlick(cos: f32, f0: Spectrum) -> Spectrum {
    f0 + (Spectrum::ONE - f0) * schlick_weight(cos)
}

/// Mean of [`schlick`] over diffuse illumination: F₀ + (1 − F₀)/21.
#[inline]
pub fn mean_schlick(f0: Spectrum) -> Spectrum {
    f0 + (Spectrum::ONE - f0) * (1.0 / 21.0)
}

/// Mean of [`dielectric`] over diffuse illumination, with `eta` the index of the other side over
/// that of the side of incidence; accurate to 0.007. The transmittances of the two directions
/// differ by the factor η². [Fit of Kulla & Conty 2017, "Revisiting Physically Based Shading at
/// Imageworks"]
#[inline]
pub fn mean_dielectric(eta: f32) -> f32 {
    let outside = |eta: f32| (eta - 1.0) / (4.085_67 + 1.000_71 * eta);
    if eta >= 1.0 { outside(eta) } else { 1.0 - eta * eta * (1.0 - outside(1.0 / eta)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At normal incidence F = ((η − 1)² + k²) / ((η + 1)² + k²).
    #[test]
    fn normal_incidence_has_its_closed_form() {
        let (eta, k) = (0.2f32, 3.9f32);
        let want = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        let got = conductor(1.0, Spectrum::splat(eta), Spectrum::splat(k)).0.x;
        assert!((got - want).abs() < 1e-6, "{got} {want}");
        let (f, cos_t) = dielectric(1.0, 1.5).unwrap();
        assert!((f - 0.04).abs() < 1e-6 && cos_t == 1.0);
    }

    /// A metal with an index of 0, which a file may contain, reflects everything.
    #[test]
    fn an_index_of_0_is_a_mirror() {
        for cos in [0.0, 0.3, 1.0] {
            let f = conductor(cos, Spectrum::ZERO, Spectrum::ZERO);
            assert!((f.0.x - 1.0).abs() < 1e-6, "{cos}: {f:?}");
        }
    }

    /// A conductor without absorption is a dielectric.
    #[test]
    fn conductor_without_absorption_is_a_dielectric() {
        for cos in [0.05, 0.3, 0.7, 1.0] {
            let c = conductor(cos, Spectrum::splat(1.5), Spectrum::ZERO).0.x;
            let (d, _) = dielectric(cos, 1.5).unwrap();
            assert!((c - d).abs() < 1e-5, "{cos}: {c} {d}");
        }
    }

    /// The means equal the integrals 2 ∫ F(cos θ) cos θ d cos θ.
    #[test]
    fn means_are_integrals() {
        let mean = |f: &dyn Fn(f32) -> f32| {
            let middle = |i: u16| (f32::from(i) + 0.5) / 4096.0;
            (0..4096).map(middle).map(|cos| 2.0 * cos * f(cos)).sum::<f32>() / 4096.0
        };
        for eta in [0.5, 0.7, 0.9, 1.1, 1.33, 1.5, 2.0, 2.5] {
            let want = mean(&|cos| dielectric(cos, eta).map_or(1.0, |(f, _)| f));
            let got = mean_dielectric(eta);
            assert!((got - want).abs() < 7e-3, "{eta}: {got} {want}");
        }
        let f0 = Spectrum::rgb(0.04, 0.5, 1.0);
        let want = [0, 1, 2].map(|c| mean(&|cos| schlick(cos, f0).to_array()[c]));
        let error = mean_schlick(f0).0 - Spectrum::from(want).0;
        assert!(error.abs().max_element() < 1e-4, "{want:?}");
    }

    /// The reflectance is equal from both sides (Stokes).
    #[test]
    fn dielectric_is_the_same_from_both_sides() {
        for cos in [0.05, 0.3, 0.7, 1.0] {
            let (f, cos_t) = dielectric(cos, 1.5).unwrap();
            let (g, back) = dielectric(cos_t, 1.0 / 1.5).unwrap();
            assert!((f - g).abs() < 1e-5 && (back - cos).abs() < 1e-4, "{cos}");
        }
        assert!(dielectric(0.5, 1.0 / 1.5).is_none(), "total reflection beyond 41.8 degrees");
    }
}
