//! Sources of the lights in the scene that was compiled.

use super::RenderScene;
use crate::light::{LightSourceId, LightSourceIds};

impl RenderScene {
    /// Returns the source of an emissive primitive.
    pub fn source_of_primitive(&self, primitive: u32) -> LightSourceId {
        let place = self.locate_primitive(primitive);
        let square = (place.index / 2) as usize;
        if (place.object as usize) < self.object_ends.len() {
            return LightSourceId::Object(place.object);
        }
        let node = self.light_origins.squares.get(square).copied();
        LightSourceId::Node(node.unwrap_or(u32::MAX))
    }

    /// Returns the sources of each light, in the order of [`Self::lights`]: one, or those of all
    /// lights of a tree.
    pub fn light_source_ids(&self) -> Vec<Vec<LightSourceId>> {
        let LightSourceIds { lights, points, .. } = &self.light_origins;
        let mut first_primitives = vec![None; self.lights.as_slice().len()];
        for (primitive, surface) in (0..).zip(&*self.shapes.primitive_surface) {
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

    /// Returns the indices of the light nodes that are no visible lights at infinity, in ascending
    /// order.
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

    /// Returns the source of each of [`Self::animated_lights`].
    pub fn animated_light_source_ids(&self) -> Vec<LightSourceId> {
        let object = |placement: u32| {
            self.with_instances(|placed| placed.instances()[placement as usize].number)
        };
        let lights = self.animated_lights().iter();
        lights.map(|light| LightSourceId::Object(object(light.placement))).collect()
    }
}
