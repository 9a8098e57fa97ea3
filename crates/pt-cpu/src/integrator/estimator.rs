//! Estimators of path tracers: weights, numbers of samples and Russian roulette.

use pt_core::bsdf::Bsdf;
use pt_core::light::{AnyLight, LightSample};
use pt_core::settings::Settings;
use pt_math::{Spectrum, Vec3};

use super::accumulator::RadianceAccumulator;
use super::observer::{self, PathObserver};
use super::path_queue::{BsdfPdf, PathState};
use crate::integrator::context::{Context, Skies, SurfaceHit};

/// Estimator of a path tracer.
pub(super) trait PathEstimator {
    /// Maximum number of surface interactions.
    fn max_depth(&self, settings: &Settings) -> u32;

    /// Returns true if contributions are clamped according to the settings.
    fn clamps(&self) -> bool {
        true
    }

    /// Radiance of infinite lights along a ray that left the scene in direction `d`, times the MIS
    /// weight.
    fn sky_radiance(
        &self,
        cx: Context,
        path: &PathState,
        d: Vec3,
        bounces: u32,
        infinite_lights: &Skies,
    ) -> Spectrum;

    /// Radiance emitted by a surface towards the ray that hit it, times the MIS weight.
    fn emitted_radiance(&self, cx: Context, path: &PathState, found: SurfaceHit) -> Spectrum;

    /// Number of samples of a light at each surface, 0 if it is not sampled.
    fn light_samples(&self, settings: &Settings, light: &AnyLight) -> u32;

    /// MIS weight of one of `n` samples of a light that BSDF samples may find, too.
    fn light_weight(&self, settings: &Settings, bsdf: &Bsdf, sample: &LightSample, n: u32) -> f32;

    /// Hemisphere sampling of direct light, if enabled in the settings.
    fn hemisphere(&self, cx: Context) -> Option<Hemisphere>;

    /// Returns true if emission found by a ray counts, given the density of its direction.
    fn counts_emission(&self, settings: &Settings, bsdf_pdf: BsdfPdf) -> bool;

    /// Russian roulette: the probability with which a path continues after `bounces` interactions,
    /// or `None` if it always does.
    fn rr_survival_probability(
        &self,
        settings: &Settings,
        path: &PathState,
        bounces: u32,
    ) -> Option<f32>;
}

/// Transmittance from the camera after a surface that the path leaves towards `wi`.
#[inline(always)]
pub(super) fn transmittance_after(camera_transmittance: f32, bsdf: &Bsdf, wi: Vec3) -> f32 {
    if camera_transmittance != 0.0 && bsdf.lets_through(wi) { camera_transmittance } else { 0.0 }
}

/// Adds the emission of a surface that a path hit.
#[inline(always)]
pub(super) fn add_emission(
    estimator: &impl PathEstimator,
    cx: Context,
    path: &PathState,
    found: SurfaceHit,
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let l = estimator.emitted_radiance(cx, path, found);
    accumulator
        .add_emission(path.target, path.beta * l, || observer::emitter_source(cx, path, found, l));
}

/// Adds the radiance of infinite lights to a path that left the scene in direction `d`.
#[inline(always)]
pub(super) fn add_sky<W: PathObserver>(
    estimator: &impl PathEstimator,
    cx: Context,
    path: &PathState,
    (d, bounces): (Vec3, u32),
    accumulator: &mut RadianceAccumulator<W>,
) {
    let scene = cx.scene;
    let l = estimator.sky_radiance(cx, path, d, bounces, &scene.infinite_lights);
    accumulator
        .add_emission(path.target, path.beta * l, || observer::sky_source(cx, path.origin.p, d, l));
    if W::ENABLED && scene.infinite_lights.len() > 1 {
        let of_each = |sky| estimator.sky_radiance(cx, path, d, bounces, std::slice::from_ref(sky));
        accumulator
            .observer
            .on_sky_split(path.target, || scene.infinite_lights.iter().map(of_each).collect());
    }
}

/// Estimator of direct light by random directions of the hemisphere.
#[derive(Clone, Copy)]
pub(super) struct Hemisphere {
    /// Directions per surface point.
    pub(super) samples: u32,
    /// True if directions are cosine-weighted; else they are uniform.
    pub(super) cosine: bool,
    /// True if infinite lights count.
    pub(super) sky: bool,
}
