//! Scattering at the vertices of paths.

use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::light::{LightSample, LightSampleContext};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

/// Scattering function at a vertex of a path: a BSDF, or a phase function.
pub(super) trait Scatterer {
    /// The BSDF, if the vertex is on a surface.
    fn bsdf(&self) -> Option<&Bsdf<'_>>;

    /// Returns true in a medium.
    fn is_in_medium(&self) -> bool;

    /// See [`Bsdf::is_delta`].
    fn is_delta(&self) -> bool;

    /// See [`Bsdf::lets_through`].
    #[inline(always)]
    fn lets_through(&self, wi: Vec3) -> bool {
        self.bsdf().is_some_and(|bsdf| bsdf.lets_through(wi))
    }

    /// Context of light samples at the vertex, which is at `p`.
    #[inline(always)]
    fn light_sample_context(&self, p: Vec3) -> LightSampleContext {
        match self.bsdf() {
            Some(bsdf) => LightSampleContext::of_bsdf(p, bsdf),
            None => LightSampleContext::in_space(p),
        }
    }

    /// f(wo, wi) · |cos θi|, or the phase function; and, unless that is zero, the density with
    /// which [`Self::sample`] returns `wi`.
    fn eval_and_pdf(&self, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>);

    /// Samples a direction.
    fn sample(&self, u: [f32; 3]) -> Option<BsdfSample>;
}

impl Scatterer for Bsdf<'_> {
    #[inline(always)]
    fn bsdf(&self) -> Option<&Bsdf<'_>> {
        Some(self)
    }

    #[inline(always)]
    fn is_in_medium(&self) -> bool {
        false
    }

    #[inline(always)]
    fn is_delta(&self) -> bool {
        self.is_delta()
    }

    #[inline(always)]
    fn eval_and_pdf(&self, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        self.eval_and_pdf(wi)
    }

    #[inline(always)]
    fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        self.sample(u)
    }
}

/// One of `n` samples of a light, at a vertex.
#[derive(Clone, Copy)]
pub(super) struct WeightedLightSample<'a> {
    pub(super) sample: &'a LightSample,
    /// Number of samples of the light.
    pub(super) n: u32,
    /// f(wo, wi) · |cos θi|, or the phase function.
    pub(super) f: Spectrum,
    /// MIS weight against sampling of the BSDF or phase function.
    pub(super) mis_weight: f32,
}

impl WeightedLightSample<'_> {
    /// MIS weight / (n p).
    #[inline(always)]
    pub(super) fn weight(&self) -> f32 {
        self.mis_weight / (self.sample.pdf.map_or(1.0, Pdf::get) * self.n as f32)
    }

    /// Unoccluded contribution: throughput · f · |cos| · L · MIS weight / (n p).
    #[inline(always)]
    pub(super) fn contribution(&self, beta: Spectrum) -> Spectrum {
        beta * self.f * self.sample.radiance * self.weight()
    }
}

/// Random numbers of a scattering event.
#[derive(Clone, Copy)]
pub(super) struct ScatterNumbers {
    /// Direction, and the choice of a BSDF component.
    pub(super) direction: [f32; 3],
    /// Russian roulette.
    pub(super) roulette: f32,
}

/// Transmittance from the camera after a vertex that the path leaves towards `wi`.
#[inline(always)]
pub(super) fn transmittance_after(
    camera_transmittance: f32,
    scatterer: &impl Scatterer,
    wi: Vec3,
) -> f32 {
    let passes = camera_transmittance != 0.0 && scatterer.lets_through(wi);
    if passes { camera_transmittance } else { 0.0 }
}
