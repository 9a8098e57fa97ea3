//! Where the lights of a compiled scene come from.

use crate::scene::RenderScene;

/// What a light is in the scene that was compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightSourceId {
    /// The object of this number, which glows.
    Object(u32),
    /// The light node of this number.
    Node(u32),
    /// The light of this number among those that are infinitely far away and are seen.
    Sky(u32),
    /// The medium of this number, which glows.
    Medium(u32),
}

/// The numbers of the light nodes of which lights were made.
#[derive(Clone, Debug, Default)]
pub struct LightSourceIds {
    /// Of each light; `None` where it was made of something else, or of many.
    pub(crate) lights: Vec<Option<u32>>,
    /// Of each light in the tree of lights without extent.
    pub(crate) points: Vec<u32>,
    /// Of each glowing square; these are two triangles each, behind those of all objects.
    pub(crate) squares: Vec<u32>,
}

impl RenderScene {
    /// What a primitive that glows is.
    pub fn source_of_primitive(&self, primitive: u32) -> LightSourceId {
        let place = self.locate_primitive(primitive);
        let square = (place.index / 2) as usize;
        if (place.object as usize) < self.object_ends.len() {
            return LightSourceId::Object(place.object);
        }
        let node = self.light_origins.squares.get(square).copied();
        LightSourceId::Node(node.unwrap_or(u32::MAX))
    }

    /// What each light is, by its place in [`Self::lights`]: as many for each as may be chosen
    /// there, or one.
    pub fn light_source_ids(&self) -> Vec<Vec<LightSourceId>> {
        let LightSourceIds { lights, points, .. } = &self.light_origins;
        let mut first_primitives = vec![None; self.lights.as_slice().len()];
        for (primitive, surface) in (0..).zip(&self.shapes.primitive_surface) {
            if let Some(light) = self.surfaces[*surface].light {
                first_primitives[light.index()].get_or_insert(primitive);
            }
        }
        let nodes = lights.iter().copied().chain(std::iter::repeat(None));
        let lights = self.lights.iter().zip(nodes).zip(first_primitives);
        let origins = lights.map(|(((id, light), node), primitive)| {
            if let Some(tree) = light.tree(&self.light_tables) {
                let points = points.iter().copied().map(LightSourceId::Node);
                let primitives = tree.primitive_of_each().into_iter().flatten();
                let of_tree: Vec<_> = primitives.map(|p| self.source_of_primitive(p)).collect();
                return if of_tree.is_empty() { points.collect() } else { of_tree };
            }
            let sky = self.infinite_lights.iter().position(|sky| *sky == id);
            vec![match (sky, primitive) {
                (Some(number), _) => LightSourceId::Sky(number as u32),
                (None, Some(primitive)) => self.source_of_primitive(primitive),
                (None, None) => LightSourceId::Node(node.unwrap_or(u32::MAX)),
            }]
        });
        origins.collect()
    }

    /// The numbers of the light nodes that are no part of the sky, in their order.
    pub fn light_nodes(&self) -> Vec<u32> {
        let lights = self.light_source_ids().into_iter().flatten();
        let squares = self.light_origins.squares.iter().copied().map(LightSourceId::Node);
        let node = |origin| match origin {
            LightSourceId::Node(number) => Some(number),
            LightSourceId::Object(_) | LightSourceId::Sky(_) | LightSourceId::Medium(_) => None,
        };
        let mut nodes: Vec<_> = lights.chain(squares).filter_map(node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// What each of [`Self::animated_lights`] is.
    pub fn animated_light_source_ids(&self) -> Vec<LightSourceId> {
        let object = |placement: u32| {
            self.with_instances(|placed| placed.instances()[placement as usize].number)
        };
        let lights = self.animated_lights().iter();
        lights.map(|light| LightSourceId::Object(object(light.placement))).collect()
    }
}
