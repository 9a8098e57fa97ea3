//! Assignment of contributions to light groups.

use std::collections::HashMap;

use pt_core::RenderScene;
use pt_core::light::LightSourceId;

use crate::trace::{LightRef, LightSource, SampledLight};

/// Light groups of a scene. All lights that are in no group belong to the last one.
#[derive(Clone, Debug)]
pub struct LightGroups {
    names: Vec<String>,
    of: HashMap<LightSourceId, u32>,
    /// Group of each static light, or of each light that may be chosen by it.
    of_lights: Vec<Vec<u32>>,
    of_moving: Vec<u32>,
}

impl LightGroups {
    /// Creates the groups of a scene: the names of the groups, of which the last one contains all
    /// other lights, and the group of each light that is not in the last one.
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

    /// Names of the groups.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    fn rest(&self) -> u32 {
        self.names.len().saturating_sub(1) as u32
    }

    fn of(&self, origin: LightSourceId) -> u32 {
        self.of.get(&origin).copied().unwrap_or(self.rest())
    }

    /// Group of an infinite light, by its number.
    pub(crate) fn of_sky(&self, number: u32) -> u32 {
        self.of(LightSourceId::Sky(number))
    }

    /// Group of a contribution from this source, if there is a single infinite light. Light found
    /// by hemisphere sampling, whose source is unknown, belongs to the last group.
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
