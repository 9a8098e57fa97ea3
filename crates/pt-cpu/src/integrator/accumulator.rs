//! Accumulation of the radiance of camera rays, contribution by contribution.

use pt_core::film::ExactSum;
use pt_core::settings::Clamp;
use pt_math::Spectrum;

use super::observer::PathObserver;
use crate::trace::LightSource;

/// Sums of contributions, each clamped to a luminance.
pub(super) struct RadianceAccumulator<'a, W> {
    radiance: &'a mut Vec<Spectrum>,
    /// Number of sums that belong to camera rays; the rest are partial sums.
    camera_rays: usize,
    clamp: Clamp,
    /// Limit of the luminance of the next contributions.
    limit: f32,
    /// Camera rays with the luminance that clamping removed from their contributions.
    clamped: Vec<(u32, f32)>,
    /// Observer of every contribution.
    pub(super) observer: W,
}

impl<'a, W: PathObserver> RadianceAccumulator<'a, W> {
    /// Accumulates into `radiance`, which has the sums of the camera rays.
    pub(super) fn new(radiance: &'a mut Vec<Spectrum>, clamp: Clamp, observer: W) -> Self {
        Self {
            camera_rays: radiance.len(),
            radiance,
            clamp,
            limit: clamp.limit(0),
            clamped: Vec::new(),
            observer,
        }
    }

    /// Removes the partial sums; returns the luminance removed by clamping from contributions of
    /// camera rays, and the observer.
    pub(super) fn finish(self) -> (Vec<(u32, f32)>, W) {
        self.radiance.truncate(self.camera_rays);
        (self.clamped, self.observer)
    }

    /// Sets the number of scattering events of the next contributions.
    #[inline(always)]
    pub(super) fn set_bounces(&mut self, bounces: u32) {
        self.limit = self.clamp.limit(bounces);
    }

    /// Adds a contribution to a sum; returns its value after clamping.
    #[inline(always)]
    pub(super) fn add(&mut self, start: u32, value: Spectrum) -> Spectrum {
        let kept = if self.limit < f32::INFINITY { self.clamp(start, value) } else { value };
        self.radiance[start as usize] += kept;
        kept
    }

    /// Adds emission found by a path.
    #[inline(always)]
    pub(super) fn add_emission(
        &mut self,
        start: u32,
        value: Spectrum,
        source: impl FnOnce() -> LightSource,
    ) {
        let kept = self.add(start, value);
        self.observer.on_emission(start, [value, kept], source);
    }

    /// Adds the result of a light sample; see [`PathObserver::on_light_result`].
    #[inline(always)]
    pub(super) fn add_light_sample(&mut self, start: u32, value: Spectrum, is_last: bool) {
        let kept = self.add(start, value);
        self.observer.on_light_result(start, [value, kept], is_last);
    }

    /// Returns the index of a new partial sum, which is not clamped.
    pub(super) fn new_partial(&mut self) -> u32 {
        self.radiance.push(Spectrum::ZERO);
        self.radiance.len() as u32 - 1
    }

    /// Current value of a sum.
    pub(super) fn value(&self, target: u32) -> Spectrum {
        self.radiance[target as usize]
    }

    /// Clamps a contribution. NaN is unchanged, for the film to reject.
    #[cold]
    fn clamp(&mut self, start: u32, value: Spectrum) -> Spectrum {
        let y = value.luminance();
        if start as usize >= self.camera_rays || !(y > self.limit && y < f32::INFINITY) {
            return value;
        }
        self.clamped.push((start, (y - self.limit).min(ExactSum::LIMIT)));
        value * (self.limit / y)
    }
}
