//! The principled material, with parameters for artists.

mod base;
mod clearcoat;
#[cfg(test)]
mod tests;
mod thin;

use base::{Base, about_sheen, sheen, tint, tinted};
use clearcoat::Clearcoat;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};
use pt_scene::material::{Distribution, Masking};
pub use thin::PrincipledThin;

#[cfg(test)]
use super::laws::{AnyLobe, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::rough_dielectric::{DirectionPair, eta_from, refract, upright};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// [`Lobe::eval_and_pdf`] of directions into which nothing is scattered.
const NO_SCATTERING: (Spectrum, Pdf<SolidAngle>) = (Spectrum::ZERO, Pdf::ZERO);

/// A diffuse base with sheen, facets that reflect as a dielectric or a metal or transmit light, and
/// a clear coat. See [`pt_scene::material::Principled`] for its parameters.
///
/// It equals Mitsuba 3's "principled": parts are added, so that bright bases scatter more than
/// arrives (see `PRINCIPLED` in `laws/gains.rs`), and an index of 1 removes the reflection of
/// metals. [Burley 2012, "Physically Based Shading at Disney"; Burley 2015, "Extending the Disney
/// BRDF to a BSDF with Integrated Subsurface Scattering"]
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    /// Colour of the base, the metal, and of transmitted light (its square root at each surface).
    pub base_color: Spectrum,
    /// √α of the facets, from 0 to 1.
    pub roughness: f32,
    /// Elongation of highlights along +x, from 0 to 1.
    pub anisotropic: f32,
    /// Weight of the metal, from 0 to 1.
    pub metallic: f32,
    /// Weight of transmission in the dielectric, from 0 to 1.
    pub spec_trans: f32,
    /// Index of refraction below the surface over that above it; not 1 with transmission.
    pub eta: f32,
    /// Fraction of the base's tint in the reflection of the dielectric, from 0 to 1.
    pub spec_tint: f32,
    /// Amount of sheen, from 0 to 1.
    pub sheen: f32,
    /// Fraction of the base's tint in the sheen, from 0 to 1.
    pub sheen_tint: f32,
    /// Weight of the approximate subsurface scattering, from 0 to 1.
    pub flatness: f32,
    /// Amount of clear coat, from 0 to 1.
    pub clearcoat: f32,
    /// Gloss of the clear coat, from 0, satin, to 1, glossy.
    pub clearcoat_gloss: f32,
}

/// Probabilities of the sampling maps of [`Lobe::sample`]; the remainder is that of cosine
/// sampling.
struct MapProbabilities {
    distribution: f32,
    coat: f32,
}

/// Facets for a roughness and an anisotropy, both from 0 to 1: α = roughness² if isotropic.
/// [Burley 2012, §5.4]
#[inline]
fn distribution(roughness: f32, anisotropic: f32) -> MicrofacetDistribution {
    const MIN_ALPHA: f32 = 1e-3;
    let alpha = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    MicrofacetDistribution {
        distribution: Distribution::Ggx,
        masking: Masking::Separable,
        alpha: [(alpha / aspect).max(MIN_ALPHA), (alpha * aspect).max(MIN_ALPHA)],
    }
}

/// Schlick's weight of light that arrives at a side whose other side has the index `eta`: by the
/// greater of the two angles.
#[inline]
fn schlick_weight(cos: f32, eta: f32) -> f32 {
    if eta > 1.0 {
        return fresnel::schlick_weight(cos);
    }
    let sin2_t = (1.0 - cos * cos) / (eta * eta);
    fresnel::schlick_weight((1.0 - sin2_t).max(0.0).sqrt())
}

/// Fresnel reflectance of a dielectric with a tint. [Burley 2012, §5.4]
#[inline]
fn tinted_fresnel(tint: Spectrum, weight: f32, eta: f32) -> Spectrum {
    let ratio = (eta - 1.0) / (eta + 1.0);
    let f0 = tint * (ratio * ratio);
    f0 + (Spectrum::ONE - f0) * weight
}

