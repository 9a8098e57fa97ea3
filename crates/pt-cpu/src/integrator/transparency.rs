//! Coverage of pixels, and lights that are hidden from the camera.
//!
//! A path that nothing has scattered yet carries how clear its way is
//! ([`PathState::camera_transmittance`]): 1 at the camera; times what media let through on average
//! over the channels; the same behind holes and where a surface lets light through as it
//! came, but for Russian roulette, which it makes up for; and 0 once it is scattered. If the path
//! then leaves the scene, so much of the sample is transparent. What is hidden is hidden as long as
//! the way is clear.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_core::settings::{Hidden, Settings};

use super::path_queue::PathState;
use super::split::PathSplitting;

/// The transparencies of the starts of a batch.
pub(super) struct Transparency {
    /// True if the settings ask for coverage.
    is_kept: bool,
    hidden: Hidden,
    /// True if coverage is that of a picture in which a background is seen.
    has_background: bool,
    values: Vec<f32>,
}

impl Transparency {
    pub(super) fn new(scene: &RenderScene, settings: &Settings) -> Self {
        let hidden = settings.hidden;
        Self {
            is_kept: settings.keeps_alpha(),
            hidden,
            has_background: hidden == Hidden::Nothing && !scene.infinite_lights.is_empty(),
            values: Vec::new(),
        }
    }

    /// Begins a batch; returns how clear the ways of its paths are, 0 if nobody asks.
    pub(super) fn begin(&mut self, camera_rays: usize) -> f32 {
        self.values.clear();
        if self.is_kept {
            self.values.resize(camera_rays, 0.0);
        }
        if self.is_kept || self.hidden != Hidden::Nothing { 1.0 } else { 0.0 }
    }

    /// Hears of a path that left the scene; returns whether it sees the sky there.
    #[inline(always)]
    pub(super) fn on_escape(&mut self, path: &PathState, splitting: PathSplitting) -> bool {
        if path.camera_transmittance == 0.0 {
            return true;
        }
        if self.is_kept && !self.has_background {
            self.values[splitting.camera_ray(path.start)] += path.camera_transmittance;
        }
        self.hidden == Hidden::Nothing
    }

    /// Returns true if surfaces that emit are hidden from who sees them directly.
    #[inline]
    pub(super) fn hides_emitters(&self) -> bool {
        self.hidden == Hidden::Emitters
    }

    /// Takes those of an integrator whose samples are what their rays hit first.
    pub(super) fn of_first_hits(&mut self, hits: &[Option<Hit>]) {
        if self.is_kept {
            self.values.clear();
            self.values.extend(hits.iter().map(|hit| if hit.is_some() { 0.0 } else { 1.0 }));
        }
    }

    /// See [`super::Integrator::transparency`].
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }
}
