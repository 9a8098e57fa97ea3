//! Precise intersections for cameras that are far from the scene.
//!
//! The depth of a hit errs by some rounding errors of the distance to the farthest vertex, so that
//! from afar one surface closely in front of another cannot be distinguished from it. The entry
//! points of rays into the box of the scene are computed in double precision, and hits are queried
//! from there: the error is then as small as if the camera stood in front of the box.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_math::{Bounds3, DVec3, Ray, Rays, Vec3};

/// A camera is far if, along an axis on which it is outside of the scene, its distance exceeds this
/// many times the size of the scene.
const FAR: f32 = 4.0;

/// Minimum distance relative to the largest extent of the scene, so that cameras in front of a flat
/// scene are not far.
const FAR_FROM_ALL: f32 = 0.25;

/// Relative distance before the box at which rays are cut, greater than the rounding error.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;

/// Rays that replace others in queries.
pub(crate) struct Distant {
    bounds: Bounds3,
    rays: Vec<Ray>,
    /// Parameter along the original ray at which each of them begins.
    starts: Vec<f32>,
}

impl Distant {
    /// Creates the state for a scene, or `None` if its camera is not far from it.
    pub(crate) fn new(scene: &RenderScene) -> Option<Self> {
        let bounds = scene.bounds();
        let is_far = |time| is_far(scene.camera_at(time).position, &bounds);
        let is_distant = !bounds.is_empty() && (is_far(0.0) || is_far(1.0));
        is_distant.then(|| Self { bounds, rays: Vec::new(), starts: Vec::new() })
    }

    /// Moves the origins of the rays to the box; other rays are unchanged.
    pub(crate) fn approach(&mut self, rays: Rays) -> Rays<'_> {
        let Self { bounds, rays: nearer, starts } = self;
        nearer.clear();
        starts.clear();
        for ray in rays.iter() {
            let start = entry(&ray, bounds);
            let origin = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(start);
            starts.push(start);
            nearer.push(Ray {
                origin: if start > 0.0 { origin.as_vec3() } else { ray.origin },
                direction: ray.direction,
                t_min: (ray.t_min - start).max(0.0),
                t_max: ray.t_max - start,
            });
        }
        Rays::Rows(nearer)
    }

    /// Converts the parameters of hits to those of the original rays.
    pub(crate) fn depart(&self, hits: &mut [Option<Hit>]) {
        for (hit, start) in hits.iter_mut().zip(&self.starts) {
            if let Some(hit) = hit {
                hit.t += start;
            }
        }
    }
}

/// Returns true if a point is far from a box.
fn is_far(p: Vec3, bounds: &Bounds3) -> bool {
    let gap = (bounds.min - p).max(p - bounds.max);
    let size = bounds.max - bounds.min;
    let far = (size * FAR).max(Vec3::splat(size.max_element() * FAR_FROM_ALL));
    gap.cmpgt(far).any()
}

/// Parameter shortly before a ray enters the box, or passes it; 0 if it begins inside or behind the
/// box.
fn entry(ray: &Ray, bounds: &Bounds3) -> f32 {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [mut start, mut end] = [0.0f64, f64::INFINITY];
    for k in 0..3 {
        if d[k] == 0.0 {
            continue;
        }
        let [a, b] = [bounds.min, bounds.max].map(|plane| (DVec3::from(plane)[k] - o[k]) / d[k]);
        start = start.max(a.min(b));
        end = end.min(a.max(b));
    }
    // Rays that miss the box are moved to it, too: from afar, rounding might make them hit.
    (start.min(end).max(0.0) * (1.0 - MARGIN)) as f32
}
