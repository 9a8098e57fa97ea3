//! Sampling of directions.

use std::f32::consts::TAU;

use pt_math::{Vec3, warp};

#[cfg(test)]
use super::FacetDirections;
use super::MetallicRoughness;
use super::coat::{Coat, coat_albedo};
use super::sheen::Sheen;
use crate::bsdf::fresnel;
#[cfg(test)]
use crate::bsdf::laws::{AnyLobe, CONSERVING_BY_TABLES, LobeLaws, LobeProperties, SamplingMaps};
use crate::bsdf::multiscatter::Reflected;
use crate::bsdf::rough_dielectric::{eta_from, refract, upright};

/// Probabilities of the sampling maps of [`MetallicRoughness::draw`]; the remainder is that of
/// cosine sampling.
struct LayerProbabilities {
    distribution: f32,
    coat: f32,
    sheen: f32,
    /// Fraction of cosine sampling that is on the other side.
    beyond: f32,
}

impl MetallicRoughness {
    /// Probabilities by the approximate albedo of each part for light from `wo`.
    fn shares(&self, wo: Vec3, lost: &Reflected) -> LayerProbabilities {
        /// Added to the weight of the facets, which may scatter more than estimated.
        const MIN: f32 = 0.05;
        if wo.z < 0.0 {
            return LayerProbabilities { distribution: 1.0, coat: 0.0, sheen: 0.0, beyond: 0.0 };
        }
        let cos = wo.z;
        let dielectric = self.reflected_by_dielectric(cos, self.eta);
        let reflected = self.reflectance(true, cos, dielectric);
        let distribution = (reflected + self.transmittance(dielectric)).luminance() + MIN;
        let coat_cosine = self.coat_frame().to_local(wo).z;
        let coat = if self.clearcoat > 0.0 && coat_cosine > 0.0 {
            self.clearcoat * coat_albedo(self.clearcoat_roughness, coat_cosine)
        } else {
            0.0
        };
        let sheen = if self.has_sheen() {
            self.sheen_color.luminance() * Sheen::new(self.sheen_roughness).albedo(cos)
        } else {
            0.0
        };
        let opaque = self.opaque();
        let above = opaque * (1.0 - self.diffuse_transmission) * self.base_color.luminance();
        let beyond =
            opaque * self.diffuse_transmission * self.diffuse_transmission_color.luminance();
        let again = 0.9 * lost.lost(wo) + 0.02;
        let all = distribution + coat + sheen + above + again + beyond;
        LayerProbabilities {
            distribution: distribution / all,
            coat: coat / all,
            sheen: sheen / all,
            beyond: beyond / (above + again + beyond),
        }
    }

    /// Density of one direction of a `FacetDirections` given the other.
    pub(super) fn density_of(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !self.connects(wo, wi) {
            return 0.0;
        }
        let (distribution, front) = (self.distribution(), wo.z > 0.0);
        let shares = self.shares(wo, &Reflected::new(&distribution));
        let above = front && wi.z > 0.0;
        let mut pdf = 0.0;
        let pair = self.pair(wo, wi);
        if let Some(pair) = &pair {
            let dielectric = self.reflected_by_pair(pair);
            let reflected = self.reflectance(front, pair.wo.dot(pair.h), dielectric);
            let chosen = Self::reflection_probability(reflected, self.transmittance(dielectric));
            let chosen = if pair.is_reflected { chosen } else { 1.0 - chosen };
            pdf += shares.distribution * chosen * self.density(pair, &distribution);
        }
        if above || (self.thin && front) {
            let base = (1.0 - shares.distribution - shares.coat - shares.sheen).max(0.0);
            let side = if above { 1.0 - shares.beyond } else { shares.beyond };
            pdf += base * side * warp::cosine_hemisphere_pdf(wi.z.abs()).get();
        }
        if let Some(pair) = pair.filter(|_| above) {
            if shares.coat > 0.0 {
                let coat = self.coat_frame();
                let [wo, wi, h] = [wo, wi, pair.h].map(|w| coat.to_local(w));
                let reflected = Coat::new(self.clearcoat_roughness);
                pdf += if wi.z > 0.0 { shares.coat * reflected.pdf(wo, h) } else { 0.0 };
            }
            pdf += shares.sheen / TAU;
        }
        pdf
    }

