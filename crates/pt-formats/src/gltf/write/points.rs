//! Primitives of points and lines.

use std::collections::HashSet;
use std::sync::Arc;

use pt_scene::Points;
use serde_json::{Map, Value, json};

use super::GltfWriter;

impl GltfWriter<'_> {
    /// Writes a mesh with primitives of points and of lines, and returns the fields of a node that
    /// refers to it.
    ///
    /// # Errors
    /// If a position is not finite.
    pub(super) fn points(
        &mut self,
        points: &Arc<Points>,
        material: Option<usize>,
    ) -> Result<Map<String, Value>, String> {
        let shown = |index: usize| Map::from_iter([("mesh".to_owned(), index.into())]);
        let key = (Arc::as_ptr(points).addr(), material);
        if let Some(known) = self.known_points.get(&key) {
            return Ok(shown(*known));
        }
        if !points.positions.as_flattened().iter().all(|x| x.is_finite()) {
            return Err("found a point with a position that is not finite".to_owned());
        }
        let binary = &mut self.binary;
        let mut attributes = json!({"POSITION": binary.vertices(&points.positions, true)});
        if let Some(colors) = &points.colors {
            let share = |x: f32| if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) };
            let colors: Vec<_> = colors.iter().map(|color| color.map(share)).collect();
            attributes["COLOR_0"] = binary.vertices(&colors, false).into();
        }
        let count = points.positions.len();
        let mut primitives = Vec::new();
        let mut primitive = |mode: u8, indices: Option<&[u32]>| {
            let mut written = json!({"attributes": attributes, "mode": mode});
            if let Some(indices) = indices {
                written["indices"] = binary.indices(indices, count).into();
            }
            if let Some(material) = material {
                written["material"] = material.into();
            }
            primitives.push(written);
        };
        if points.segments.is_empty() {
            primitive(0, None);
        } else {
            primitive(1, Some(points.segments.as_flattened()));
            let ends: HashSet<_> = points.segments.as_flattened().iter().collect();
            let alone: Vec<_> = (0..count as u32).filter(|i| !ends.contains(i)).collect();
            if !alone.is_empty() {
                primitive(0, Some(&alone));
            }
        }
        let mut mesh = json!({"primitives": primitives});
        if !points.name.is_empty() {
            mesh["name"] = points.name.clone().into();
        }
        self.meshes.push(mesh);
        let index = self.meshes.len() - 1;
        self.known_points.insert(key, index);
        Ok(shown(index))
    }
}
