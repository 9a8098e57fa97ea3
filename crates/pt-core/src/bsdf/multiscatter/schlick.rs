//! Coupling between facets with Schlick's Fresnel term and the base under them.

use std::f32::consts::FRAC_1_PI;
use std::sync::OnceLock;

use pt_math::{FloatExt, Vec3};
use pt_scene::material::{Distribution, Masking};

use super::{ALPHAS, COSINES, MIN_ALPHA, Reflected, cosine, locate, node, place, stretch_of_gloss};
use crate::bsdf::fresnel::schlick_weight;
use crate::bsdf::microfacet::MicrofacetDistribution;

/// Mean of Schlick's weight over single scattering by GGX facets of a roughness: by the cosine, and
/// for diffuse illumination.
struct Weights {
    seen: [f32; COSINES],
    mean: f32,
}

static ROWS: [OnceLock<Box<Weights>>; ALPHAS] = [const { OnceLock::new() }; ALPHAS];

/// Weights of a node of the roughnesses.
#[inline]
fn row(i: usize) -> &'static Weights {
    ROWS[i].get_or_init(|| {
        let alpha = node(i, ALPHAS).powi(2).max(MIN_ALPHA);
        let distribution = MicrofacetDistribution {
            distribution: Distribution::Ggx,
            masking: Masking::Correlated,
            alpha: [alpha; 2],
        };
        let stretch = stretch_of_gloss(alpha);
        let at = |cos: f32| {
            distribution.mean_of_visible(cos, 32, |wo, h| {
                let wi = h * (2.0 * wo.dot(h)) - wo;
                if wi.z > 0.0 {
                    schlick_weight(wo.dot(h)) * distribution.shadowing(wo, wi)
                } else {
                    0.0
                }
            })
        };
        let seen = std::array::from_fn(|j| at(cosine(node(j, COSINES), stretch)));
        let mut weights = Weights { seen, mean: 0.0 };
        weights.mean = weights.mean_of(stretch);
        Box::new(weights)
    })
}

impl Weights {
    #[inline]
    fn at(&self, x: f32) -> f32 {
        let (j, t) = locate(x, COSINES);
        self.seen[j].lerp(self.seen[j + 1], t)
    }

    /// 1/π ∫ … cos θ dω, by midpoints in √cos θ.
    fn mean_of(&self, stretch: f32) -> f32 {
        const STEPS: u16 = 512;
        let at = |i: u16| {
            let t = (f32::from(i) + 0.5) / f32::from(STEPS);
            4.0 * t * t * t * self.at(place(t * t, stretch))
        };
        (0..STEPS).map(at).sum::<f32>() / f32::from(STEPS)
    }
}

/// Factor of the light that anisotropic facets leave to their base: compensates the error of E, so
/// that no energy is gained.
const BRUSHED: f32 = 0.992;

/// Facets that reflect F₀ + (F₉₀ − F₀)(1 − cos θ)⁵, with multiple scattering.
#[derive(Clone, Copy)]
pub(in crate::bsdf) struct SchlickGloss {
    again: Reflected,
    alpha: f32,
    f0: f32,
    f90: f32,
    /// Fraction of the single-scattering loss that multiple scattering reflects.
    share: f32,
    /// Mean of 1 − E.
    mean: f32,
    /// Factor of the light that is left to the base.
    kept: f32,
}

impl SchlickGloss {
    /// Creates the terms for GGX facets, whose Schlick weights are those of the geometric mean of
    /// the two roughnesses. `share` is the fraction of the single-scattering loss that multiple
    /// scattering reflects.
    #[inline]
    pub(in crate::bsdf) fn new(
        distribution: &MicrofacetDistribution,
        again: Reflected,
        [f0, f90]: [f32; 2],
        share: f32,
    ) -> Self {
        let [ax, ay] = distribution.alpha;
        let alpha = (ax * ay).sqrt().clamp(MIN_ALPHA, 1.0);
        let (i, t) = locate(alpha.sqrt(), ALPHAS);
        let weight = row(i).mean.lerp(row(i + 1).mean, t);
        let reflected = f0 * (1.0 - again.mean - weight) + f90 * weight + share * again.mean;
        let kept = if ax == ay { 1.0 } else { BRUSHED };
        Self { again, alpha, f0, f90, share, mean: (1.0 - reflected).max(0.0), kept }
    }

    /// E: directional albedo for a direction above the surface.
    #[inline]
    pub(in crate::bsdf) fn albedo(&self, w: Vec3) -> f32 {
        let x = place(w.z, stretch_of_gloss(self.alpha));
        let (i, t) = locate(self.alpha.sqrt(), ALPHAS);
        let weight = row(i).at(x).lerp(row(i + 1).at(x), t);
        let lost = self.again.lost(w);
        self.f0 * (1.0 - lost - weight).max(0.0) + self.f90 * weight + self.share * lost
    }

    /// 1 − E, or slightly less.
    #[inline]
    pub(in crate::bsdf) fn left(&self, w: Vec3) -> f32 {
        self.kept * (1.0 - self.albedo(w)).max(0.0)
    }

    /// f |cos θi| of a white diffuse base, for two directions taken as above the surface.
    ///
    /// Light that reaches the base leaves in each direction by the fraction that would have reached
    /// it from there, which is limited by 1 minus the reflectance `other`. Facets and base together
    /// thus scatter all light if the base does, and are reciprocal. [Kelemen & Szirmay-Kalos 2001,
    /// "A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling", §2.1]
    #[inline]
    pub(in crate::bsdf) fn eval_base(&self, wo: Vec3, wi: Vec3, other: impl Fn(f32) -> f32) -> f32 {
        if self.mean > 0.0 {
            let left = |w: Vec3| self.left(w).min(1.0 - other(w.z));
            left(wo) * left(wi) * (FRAC_1_PI * wi.z) / self.mean
        } else {
            0.0
        }
    }
}
