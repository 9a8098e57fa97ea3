//! Path splitting at the first surface where a path scatters.

use pt_core::settings::Settings;
use pt_math::sampler::{Sampler, Samplers};

use super::CameraRays;
use super::path_queue::PathState;

/// Number of paths per camera ray, a power of two. Paths are numbered camera ray by camera ray.
#[derive(Clone, Copy)]
pub(super) struct PathSplitting {
    log2: u32,
}

impl PathSplitting {
    pub(super) const NONE: Self = Self { log2: 0 };

    /// Splitting after the first surface by [`Settings::split`], which must be a power of two.
    pub(super) fn of_settings(settings: &Settings) -> Self {
        debug_assert!(settings.split.is_power_of_two());
        Self { log2: settings.split.trailing_zeros() }
    }

    pub(super) fn count(self) -> u32 {
        1 << self.log2
    }

    /// Number of a path of a camera ray.
    pub(super) fn path_index(self, start: u32, way: u32) -> u32 {
        start << self.log2 | way
    }

    /// Camera ray of the path with this number.
    #[inline(always)]
    pub(super) fn camera_ray(self, number: u32) -> usize {
        (number >> self.log2) as usize
    }

    /// Sampler of the path with this number.
    #[inline(always)]
    pub(super) fn sampler(self, camera_rays: &CameraRays, number: u32) -> Sampler {
        let whole = camera_rays.samplers.get(self.camera_ray(number));
        whole.split(self.log2, number & (self.count() - 1))
    }

    /// Samplers of a block of paths with these numbers.
    #[inline(always)]
    pub(super) fn samplers(
        self,
        camera_rays: &CameraRays,
        numbers: impl Iterator<Item = u32>,
    ) -> Samplers {
        camera_rays.samplers.parts(self.log2, numbers)
    }

    /// Time of path number `i`; 0 in static scenes.
    #[inline(always)]
    pub(super) fn time(self, camera_rays: &CameraRays, paths: &[PathState], i: usize) -> f32 {
        match &camera_rays.times {
            Some(times) => times[self.camera_ray(paths[i].start)],
            None => 0.0,
        }
    }
}
