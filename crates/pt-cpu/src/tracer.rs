//! Ray queries of one thread, counted.

use pt_core::scene::{Interaction, RenderScene};
use pt_math::Ray;

/// Asks a scene for intersections and counts the questions.
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

    /// The nearest surface point along a ray of unit direction.
    #[inline]
    pub fn intersect(&mut self, ray: &Ray) -> Option<Interaction> {
        self.rays += 1;
        let hit = if self.counts_tests {
            self.scene.bvh.intersect_counted(ray, &mut self.tests)
        } else {
            self.scene.bvh.intersect(ray)
        };
        hit.map(|h| self.scene.interaction(ray, &h))
    }

    /// Whether anything is in the way.
    #[inline]
    pub fn occluded(&mut self, ray: &Ray) -> bool {
        self.rays += 1;
        if self.counts_tests {
            self.scene.bvh.occluded_counted(ray, &mut self.tests)
        } else {
            self.scene.bvh.occluded(ray)
        }
    }
}
