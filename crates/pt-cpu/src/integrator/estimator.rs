//! Estimators of path tracers: weights, numbers of samples and Russian roulette.

use pt_bvh::Hit;
use pt_core::bsdf::BsdfSample;
use pt_core::light::{AnyLight, LightSample};
use pt_core::settings::Settings;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3};

use super::accumulator::RadianceAccumulator;
use super::context::{Context, Skies, SurfaceHit};
use super::observer::{self, PathObserver};
use super::path_queue::{BsdfPdf, PathState};
use super::scatterer::{Scatterer, WeightedLightSample, transmittance_after};

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

    /// MIS weight of one of `n` samples of a light that BSDF samples may find, too, with density
    /// `bsdf_pdf`.
    fn light_weight(
        &self,
        settings: &Settings,
        sample: &LightSample,
        n: u32,
        bsdf_pdf: Pdf<SolidAngle>,
    ) -> f32;

    /// Weights one of `n` samples of a light, for which the scattering function has the value `f`
    /// and the density `bsdf_pdf`. Samples of invisible lights, which rays do not find, have MIS
    /// weight 1.
    #[inline(always)]
    fn weighted<'a>(
        &self,
        settings: &Settings,
        (f, bsdf_pdf): (Spectrum, Pdf<SolidAngle>),
        sample: &'a LightSample,
        n: u32,
        is_invisible: bool,
    ) -> WeightedLightSample<'a> {
        let mis_weight =
            if is_invisible { 1.0 } else { self.light_weight(settings, sample, n, bsdf_pdf) };
        WeightedLightSample { sample, n, f, mis_weight }
    }

    /// Hemisphere sampling of direct light, if enabled in the settings.
    fn hemisphere(&self, cx: Context) -> Option<Hemisphere>;

    /// Returns true if emission found by a ray counts, given the density of its direction.
    fn counts_emission(&self, settings: &Settings, bsdf_pdf: BsdfPdf) -> bool;

    /// Russian roulette: the probability with which a path continues after `bounces` interactions,
    /// or `None` if it always does.
    fn rr_survival_probability(
        &self,
        settings: &Settings,
        scatterer: &impl Scatterer,
        path: &PathState,
        bounces: u32,
    ) -> Option<f32>;
}

/// Adds the emission of the surface that the ray of a path hit at a time, if it is emissive.
#[inline(always)]
pub(super) fn add_hit_emission(
    estimator: &impl PathEstimator,
    cx: Context,
    path: &PathState,
    ray: &Ray,
    hit: &Hit,
    time: f32,
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    if cx.scene.is_emissive(hit) {
        let at = &cx.scene.interaction(ray, hit, time);
        add_emission(estimator, cx, path, SurfaceHit { at, hit, time }, accumulator);
    }
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
    d: Vec3,
    bounces: u32,
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

/// A path that continues from a vertex.
pub(super) struct ScatteredPath {
    pub(super) state: PathState,
    pub(super) sample: BsdfSample,
    /// Probability with which Russian roulette continued the path, if it was applied.
    pub(super) survival: Option<f32>,
}

/// Continues a path in a sampled direction after interaction number `bounces`, by Russian roulette
/// with a random number. `path` is its state at the vertex, whose light sample context is the new
/// [`PathState::origin`]. `None` if the path ends.
#[inline(always)]
pub(super) fn continue_by_roulette(
    estimator: &impl PathEstimator,
    settings: &Settings,
    scatterer: &impl Scatterer,
    path: PathState,
    (sample, roulette): (BsdfSample, f32),
    bounces: u32,
) -> Option<ScatteredPath> {
    let beta = path.beta * sample.weight;
    if beta.is_black() {
        return None;
    }
    let mut state = PathState {
        beta,
        eta_scale: path.eta_scale * sample.eta_scale,
        bsdf_pdf: sample.pdf,
        camera_transmittance: transmittance_after(path.camera_transmittance, scatterer, sample.wi),
        ..path
    };
    let survival = estimator.rr_survival_probability(settings, scatterer, &state, bounces);
    if let Some(q) = survival {
        if roulette >= q {
            return None;
        }
        state.beta *= 1.0 / q;
        state.camera_transmittance *= 1.0 / q;
    }
    Some(ScatteredPath { state, sample, survival })
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
