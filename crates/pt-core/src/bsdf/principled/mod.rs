//! The material of many parameters that artists think in.

mod base;
mod clearcoat;
pub(super) mod layers;
#[cfg(test)]
mod tests;
mod thin;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};
use pt_scene::material::{Distribution, Masking};

use super::compensation::{Gloss, Reflected};
use super::fresnel;
use super::microfacet::Facets;
use super::rough_dielectric::{Pair, eta_from, refract, upright};
use super::{BsdfSample, Lobe, LobeTables, PARAMETERS, color, padded};
use base::{Base, about_sheen, sheen, tint, tinted};
use clearcoat::Clearcoat;
use layers::Coat;

pub use thin::PrincipledThin;

/// A diffuse base with sheen, facets that reflect as a dielectric or a metal or let light through, and a clear
/// coat. See [`pt_scene::material::Principled`] for its parameters.
///
/// Unless it is `layered`, it is Mitsuba 3's "principled", value by value: parts are added up, so that bright bases
/// scatter more than arrives (see `MITSUBA_GAIN` among the tests), and an index of 1 takes away the reflection of metals.
/// [Burley 2012, "Physically Based Shading at Disney"; Burley 2015, "Extending the Disney BRDF to a BSDF with
/// Integrated Subsurface Scattering"]
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    /// Colour of the base, the metal, and of light that goes through (its square root at each surface).
    pub base_color: Spectrum,
    /// √α of the facets, from 0 to 1.
    pub roughness: f32,
    /// From 0 to 1: how much longer highlights are along +x than across it.
    pub anisotropic: f32,
    /// Share of metal, from 0 to 1.
    pub metallic: f32,
    /// Share of what is not metal that light goes through, from 0 to 1.
    pub spec_trans: f32,
    /// Index of refraction below the surface over that above it; not 1 if light goes through.
    pub eta: f32,
    /// How much of the base's tint the reflection of a dielectric has, from 0 to 1.
    pub spec_tint: f32,
    /// Amount of sheen, from 0 to 1.
    pub sheen: f32,
    /// How much of the base's tint the sheen has, from 0 to 1.
    pub sheen_tint: f32,
    /// From 0, a diffuse surface, to 1, light that is scattered under it.
    pub flatness: f32,
    /// Amount of clear coat, from 0 to 1.
    pub clearcoat: f32,
    /// From 0, a satin coat, to 1, a glossy one; in layers 1 − √α.
    pub clearcoat_gloss: f32,
    /// Whether the front is on the side of −z.
    pub inside_out: bool,
    /// Whether light that one facet reflects to another is followed on, and so not lost.
    pub multiple_scattering: bool,
    /// Whether each layer has the light that those above leave to it: the coat, the sheen, the facets, and a matte
    /// base without `flatness`. Then no more is scattered than arrives, and tints take light away.
    pub layered: bool,
}

/// Probabilities of the maps that [`Lobe::sample`] takes; the rest is the cosine's.
struct Shares {
    facets: f32,
    coat: f32,
}

/// Facets for a roughness and an anisotropy, both from 0 to 1: α = roughness² if there is no direction.
/// [Burley 2012, §5.4]
#[inline]
fn facets(roughness: f32, anisotropic: f32) -> Facets {
    const LEAST_ALPHA: f32 = 1e-3;
    let alpha = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropic).sqrt();
    Facets {
        distribution: Distribution::Ggx,
        masking: Masking::Separable,
        alpha: [(alpha / aspect).max(LEAST_ALPHA), (alpha * aspect).max(LEAST_ALPHA)],
    }
}

/// Schlick's weight of light that arrives at a side whose other side has the index `eta`: of the greater angle.
#[inline]
fn schlick_weight(cos: f32, eta: f32) -> f32 {
    if eta > 1.0 {
        return fresnel::schlick_weight(cos);
    }
    let sin2_t = (1.0 - cos * cos) / (eta * eta);
    fresnel::schlick_weight((1.0 - sin2_t).max(0.0).sqrt())
}

/// Reflectance of a dielectric with a tint. [Burley 2012, §5.4]
#[inline]
fn tinted_fresnel(tint: Spectrum, weight: f32, eta: f32) -> Spectrum {
    let ratio = (eta - 1.0) / (eta + 1.0);
    let f0 = tint * (ratio * ratio);
    f0 + (Spectrum::ONE - f0) * weight
}

