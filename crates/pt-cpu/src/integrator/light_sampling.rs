//! Sampling of all lights of a scene at a vertex of a path.

use pt_core::RenderScene;
use pt_core::light::{AnimatedLight, AnyLight, LightSample, LightSampleContext};
use pt_math::Spectrum;

use super::context::Context;
use super::estimator::PathEstimator;
use super::observer::{self, PathObserver};
use super::path_queue::PathState;
use super::scatterer::Scatterer;
use crate::trace::LightRef;

/// A light of the scene.
#[derive(Clone, Copy)]
pub(super) enum SceneLight<'a> {
    Static { index: usize, light: &'a AnyLight },
    Animated { index: usize, light: &'a AnimatedLight },
}

impl SceneLight<'_> {
    /// Kind of the light, without its motion.
    #[inline(always)]
    pub(super) fn kind(&self) -> &AnyLight {
        match self {
            Self::Static { light, .. } => light,
            Self::Animated { light, .. } => &light.light,
        }
    }

    /// Reference to the light for observers.
    pub(super) fn reference(&self) -> LightRef {
        match *self {
            Self::Static { index, .. } => LightRef::Static(index),
            Self::Animated { index, .. } => LightRef::Animated(index),
        }
    }

    /// Samples the light for a point at a time.
    #[inline(always)]
    fn sample(
        &self,
        scene: &RenderScene,
        context: &LightSampleContext,
        time: f32,
        u: [f32; 2],
    ) -> Option<LightSample> {
        match self {
            Self::Static { light, .. } => light.sample(&scene.light_tables, context, u),
            Self::Animated { light, .. } => scene.sample_animated_light(light, time, context.p, u),
        }
    }
}

/// All lights of a scene: first the static ones, then the animated ones.
#[inline(always)]
pub(super) fn scene_lights(scene: &RenderScene) -> impl Iterator<Item = SceneLight<'_>> {
    let lights = scene.lights.as_slice().iter().enumerate();
    let lights = lights.map(|(index, light)| SceneLight::Static { index, light });
    let animated = scene.animated_lights().iter().enumerate();
    lights.chain(animated.map(|(index, light)| SceneLight::Animated { index, light }))
}

/// Calls `sample` for each sample of each light at a vertex. Its arguments are the light, the
/// number of its samples, and the number of the sample among those of all lights, which determines
/// its random numbers. Returns the number of all samples.
#[inline(always)]
pub(super) fn for_each_light_sample<'a>(
    Context { scene, settings }: Context<'a>,
    estimator: &impl PathEstimator,
    mut sample: impl FnMut(SceneLight<'a>, u32, u32),
) -> u32 {
    let mut number = 0u32;
    for light in scene_lights(scene) {
        let n = estimator.light_samples(settings, light.kind());
        for _ in 0..n {
            sample(light, n, number);
            number = number.wrapping_add(1);
        }
    }
    number
}

/// Number of light samples at a vertex, as [`for_each_light_sample`] returns it.
pub(super) fn light_sample_count(
    Context { scene, settings }: Context,
    estimator: &impl PathEstimator,
) -> u32 {
    let samples = scene_lights(scene).map(|light| estimator.light_samples(settings, light.kind()));
    samples.fold(0, u32::wrapping_add)
}

/// Vertex at which lights are sampled for a single path.
pub(super) struct LightingVertex<'a, S> {
    pub(super) path: &'a PathState,
    pub(super) scatterer: &'a S,
    pub(super) context: LightSampleContext,
    pub(super) time: f32,
}

/// Samples all lights at a vertex; `u` gives the random numbers of each sample by its number.
/// `shadow_ray` receives the samples that may contribute: the sample, its unoccluded contribution,
/// and its number.
#[inline(always)]
pub(super) fn sample_lights(
    cx: Context,
    estimator: &impl PathEstimator,
    vertex: &LightingVertex<impl Scatterer>,
    u: impl Fn(u32) -> [f32; 2],
    observer: &mut impl PathObserver,
    mut shadow_ray: impl FnMut(&LightSample, Spectrum, u32),
) {
    let Context { scene, settings } = cx;
    let &LightingVertex { path, scatterer, ref context, time } = vertex;
    for_each_light_sample(cx, estimator, |light, n, number| {
        let u = u(number);
        let Some(sample) = light.sample(scene, context, time, u) else { return };
        let is_invisible = light.kind().is_invisible();
        let value = scatterer.eval_and_pdf(sample.wi);
        let weighted = estimator.weighted(settings, value, &sample, n, is_invisible);
        let contribution = weighted.contribution(path.beta);
        if contribution.is_black() {
            return;
        }
        observer.on_light_sample(path.start, || {
            observer::light_source(scene, light.reference(), context, u, &weighted)
        });
        shadow_ray(&sample, contribution, number);
    });
}