impl Principled {
    /// Index of the base colour among the packed parameters; like the following ones, it may be
    /// given by a texture.
    pub(crate) const BASE_COLOR: usize = 0;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ROUGHNESS: usize = 3;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ANISOTROPIC: usize = 4;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const METALLIC: usize = 5;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPEC_TRANS: usize = 6;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPEC_TINT: usize = 8;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN: usize = 9;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN_TINT: usize = 10;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const FLATNESS: usize = 11;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const CLEARCOAT: usize = 12;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const CLEARCOAT_GLOSS: usize = 13;

    #[inline]
    fn distribution(&self) -> MicrofacetDistribution {
        distribution(self.roughness, self.anisotropic)
    }

    /// Weight of the diffuse base.
    #[inline]
    fn opaque(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.spec_trans)
    }

    /// Weight of transmission.
    #[inline]
    fn transparent(&self) -> f32 {
        (1.0 - self.metallic) * self.spec_trans
    }

    /// Colour of sheen of amount 1.
    #[inline]
    fn sheen_color(&self) -> Spectrum {
        tinted(tint(self.base_color), self.sheen_tint)
    }

    /// Amount of sheen on the dielectric.
    #[inline]
    fn sheen_amount(&self) -> f32 {
        if self.opaque() > 0.0 { self.sheen * (1.0 - self.metallic) } else { 0.0 }
    }

    /// Reflectance of facets seen from the front at a cosine, where `f` is the Fresnel reflectance
    /// of the dielectric.
    #[inline]
    fn reflectance(&self, cos: f32, f: f32) -> Spectrum {
        if f <= 0.0 {
            return Spectrum::ZERO;
        }
        let weight = schlick_weight(cos, self.eta);
        let metal = self.base_color + (Spectrum::ONE - self.base_color) * weight;
        let hued = tinted_fresnel(tint(self.base_color), weight, self.eta);
        let dielectric = hued * self.spec_tint + Spectrum::splat((1.0 - self.spec_tint) * f);
        metal * self.metallic + dielectric * (1.0 - self.metallic)
    }

    /// Transmittance of facets, where `f` is the Fresnel reflectance of the dielectric.
    #[inline]
    fn transmittance(&self, f: f32) -> Spectrum {
        self.base_color.map(f32::sqrt) * (self.transparent() * (1.0 - f))
    }

    /// Reflectance of facets seen from either side.
    #[inline]
    fn reflectance_from(&self, front: bool, cos: f32, f: f32) -> Spectrum {
        if front { self.reflectance(cos, f) } else { Spectrum::splat(self.transparent() * f) }
    }

    /// Probability with which a facet that is seen at a cosine reflects instead of refracting.
    #[inline]
    fn reflection_probability(&self, front: bool, cos: f32, f: f32) -> f32 {
        let reflected = self.reflectance_from(front, cos, f).luminance();
        let transmitted = self.transmittance(f).luminance();
        if transmitted > 0.0 { reflected / (reflected + transmitted) } else { 1.0 }
    }

    /// Probabilities by the approximate albedo of each part for light from `wo`.
    #[inline]
    fn shares(&self, wo: Vec3) -> MapProbabilities {
        /// Added to the weight of the facets, which may scatter more than estimated.
        const MIN: f32 = 0.05;
        if wo.z < 0.0 {
            return MapProbabilities { distribution: 1.0, coat: 0.0 };
        }
        let cos = wo.z;
        let f = fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| f);
        let through = self.transmittance(f);
        let distribution = (self.reflectance(cos, f) + through).luminance() + MIN;
        let coat = if self.clearcoat == 0.0 {
            0.0
        } else {
            self.clearcoat * (Clearcoat::albedo(cos) + 0.2 * MIN)
        };
        let opaque = self.opaque();
        let sheen = self.sheen_amount() * about_sheen(cos);
        let base = opaque * self.base_color.luminance() + sheen;
        let all = distribution + coat + base;
        MapProbabilities { distribution: distribution / all, coat: coat / all }
    }

    /// Base, sheen and coat, for two directions above the front and their half vector.
    #[inline]
    fn others(&self, wo: Vec3, wi: Vec3, h: Vec3) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        let opaque = self.opaque();
        if opaque > 0.0 {
            let &Self { base_color: color, roughness, flatness, .. } = self;
            sum += Base { color, roughness, flatness }.eval(wo, wi) * opaque;
        }
        let sheen_amount = self.sheen_amount();
        if sheen_amount > 0.0 {
            sum += sheen(self.sheen_color() * sheen_amount, wo, wi);
        }
        if self.clearcoat > 0.0 {
            let weight = schlick_weight(wo.dot(h), self.eta);
            let seen = Clearcoat::new(self.clearcoat_gloss).eval(weight, wo, wi, h);
            sum += Spectrum::splat(self.clearcoat * seen);
        }
        sum
    }

    /// Samples a direction, where up is the front.
    #[inline]
    fn draw(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<Vec3> {
        let shares = self.shares(wo);
        if choice >= shares.distribution {
            let coated = choice < shares.distribution + shares.coat;
            let wi = if coated {
                let h = Clearcoat::new(self.clearcoat_gloss).sample([u, v]);
                h * (2.0 * wo.dot(h)) - wo
            } else {
                warp::cosine_hemisphere([u, v])
            };
            return (wi.z > 0.0).then_some(wi);
        }
        let (up, eta) = (upright(wo, wo), eta_from(wo, self.eta));
        let h = self.distribution().sample_visible(up, [u, v]);
        let cos = up.dot(h);
        let (f, cos_t) = fresnel::dielectric(cos, eta).unwrap_or((1.0, 0.0));
        let reflects =
            choice < shares.distribution * self.reflection_probability(wo.z > 0.0, cos, f);
        let wi = if reflects { h * (2.0 * cos) - up } else { refract(up, h, [cos, cos_t], eta) };
        // Light that a facet scatters to the wrong side is absorbed.
        ((wi.z > 0.0) == reflects).then(|| upright(wi, wo))
    }
}

