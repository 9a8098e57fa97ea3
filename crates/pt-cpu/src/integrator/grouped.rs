//! Light by groups of lights: of what paths are told to have found, by whom each part was given.

use pt_core::RenderScene;
use pt_core::film::ExactSum;
use pt_math::Spectrum;

use super::{Integrator, Recording, Starts};
use crate::Tracer;
use crate::light_groups::LightGroups;
use crate::trace::{Contribution, Source};

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

/// Adds light of the sky, of which each of its lights gave a share in proportion to what it brought.
fn add_shares(parts: &mut [Spectrum], groups: &LightGroups, value: Spectrum, skies: &[Spectrum]) {
    let whole = skies.iter().copied().sum::<Spectrum>().to_array();
    for (number, sky) in (0..).zip(skies) {
        let (sky, value) = (sky.to_array(), value.to_array());
        let share = |c: usize| if sky[c] == 0.0 { 0.0 } else { value[c] * (sky[c] / whole[c]) };
        parts[groups.of_sky(number) as usize] += Spectrum::from([0, 1, 2].map(share));
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
            let mut skies = trace.skies.iter().peekable();
            for Contribution { source, value, .. } in &trace.contributions {
                let is_sky = matches!(source, Source::Sky { .. });
                match skies.next_if(|_| is_sky) {
                    Some(skies) => add_shares(parts, groups, *value, skies),
                    None => parts[groups.of_source(scene, source) as usize] += *value,
                }
            }
        }
    }

    fn take_removed(&mut self) -> ExactSum {
        self.inner.take_removed()
    }

    fn transparencies(&self) -> &[f32] {
        self.inner.transparencies()
    }

    fn parts(&self) -> &[Spectrum] {
        &self.parts
    }
}
