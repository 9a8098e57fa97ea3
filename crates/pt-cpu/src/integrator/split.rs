//! Paths that have split behind the first surface where they scattered.

use pt_math::sampler::Sampler;

use super::CameraRays;
use super::path_queue::PathState;

/// The number of ways that each start has, a power of two. The ways of all starts are numbered
/// start by start.
#[derive(Clone, Copy)]
pub(super) struct PathSplitting {
    log2: u32,
}

impl PathSplitting {
    pub(super) const NONE: Self = Self { log2: 0 };

    /// So many.
    pub(super) fn new(count: u32) -> Self {
        debug_assert!(count.is_power_of_two());
        Self { log2: count.trailing_zeros() }
    }

    pub(super) fn count(self) -> u32 {
        1 << self.log2
    }

    /// The number of a way of a start.
    pub(super) fn path_index(self, start: u32, way: u32) -> u32 {
        start << self.log2 | way
    }

    /// The start of the way with this number.
    #[inline(always)]
    pub(super) fn camera_ray(self, number: u32) -> usize {
        (number >> self.log2) as usize
    }

    /// Its numbers.
    #[inline(always)]
    pub(super) fn sampler(self, camera_rays: &CameraRays, number: u32) -> Sampler {
        let whole = camera_rays.samplers.get(self.camera_ray(number));
        whole.split(self.log2, number & (self.count() - 1))
    }

    /// The time of path number `i`. Where nothing moves, the path is not looked at.
    #[inline(always)]
    pub(super) fn time(self, camera_rays: &CameraRays, paths: &[PathState], i: usize) -> f32 {
        if camera_rays.times.is_empty() {
            0.0
        } else {
            camera_rays.time(self.camera_ray(paths[i].start))
        }
    }
}
