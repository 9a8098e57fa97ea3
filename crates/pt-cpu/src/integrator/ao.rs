//! Ambient occlusion: the unoccluded fraction of the hemisphere above a surface.

use pt_bvh::Hit;
use pt_core::settings::Hidden;
use pt_core::{RenderScene, Settings};
use pt_math::sampler::LANES;
use pt_math::{Frame, Ray, Rays, Spectrum, Vec3, warp};

use super::transparency::Transparency;
use super::{CAMERA_DIMENSIONS, CameraRays, Integrator, alpha};
use crate::Tracer;

/// ∫ V(ω) cos θ / π dω over the hemisphere on the visible side of the first hit, where V is 1 if
/// nothing is nearer than a given distance in direction ω, else 0; black without a hit. [Zhukov,
/// Iones & Kronin 1998, "An Ambient Light Illumination Model"]
///
/// Directions are cosine-weighted, so all have the same weight.
pub(super) struct AmbientOcclusion {
    /// Directions per surface point.
    samples: u32,
    distance: f32,
    hits: Vec<Option<Hit>>,
    /// Surface points of a block, and their lanes in it.
    points: Vec<(usize, Point)>,
    rays: Vec<Ray>,
    /// Camera ray of each occlusion ray.
    camera_rays: Vec<u32>,
    blocked: Vec<bool>,
    /// Transmittance of each occlusion ray.
    transmittance: Vec<f32>,
    /// Sum of the transmittances for each camera ray.
    open: Vec<f32>,
    hidden: Hidden,
    transparency: Transparency,
}

/// Surface point, with its side.
struct Point {
    at: pt_core::interaction::SurfacePoint,
    /// Geometric normal and shading frame, both on the visible side.
    normal: Vec3,
    frame: Frame,
}

/// Number of rays from which on the queue is flushed.
const FLUSH_RAYS: usize = 4096;

impl AmbientOcclusion {
    pub(super) fn new(scene: &RenderScene, settings: &Settings) -> Self {
        Self {
            samples: settings.light_samples.max(1),
            distance: settings.ao_distance,
            hits: Vec::new(),
            points: Vec::new(),
            rays: Vec::new(),
            camera_rays: Vec::new(),
            blocked: Vec::new(),
            transmittance: Vec::new(),
            open: Vec::new(),
            hidden: settings.hidden,
            transparency: Transparency::new(scene, settings),
        }
    }

    /// Queues the occlusion rays of a block of camera rays.
    fn sample_directions(&mut self, block: usize, tracer: &mut Tracer, camera_rays: &CameraRays) {
        let first = block * LANES;
        let rays = Rays::from(&camera_rays.rays);
        let hits = self.hits[first..].iter().take(LANES).enumerate();
        let point = |(lane, hit): (usize, &Option<Hit>)| {
            let ray = rays.get(first + lane);
            let time = camera_rays.time(first + lane);
            hit.as_ref().map(|hit| (lane, Point::new(tracer.scene, &ray, hit, time)))
        };
        self.points.clear();
        self.points.extend(hits.filter_map(point));
        if self.points.is_empty() {
            return;
        }
        for i in 0..self.samples {
            let d = CAMERA_DIMENSIONS.wrapping_add(i.wrapping_mul(2));
            let [x, y] = camera_rays.samplers.points(block, d);
            for (lane, point) in &self.points {
                let w = point.frame.to_world(warp::cosine_hemisphere([x[*lane], y[*lane]]));
                if w.dot(point.normal) > 0.0 {
                    self.rays.push(Ray { t_max: self.distance, ..point.at.spawn(w) });
                    self.camera_rays.push((first + lane) as u32);
                }
            }
            if self.rays.len() >= FLUSH_RAYS {
                self.trace(tracer, camera_rays);
            }
        }
    }

    /// Traces the queued rays, adds their transmittances, and clears the queue.
    fn trace(&mut self, tracer: &mut Tracer, camera_rays: &CameraRays) {
        let time = |i: usize| camera_rays.time(self.camera_rays[i] as usize);
        tracer.occluded(&self.rays, time, &mut self.blocked);
        alpha::shadow_transmittance(
            tracer,
            &self.rays,
            time,
            &self.blocked,
            &mut self.transmittance,
        );
        for (&start, &share) in self.camera_rays.iter().zip(&self.transmittance) {
            self.open[start as usize] += share;
        }
        self.rays.clear();
        self.camera_rays.clear();
    }
}

impl Integrator for AmbientOcclusion {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        alpha::first_hits(tracer, camera_rays, self.hidden, &mut self.hits);
        self.transparency.of_first_hits(&self.hits);
        self.open.clear();
        self.open.resize(self.hits.len(), 0.0);
        for block in 0..self.hits.len().div_ceil(LANES) {
            self.sample_directions(block, tracer, camera_rays);
        }
        self.trace(tracer, camera_rays);
        let samples = self.samples as f32;
        radiance.clear();
        radiance.extend(self.open.iter().map(|&sum| Spectrum::splat(sum / samples)));
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}

impl Point {
    fn new(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32) -> Self {
        let at = scene.interaction(ray, hit, time);
        let side = if at.wo.dot(at.point.normal) < 0.0 { -1.0 } else { 1.0 };
        let frame = Frame::from_normal(at.normal.normalize() * side);
        Self { at: at.point, normal: at.point.normal * side, frame }
    }
}
