//! Pending rays with their contributions.

use pt_math::{Ray, Spectrum};

/// Contribution of a ray.
#[derive(Clone, Copy)]
pub(super) struct Payload<S> {
    pub(super) value: Spectrum,
    /// Index of its sum: see [`super::accumulator::RadianceAccumulator`].
    pub(super) target: u32,
    /// State of the ray in the space between surfaces.
    pub(super) state: S,
}

/// Rays with their contributions.
pub(super) struct RayQueue<S> {
    pub(super) rays: Vec<Ray>,
    pub(super) payloads: Vec<Payload<S>>,
}

impl<S> RayQueue<S> {
    /// Number of rays from which on a queue is flushed: enough for full batches, few enough for the
    /// cache.
    const FLUSH_RAYS: usize = 4096;

    pub(super) const fn new() -> Self {
        Self { rays: Vec::new(), payloads: Vec::new() }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, ray: Ray, payload: Payload<S>) {
        self.rays.push(ray);
        self.payloads.push(payload);
    }

    pub(super) fn is_full(&self) -> bool {
        self.rays.len() >= Self::FLUSH_RAYS
    }

    pub(super) fn clear(&mut self) {
        self.rays.clear();
        self.payloads.clear();
    }
}
