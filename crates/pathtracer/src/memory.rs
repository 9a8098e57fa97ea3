//! Estimates and limits of the memory of a render.

use std::collections::HashSet;
use std::sync::Arc;

pub use pt_memory::{
    Grant, ask, available_bytes, is_short, limit, peak_bytes, return_large_arrays, set_limit,
    used_bytes,
};
use pt_scene::{Geometry, Scene};

/// Maximum number of bytes per triangle of tables and hierarchy while they are built. For meshes of
/// 245,000, 980,000 and 3,920,000 triangles, whole renders took 45, 147 and 498 MB; this value
/// gives 41, 146 and 567 MB.
const TRIANGLE_BYTES: u64 = 125;

/// Maximum number of bytes per sphere of a point cloud.
const POINT_BYTES: u64 = 100;

/// Estimates the bytes that compiling a scene takes in addition to the scene itself.
pub fn bytes_of_tables(scene: &Scene, most_copied_triangles: Option<usize>) -> u64 {
    let mut seen = HashSet::new();
    let (mut once, mut copies) = (0, 0);
    for object in &scene.objects {
        let (address, triangles, points) = match &object.geometry {
            Geometry::Mesh(mesh) => (Arc::as_ptr(mesh).addr(), mesh.triangles.len(), 0),
            Geometry::Points { points, .. } => {
                (Arc::as_ptr(points).addr(), points.triangles(), points.positions.len())
            }
            Geometry::Sphere { .. } => continue,
        };
        let bytes = triangles as u64 * TRIANGLE_BYTES + points as u64 * POINT_BYTES;
        *(if seen.insert(address) { &mut once } else { &mut copies }) += bytes;
    }
    let most = most_copied_triangles.unwrap_or(pt_core::MAX_FLATTENED_TRIANGLES) as u64;
    once + copies.min(most * TRIANGLE_BYTES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_beyond_those_that_are_made_cost_nothing() {
        let mut scene = crate::default_scene();
        let meshes = scene.objects.iter().filter(|o| matches!(o.geometry, Geometry::Mesh(_)));
        assert!(meshes.count() > 1);
        let once = bytes_of_tables(&scene, None);
        let again = scene.objects.clone();
        scene.objects.extend(again);
        assert_eq!(bytes_of_tables(&scene, None), 2 * once);
        assert_eq!(bytes_of_tables(&scene, Some(0)), once);
    }
}
