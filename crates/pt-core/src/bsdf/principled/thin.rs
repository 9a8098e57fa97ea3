//! The principled material of thin sheets: paper, leaves, lampshades, frosted panes.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

use super::base::{Base, about_sheen, sheen, tint, tinted};
use super::{NO_SCATTERING, distribution, schlick_weight, tinted_fresnel};
#[cfg(test)]
use crate::bsdf::laws::{AnyLobe, LobeLaws, LobeProperties, SamplingMaps};
use crate::bsdf::microfacet::MicrofacetDistribution;
use crate::bsdf::rough_dielectric::upright;
use crate::bsdf::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Both sides of a sheet at once: diffuse reflection with sheen, diffuse transmission, and facets
/// that reflect light or transmit it unrefracted. See [`pt_scene::material::PrincipledThin`] for
/// its parameters.
///
/// It equals Mitsuba 3's "principledthin": there is no specular layer above the diffuse part,
/// bright bases can scatter a little more than arrives, and facets transmit no light into
/// directions from which their back is not visible, which is not reciprocal. [Burley 2015,
/// "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", §5]
#[derive(Clone, Copy, Debug)]
pub struct PrincipledThin {
    /// Colour of the diffuse part, and of light that facets transmit.
    pub base_color: Spectrum,
    /// √α of the reflecting facets, from 0 to 1.
    pub roughness: f32,
    /// Elongation of highlights along +x, from 0 to 1.
    pub anisotropic: f32,
    /// Weight of the facets, from 0 to 1; the remainder is diffuse.
    pub spec_trans: f32,
    /// Index of refraction of the sheet over that around it.
    pub eta: f32,
    /// Fraction of the base's tint in the reflection of facets, from 0 to 1.
    pub spec_tint: f32,
    /// Amount of sheen, from 0 to 1.
    pub sheen: f32,
    /// Fraction of the base's tint in the sheen, from 0 to 1.
    pub sheen_tint: f32,
    /// Weight of the approximate subsurface scattering, from 0 to 1.
    pub flatness: f32,
    /// Diffuse transmission, from 0, all diffuse light is reflected, to 2, all is transmitted.
    pub diff_trans: f32,
}

/// A pair of directions, with the side of `wo` up.
struct FoldedDirections {
    wo: Vec3,
    /// Mirrored to the side of `wo`, if it is on the other.
    wi: Vec3,
    is_reflected: bool,
    /// Half vector of `wo` and the mirrored `wi`.
    h: Vec3,
}

/// Probabilities of the sampling maps of [`Lobe::sample`].
struct SheetProbabilities {
    /// Probabilities of facets that reflect, and of facets that transmit.
    distribution: [f32; 2],
    /// Probabilities of the cosine distribution on the side of the viewer, and on the other.
    cosine: [f32; 2],
}

/// Index of a side in pairs of numbers: 0 for reflection, 1 for transmission.
#[inline]
fn side(is_reflected: bool) -> usize {
    usize::from(!is_reflected)
}

impl FoldedDirections {
    /// Creates the pair; `None` if a direction is along the surface.
    #[inline]
    fn new(wo: Vec3, wi: Vec3) -> Option<Self> {
        let (wo, wi) = (upright(wo, wo), upright(wi, wo));
        let is_reflected = wi.z > 0.0;
        let wi = Vec3::new(wi.x, wi.y, wi.z.abs());
        let h = (wo + wi).try_normalize()?;
        (wo.z > 0.0 && wi.z > 0.0).then_some(Self { wo, wi, is_reflected, h })
    }

    /// Returns true if the back of the facet is not visible from the direction of transmission.
    #[inline]
    fn hides(&self) -> bool {
        !self.is_reflected && hides(self.wi, self.h)
    }
}

/// Returns true if the back of a facet is not visible from a direction below the surface, of which
/// `wi` is the mirror image above it.
#[inline]
fn hides(wi: Vec3, h: Vec3) -> bool {
    wi.x * h.x + wi.y * h.y >= wi.z * h.z
}

impl PrincipledThin {
    /// Index of the base colour among the packed parameters; like the following ones, it may be
    /// given by a texture.
    pub(crate) const BASE_COLOR: usize = 0;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ROUGHNESS: usize = 3;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const ANISOTROPIC: usize = 4;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPEC_TRANS: usize = 5;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SPEC_TINT: usize = 7;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN: usize = 8;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const SHEEN_TINT: usize = 9;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const FLATNESS: usize = 10;
    /// See [`Self::BASE_COLOR`].
    pub(crate) const DIFF_TRANS: usize = 11;

    /// Facet distribution of a side; that of transmitted light is scaled by the index.
    /// [Burley 2015, figure 15]
    #[inline]
    fn distribution(&self, is_reflected: bool) -> MicrofacetDistribution {
        let scale = if is_reflected { 1.0 } else { 0.65 * self.eta - 0.35 };
        distribution(scale * self.roughness, self.anisotropic)
    }

