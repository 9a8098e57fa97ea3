//! Batches of camera rays in path tracers: their begin and their end.

use pt_core::settings::Clamp;
use pt_math::Spectrum;

use super::CameraRays;
use super::accumulator::RadianceAccumulator;
use super::observer::{PathObserver, PathRecorder};
use super::split::PathSplitting;
use crate::Tracer;
use crate::trace::Trace;

/// A batch of camera rays under way.
pub(super) struct Batch<'b, 's, W> {
    pub(super) tracer: &'b mut Tracer<'s>,
    pub(super) camera_rays: &'b CameraRays,
    pub(super) accumulator: RadianceAccumulator<'b, W>,
}

impl<'b, W: PathObserver> Batch<'b, '_, W> {
    /// Returns the time of the camera ray to which a sum of the accumulator belongs.
    pub(super) fn times_of_sums(&self) -> impl Fn(u32) -> f32 + Copy + use<'b, W> {
        let Self { camera_rays, accumulator, .. } = self;
        let (camera_rays, splitting) = (*camera_rays, accumulator.splitting);
        move |target| camera_rays.time(splitting.camera_ray(target))
    }
}

/// By-products of the batches of a path tracer.
#[derive(Default)]
pub(super) struct ByProducts<W> {
    /// See [`super::Integrator::take_clamped`].
    clamped: Vec<(u32, f32)>,
    observer: W,
}

impl<W: PathObserver> ByProducts<W> {
    /// Begins a batch, with radiance 0 for each camera ray.
    pub(super) fn begin<'b, 's>(
        &mut self,
        tracer: &'b mut Tracer<'s>,
        camera_rays: &'b CameraRays,
        radiance: &'b mut Vec<Spectrum>,
        splitting: PathSplitting,
        clamp: Clamp,
    ) -> Batch<'b, 's, W> {
        let mut observer = std::mem::take(&mut self.observer);
        observer.on_batch(camera_rays);
        let count = camera_rays.samplers.len();
        let accumulator = RadianceAccumulator::new(radiance, count, splitting, clamp, observer);
        Batch { tracer, camera_rays, accumulator }
    }

    /// Ends a batch.
    pub(super) fn end(&mut self, batch: Batch<W>) {
        let (clamped, observer) = batch.accumulator.finish();
        self.clamped = clamped;
        self.observer = observer;
    }

    /// See [`super::Integrator::take_clamped`].
    pub(super) fn take_clamped(&mut self) -> Vec<(u32, f32)> {
        std::mem::take(&mut self.clamped)
    }
}

impl ByProducts<PathRecorder> {
    /// See [`super::TracedIntegrator::take_traces`].
    pub(super) fn take_traces(&mut self) -> Vec<Trace> {
        self.observer.take()
    }
}
