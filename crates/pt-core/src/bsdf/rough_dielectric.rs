//! The rough interface between two dielectrics.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Microfacets that reflect and refract. [Walter et al. 2007, eq. 20 and 21]
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    /// Tint of reflected light.
    pub reflectance: Spectrum,
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction below the surface (−z) over that above it; not 1.
    pub eta: f32,
    /// Distribution of the facet normals.
    pub distribution: MicrofacetDistribution,
}

/// A pair of directions, with the side of `wo` up.
pub(super) struct DirectionPair {
    pub(super) wo: Vec3,
    pub(super) wi: Vec3,
    /// Index of refraction of the other side over that of the side of `wo`.
    pub(super) eta: f32,
    /// Normal of the facet that reflects or refracts one into the other.
    pub(super) h: Vec3,
    /// Fresnel reflectance of the facet.
    pub(super) f: f32,
    pub(super) is_reflected: bool,
}

/// Flips a direction so that the side of `wo` is up.
#[inline]
pub(super) fn upright(w: Vec3, wo: Vec3) -> Vec3 {
    if wo.z > 0.0 { w } else { Vec3::new(w.x, w.y, -w.z) }
}

/// Index of the other side over that of the side of `wo`, given the index below over that above.
#[inline]
pub(super) fn eta_from(wo: Vec3, eta: f32) -> f32 {
    if wo.z > 0.0 { eta } else { 1.0 / eta }
}

/// Direction into which a facet of normal `h`, seen from `wo` at the cosine `cos`, refracts;
/// `cos_t` is the cosine of the refracted direction. [Snell's law about h: across, the sine over η]
#[inline]
pub(super) fn refract(wo: Vec3, h: Vec3, [cos, cos_t]: [f32; 2], eta: f32) -> Vec3 {
    (h * (cos / eta - cos_t) - wo / eta).normalize()
}

impl DirectionPair {
    /// Creates the pair; `None` if no facet connects the directions. `eta` is the index below the
    /// surface (−z) over that above it.
    #[inline]
    pub(super) fn new(eta: f32, wo: Vec3, wi: Vec3) -> Option<Self> {
        let eta = eta_from(wo, eta);
        let (wo, wi) = (upright(wo, wo), upright(wi, wo));
        let is_reflected = wi.z > 0.0;
        // [Walter et al. 2007, eq. 13 and 16]
        let h = if is_reflected { wo + wi } else { wo + wi * eta };
        let h = (h * h.z.signum()).try_normalize()?;
        // Facets are visible from their front, and refract to their back.
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        let exists = wo.z > 0.0 && wi.z != 0.0 && cos_o > 0.0 && (cos_i > 0.0) == is_reflected;
        let f = if is_reflected {
            fresnel::dielectric(cos_o, eta).map_or(1.0, |(f, _)| f)
        } else {
            fresnel::refracted(cos_o, -cos_i, eta)
        };
        exists.then_some(Self { wo, wi, eta, h, f, is_reflected })
    }

    /// |∂h/∂wi|. [Walter et al. 2007, eq. 14 and 17]
    #[inline]
    fn jacobian(&self) -> f32 {
        if self.is_reflected {
            return 0.25 / self.wo.dot(self.h);
        }
        let (cos_o, cos_i) = (self.wo.dot(self.h), self.wi.dot(self.h));
        let s = cos_o + self.eta * cos_i;
        self.eta * self.eta * cos_i.abs() / (s * s)
    }

