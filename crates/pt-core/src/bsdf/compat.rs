//! Materials of the university course as its program computes them, used under `--cs184`.
//! Differences from physics are named; `docs/cs184.md` shows images.

use std::f32::consts::PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, trig};
use pt_scene::material::Distribution;

use super::conductor::half_vector;
use super::dielectric::refract;
#[cfg(test)]
use super::laws::{AnyLobe, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::mirror::reflect;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, padded};

/// Glass with Schlick's approximation instead of Fresnel's equations, and with radiance
/// multiplied (not divided) by η² on entering.
#[derive(Clone, Copy, Debug)]
pub struct SchlickGlass {
    /// Tint of reflected light.
    pub reflectance: Spectrum,
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction below the surface.
    pub ior: f32,
}

/// Refraction with radiance multiplied by η² on entering.
#[derive(Clone, Copy, Debug)]
pub struct EtaSquaredRefraction {
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction below the surface.
    pub ior: f32,
}

/// Refracted direction and the factor 1/η² of the course, with η the index of this side over that
/// of the other; `None` for total internal reflection.
#[inline]
fn course_refract(wo: Vec3, ior: f32) -> Option<(Vec3, f32)> {
    let eta = if wo.z > 0.0 { ior } else { 1.0 / ior };
    let cos2 = 1.0 - (1.0 - wo.z * wo.z) / (eta * eta);
    (cos2 >= 0.0).then(|| (refract(wo, cos2.sqrt(), eta), eta * eta))
}

impl Lobe<'_> for SchlickGlass {
    const DELTA: bool = true;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.reflectance.to_array(), self.transmittance.to_array());
        padded([a, b, c, d, e, f, self.ior])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { reflectance: color(p, 0), transmittance: color(p, 3), ior: p[6] }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let reflected = BsdfSample::new(reflect(wo), self.reflectance, None);
        let Some((wi, factor)) = course_refract(wo, self.ior) else { return Some(reflected) };
        let r0 = (1.0 - self.ior) / (1.0 + self.ior);
        let f = super::fresnel::schlick(wo.z.abs(), Spectrum::splat(r0 * r0)).0.x;
        if u[0] < f {
            return Some(reflected);
        }
        Some(BsdfSample::new(wi, self.transmittance * factor, None))
    }

    fn examples() -> Vec<Self> {
        vec![Self { reflectance: Spectrum::ONE, transmittance: Spectrum::ONE, ior: 1.45 }]
    }
}

#[cfg(test)]
impl LobeLaws for SchlickGlass {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: false,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: None,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }
}

impl Lobe<'_> for EtaSquaredRefraction {
    const DELTA: bool = true;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [a, b, c] = self.transmittance.to_array();
        padded([a, b, c, self.ior])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { transmittance: color(p, 0), ior: p[3] }
    }

    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 3]) -> Option<BsdfSample> {
        let (wi, factor) = course_refract(wo, self.ior)?;
        Some(BsdfSample::new(wi, self.transmittance * factor, None))
    }

    fn examples() -> Vec<Self> {
        vec![Self { transmittance: Spectrum::ONE, ior: 1.45 }]
    }
}

#[cfg(test)]
impl LobeLaws for EtaSquaredRefraction {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: false,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: None,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }
}

/// A Beckmann metal with the formulas given in the course: π instead of √π in Λ, and the simplified
/// Fresnel term of [Lazányi & Szirmay-Kalos 2005], evaluated at the angle of `wi` to the surface
/// instead of the facet.
#[derive(Clone, Copy, Debug)]
pub struct SimplifiedConductor {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part of the index of refraction.
    pub k: Spectrum,
    /// Roughness of the microfacets.
    pub alpha: f32,
}

impl SimplifiedConductor {
    /// Index of the roughness among the packed parameters.
    pub(crate) const ALPHA: usize = 6;

    /// D(h) of the Beckmann distribution.
    #[inline]
    fn d(&self, h: Vec3) -> f32 {
        MicrofacetDistribution::isotropic(Distribution::Beckmann, self.alpha).d(h)
    }

