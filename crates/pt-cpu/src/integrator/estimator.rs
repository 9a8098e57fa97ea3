//! Estimators of path tracers: weights, numbers of samples and Russian roulette.

use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::id::Id;
use pt_core::light::{AnyLight, LightSample};
use pt_core::scene::{Interaction, RenderScene};
use pt_core::settings::Settings;
use pt_math::{Spectrum, Vec3};

use super::accumulator::RadianceAccumulator;
use super::direct::Hemisphere;
use super::observer::{self, PathObserver};
use super::path_queue::{BsdfPdf, PathState};

/// Scene and settings of a render.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) scene: &'a RenderScene,
    pub(super) settings: &'a Settings,
}

/// Lights of the sky.
pub(super) type Skies = [Id<AnyLight>];

/// A surface hit by a ray.
#[derive(Clone, Copy)]
pub(super) struct SurfaceHit<'a> {
    pub(super) at: &'a Interaction,
    pub(super) hit: &'a Hit,
    /// The time of the path.
    pub(super) time: f32,
}

/// The estimator of a path tracer.
pub(super) trait PathEstimator {
    /// Largest number of surface interactions.
    fn max_depth(&self, settings: &Settings) -> u32;

    /// Returns true if contributions are cut off as the settings say.
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

    /// Radiance that a surface emits towards the ray that hit it, times the MIS weight.
    fn emitted_radiance(&self, cx: Context, path: &PathState, found: SurfaceHit) -> Spectrum;

    /// Number of samples of a light at each surface, 0 if it is not sampled.
    fn light_samples(&self, settings: &Settings, light: &AnyLight) -> u32;

    /// MIS weight of one of `n` samples of a light that BSDF samples may find, too.
    fn light_weight(&self, settings: &Settings, bsdf: &Bsdf, sample: &LightSample, n: u32) -> f32;

    /// Hemisphere sampling of direct light, if the settings ask for it.
    fn hemisphere(&self, cx: Context) -> Option<Hemisphere>;

    /// Returns true if light that a ray finds can count, by how the ray came to its direction.
    fn counts_emission(&self, settings: &Settings, bsdf_pdf: BsdfPdf) -> bool;

    /// Russian roulette: the probability with which a path goes on after `bounces` interactions,
    /// or `None` if it does in any case.
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