impl Principled {
    /// Where the parameters that textures may give are packed.
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

    /// The probability with which the map that `choice` takes leads from `wo` to `wi`.
    #[cfg(test)]
    pub(super) fn chance(&self, wo: Vec3, wi: Vec3, choice: f32) -> f32 {
        let shares = self.shares(wo);
        if choice < shares.facets {
            let pair = Pair::new(self.eta, wo, wi).expect("a pair that was sampled");
            let chosen = self.reflection_probability(wo.z > 0.0, wo.dot(pair.h).abs(), pair.f);
            shares.facets * if pair.is_reflected { chosen } else { 1.0 - chosen }
        } else if choice < shares.facets + shares.coat {
            shares.coat
        } else {
            1.0 - shares.facets - shares.coat
        }
    }

    /// The direction where the front is up.
    #[inline]
    fn turned(&self, w: Vec3) -> Vec3 {
        if self.inside_out { -w } else { w }
    }

    #[inline]
    fn facets(&self) -> Facets {
        facets(self.roughness, self.anisotropic)
    }

    /// Share of the diffuse base.
    #[inline]
    fn opaque(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.spec_trans)
    }

    /// Share of what light goes through.
    #[inline]
    fn transparent(&self) -> f32 {
        (1.0 - self.metallic) * self.spec_trans
    }

    /// The hue of the base: of luminance 1, or in layers with 1 in its greatest channel.
    #[inline]
    fn tint(&self) -> Spectrum {
        let greatest = self.base_color.max_channel();
        match self.layered {
            false => tint(self.base_color),
            true if greatest > 0.0 => self.base_color / greatest,
            true => Spectrum::ONE,
        }
    }

    /// The colour of sheen of full amount.
    #[inline]
    fn sheen_color(&self) -> Spectrum {
        tinted(self.tint(), self.sheen_tint)
    }

    /// Amount of sheen on what is not metal.
    #[inline]
    fn sheen_amount(&self) -> f32 {
        if self.opaque() > 0.0 { self.sheen * (1.0 - self.metallic) } else { 0.0 }
    }

    /// The reflectance of facets that are seen from the front at a cosine, where a dielectric reflects `f`.
    #[inline]
    fn reflectance(&self, cos: f32, f: f32) -> Spectrum {
        if f <= 0.0 && !self.layered {
            return Spectrum::ZERO;
        }
        let weight = schlick_weight(cos, self.eta);
        let metal = self.base_color + (Spectrum::ONE - self.base_color) * weight;
        let hued = if self.layered {
            tinted(self.tint(), 1.0 - weight) * f
        } else {
            tinted_fresnel(self.tint(), weight, self.eta)
        };
        let dielectric = hued * self.spec_tint + Spectrum::splat((1.0 - self.spec_tint) * f);
        metal * self.metallic + dielectric * (1.0 - self.metallic)
    }

    /// What facets let through where a dielectric reflects `f`.
    #[inline]
    fn transmittance(&self, f: f32) -> Spectrum {
        self.base_color.map(f32::sqrt) * (self.transparent() * (1.0 - f))
    }

    /// What facets reflect that are seen from one of the sides.
    #[inline]
    fn reflectance_from(&self, front: bool, cos: f32, f: f32) -> Spectrum {
        if front { self.reflectance(cos, f) } else { Spectrum::splat(self.transparent() * f) }
    }

    /// How often facets reflect that are seen at a cosine, and do not refract.
    #[inline]
    fn reflection_probability(&self, front: bool, cos: f32, f: f32) -> f32 {
        let reflected = self.reflectance_from(front, cos, f).luminance();
        let transmitted = self.transmittance(f).luminance();
        if transmitted > 0.0 { reflected / (reflected + transmitted) } else { 1.0 }
    }

    /// Shares by about what each part scatters of light towards a cosine.
    #[inline]
    fn shares(&self, wo: Vec3) -> Shares {
        /// Of what there is, so that nothing is left out where it is more than expected.
        const LEAST: f32 = 0.05;
        if wo.z < 0.0 {
            return Shares { facets: 1.0, coat: 0.0 };
        }
        let cos = wo.z;
        let f = fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| f);
        let through = self.transmittance(f);
        let facets = (self.reflectance(cos, f) + through).luminance() + LEAST;
        let coat = if self.clearcoat == 0.0 {
            0.0
        } else if self.layered {
            self.clearcoat * layers::coat_albedo(self.clearcoat_gloss, cos)
        } else {
            self.clearcoat * (Clearcoat::albedo(cos) + 0.2 * LEAST)
        };
        let opaque = self.opaque();
        let sheen = self.sheen_amount() * about_sheen(cos);
        let base = opaque * self.base_color.luminance() + sheen;
        let again = if self.multiple_scattering {
            0.9 * Reflected::new(&self.facets()).lost(wo) + 0.02
        } else {
            0.0
        };
        let all = facets + coat + base + again;
        Shares { facets: facets / all, coat: coat / all }
    }

    /// What facets reflect more than once.
    #[inline]
    fn reflected_again(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let again = Reflected::new(&self.facets());
        let metal = fresnel::mean_schlick(self.base_color);
        let dielectric = Spectrum::splat(fresnel::mean_dielectric(self.eta));
        let colored = again.colored(metal) * self.metallic
            + again.colored(dielectric) * (1.0 - self.metallic);
        colored * again.eval(wo, wi)
    }

    /// Light that is scattered above the front by facets more than once, and by the base.
    #[inline]
    fn again_and_base(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        if self.multiple_scattering {
            sum += self.reflected_again(wo, wi);
        }
        let opaque = self.opaque();
        if opaque > 0.0 {
            let &Self { base_color: color, roughness, flatness, .. } = self;
            sum += if self.layered {
                let gloss = Gloss::new(&self.facets(), self.eta, self.multiple_scattering);
                color * (opaque * gloss.eval_base(wo, wi))
            } else {
                Base { color, roughness, flatness }.eval(wo, wi) * opaque
            };
        }
        sum
    }

    /// The layers over the facets and the base, which scatter `below`, for two directions and the half vector; `above` says
    /// whether both are on the side of the front.
    #[inline]
    fn under_layers(&self, below: Spectrum, [wo, wi, h]: [Vec3; 3], above: bool) -> Spectrum {
        let mut sum = below;
        let sheen_amount = self.sheen_amount();
        if sheen_amount > 0.0 {
            let color = self.sheen_color() * sheen_amount;
            if self.layered {
                let scattered = color.max_channel();
                let left = |cos| 1.0 - scattered * layers::sheen_albedo(cos);
                sum *= layers::through(wo, wi, left);
            }
            if above {
                sum += sheen(color, wo, wi);
            }
        }
        if self.clearcoat > 0.0 {
            if self.layered {
                let reflected = |cos| layers::coat_albedo(self.clearcoat_gloss, cos);
                let left = |cos| 1.0 - self.clearcoat * reflected(cos);
                sum *= layers::through(wo, wi, left);
            }
            if above {
                let gloss = self.clearcoat_gloss;
                let seen = if self.layered {
                    Coat::new(gloss).eval(wo, wi, h)
                } else {
                    let weight = schlick_weight(wo.dot(h), self.eta);
                    Clearcoat::new(gloss).eval(weight, wo, wi, h)
                };
                sum += Spectrum::splat(self.clearcoat * seen);
            }
        }
        sum
    }

    /// f cos θi and the density.
    #[inline]
    fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        let (wo, wi) = (self.turned(wo), self.turned(wi));
        let front = wo.z > 0.0;
        let above = front && wi.z > 0.0;
        if !above && self.transparent() <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let Some(pair) = Pair::new(self.eta, wo, wi) else { return (Spectrum::ZERO, 0.0) };
        let (cos, facets) = (pair.wo.dot(pair.h), self.facets());
        let chosen = self.reflection_probability(front, cos, pair.f);
        let (scattered, chosen) = if pair.is_reflected {
            (self.reflectance_from(front, cos, pair.f), chosen)
        } else {
            (self.transmittance(pair.f) / (pair.eta * pair.eta), 1.0 - chosen)
        };
        let seen = pair.density(1.0, &facets);
        let f = scattered * (seen * pair.shadowing(&facets));
        let shares = self.shares(wo);
        let pdf = shares.facets * chosen * seen;
        if !above {
            let f = if self.layered { self.under_layers(f, [wo, wi, pair.h], false) } else { f };
            return (f, pdf);
        }
        let coat = match shares.coat {
            0.0 => 0.0,
            share if self.layered => share * Coat::new(self.clearcoat_gloss).pdf(wo, pair.h),
            share => share * Clearcoat::new(self.clearcoat_gloss).pdf(wo, pair.h),
        };
        let base = 1.0 - shares.facets - shares.coat;
        let pdf = pdf + coat + base.max(0.0) * warp::cosine_hemisphere_pdf(wi.z).get();
        let below = f + self.again_and_base(wo, wi);
        (self.under_layers(below, [wo, wi, pair.h], true), pdf)
    }

    /// Follows one of the maps, from a direction that is up if the front is seen.
    #[inline]
    fn draw(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<Vec3> {
        let shares = self.shares(wo);
        if choice >= shares.facets {
            let coated = choice < shares.facets + shares.coat;
            let wi = if coated {
                let h = if self.layered {
                    Coat::new(self.clearcoat_gloss).sample(wo, [u, v])
                } else {
                    Clearcoat::new(self.clearcoat_gloss).sample([u, v])
                };
                h * (2.0 * wo.dot(h)) - wo
            } else {
                warp::cosine_hemisphere([u, v])
            };
            return (wi.z > 0.0).then_some(wi);
        }
        let (up, eta) = (upright(wo, wo), eta_from(wo, self.eta));
        let h = self.facets().sample_visible(up, [u, v]);
        let cos = up.dot(h);
        let (f, cos_t) = fresnel::dielectric(cos, eta).unwrap_or((1.0, 0.0));
        let reflects = choice < shares.facets * self.reflection_probability(wo.z > 0.0, cos, f);
        let wi = if reflects { h * (2.0 * cos) - up } else { refract(up, h, [cos, cos_t], eta) };
        // Facets that send light to the wrong side absorb it.
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
            f32::from(
                u8::from(self.inside_out)
                    + 2 * u8::from(self.multiple_scattering)
                    + 4 * u8::from(self.layered),
            ),
        ])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: &LobeTables) -> Self {
        let flags = p[14] as u8;
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
            inside_out: flags & 1 != 0,
            multiple_scattering: flags & 2 != 0,
            layered: flags & 4 != 0,
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_and_pdf(wo, wi).0
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        Pdf::new(self.eval_and_pdf(wo, wi).1)
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let seen = self.turned(wo);
        if seen.z == 0.0 || (seen.z < 0.0 && self.transparent() <= 0.0) {
            return None;
        }
        let wi = self.turned(self.draw(seen, u)?);
        let (f, pdf) = self.eval_and_pdf(wo, wi);
        let eta = eta_from(seen, self.eta);
        let squeeze = if wo.z * wi.z < 0.0 { eta * eta } else { 1.0 };
        let pdf = Pdf::new(pdf);
        let sample = || BsdfSample::new(wi, f / pdf.get(), Some(pdf)).squeezed_by(squeeze);
        pdf.is_positive().then(sample)
    }

    #[inline]
    fn spread(&self) -> f32 {
        if self.transparent() > 0.0 {
            return 0.0;
        }
        let facets = facets(self.roughness, self.anisotropic).spread();
        if self.clearcoat > 0.0 {
            let gloss = self.clearcoat_gloss;
            let coat =
                if self.layered { Coat::new(gloss).alpha() } else { Clearcoat::new(gloss).alpha() };
            facets.min(coat)
        } else {
            facets
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
            inside_out: false,
            multiple_scattering: false,
            layered: false,
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
            Self { base_color, metallic: 1.0, roughness: 0.9, multiple_scattering: true, ..plain },
            Self { base_color, layered: true, multiple_scattering: true, ..plain },
            Self { base_color, spec_trans: 1.0, ..plain },
            Self { base_color, spec_trans: 1.0, eta: 1.0 / 1.33, roughness: 0.4, ..plain },
            Self { spec_trans: 0.6, eta: 1.33, clearcoat: 0.5, metallic: 0.2, ..plain },
            // The brightest, as in Mitsuba and in layers.
            bright,
            Self { layered: true, multiple_scattering: true, ..bright },
        ]
    }
}
