//! The radiance of starts, added up contribution by contribution.

use pt_core::film::ExactSum;
use pt_core::settings::Clamp;
use pt_math::Spectrum;

use super::observer::PathObserver;
use crate::trace::LightSource;

/// Sums of contributions, which are cut off at a luminance.
pub(super) struct RadianceAccumulator<'a, W> {
    radiance: &'a mut Vec<Spectrum>,
    /// Number of those that are camera rays; the rest are partial sums.
    camera_rays: usize,
    clamp: Clamp,
    /// That of the contributions that come next.
    limit: f32,
    /// Luminance that was cut off.
    clamped: &'a mut ExactSum,
    /// Who hears of all that is added, and of how it came about.
    pub(super) observer: W,
}

impl<'a, W: PathObserver> RadianceAccumulator<'a, W> {
    /// Adds to `radiance`, and to `clamped` what is cut off.
    pub(super) fn new(
        radiance: &'a mut Vec<Spectrum>,
        clamp: Clamp,
        clamped: &'a mut ExactSum,
        observer: W,
    ) -> Self {
        let camera_rays = radiance.len();
        Self { radiance, camera_rays, clamp, limit: clamp.limit(0), clamped, observer }
    }

    /// The contributions that come next are of light scattered `bounces` times.
    #[inline(always)]
    pub(super) fn set_bounces(&mut self, bounces: u32) {
        self.limit = self.clamp.limit(bounces);
    }

    /// Adds a contribution to the radiance of a start, and tells what is left of it.
    #[inline(always)]
    pub(super) fn add(&mut self, start: u32, value: Spectrum) -> Spectrum {
        let kept = if self.limit < f32::INFINITY { self.clamp(start, value) } else { value };
        self.radiance[start as usize] += kept;
        kept
    }

    /// Adds light that a path found.
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

    /// Adds light that a path asked for, as [`PathObserver::on_light_result`] says.
    #[inline(always)]
    pub(super) fn add_light_sample(&mut self, start: u32, value: Spectrum, is_last: bool) {
        let kept = self.add(start, value);
        self.observer.on_light_result(start, [value, kept], is_last);
    }

    /// Another sum, for a part of the light of a start; nothing is cut off from it.
    pub(super) fn new_partial(&mut self) -> u32 {
        self.radiance.push(Spectrum::ZERO);
        self.radiance.len() as u32 - 1
    }

    /// What a start or a part has so far.
    pub(super) fn value(&self, target: u32) -> Spectrum {
        self.radiance[target as usize]
    }

    /// What is left of a contribution. What is no number stays, to be refused by the film.
    #[cold]
    fn clamp(&mut self, start: u32, value: Spectrum) -> Spectrum {
        let y = value.luminance();
        if start as usize >= self.camera_rays || !(y > self.limit && y < f32::INFINITY) {
            return value;
        }
        self.clamped.add((y - self.limit).min(ExactSum::LIMIT));
        value * (self.limit / y)
    }
}