    /// Weight of diffuse scattering to a side.
    #[inline]
    fn diffuse(&self, is_reflected: bool) -> f32 {
        let through = 0.5 * self.diff_trans;
        (1.0 - self.spec_trans) * if is_reflected { 1.0 - through } else { through }
    }

    /// Scattering to a side by facets seen at a cosine.
    #[inline]
    fn scattered(&self, is_reflected: bool, cos: f32) -> Spectrum {
        let f = fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| f);
        let colored = if is_reflected {
            let weight = schlick_weight(cos, self.eta);
            let tinted = tinted_fresnel(tint(self.base_color), weight, self.eta);
            Spectrum::splat(f) + (tinted - Spectrum::splat(f)) * self.spec_tint
        } else {
            self.base_color * (1.0 - f)
        };
        colored * self.spec_trans
    }

    /// Probabilities by the approximate albedo of each part at a cosine.
    #[inline]
    fn shares(&self, cos: f32) -> SheetProbabilities {
        /// Added to the weights of the parts, which may scatter more than estimated.
        const MIN: f32 = 0.05;
        let distribution = [true, false].map(|is_reflected| {
            self.scattered(is_reflected, cos).luminance() + MIN * self.spec_trans
        });
        let base = self.base_color.luminance();
        let above = base + self.sheen * about_sheen(cos) + MIN;
        let cosine = [self.diffuse(true) * above, self.diffuse(false) * (base + MIN)];
        let all = distribution[0] + distribution[1] + cosine[0] + cosine[1];
        SheetProbabilities {
            distribution: distribution.map(|x| x / all),
            cosine: cosine.map(|x| x / all),
        }
    }

    /// f cos θi of the diffuse part.
    #[inline]
    fn eval_diffuse(
        &self,
        &FoldedDirections { wo, wi, is_reflected, .. }: &FoldedDirections,
    ) -> Spectrum {
        let &Self { base_color: color, roughness, flatness, .. } = self;
        let f = if is_reflected {
            let base = Base { color, roughness, flatness }.eval(wo, wi);
            base + sheen(tinted(tint(color), self.sheen_tint), wo, wi) * self.sheen
        } else {
            color * (FRAC_1_PI * wi.z)
        };
        f * self.diffuse(is_reflected)
    }

    /// Samples a direction, with `wo` up.
    #[inline]
    fn draw(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<Vec3> {
        let SheetProbabilities { distribution: [reflects, through], cosine: [above, _] } =
            self.shares(wo.z);
        let by_facets = choice < reflects + through;
        let is_reflected =
            if by_facets { choice < reflects } else { choice < reflects + through + above };
        let wi = if by_facets {
            let h = self.distribution(is_reflected).sample_visible(wo, [u, v]);
            // Light that a facet scatters to the wrong side is absorbed, as is light transmitted
            // into directions from which its back is not visible.
            let wi = h * (2.0 * wo.dot(h)) - wo;
            (wi.z > 0.0 && (is_reflected || !hides(wi, h))).then_some(wi)?
        } else {
            warp::cosine_hemisphere([u, v])
        };
        Some(if is_reflected { wi } else { Vec3::new(wi.x, wi.y, -wi.z) })
    }
}

impl Lobe<'_> for PrincipledThin {
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
            self.spec_trans,
            self.eta,
            self.spec_tint,
            self.sheen,
            self.sheen_tint,
            self.flatness,
            self.diff_trans,
        ])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            base_color: color(p, Self::BASE_COLOR),
            roughness: p[Self::ROUGHNESS],
            anisotropic: p[Self::ANISOTROPIC],
            spec_trans: p[Self::SPEC_TRANS],
            eta: p[6],
            spec_tint: p[Self::SPEC_TINT],
            sheen: p[Self::SHEEN],
            sheen_tint: p[Self::SHEEN_TINT],
            flatness: p[Self::FLATNESS],
            diff_trans: p[Self::DIFF_TRANS],
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
        let Some(pair) = FoldedDirections::new(wo, wi) else { return NO_SCATTERING };
        let shares = self.shares(pair.wo.z);
        let side = side(pair.is_reflected);
        let mut f = self.eval_diffuse(&pair);
        let mut pdf = shares.cosine[side] * warp::cosine_hemisphere_pdf(pair.wi.z).get();
        if self.spec_trans > 0.0 && !pair.hides() {
            let distribution = self.distribution(pair.is_reflected);
            let cos = pair.wo.dot(pair.h);
            let seen = distribution.visible_pdf(pair.wo, pair.h) / (4.0 * cos);
            if seen.is_finite() {
                let scattered = self.scattered(pair.is_reflected, cos);
                f += scattered * (seen * distribution.shadowing(pair.wo, pair.wi));
                pdf += shares.distribution[side] * seen;
            }
        }
        (f, Pdf::new(pdf))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let wi = upright(self.draw(upright(wo, wo), u)?, wo);
        let (f, pdf) = self.eval_and_pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, f / pdf.get(), Some(pdf)))
    }

    fn examples() -> Vec<Self> {
        let plain = Self {
            base_color: Spectrum::rgb(0.3, 0.2, 0.1),
            roughness: 0.5,
            anisotropic: 0.0,
            spec_trans: 0.0,
            eta: 1.5,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            diff_trans: 0.0,
        };
        let bright = Spectrum::rgb(0.9, 0.6, 0.3);
        vec![
            plain,
            Self { diff_trans: 0.8, sheen: 0.1, sheen_tint: 0.7, flatness: 0.6, ..plain },
            Self { base_color: bright, diff_trans: 2.0, ..plain },
            Self { base_color: bright, spec_trans: 1.0, spec_tint: 0.5, ..plain },
            Self { spec_trans: 0.7, diff_trans: 1.0, anisotropic: 0.6, eta: 1.8, ..plain },
            // The facets for transmission have a roughness of 0.24.
            Self { spec_trans: 1.0, roughness: 1.0, eta: 0.9, ..plain },
            Self { base_color: Spectrum::ONE, sheen: 1.0, diff_trans: 1.0, ..plain },
        ]
    }
}

