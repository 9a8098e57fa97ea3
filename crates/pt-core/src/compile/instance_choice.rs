//! Choice of the objects that become instances.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::Arc;

use pt_scene::{Geometry, Object, Scene, Sides};

/// Default of [`super::CompileOptions::most_copied_triangles`].
pub const MAX_FLATTENED_TRIANGLES: usize = 1 << 21;

/// Key of objects that differ only in their transform: address of the mesh or the points, radius of
/// the points, materials, and media.
pub(super) type InstanceKey = (usize, Option<u64>, Vec<Option<u32>>, Option<Sides>);

pub(super) fn instance_key(object: &Object) -> Option<InstanceKey> {
    let (address, radius) = match &object.geometry {
        Geometry::Mesh(mesh) => (Arc::as_ptr(mesh).addr(), None),
        Geometry::Points { points, radius } => (Arc::as_ptr(points).addr(), *radius),
        Geometry::Sphere { .. } => return None,
    };
    let radius = radius.map(f64::to_bits);
    Some((address, radius, object.materials.clone(), object.media))
}

/// Number of triangles and spheres of an object.
fn primitives(object: &Object) -> usize {
    match &object.geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Points { points, .. } => points.positions.len() + points.triangles(),
        Geometry::Sphere { .. } => 1,
    }
}

/// Returns, for each object, true if it becomes an instance. These are the objects whose mesh has
/// the most triangles in copies, until the copies of all others together have at most `most`. `may`
/// selects the candidates.
pub(super) fn choose_instances(
    scene: &Scene,
    most: Option<usize>,
    may: impl Fn(usize, &Object) -> bool,
) -> Vec<bool> {
    let mut places: HashMap<InstanceKey, Vec<usize>> = HashMap::new();
    for (number, object) in scene.objects.iter().enumerate() {
        if let Some(key) = instance_key(object).filter(|_| may(number, object)) {
            places.entry(key).or_default().push(number);
        }
    }
    // Triangles of all copies but the first, and the numbers of the objects.
    let extra = |numbers: Vec<usize>| {
        (primitives(&scene.objects[numbers[0]]) * (numbers.len() - 1), numbers)
    };
    let mut meshes: Vec<_> = places.into_values().map(extra).collect();
    meshes.sort_by_key(|(extra, numbers)| (Reverse(*extra), numbers[0]));
    let mut left: usize = meshes.iter().map(|(extra, _)| extra).sum();
    let mut shared = vec![false; scene.objects.len()];
    for (extra, numbers) in meshes {
        if left <= most.unwrap_or(MAX_FLATTENED_TRIANGLES) {
            break;
        }
        left -= extra;
        for number in numbers {
            shared[number] = true;
        }
    }
    shared
}
