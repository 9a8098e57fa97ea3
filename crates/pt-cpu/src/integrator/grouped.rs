//! Light by groups of lights: of what paths are told to have found, by whom each part was given.

use pt_core::RenderScene;
use pt_core::film::ExactSum;
use pt_math::Spectrum;

use super::{Integrator, Recording, Starts};
use crate::Tracer;
use crate::light_groups::LightGroups;

/// An integrator that also tells the light of each group: the samples are those of `inner`, which writes down where
/// its light came from.
pub(crate) struct Grouped<'a> {
    inner: Box<dyn Recording + 'a>,
    scene: &'a RenderScene,
    groups: &'a LightGroups,
    /// Of each start in turn the light of all groups.
    parts: Vec<Spectrum>,
}

impl<'a> Grouped<'a> {
    pub(crate) fn new(
        inner: Box<dyn Recording + 'a>,
        scene: &'a RenderScene,
        groups: &'a LightGroups,
    ) -> Self {
        Self { inner, scene, groups, parts: Vec::new() }
    }
}

impl Integrator for Grouped<'_> {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        self.inner.radiance(tracer, starts, radiance);
        let Self { scene, groups, .. } = *self;
        let count = groups.names().len();
        self.parts.clear();
        self.parts.resize(count * radiance.len(), Spectrum::ZERO);
        let traces = self.inner.take_traces();
        for (trace, parts) in traces.iter().zip(self.parts.chunks_exact_mut(count)) {
            for contribution in &trace.contributions {
                parts[groups.of_source(scene, &contribution.source) as usize] += contribution.value;
            }
        }
    }

    fn take_removed(&mut self) -> ExactSum {
        self.inner.take_removed()
    }

    fn parts(&self) -> &[Spectrum] {
        &self.parts
    }
}
