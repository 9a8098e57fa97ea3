//! Which group of lights a contribution belongs to.

use std::collections::HashMap;

use pt_core::RenderScene;
use pt_core::light::LightSourceId;

use crate::trace::{LightRef, LightSource, SampledLight};

/// Groups of the lights of a scene. All lights that are in none of them belong to the last one.
#[derive(Clone, Debug)]
pub struct LightGroups {
    names: Vec<String>,
    of: HashMap<LightSourceId, u32>,
    /// Of each light, or of each that may be chosen there.
    of_lights: Vec<Vec<u32>>,
    of_moving: Vec<u32>,
}

impl LightGroups {
    /// Of a scene: the names of the groups, the last one of which is that of all other lights, and
    /// where each light belongs that is not there.
    pub fn new(
        scene: &RenderScene,
        names: Vec<String>,
        groups: impl IntoIterator<Item = (LightSourceId, u32)>,
    ) -> Self {
        let (of_lights, of_moving) = (Vec::new(), Vec::new());
        let mut this = Self { names, of: groups.into_iter().collect(), of_lights, of_moving };
        let of = |origins: Vec<LightSourceId>| -> Vec<u32> {
            origins.into_iter().map(|origin| this.of(origin)).collect()
        };
        let of_lights = scene.light_source_ids().into_iter().map(of).collect();
        let of_moving = of(scene.animated_light_source_ids());
        (this.of_lights, this.of_moving) = (of_lights, of_moving);
        this
    }

    /// Their names.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    fn rest(&self) -> u32 {
        self.names.len().saturating_sub(1) as u32
    }

    fn of(&self, origin: LightSourceId) -> u32 {
        self.of.get(&origin).copied().unwrap_or(self.rest())
    }

    /// The group of a light of the sky, by its number there.
    pub(crate) fn of_sky(&self, number: u32) -> u32 {
        self.of(LightSourceId::Sky(number))
    }

    /// The group of light that was found like this, if the sky has one light. That from directions
    /// of a hemisphere, of which nobody tells where it came from, is counted with the rest.
    pub(crate) fn of_source(&self, scene: &RenderScene, source: &LightSource) -> u32 {
        match source {
            LightSource::Emitter { primitive, .. } => {
                self.of(scene.source_of_primitive(*primitive))
            }
            LightSource::Sky { .. } => self.of_sky(0),
            LightSource::Medium { medium, .. } => self.of(LightSourceId::Medium(*medium)),
            LightSource::Light(SampledLight {
                light: LightRef::Static(number), chosen, ..
            }) => {
                let chosen = chosen.map_or(0, |chosen| chosen.number as usize);
                let group = self.of_lights.get(*number).and_then(|groups| groups.get(chosen));
                group.copied().unwrap_or(self.rest())
            }
            LightSource::Light(SampledLight { light: LightRef::Animated(number), .. }) => {
                self.of_moving.get(*number).copied().unwrap_or(self.rest())
            }
            LightSource::Hemisphere { .. } => self.rest(),
        }
    }
}
