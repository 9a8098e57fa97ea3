//! Ray queries of one thread, with counters.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_core::instances::InstanceTable;
use pt_math::{Ray, Rays};

use crate::distant::Distant;

/// Runs batched ray queries on a scene, and counts them.
pub struct Tracer<'a> {
    /// Scene of the queries.
    pub scene: &'a RenderScene,
    /// Number of rays traced so far.
    pub rays: u64,
    /// Number of primitives tested; 0 unless counting is enabled.
    pub tests: u64,
    counts_tests: bool,
    distant: Option<Distant>,
}

impl<'a> Tracer<'a> {
    /// Creates a tracer for one scene; counting tests costs a little.
    pub fn new(scene: &'a RenderScene, counts_tests: bool) -> Self {
        Self { scene, rays: 0, tests: 0, counts_tests, distant: Distant::new(scene) }
    }

    /// Replaces the contents of `hits` by the nearest hit of each ray, in order. `time` returns the
    /// time of ray number i, and is called only in scenes with instances; see
    /// [`RenderScene::is_animated`].
    pub fn intersect<'r>(
        &mut self,
        rays: impl Into<Rays<'r>>,
        time: impl Fn(usize) -> f32,
        hits: &mut Vec<Option<Hit>>,
    ) {
        let rays = rays.into();
        self.rays += rays.len() as u64;
        if let Some(mut distant) = self.distant.take() {
            self.nearest(distant.approach(rays), time, hits);
            distant.depart(hits);
            self.distant = Some(distant);
        } else {
            self.nearest(rays, time, hits);
        }
    }

    /// [`Self::intersect`] in the precision of the rays' origins.
    fn nearest(&mut self, rays: Rays, time: impl Fn(usize) -> f32, hits: &mut Vec<Option<Hit>>) {
        let bvh = &self.scene.bvh;
        if self.counts_tests {
            bvh.intersect_batch_counted(rays, hits, &mut self.tests);
        } else {
            bvh.intersect_batch(rays, hits);
        }
        if let Some(placed) = &self.scene.instances {
            self.intersect_placed(placed, rays, time, hits);
        }
    }

    /// Replaces hits by nearer ones on instances.
    fn intersect_placed(
        &mut self,
        placed: &InstanceTable,
        rays: Rays,
        time: impl Fn(usize) -> f32,
        hits: &mut [Option<Hit>],
    ) {
        for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            let ray = Ray { t_max: hit.map_or(ray.t_max, |hit| hit.t), ..ray };
            let nearer = if self.counts_tests {
                placed.intersect_counted(&ray, time(i), &mut self.tests)
            } else {
                placed.intersect(&ray, time(i))
            };
            *hit = nearer.or(*hit);
        }
    }

    /// Writes to `occluded`, for each ray in order, true if it is occluded; `time` as in
    /// [`Self::intersect`].
    pub fn occluded<'r>(
        &mut self,
        rays: impl Into<Rays<'r>>,
        time: impl Fn(usize) -> f32,
        occluded: &mut Vec<bool>,
    ) {
        let rays = rays.into();
        self.rays += rays.len() as u64;
        let bvh = &self.scene.bvh;
        if self.counts_tests {
            bvh.occluded_batch_counted(rays, occluded, &mut self.tests);
        } else {
            bvh.occluded_batch(rays, occluded);
        }
        if let Some(placed) = &self.scene.instances {
            self.occluded_placed(placed, rays, time, occluded);
        }
    }

    /// Adds occlusion by instances.
    fn occluded_placed(
        &mut self,
        placed: &InstanceTable,
        rays: Rays,
        time: impl Fn(usize) -> f32,
        occluded: &mut [bool],
    ) {
        let free = occluded.iter_mut().enumerate().filter(|(_, occluded)| !**occluded);
        for (i, occluded) in free {
            let ray = rays.get(i);
            *occluded = if self.counts_tests {
                placed.occluded_counted(&ray, time(i), &mut self.tests)
            } else {
                placed.occluded(&ray, time(i))
            };
        }
    }
}
