//! Order of paths by the lobes that they meet.

use pt_bvh::Hit;
use pt_core::bsdf::LobeRecord;
use pt_core::scene::RenderScene;

/// Sorts paths by the constant lobe at their vertices, so that many neighbours have the same one
/// and are computed together. [Laine, Karras & Aila 2013, "Megakernels Considered Harmful"] The
/// sort is stable: split paths of a camera ray, whose transmittances share a sum
/// ([`super::transparency`]), have the order that their own lobes give them.
pub(super) struct LobeOrder<P> {
    /// Bucket of each lobe of the scene: 0 for those that are not in blocks.
    buckets: Vec<u8>,
    /// Bucket of each path.
    keys: Vec<u8>,
    sorted: Vec<P>,
}

/// Number of buckets; further lobes share them.
const BUCKETS: usize = 64;

impl<P: Copy> LobeOrder<P> {
    /// `None` if no lobe of the scene is in blocks.
    pub(super) fn new(scene: &RenderScene) -> Option<Self> {
        let mut number = 0;
        let bucket = |lobe: &LobeRecord| {
            if !lobe.is_in_blocks() {
                return 0;
            }
            number += 1;
            (1 + (number - 1) % (BUCKETS - 1)) as u8
        };
        let buckets: Vec<u8> = scene.lobes.as_slice().iter().map(bucket).collect();
        let any = buckets.iter().any(|&bucket| bucket > 0);
        any.then(|| Self { buckets, keys: Vec::new(), sorted: Vec::new() })
    }

    /// Sorts `paths`; `surface_hit` returns the surface that a path reached, if it is on one.
    pub(super) fn sort(
        &mut self,
        scene: &RenderScene,
        paths: &mut Vec<P>,
        surface_hit: impl Fn(&P) -> Option<&Hit>,
    ) {
        let Self { buckets, keys, sorted } = self;
        let mut starts = [0; BUCKETS + 1];
        keys.clear();
        keys.extend(paths.iter().map(|path| {
            let lobe = surface_hit(path).map(|hit| scene.constant_lobe(hit).index());
            let key = lobe.map_or(0, |lobe| buckets[lobe]);
            starts[usize::from(key) + 1] += 1;
            key
        }));
        for bucket in 0..BUCKETS {
            starts[bucket + 1] += starts[bucket];
        }
        sorted.clone_from(paths);
        for (path, &key) in paths.iter().zip(&*keys) {
            let place = &mut starts[usize::from(key)];
            sorted[*place] = *path;
            *place += 1;
        }
        std::mem::swap(paths, sorted);
    }
}
