//! Which group of lights a contribution belongs to.

use std::collections::HashMap;

use pt_core::RenderScene;
use pt_core::light::LightOrigin;

use crate::trace::{LightNumber, SampledLight, Source};

/// Groups of the lights of a scene. All lights that are in none of them belong to the last one.
#[derive(Clone, Debug)]
pub struct LightGroups {
    names: Vec<String>,
    of: HashMap<LightOrigin, u32>,
    /// Of each light, or of each that may be chosen there.
    of_lights: Vec<Vec<u32>>,
    of_moving: Vec<u32>,
}

impl LightGroups {
    /// Of a scene: the names of the groups, the last one of which is that of all other lights, and where each light belongs
    /// that is not there.
    pub fn new(
        scene: &RenderScene,
        names: Vec<String>,
        groups: impl IntoIterator<Item = (LightOrigin, u32)>,
    ) -> Self {
        let (of_lights, of_moving) = (Vec::new(), Vec::new());
        let mut this = Self { names, of: groups.into_iter().collect(), of_lights, of_moving };
        let of = |origins: Vec<LightOrigin>| -> Vec<u32> {
            origins.into_iter().map(|origin| this.of(origin)).collect()
        };
        let of_lights = scene.light_origins().into_iter().map(of).collect();
        let of_moving = of(scene.moving_light_origins());
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

    fn of(&self, origin: LightOrigin) -> u32 {
        self.of.get(&origin).copied().unwrap_or(self.rest())
    }

    /// The group of a light of the sky, by its number there.
    pub(crate) fn of_sky(&self, number: u32) -> u32 {
        self.of(LightOrigin::Sky(number))
    }

    /// The group of light that was found like this, if the sky has one light. That from directions of a hemisphere, of which nobody tells where it
    /// came from, is counted with the rest.
    pub(crate) fn of_source(&self, scene: &RenderScene, source: &Source) -> u32 {
        match source {
            Source::Emitter { primitive, .. } => self.of(scene.origin_of_primitive(*primitive)),
            Source::Sky { .. } => self.of_sky(0),
            Source::Glow { medium, .. } => self.of(LightOrigin::Medium(*medium)),
            Source::Light(SampledLight { light: LightNumber::Still(number), chosen, .. }) => {
                let chosen = chosen.map_or(0, |chosen| chosen.number as usize);
                let group = self.of_lights.get(*number).and_then(|groups| groups.get(chosen));
                group.copied().unwrap_or(self.rest())
            }
            Source::Light(SampledLight { light: LightNumber::Moving(number), .. }) => {
                self.of_moving.get(*number).copied().unwrap_or(self.rest())
            }
            Source::Hemisphere { .. } => self.rest(),
        }
    }
}
