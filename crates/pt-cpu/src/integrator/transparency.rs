//! Coverage of pixels, and lights that are hidden from the camera.
//!
//! A path that has not been scattered yet has a transmittance from the camera
//! ([`PathState::camera_transmittance`]). It is 1 at the camera, and is multiplied by the
//! transmittance of media, averaged over the channels. It does not change at transparent surfaces
//! and at surfaces that transmit light undeflected, except for division by the survival probability
//! of Russian roulette. It is 0 once the path is scattered. If the path then leaves the scene, this
//! fraction of the sample is transparent. Hidden lights are hidden while the transmittance is
//! not 0.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_core::settings::{Hidden, Settings};

use super::path_queue::PathState;
use super::split::PathSplitting;

/// Transparencies of the camera rays of a batch.
pub(super) struct Transparency {
    hidden: Hidden,
    /// True if the image has a visible background, so that its coverage is 1.
    has_background: bool,
    /// Values of the last batch, if the settings require coverage.
    values: Option<Vec<f32>>,
}

impl Transparency {
    pub(super) fn new(scene: &RenderScene, settings: &Settings) -> Self {
        let hidden = settings.hidden;
        Self {
            hidden,
            has_background: hidden == Hidden::Nothing && !scene.infinite_lights.is_empty(),
            values: settings.keeps_alpha().then(Vec::new),
        }
    }

    /// Begins a batch; returns the initial transmittance of its paths, 0 if it is not needed.
    pub(super) fn begin(&mut self, camera_rays: usize) -> f32 {
        if let Some(values) = &mut self.values {
            values.clear();
            values.resize(camera_rays, 0.0);
        }
        if self.values.is_some() || self.hidden != Hidden::Nothing { 1.0 } else { 0.0 }
    }

    /// Handles a path that left the scene; returns true if the environment is visible to it.
    #[inline(always)]
    pub(super) fn on_escape(&mut self, path: &PathState, splitting: PathSplitting) -> bool {
        if path.camera_transmittance == 0.0 {
            return true;
        }
        if let (Some(values), false) = (&mut self.values, self.has_background) {
            values[splitting.camera_ray(path.start)] += path.camera_transmittance;
        }
        self.hidden == Hidden::Nothing
    }

    /// Returns true if emissive surfaces are hidden from the camera.
    #[inline]
    pub(super) fn hides_emitters(&self) -> bool {
        self.hidden == Hidden::Emitters
    }

    /// Sets the transparencies of an integrator whose samples depend only on first hits.
    pub(super) fn of_first_hits(&mut self, hits: &[Option<Hit>]) {
        if let Some(values) = &mut self.values {
            values.clear();
            values.extend(hits.iter().map(|hit| if hit.is_some() { 0.0 } else { 1.0 }));
        }
    }

    /// See [`super::Integrator::transparency`].
    pub(super) fn values(&self) -> Option<&[f32]> {
        self.values.as_deref()
    }
}
