//! Direction sampling of facets over a diffuse base.

use pt_math::{Pdf, SolidAngle, Vec3, warp};

use super::conductor::{half_vector, reflected_pdf};
use super::microfacet::MicrofacetDistribution;

/// Samples the facets with probability `q`, otherwise the cosine distribution of the base.
pub(super) struct OverBase<'a> {
    pub(super) distribution: &'a MicrofacetDistribution,
    /// Probability of sampling the facets.
    pub(super) q: f32,
}

impl OverBase<'_> {
    /// Density of a direction.
    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let Some(h) = half_vector(wo, wi) else { return Pdf::ZERO };
        let gloss = reflected_pdf(self.distribution, wo, h).get();
        let base = warp::cosine_hemisphere_pdf(wi.z).get();
        Pdf::new(self.q * gloss + (1.0 - self.q) * base)
    }

    /// Samples a direction by a point of the unit square, from the facets if `is_gloss`.
    #[inline]
    pub(super) fn draw(&self, wo: Vec3, u: [f32; 2], is_gloss: bool) -> Vec3 {
        if !is_gloss {
            return warp::cosine_hemisphere(u);
        }
        let h = self.distribution.sample_visible(wo, u);
        h * (2.0 * wo.dot(h)) - wo
    }
}