#[cfg(test)]
impl LobeLaws for PrincipledThin {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            // With a white base and sheen: see docs/formats.md.
            max_albedo: Some(1.65),
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { roughness: alpha.sqrt(), ..*self }.into())
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let SheetProbabilities { distribution: [a, b], cosine: [c, d] } = self.shares(wo.z.abs());
        let shares = [a, b, c, d];
        let mut rest = choice;
        let chosen = shares.into_iter().find(|share| {
            rest -= share;
            rest < 0.0
        });
        chosen.unwrap_or(d)
    }

    /// Facets may transmit light in only one of the two directions.
    fn reciprocity(&self, wo: Vec3, wi: Vec3) -> Option<f32> {
        let hides = |wo, wi| FoldedDirections::new(wo, wi).is_some_and(|pair| pair.hides());
        (hides(wo, wi) == hides(wi, wo)).then_some(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of Mitsuba 3.9.1 for the base colour (0.8, 0.4, 0.2), for all parts and from both
    /// sides.
    #[test]
    fn values_are_those_of_mitsuba() {
        let plain = PrincipledThin {
            base_color: Spectrum::rgb(0.8, 0.4, 0.2),
            ..PrincipledThin::examples()[0]
        };
        let cloth = PrincipledThin {
            roughness: 0.8,
            diff_trans: 0.6,
            flatness: 0.7,
            sheen: 0.6,
            sheen_tint: 0.4,
            ..plain
        };
        let mixed = PrincipledThin {
            roughness: 0.4,
            spec_trans: 0.8,
            anisotropic: 0.7,
            diff_trans: 0.6,
            ..plain
        };
        let distribution =
            |roughness, eta| PrincipledThin { roughness, eta, spec_trans: 1.0, ..plain };
        let (above, near) = ([0.6, 0.0, 0.8], [0.1, 0.0, 0.995]);
        let cases = [
            (plain, above, [-0.48, 0.36, 0.8], [0.203_741, 0.101_871, 0.050_935_3]),
            (cloth, above, [0.48, 0.64, 0.6], [0.099_178_9, 0.049_589_5, 0.024_794_8]),
            (cloth, above, [0.48, 0.64, -0.6], [0.045_836_6, 0.022_918_3, 0.011_459_2]),
            (
                PrincipledThin { spec_tint: 0.4, ..mixed },
                above,
                [-0.6, 0.048, 0.8],
                [0.165_218, 0.116_332, 0.091_889_5],
            ),
            (
                PrincipledThin { eta: 1.8, ..mixed },
                above,
                [-0.64, 0.192, -0.744],
                [0.250_399, 0.125_2, 0.062_599_8],
            ),
            (
                PrincipledThin { spec_tint: 0.5, ..distribution(0.6, 0.7) },
                above,
                [-0.64, 0.192, 0.744],
                [0.060_874_5, 0.053_359_7, 0.049_602_2],
            ),
            (
                distribution(0.6, 0.7),
                [0.36, 0.0, 0.933],
                [-0.48, 0.1, -0.87],
                [0.018_380_9, 0.009_190_45, 0.004_595_22],
            ),
            (
                distribution(0.9, 1.5),
                near,
                [-0.85, 0.1, -0.51],
                [0.072_077_1, 0.036_038_6, 0.018_019_3],
            ),
            // Facets whose back is not visible, and the reversed directions.
            (distribution(0.9, 1.5), near, [-0.98, 0.1, -0.17], [0.0; 3]),
            (
                distribution(0.9, 1.5),
                [0.98, 0.1, 0.17],
                [-0.1, 0.0, -0.995],
                [0.124_993, 0.062_496_7, 0.031_248_3],
            ),
        ];
        for (lobe, wo, wi, want) in cases {
            let [wo, wi] = [wo, wi].map(|w| Vec3::from_array(w).normalize());
            for sign in [1.0, -1.0] {
                let got = lobe.eval(wo * sign, wi * sign);
                let error = (got.0 - Vec3::from_array(want)).abs().max_element();
                assert!(error <= 1e-4 * want[0], "{lobe:?} {wo} {wi}: {got:?} {want:?}");
            }
        }
    }
}