    /// Density of `wi` if visible facets are sampled, and this one scatters into `wi` with the
    /// probability `chosen`.
    #[inline]
    pub(super) fn density(&self, chosen: f32, distribution: &MicrofacetDistribution) -> f32 {
        let pdf = chosen * distribution.visible_pdf(self.wo, self.h) * self.jacobian();
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// G/G₁: the fraction of the visible facets that is also visible from the other direction.
    #[inline]
    pub(super) fn shadowing(&self, distribution: &MicrofacetDistribution) -> f32 {
        // Λ is equal on both sides.
        distribution.shadowing(self.wo, Vec3::new(self.wi.x, self.wi.y, self.wi.z.abs()))
    }

    /// Density of `wi` if visible facets are sampled, and reflect or refract by Fresnel's
    /// equations.
    #[inline]
    fn pdf(&self, distribution: &MicrofacetDistribution) -> f32 {
        self.density(if self.is_reflected { self.f } else { 1.0 - self.f }, distribution)
    }

    /// f cos θi over [`Self::pdf`].
    #[inline]
    fn weight(&self, lobe: &RoughDielectric) -> Spectrum {
        let shadowing = self.shadowing(&lobe.distribution);
        if self.is_reflected {
            lobe.reflectance * shadowing
        } else {
            lobe.transmittance * (shadowing / (self.eta * self.eta))
        }
    }
}

impl RoughDielectric {
    /// Index of the two roughnesses among the packed parameters.
    pub(crate) const ALPHA: usize = 7;
}

impl Lobe<'_> for RoughDielectric {
    const DELTA: bool = false;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.reflectance.to_array(), self.transmittance.to_array());
        let [g, h, i] = self.distribution.pack();
        padded([a, b, c, d, e, f, self.eta, g, h, i])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            reflectance: color(p, 0),
            transmittance: color(p, 3),
            eta: p[6],
            distribution: MicrofacetDistribution::unpack([p[7], p[8], p[9]]),
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let f = |pair: DirectionPair| pair.weight(self) * pair.pdf(&self.distribution);
        DirectionPair::new(self.eta, wo, wi).map_or(Spectrum::ZERO, f)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        DirectionPair::new(self.eta, wo, wi)
            .map_or(Pdf::ZERO, |pair| Pdf::new(pair.pdf(&self.distribution)))
    }

    /// Samples a visible facet, and reflection or refraction: the weight is G/G₁, over η² for
    /// refraction.
    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let (up, eta) = (upright(wo, wo), eta_from(wo, self.eta));
        let h = self.distribution.sample_visible(up, [u, v]);
        let cos = up.dot(h);
        let refracted = fresnel::dielectric(cos, eta).filter(|(f, _)| choice >= *f);
        let is_reflected = refracted.is_none();
        let wi = match refracted {
            Some((_, cos_t)) => refract(up, h, [cos, cos_t], eta),
            None => h * (2.0 * cos) - up,
        };
        let wi = upright(wi, wo);
        // Light that a facet scatters to the wrong side is absorbed.
        let pair = DirectionPair::new(self.eta, wo, wi)
            .filter(|pair| pair.is_reflected == is_reflected)?;
        let pdf = Pdf::new(pair.pdf(&self.distribution));
        let eta_scale = if is_reflected { 1.0 } else { eta * eta };
        let sample = BsdfSample::new(wi, pair.weight(self), Some(pdf)).with_eta_scale(eta_scale);
        pdf.is_positive().then_some(sample)
    }

    fn examples() -> Vec<Self> {
        let with = |eta, distribution| Self {
            reflectance: Spectrum::ONE,
            transmittance: Spectrum::ONE,
            eta,
            distribution,
        };
        vec![
            with(1.5, MicrofacetDistribution::isotropic(Distribution::Ggx, 0.3)),
            with(1.0 / 1.33, MicrofacetDistribution::isotropic(Distribution::Beckmann, 0.2)),
            with(
                1.8,
                MicrofacetDistribution {
                    distribution: Distribution::Ggx,
                    masking: Masking::Separable,
                    alpha: [0.2, 0.6],
                },
            ),
        ]
    }
}

#[cfg(test)]
impl LobeLaws for RoughDielectric {
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

    fn map_probability(&self, wo: Vec3, wi: Vec3, _: f32) -> f32 {
        let pair = DirectionPair::new(self.eta, wo, wi).expect("a pair that was sampled");
        if pair.is_reflected { pair.f } else { 1.0 - pair.f }
    }

    fn reciprocity(&self, _: Vec3, wi: Vec3) -> Option<f32> {
        Some(if wi.z < 0.0 { self.eta * self.eta } else { 1.0 })
    }
}
