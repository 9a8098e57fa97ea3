//! Metals.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::mirror::reflect;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// A smooth metal: a mirror with the Fresnel reflectance of η + ik.
#[derive(Clone, Copy, Debug)]
pub struct SmoothConductor {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part of the index of refraction.
    pub k: Spectrum,
    /// Tint of the reflection.
    pub reflectance: Spectrum,
}

/// A metal of microfacets: f = F D G / (4 cos θo cos θi). [Cook & Torrance 1982; Walter et al.
/// 2007, eq. 20]
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    /// The metal of the facets.
    pub metal: SmoothConductor,
    /// Distribution of the facet normals.
    pub distribution: MicrofacetDistribution,
}

impl SmoothConductor {
    /// Index of the tint among the packed parameters.
    pub(crate) const REFLECTANCE: usize = 6;

    #[inline]
    fn numbers(&self) -> [f32; 9] {
        let [a, b, c] = self.eta.to_array();
        let [d, e, f] = self.k.to_array();
        let [g, h, i] = self.reflectance.to_array();
        [a, b, c, d, e, f, g, h, i]
    }

    #[inline]
    fn of_numbers(p: &[f32; PARAMETERS]) -> Self {
        Self { eta: color(p, 0), k: color(p, 3), reflectance: color(p, 6) }
    }

    #[inline(always)]
    fn fresnel(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos, self.eta, self.k) * self.reflectance
    }

    pub(super) fn gold() -> Self {
        Self {
            eta: Spectrum::rgb(0.143, 0.375, 1.442),
            k: Spectrum::rgb(3.983, 2.386, 1.603),
            reflectance: Spectrum::ONE,
        }
    }

    /// η → 0: reflects everything.
    fn perfect() -> Self {
        Self { eta: Spectrum::ZERO, k: Spectrum::ONE, reflectance: Spectrum::ONE }
    }
}

impl Lobe<'_> for SmoothConductor {
    const DELTA: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        padded(self.numbers())
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self::of_numbers(p)
    }

    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 3]) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample::new(reflect(wo), self.fresnel(wo.z), None))
    }

    fn examples() -> Vec<Self> {
        vec![Self::gold(), Self::perfect()]
    }
}

#[cfg(test)]
impl LobeLaws for SmoothConductor {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: true,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn is_lossless(&self, wo: Vec3) -> bool {
        self.eta.is_black() && self.reflectance == Spectrum::ONE && wo.z > 0.0
    }
}

/// Normal of the facet that mirrors `wo` into `wi`, or `None` unless both are above the surface.
#[inline]
pub(super) fn half_vector(wo: Vec3, wi: Vec3) -> Option<Vec3> {
    (wo.z > 0.0 && wi.z > 0.0).then(|| (wo + wi).normalize())
}

/// Density of the direction into which the visible facets of normal `h` reflect `wo`: p(h) / (4
/// wo·h). [Walter et al. 2007, eq. 14]
#[inline(always)]
pub(super) fn reflected_pdf(
    distribution: &MicrofacetDistribution,
    wo: Vec3,
    h: Vec3,
) -> Pdf<SolidAngle> {
    Pdf::new(distribution.d(h) * distribution.g1(wo) / (4.0 * wo.z))
}

/// D G / (4 cos θo): reflection of light from `wi` by facets of normal `h`, without the Fresnel
/// factor. [Walter et al. 2007, eq. 20, times cos θi]
#[inline(always)]
pub(super) fn reflected(distribution: &MicrofacetDistribution, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
    distribution.d(h) * distribution.g(wo, wi) / (4.0 * wo.z)
}

impl RoughConductor {
    /// Index of the two roughnesses among the packed parameters, after those of the metal.
    pub(crate) const ALPHA: usize = 9;
}

impl Lobe<'_> for RoughConductor {
    const DELTA: bool = false;
    const IN_BLOCKS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [a, b, c, d, e, f, g, h, i] = self.metal.numbers();
        let [j, k, l] = self.distribution.pack();
        padded([a, b, c, d, e, f, g, h, i, j, k, l])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            metal: SmoothConductor::of_numbers(p),
            distribution: MicrofacetDistribution::unpack([p[9], p[10], p[11]]),
        }
    }

    #[inline(always)]
    fn specialized(self, mut f: impl FnMut(Self)) {
        self.distribution.specialized(
            #[inline(always)]
            |distribution| f(Self { distribution, ..self }),
        );
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_and_pdf(wo, wi).0
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        self.eval_and_pdf(wo, wi).1
    }

    #[inline(always)]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        let h = (wo + wi).normalize();
        let f = self.metal.fresnel(wo.dot(h)) * reflected(&self.distribution, wo, wi, h);
        let pdf = reflected_pdf(&self.distribution, wo, h).get();
        let is_above = wo.z > 0.0 && wi.z > 0.0;
        (if is_above { f } else { Spectrum::ZERO }, Pdf::new(if is_above { pdf } else { 0.0 }))
    }

    /// Samples a visible facet and reflects about its normal: the weight is F G/G₁.
    #[inline(always)]
    fn sample(&self, wo: Vec3, [u, v, _]: [f32; 3]) -> Option<BsdfSample> {
        let h = self.distribution.sample_visible(wo, [u, v]);
        let cos_h = wo.dot(h);
        let wi = h * (2.0 * cos_h) - wo;
        let pdf = reflected_pdf(&self.distribution, wo, h);
        let weight = self.metal.fresnel(cos_h) * self.distribution.shadowing(wo, wi);
        let is_above = wo.z > 0.0 && wi.z > 0.0 && cos_h > 0.0;
        let exists = is_above && pdf.is_positive();
        exists.then_some(BsdfSample::new(wi, weight, Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.distribution.spread()
    }

    fn examples() -> Vec<Self> {
        let (gold, perfect) = (SmoothConductor::gold(), SmoothConductor::perfect());
        let with = |metal, distribution, alpha| Self {
            metal,
            distribution: MicrofacetDistribution::isotropic(distribution, alpha),
        };
        let anisotropic = |distribution, alpha, masking| Self {
            metal: perfect,
            distribution: MicrofacetDistribution { distribution, masking, alpha },
        };
        vec![
            with(gold, Distribution::Beckmann, 0.25),
            with(perfect, Distribution::Beckmann, 0.6),
            with(perfect, Distribution::Ggx, 0.1),
            with(gold, Distribution::Ggx, 0.5),
            anisotropic(Distribution::Beckmann, [0.15, 0.4], Masking::Separable),
            anisotropic(Distribution::Ggx, [0.5, 0.2], Masking::Correlated),
        ]
    }
}

#[cfg(test)]
impl LobeLaws for RoughConductor {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { distribution: self.distribution.with_alpha(alpha), ..*self }.into())
    }
}
