//! Accumulation of the radiance of camera rays, contribution by contribution.

use pt_core::film::ExactSum;
use pt_core::settings::Clamp;
use pt_math::Spectrum;

use super::observer::PathObserver;
use super::split::PathSplitting;
use crate::trace::LightSource;

/// Sums of contributions, each clamped to a luminance.
///
/// With path splitting, each path of a camera ray has its own sum, numbered by
/// [`PathSplitting::path_index`]. One sum for all of them would depend on the batch: rays are
/// traced when their queue is full, so that it is not fixed which path's light comes first.
pub(super) struct RadianceAccumulator<'a, W> {
    radiance: &'a mut Vec<Spectrum>,
    /// Number of sums that belong to paths; the rest are partial sums.
    paths: usize,
    /// Paths of each camera ray that have a sum.
    pub(super) splitting: PathSplitting,
    clamp: Clamp,
    /// Limit of the luminance of the next contributions.
    limit: f32,
    /// Camera rays with the luminance that clamping removed from their contributions.
    clamped: Vec<(u32, f32)>,
    /// Observer of every contribution.
    pub(super) observer: W,
}

impl<'a, W: PathObserver> RadianceAccumulator<'a, W> {
    /// Accumulates the radiance of `camera_rays` into `radiance`, from 0.
    pub(super) fn new(
        radiance: &'a mut Vec<Spectrum>,
        camera_rays: usize,
        splitting: PathSplitting,
        clamp: Clamp,
        observer: W,
    ) -> Self {
        let paths = camera_rays * splitting.count() as usize;
        radiance.clear();
        radiance.resize(paths, Spectrum::ZERO);
        Self {
            radiance,
            paths,
            splitting,
            clamp,
            limit: clamp.limit(0),
            clamped: Vec::new(),
            observer,
        }
    }

    /// Adds the sums of the paths of each camera ray, and removes the partial sums; returns the
    /// luminance removed by clamping from contributions of camera rays, and the observer.
    pub(super) fn finish(self) -> (Vec<(u32, f32)>, W) {
        let Self { radiance, paths, splitting, clamped, observer, .. } = self;
        radiance.truncate(paths);
        if splitting.count() > 1 {
            let ways = radiance.chunks_exact(splitting.count() as usize);
            *radiance = ways.map(|ways| ways.iter().copied().sum()).collect();
        }
        (clamped, observer)
    }

    /// Sets the number of scattering events of the next contributions.
    #[inline(always)]
    pub(super) fn set_bounces(&mut self, bounces: u32) {
        self.limit = self.clamp.limit(bounces);
    }

    /// Adds a contribution to a sum; returns its value after clamping.
    #[inline(always)]
    pub(super) fn add(&mut self, target: u32, value: Spectrum) -> Spectrum {
        let kept = if self.limit < f32::INFINITY { self.clamp(target, value) } else { value };
        self.radiance[target as usize] += kept;
        kept
    }

    /// Adds emission found by a path.
    #[inline(always)]
    pub(super) fn add_emission(
        &mut self,
        target: u32,
        value: Spectrum,
        source: impl FnOnce() -> LightSource,
    ) {
        let kept = self.add(target, value);
        self.observer.on_emission(target, [value, kept], source);
    }

    /// Adds the result of a light sample; see [`PathObserver::on_light_result`].
    #[inline(always)]
    pub(super) fn add_light_sample(&mut self, target: u32, value: Spectrum, is_last: bool) {
        let kept = self.add(target, value);
        self.observer.on_light_result(target, [value, kept], is_last);
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
    fn clamp(&mut self, target: u32, value: Spectrum) -> Spectrum {
        let y = value.luminance();
        if target as usize >= self.paths || !(y > self.limit && y < f32::INFINITY) {
            return value;
        }
        let camera_ray = self.splitting.camera_ray(target) as u32;
        self.clamped.push((camera_ray, (y - self.limit).min(ExactSum::LIMIT)));
        value * (self.limit / y)
    }
}
