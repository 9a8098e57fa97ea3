//! Ray queries of one thread, counted.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_math::Rays;

/// Asks a scene for intersections, many rays at a time, and counts the questions.
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a RenderScene,
    /// Number of rays so far.
    pub rays: u64,
    /// Number of primitives that were tested; stays 0 unless they are counted.
    pub tests: u64,
    counts_tests: bool,
}

impl<'a> Tracer<'a> {
    /// For one scene; counting tests costs a little.
    pub fn new(scene: &'a RenderScene, counts_tests: bool) -> Self {
        Self { scene, rays: 0, tests: 0, counts_tests }
    }

    /// The nearest hit of each ray, in order, in place of what `hits` held.
    pub fn intersect<'r>(&mut self, rays: impl Into<Rays<'r>>, hits: &mut Vec<Option<Hit>>) {
        let rays = rays.into();
        self.rays += rays.len() as u64;
        let bvh = &self.scene.bvh;
        if self.counts_tests {
            bvh.intersect_batch_counted(rays, hits, &mut self.tests);
        } else {
            bvh.intersect_batch(rays, hits);
        }
    }

    /// Whether anything is in the way of each ray, in order, in place of what `occluded` held.
    pub fn occluded<'r>(&mut self, rays: impl Into<Rays<'r>>, occluded: &mut Vec<bool>) {
        let rays = rays.into();
        self.rays += rays.len() as u64;
        let bvh = &self.scene.bvh;
        if self.counts_tests {
            bvh.occluded_batch_counted(rays, occluded, &mut self.tests);
        } else {
            bvh.occluded_batch(rays, occluded);
        }
    }
}