    /// Samples a direction of a `FacetDirections`, where up is the front.
    #[inline]
    pub(super) fn draw(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<Vec3> {
        let shares = self.shares(wo, &Reflected::new(&self.distribution()));
        let mut rest = choice - shares.distribution;
        if rest < 0.0 {
            return self.draw_facet(wo, [u, v], choice / shares.distribution);
        }
        if rest < shares.coat {
            let coat = self.coat_frame();
            let wo = coat.to_local(wo);
            let h = Coat::new(self.clearcoat_roughness).sample(wo, [u, v]);
            let seen = h * (2.0 * wo.dot(h)) - wo;
            let wi = coat.to_base(seen);
            return (seen.z > 0.0 && wi.z > 0.0).then_some(wi);
        }
        rest -= shares.coat;
        if rest < shares.sheen {
            return Some(warp::uniform_hemisphere([u, v]));
        }
        rest -= shares.sheen;
        let wi = warp::cosine_hemisphere([u, v]);
        let base = 1.0 - shares.distribution - shares.coat - shares.sheen;
        let is_beyond = rest < base * shares.beyond;
        (wi.z > 0.0).then_some(if is_beyond { Vec3::new(wi.x, wi.y, -wi.z) } else { wi })
    }

    /// Direction into which a visible facet reflects or transmits light, which `choice`, from 0 to
    /// 1, selects.
    #[inline]
    fn draw_facet(&self, wo: Vec3, u: [f32; 2], choice: f32) -> Option<Vec3> {
        let up = upright(wo, wo);
        let h = self.distribution().sample_visible(up, u);
        let cos = up.dot(h);
        let eta = if self.thin { 1.0 } else { eta_from(wo, self.eta) };
        let dielectric = self.reflected_by_dielectric(cos, eta);
        let reflected = self.reflectance(wo.z > 0.0, cos, dielectric);
        let reflects =
            choice < Self::reflection_probability(reflected, self.transmittance(dielectric));
        let mirrored = h * (2.0 * cos) - up;
        let wi = if reflects {
            mirrored
        } else if self.thin {
            Vec3::new(mirrored.x, mirrored.y, -mirrored.z)
        } else {
            let (_, cos_t) = fresnel::dielectric(cos, eta)?;
            refract(up, h, [cos, cos_t], eta)
        };
        // Light that a facet scatters to the wrong side is absorbed.
        ((wi.z > 0.0) == reflects && wi.z != 0.0).then(|| upright(wi, wo))
    }
}

#[cfg(test)]
impl LobeLaws for MetallicRoughness {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            max_albedo: CONSERVING_BY_TABLES,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { roughness: alpha.sqrt(), ..*self }.into())
    }

    fn map_probability(&self, wo: Vec3, wi: Vec3, choice: f32) -> f32 {
        let FacetDirections { wo, wi } = self.view(wo, wi);
        let shares = self.shares(wo, &Reflected::new(&self.distribution()));
        let rest = 1.0 - shares.distribution - shares.coat - shares.sheen;
        if choice < shares.distribution {
            let pair = self.pair(wo, wi).expect("a pair that was sampled");
            let dielectric = self.reflected_by_pair(&pair);
            let reflected = self.reflectance(wo.z > 0.0, pair.wo.dot(pair.h), dielectric);
            let chosen = Self::reflection_probability(reflected, self.transmittance(dielectric));
            shares.distribution * if pair.is_reflected { chosen } else { 1.0 - chosen }
        } else if choice < shares.distribution + shares.coat {
            shares.coat
        } else if choice < shares.distribution + shares.coat + shares.sheen {
            shares.sheen
        } else if wi.z < 0.0 {
            rest * shares.beyond
        } else {
            rest * (1.0 - shares.beyond)
        }
    }

    /// Coats with a normal other than that of their base are not reciprocal, since their cosine is
    /// to their own normal. [Veach 1997, §5.3]
    fn reciprocity(&self, _: Vec3, wi: Vec3) -> Option<f32> {
        let is_refracted = wi.z < 0.0 && !self.thin;
        let eta_scale = if is_refracted { self.eta * self.eta } else { 1.0 };
        (self.coat_normal == [0.0; 2]).then_some(eta_scale)
    }
}
