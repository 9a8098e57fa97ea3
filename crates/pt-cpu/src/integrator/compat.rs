//! Light transport as in the program of the university course (CS184 / CSC4140, assignments 3-1 and
//! 3-2); `docs/cs184.md` describes where it differs from physics.

use pt_core::RenderScene;
use pt_core::light::{AnyLight, EscapedRay, LightSample};
use pt_core::settings::{DirectLight, Roulette, Settings};
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::context::{Context, Skies, SurfaceHit};
use super::estimator::{Hemisphere, PathEstimator};
use super::observer::{PathObserver, PathRecorder};
use super::path_queue::{BsdfPdf, PathState};
use super::scatterer::Scatterer;
use super::wavefront::Wavefront;
use super::{Feature, Registration, Surfaces};

/// Integrator of the course's program.
pub(super) const REGISTRATION: Registration = Registration {
    name: "cs184",
    help: "light as the program of the university course computes it",
    features: &[Feature::HemisphereSampling],
    new: |scene, set| Box::new(paths::<()>(scene, set)),
    new_traced: Some(|scene, set| Box::new(paths::<PathRecorder>(scene, set))),
};

fn paths<'a, W: PathObserver>(scene: &'a RenderScene, set: &'a Settings) -> Surfaces<'a, Cs184, W> {
    Wavefront::new(Cs184, scene, set)
}

/// The course's estimator: emission is added for camera rays and after mirrors and glass; all other
/// light is found by light sampling, or by uniform directions of the hemisphere.
struct Cs184;

impl PathEstimator for Cs184 {
    fn max_depth(&self, settings: &Settings) -> u32 {
        settings.max_depth
    }

    fn clamps(&self) -> bool {
        false
    }

    /// Radiance of the environment, added for camera rays only.
    #[inline(always)]
    fn sky_radiance(
        &self,
        cx: Context,
        path: &PathState,
        d: Vec3,
        bounces: u32,
        infinite_lights: &Skies,
    ) -> Spectrum {
        if bounces == 0 {
            cx.scene.le_infinite(EscapedRay::new(path.origin.p, d), infinite_lights)
        } else {
            Spectrum::ZERO
        }
    }

    #[inline(always)]
    fn emitted_radiance(&self, cx: Context, path: &PathState, found: SurfaceHit) -> Spectrum {
        let SurfaceHit { at, hit, time } = found;
        if path.bsdf_pdf.is_none() { cx.scene.le(at, hit, time) } else { Spectrum::ZERO }
    }

    #[inline(always)]
    fn light_samples(&self, settings: &Settings, light: &AnyLight) -> u32 {
        match settings.direct {
            DirectLight::UniformHemisphere => 0,
            _ if light.is_delta() => 1,
            _ => settings.light_samples,
        }
    }

    /// Radiance of an area light is multiplied by the distance to it (its density lacks a division
    /// by it), and a point light has no distance attenuation.
    #[inline(always)]
    fn light_weight(&self, _: &Settings, sample: &LightSample, _: u32, _: Pdf<SolidAngle>) -> f32 {
        let d = sample.distance;
        match (sample.end, sample.pdf) {
            (None, _) => 1.0,
            (Some(_), Some(_)) => d,
            (Some(_), None) => d * d,
        }
    }

    /// Uniform directions, which find emissive surfaces only.
    fn hemisphere(&self, Context { scene, settings }: Context) -> Option<Hemisphere> {
        let samples = scene.lights.as_slice().len() as u32 * settings.light_samples;
        let uniform = settings.direct == DirectLight::UniformHemisphere;
        uniform.then_some(Hemisphere { samples, cosine: false, sky: false })
    }

    #[inline(always)]
    fn counts_emission(&self, _: &Settings, bsdf_pdf: BsdfPdf) -> bool {
        bsdf_pdf.is_none()
    }

    /// The first indirect bounce is always traced.
    #[inline(always)]
    fn rr_survival_probability(
        &self,
        settings: &Settings,
        _: &impl Scatterer,
        _: &PathState,
        bounces: u32,
    ) -> Option<f32> {
        match settings.roulette {
            Roulette::Fixed(q) if bounces > 1 => Some(q),
            _ => None,
        }
    }
}