    /// A facet normal with density D(h) cos θ: tan²θ = −α² ln(1 − u), φ = 2πv. [Walter et al. 2007,
    /// eq. 28 and 29]
    #[inline]
    fn sample_facet(&self, [u, v]: [f32; 2]) -> Vec3 {
        let tan2 = -self.alpha * self.alpha * trig::ln(1.0 - u);
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = (tan2 * cos * cos).sqrt();
        let (s, c) = trig::sin_cos_tau(v);
        Vec3::new(sin * c, sin * s, cos)
    }

    #[inline]
    fn lambda(&self, w: Vec3) -> f32 {
        let cos2 = w.z * w.z;
        let tan = ((1.0 - cos2).max(0.0) / cos2.max(f32::MIN_POSITIVE)).sqrt();
        if tan == 0.0 {
            return 0.0;
        }
        let a = 1.0 / (self.alpha * tan);
        0.5 * (trig::erf(a) - 1.0 + trig::exp(-a * a) / (a * PI))
    }

    #[inline]
    fn fresnel(&self, cos: f32) -> Spectrum {
        let channel = |eta: f32, k: f32| {
            let (n2, c2) = (eta * eta + k * k, cos * cos);
            let s = (n2 - 2.0 * eta * cos + c2) / (n2 + 2.0 * eta * cos + c2);
            let p = (n2 * c2 - 2.0 * eta * cos + 1.0) / (n2 * c2 + 2.0 * eta * cos + 1.0);
            0.5 * (s + p)
        };
        let (e, k) = (self.eta.0, self.k.0);
        Spectrum::rgb(channel(e.x, k.x), channel(e.y, k.y), channel(e.z, k.z))
    }
}

impl Lobe<'_> for SimplifiedConductor {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.eta.to_array(), self.k.to_array());
        padded([a, b, c, d, e, f, self.alpha])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { eta: color(p, 0), k: color(p, 3), alpha: p[6] }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let Some(h) = half_vector(wo, wi) else { return Spectrum::ZERO };
        let g = 1.0 / (1.0 + self.lambda(wo) + self.lambda(wi));
        self.fresnel(wi.z) * (self.d(h) * g / (4.0 * wo.z))
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let pdf = |h: Vec3| Pdf::new(self.d(h) * h.z / (4.0 * wo.dot(h)));
        half_vector(wo, wi).map_or(Pdf::ZERO, pdf)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, _]: [f32; 3]) -> Option<BsdfSample> {
        let h = self.sample_facet([u, v]);
        let wi = h * (2.0 * wo.dot(h)) - wo;
        let pdf = self.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    fn examples() -> Vec<Self> {
        vec![Self {
            eta: Spectrum::rgb(0.059_193, 0.059_881, 0.047_366),
            k: Spectrum::rgb(4.1283, 3.5892, 2.8132),
            alpha: 0.25,
        }]
    }
}

#[cfg(test)]
impl LobeLaws for SimplifiedConductor {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: false,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: None,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { alpha, ..*self }.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::laws::{ABOVE, below, close, grid};

    /// The course's glass differs from ours by Schlick's approximation and the inverted η²: without
    /// either factor, both conserve energy.
    #[test]
    fn course_glass_gains_by_the_square_of_the_index() {
        for lobe in AnyLobe::examples() {
            let (AnyLobe::SchlickGlass(_) | AnyLobe::EtaSquaredRefraction(_)) = lobe else {
                continue;
            };
            for wo in ABOVE.iter().flat_map(|&w| [w, below(w)]) {
                for s in grid(16).filter_map(|u| lobe.sample(wo, u)) {
                    let refracted = s.wi.z * wo.z < 0.0;
                    // sin θo / sin θi, unless the angle is near 0.
                    let sines = |w: Vec3| w.x.hypot(w.y);
                    if refracted && sines(wo) > 0.1 {
                        let eta = sines(wo) / sines(s.wi);
                        assert!(close(s.weight, Spectrum::splat(eta * eta), 1e-4), "{lobe:?} {wo}");
                    } else if !refracted {
                        assert_eq!(s.weight, Spectrum::ONE, "{lobe:?} {wo}");
                    }
                }
            }
        }
    }
}
