//! The unidirectional path tracer.

use pt_core::light::{AnyLight, EscapedRay, LightSample};
use pt_core::settings::{DirectLight, Roulette, Settings};
use pt_math::measure::power_heuristic;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::context::{Context, Skies, SurfaceHit};
use super::estimator::{Hemisphere, PathEstimator};
use super::path_queue::{BsdfPdf, PathState};
use super::scatterer::Scatterer;

/// Path tracing with direct light at every surface. [Kajiya 1986; Veach 1997, §10.3]
///
/// The radiance is a sum over the number k of surface interactions: L = Σₖ β₁ β₂ … βₖ Le, with βⱼ =
/// f |cos θ| / p of interaction j. Term k is estimated at interaction k by light sampling, and at
/// interaction k + 1 by the emission that the BSDF sample found; the MIS weights of the two sum to
/// one.
pub(super) struct Path {
    /// Maximum number of surface interactions, unless the settings specify fewer.
    max_depth: u32,
    direct: DirectLight,
}

/// Minimum number of bounces before Russian roulette: short paths carry most of the light, and
/// terminating them early only adds noise.
const FREE_BOUNCES: u32 = 3;

/// The possible contribution of a path is compared with the radiance of its pixel. [Vorba &
/// Křivánek 2016, adjoint-driven Russian roulette] That radiance is unknown here except that it was
/// scattered once by a surface, whose albedo is assumed to be a half.
const PIXEL_ALBEDO: f32 = 0.5;

/// A path that survives with probability q has its contribution divided by q; an upper bound of q
/// bounds the length of paths between perfect mirrors.
const MAX_SURVIVAL: f32 = 0.95;

/// Upper bound in media, where each collision reduces the throughput by the absorption. With little
/// absorption light is scattered hundreds of times, and weights of 0.95⁻ⁿ would grow faster than
/// long paths become rare.
const MAX_SURVIVAL_IN_MEDIA: f32 = 0.999;

impl Path {
    /// Estimator of paths with any number of interactions.
    pub(super) fn new(settings: &Settings) -> Self {
        Self { max_depth: u32::MAX, direct: settings.direct }
    }

    /// Estimator of light that was scattered at most once.
    pub(super) fn once_scattered(settings: &Settings) -> Self {
        Self { max_depth: 1, ..Self::new(settings) }
    }

    /// As [`Self::new`], with [`DirectLight::Mis`] in place of hemisphere sampling.
    pub(super) fn without_hemisphere_sampling(settings: &Settings) -> Self {
        let direct = match settings.direct {
            DirectLight::Light => DirectLight::Light,
            _ => DirectLight::Mis,
        };
        Self { direct, ..Self::new(settings) }
    }

    /// MIS weight of emission found by a ray.
    ///
    /// `bsdf_pdf` is the density with which its direction was sampled (`None`: no other technique
    /// samples it), and `light` gives the density of light sampling, if the light is sampled at
    /// all.
    #[inline(always)]
    fn emission_mis_weight(
        &self,
        settings: &Settings,
        bsdf_pdf: BsdfPdf,
        light: Option<(&AnyLight, Pdf<SolidAngle>)>,
    ) -> f32 {
        let Some(pdf) = bsdf_pdf else { return 1.0 };
        match (self.direct, light) {
            (DirectLight::Mis, Some((light, light_pdf))) => {
                let n = if light.is_delta() { 1 } else { settings.light_samples };
                power_heuristic(pdf, light_pdf.scaled_by(n as f32))
            }
            (DirectLight::Mis | DirectLight::Light, None) => 1.0,
            _ => 0.0,
        }
    }
}

impl PathEstimator for Path {
    fn max_depth(&self, settings: &Settings) -> u32 {
        self.max_depth.min(settings.max_depth).min(settings.max_bounce)
    }

    #[inline(always)]
    fn sky_radiance(
        &self,
        cx: Context,
        path: &PathState,
        d: Vec3,
        _: u32,
        infinite_lights: &Skies,
    ) -> Spectrum {
        let Context { scene, settings } = cx;
        let tables = &scene.light_tables;
        let weighted = |light: &AnyLight| {
            let pdf = light.pdf(tables, &path.origin, d, None);
            light.le_infinite(tables, EscapedRay::new(path.origin.p, d))
                * self.emission_mis_weight(settings, path.bsdf_pdf, Some((light, pdf)))
        };
        infinite_lights.iter().map(|&id| weighted(&scene.lights[id])).sum()
    }

    #[inline(always)]
    fn emitted_radiance(&self, cx: Context, path: &PathState, found: SurfaceHit) -> Spectrum {
        let SurfaceHit { at, hit, time } = found;
        let Context { scene, settings } = cx;
        let light = scene.surfaces[at.surface].light.map(|id| {
            let light: &AnyLight = &scene.lights[id];
            let met = Some(scene.light_hit(at));
            (light, light.pdf(&scene.light_tables, &path.origin, -at.wo, met))
        });
        let light = light.or_else(|| scene.animated_light(at, time, path.origin.p));
        scene.le(at, hit, time) * self.emission_mis_weight(settings, path.bsdf_pdf, light)
    }

    #[inline(always)]
    fn light_samples(&self, settings: &Settings, light: &AnyLight) -> u32 {
        match self.direct {
            _ if light.is_delta() => 1,
            _ if light.is_invisible() => settings.light_samples,
            DirectLight::Mis | DirectLight::Light => settings.light_samples,
            DirectLight::UniformHemisphere | DirectLight::CosineHemisphere => 0,
        }
    }

    #[inline(always)]
    fn light_weight(
        &self,
        _: &Settings,
        sample: &LightSample,
        n: u32,
        bsdf_pdf: Pdf<SolidAngle>,
    ) -> f32 {
        match (self.direct, sample.pdf) {
            (DirectLight::Mis, Some(light_pdf)) => {
                power_heuristic(light_pdf.scaled_by(n as f32), bsdf_pdf)
            }
            _ => 1.0,
        }
    }

    /// The same number of directions as light sampling would use.
    fn hemisphere(&self, Context { scene, settings }: Context) -> Option<Hemisphere> {
        let cosine = match self.direct {
            DirectLight::Mis | DirectLight::Light => return None,
            DirectLight::UniformHemisphere => false,
            DirectLight::CosineHemisphere => true,
        };
        let lights = scene.lights.as_slice().iter();
        let extended = lights.filter(|l| !l.is_delta() && !l.is_invisible()).count();
        let samples = extended.max(1) as u32 * settings.light_samples;
        Some(Hemisphere { samples, cosine, sky: true })
    }

    #[inline(always)]
    fn counts_emission(&self, _: &Settings, bsdf_pdf: BsdfPdf) -> bool {
        use DirectLight::{CosineHemisphere, UniformHemisphere};
        bsdf_pdf.is_none() || !matches!(self.direct, CosineHemisphere | UniformHemisphere)
    }

    /// Survival probability from the throughput without the scaling by refraction.
    #[inline(always)]
    fn rr_survival_probability(
        &self,
        settings: &Settings,
        scatterer: &impl Scatterer,
        path: &PathState,
        bounces: u32,
    ) -> Option<f32> {
        if bounces < FREE_BOUNCES {
            return None;
        }
        let max = if scatterer.is_in_medium() { MAX_SURVIVAL_IN_MEDIA } else { MAX_SURVIVAL };
        Some(match settings.roulette {
            Roulette::Fixed(q) => q,
            Roulette::Throughput => {
                let carried = (path.beta * path.eta_scale).max_channel();
                (carried / PIXEL_ALBEDO).min(max)
            }
        })
    }
}
