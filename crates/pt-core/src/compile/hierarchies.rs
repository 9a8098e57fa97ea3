//! Hierarchies of a compiled scene as bytes, so that the same scene is compiled elsewhere without
//! building them.

use std::collections::HashMap;
use std::sync::Arc;

use pt_bvh::{BuildOptions, Bvh, Geometry, ReadError, Sphere};

use super::with_geometry;
use crate::scene::RenderScene;
use crate::shapes::ShapeArrays;

/// BLAKE3 hash of primitives and build options.
type Key = [u8; blake3::OUT_LEN];

/// Hierarchies, found by the primitives over which they were built. Clones share them.
#[derive(Clone, Default)]
pub struct Hierarchies(Arc<HashMap<Key, Arc<Bvh>>>);

impl Hierarchies {
    /// Hierarchies of a compiled scene: of the shapes that are not instanced, and of each instanced
    /// object.
    pub fn of(scene: &RenderScene) -> Self {
        let placed = scene.instances.iter().flat_map(|table| table.objects());
        let all = std::iter::once((&scene.shapes.arrays, &scene.bvh))
            .chain(placed.map(|object| (&object.shapes.arrays, &object.bvh)));
        let known = all.map(|(arrays, bvh)| (key(arrays, bvh.options()), Arc::clone(bvh)));
        Self(Arc::new(known.collect()))
    }

    /// Serializes the hierarchies for [`Self::from_bytes`]; the bytes are the same on all machines
    /// of little-endian byte order.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut all: Vec<_> = self.0.iter().collect();
        all.sort_unstable_by_key(|(key, _)| **key);
        let mut bytes = Vec::new();
        for (key, bvh) in all {
            let tree = bvh.to_bytes();
            bytes.extend(key);
            bytes.extend((tree.len() as u64).to_le_bytes());
            bytes.extend(tree);
        }
        bytes
    }

    /// Parses hierarchies. Those of another scene, or of other options, are not used by any
    /// compilation.
    ///
    /// # Errors
    /// If a hierarchy is cut off or damaged, or of another version.
    pub fn from_bytes(mut bytes: &[u8]) -> Result<Self, ReadError> {
        let mut known = HashMap::new();
        while !bytes.is_empty() {
            let (key, rest) = bytes.split_first_chunk::<{ blake3::OUT_LEN }>().ok_or(CUT_OFF)?;
            let (count, rest) = rest.split_first_chunk().ok_or(CUT_OFF)?;
            let count = usize::try_from(u64::from_le_bytes(*count)).map_err(|_| CUT_OFF)?;
            let (tree, rest) = rest.split_at_checked(count).ok_or(CUT_OFF)?;
            known.insert(*key, Arc::new(Bvh::from_bytes(tree)?));
            bytes = rest;
        }
        Ok(Self(Arc::new(known)))
    }

    /// Hierarchy of these shapes.
    pub(super) fn find(&self, arrays: &ShapeArrays, options: BuildOptions) -> Option<Arc<Bvh>> {
        // Nothing is hashed without any.
        if self.0.is_empty() { None } else { self.0.get(&key(arrays, options)).cloned() }
    }
}

const CUT_OFF: ReadError = ReadError::Truncated;

fn key(arrays: &ShapeArrays, options: BuildOptions) -> Key {
    with_geometry(arrays, |Geometry { positions, triangles, spheres }| {
        let mut hash = blake3::Hasher::new();
        hash.update(format!("{options:?}").as_bytes());
        for count in [positions.len(), triangles.len(), spheres.len()] {
            hash.update(&(count as u64).to_le_bytes());
        }
        hash.update_rayon(bytemuck::cast_slice(positions));
        hash.update_rayon(bytemuck::cast_slice(triangles));
        let spheres = spheres.iter().map(|Sphere { center, radius }| center.extend(*radius));
        hash.update_rayon(bytemuck::cast_slice(&spheres.collect::<Vec<_>>()));
        *hash.finalize().as_bytes()
    })
}
