//! Rays of a camera that is far from the scene.
//!
//! The depth of a hit errs by some rounding errors of the distance to the farthest vertex, so that
//! from afar one surface closely in front of another is not told from it. Where the rays enter the
//! box around the scene is computed in double precision, and asked for hits from there: then the
//! error is as small as if the camera stood in front of the box.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_math::{Bounds3, DVec3, Ray, Rays, Vec3};

/// Along an axis on which the camera is outside of the scene, it is far if it is more than so many
/// times as far away as the scene is large.
const FAR: f32 = 4.0;

/// The same along all axes together, so that cameras in front of something flat are not far.
const FAR_FROM_ALL: f32 = 0.25;

/// Rays stop this share of the way before the box, which is more than rounding takes away.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;

/// Rays that are asked in place of others.
pub(crate) struct Distant {
    bounds: Bounds3,
    rays: Vec<Ray>,
    /// How far along the ray that was given each of them begins.
    starts: Vec<f32>,
}

impl Distant {
    /// For a scene whose camera is far from it.
    pub(crate) fn new(scene: &RenderScene) -> Option<Self> {
        let bounds = scene.bounds();
        let is_far = |time| is_far(scene.camera_at(time).position, &bounds);
        let is_distant = !bounds.is_empty() && (is_far(0.0) || is_far(1.0));
        is_distant.then(|| Self { bounds, rays: Vec::new(), starts: Vec::new() })
    }

    /// The rays from where they enter the box; others as they are.
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

    /// Measures hits from where the rays that were given begin.
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

/// The parameter shortly before a ray enters the box, or comes by it; 0 if it begins inside, or
/// behind.
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
    // Rays that miss the box come to it, too: from afar, rounding might take them in.
    (start.min(end).max(0.0) * (1.0 - MARGIN)) as f32
}