impl Lobe<'_> for Principled {
    const DELTA: bool = false;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [r, g, b] = self.base_color.to_array();
        padded([
            r,
            g,
            b,
            self.roughness,
            self.anisotropic,
            self.metallic,
            self.spec_trans,
            self.eta,
            self.spec_tint,
            self.sheen,
            self.sheen_tint,
            self.flatness,
            self.clearcoat,
            self.clearcoat_gloss,
        ])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            base_color: color(p, Self::BASE_COLOR),
            roughness: p[Self::ROUGHNESS],
            anisotropic: p[Self::ANISOTROPIC],
            metallic: p[Self::METALLIC],
            spec_trans: p[Self::SPEC_TRANS],
            eta: p[7],
            spec_tint: p[Self::SPEC_TINT],
            sheen: p[Self::SHEEN],
            sheen_tint: p[Self::SHEEN_TINT],
            flatness: p[Self::FLATNESS],
            clearcoat: p[Self::CLEARCOAT],
            clearcoat_gloss: p[Self::CLEARCOAT_GLOSS],
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_and_pdf(wo, wi).0
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        self.eval_and_pdf(wo, wi).1
    }

    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        let front = wo.z > 0.0;
        let above = front && wi.z > 0.0;
        if !above && self.transparent() <= 0.0 {
            return NO_SCATTERING;
        }
        let Some(pair) = DirectionPair::new(self.eta, wo, wi) else { return NO_SCATTERING };
        let (cos, distribution) = (pair.wo.dot(pair.h), self.distribution());
        let chosen = self.reflection_probability(front, cos, pair.f);
        let (scattered, chosen) = if pair.is_reflected {
            (self.reflectance_from(front, cos, pair.f), chosen)
        } else {
            (self.transmittance(pair.f) / (pair.eta * pair.eta), 1.0 - chosen)
        };
        let seen = pair.density(1.0, &distribution);
        let f = scattered * (seen * pair.shadowing(&distribution));
        let shares = self.shares(wo);
        let pdf = shares.distribution * chosen * seen;
        if !above {
            return (f, Pdf::new(pdf));
        }
        let coat = match shares.coat {
            0.0 => 0.0,
            share => share * Clearcoat::new(self.clearcoat_gloss).pdf(wo, pair.h),
        };
        let base = 1.0 - shares.distribution - shares.coat;
        let pdf = pdf + coat + base.max(0.0) * warp::cosine_hemisphere_pdf(wi.z).get();
        (f + self.others(wo, wi, pair.h), Pdf::new(pdf))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 || (wo.z < 0.0 && self.transparent() <= 0.0) {
            return None;
        }
        let wi = self.draw(wo, u)?;
        let (f, pdf) = self.eval_and_pdf(wo, wi);
        let eta = eta_from(wo, self.eta);
        let eta_scale = if wo.z * wi.z < 0.0 { eta * eta } else { 1.0 };
        let sample = || BsdfSample::new(wi, f / pdf.get(), Some(pdf)).with_eta_scale(eta_scale);
        pdf.is_positive().then(sample)
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        if self.transparent() > 0.0 {
            return 0.0;
        }
        let distribution = distribution(self.roughness, self.anisotropic).spread();
        if self.clearcoat > 0.0 {
            let coat = Clearcoat::new(self.clearcoat_gloss).alpha();
            distribution.min(coat)
        } else {
            distribution
        }
    }

    fn examples() -> Vec<Self> {
        let plain = Self {
            base_color: Spectrum::rgb(0.3, 0.2, 0.1),
            roughness: 0.5,
            anisotropic: 0.0,
            metallic: 0.0,
            spec_trans: 0.0,
            eta: 1.5,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
        };
        let (base_color, dark) = (Spectrum::rgb(0.9, 0.6, 0.3), Spectrum::rgb(0.1, 0.05, 0.03));
        let bright = Self {
            base_color: Spectrum::ONE,
            roughness: 0.8,
            sheen: 1.0,
            clearcoat: 1.0,
            clearcoat_gloss: 0.5,
            ..plain
        };
        vec![
            plain,
            Self {
                base_color: dark,
                sheen: 0.1,
                sheen_tint: 0.7,
                flatness: 0.6,
                spec_tint: 0.5,
                ..plain
            },
            Self { base_color, metallic: 1.0, roughness: 0.6, anisotropic: 0.7, ..plain },
            Self { clearcoat: 1.0, metallic: 0.4, ..plain },
            Self { base_color, spec_trans: 1.0, ..plain },
            Self { base_color, spec_trans: 1.0, eta: 1.0 / 1.33, roughness: 0.4, ..plain },
            Self { spec_trans: 0.6, eta: 1.33, clearcoat: 0.5, metallic: 0.2, ..plain },
            bright,
        ]
    }
}

#[cfg(test)]
impl LobeLaws for Principled {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            // With a white base, sheen and a coat: see docs/formats.md.
            max_albedo: Some(1.69 + 0.027),
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { roughness: alpha.sqrt(), ..*self }.into())
    }

    fn map_probability(&self, wo: Vec3, wi: Vec3, choice: f32) -> f32 {
        let shares = self.shares(wo);
        if choice < shares.distribution {
            let pair = DirectionPair::new(self.eta, wo, wi).expect("a pair that was sampled");
            let chosen = self.reflection_probability(wo.z > 0.0, wo.dot(pair.h).abs(), pair.f);
            shares.distribution * if pair.is_reflected { chosen } else { 1.0 - chosen }
        } else if choice < shares.distribution + shares.coat {
            shares.coat
        } else {
            1.0 - shares.distribution - shares.coat
        }
    }

    fn reciprocity(&self, _: Vec3, wi: Vec3) -> Option<f32> {
        Some(if wi.z < 0.0 { self.eta * self.eta } else { 1.0 })
    }
}
