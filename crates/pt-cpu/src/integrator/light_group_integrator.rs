//! Radiance by light groups, computed from the recorded contributions of paths.

use pt_core::RenderScene;
use pt_math::Spectrum;

use super::{CameraRays, Integrator, TracedIntegrator};
use crate::Tracer;
use crate::light_groups::LightGroups;
use crate::trace::{Contribution, LightSource};

/// Integrator that also computes the radiance of each light group: the samples are those of
/// `inner`, which records the sources of their contributions.
pub(crate) struct LightGroupIntegrator<'a> {
    inner: Box<dyn TracedIntegrator + 'a>,
    scene: &'a RenderScene,
    groups: &'a LightGroups,
    /// Radiance of all groups for each camera ray in turn.
    radiance: Vec<Spectrum>,
}

impl<'a> LightGroupIntegrator<'a> {
    pub(crate) fn new(
        inner: Box<dyn TracedIntegrator + 'a>,
        scene: &'a RenderScene,
        groups: &'a LightGroups,
    ) -> Self {
        Self { inner, scene, groups, radiance: Vec::new() }
    }
}

/// Adds radiance of the environment, divided among infinite lights in proportion to their
/// unweighted radiance.
fn add_shares(
    parts: &mut [Spectrum],
    groups: &LightGroups,
    value: Spectrum,
    infinite_lights: &[Spectrum],
) {
    let whole = infinite_lights.iter().copied().sum::<Spectrum>().to_array();
    for (number, sky) in (0..).zip(infinite_lights) {
        let (sky, value) = (sky.to_array(), value.to_array());
        let share = |c: usize| if sky[c] == 0.0 { 0.0 } else { value[c] * (sky[c] / whole[c]) };
        parts[groups.of_sky(number) as usize] += Spectrum::from([0, 1, 2].map(share));
    }
}

impl Integrator for LightGroupIntegrator<'_> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        self.inner.radiance(tracer, camera_rays, radiance);
        let Self { scene, groups, .. } = *self;
        let count = groups.names().len();
        self.radiance.clear();
        self.radiance.resize(count * radiance.len(), Spectrum::ZERO);
        let traces = self.inner.take_traces();
        for (trace, parts) in traces.iter().zip(self.radiance.chunks_exact_mut(count)) {
            let mut infinite_lights = trace.infinite_lights.iter().peekable();
            for Contribution { source, value, .. } in &trace.contributions {
                let is_sky = matches!(source, LightSource::Sky { .. });
                match infinite_lights.next_if(|_| is_sky) {
                    Some(infinite_lights) => add_shares(parts, groups, *value, infinite_lights),
                    None => parts[groups.of_source(scene, source) as usize] += *value,
                }
            }
        }
    }

    fn take_clamped(&mut self) -> Vec<(u32, f32)> {
        self.inner.take_clamped()
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.inner.transparency()
    }

    fn light_group_radiance(&self) -> Option<&[Spectrum]> {
        Some(&self.radiance)
    }
}
