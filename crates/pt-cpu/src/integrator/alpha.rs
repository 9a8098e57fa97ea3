//! Alpha: rays that continue through partly transparent surfaces.

use pt_bvh::Hit;
use pt_core::settings::Hidden;
use pt_math::sampler::Sampler;
use pt_math::{Ray, Rays};

use super::CameraRays;
use crate::Tracer;

/// Sampler dimension of the decision at a transparent surface: number `count` of those between two
/// bounces. Far from the dimensions of bounces.
fn dimension(bounces: u32, count: u32) -> u32 {
    const FIRST: u32 = 1 << 31;
    const BETWEEN_BOUNCES: u32 = 1 << 12;
    FIRST.wrapping_add(bounces.wrapping_mul(BETWEEN_BOUNCES)).wrapping_add(count.wrapping_mul(2))
}

/// Continues paths stochastically through transparent surfaces between two bounces; `passed`
/// receives the number of the ray, the ray and the hit of each surface that is passed.
pub(super) fn skip_transparent(
    tracer: &mut Tracer,
    bounces: u32,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
    time: impl Fn(usize) -> f32,
    sampler: impl Fn(usize) -> Sampler,
    mut passed: impl FnMut(usize, &Ray, &Hit),
) {
    continue_through(tracer, rays, time, hits, |i, count, ray, hit, opacity| {
        let goes_on = sampler(i).at_dimension(dimension(bounces, count)).next_1d() >= opacity;
        if goes_on {
            passed(i, ray, hit);
        }
        goes_on
    });
}

/// Replaces hits of camera rays on emissive surfaces by the next hit behind them.
pub(super) fn skip_emitters(
    tracer: &mut Tracer,
    rays: &[Ray],
    time: impl Fn(usize) -> f32,
    hits: &mut [Option<Hit>],
) {
    let scene = tracer.scene;
    continue_while(tracer, rays, time, hits, |_, _, hit| scene.is_emissive(hit));
}

/// First hits of camera rays, the same as those of their paths; replaces the content of `hits`.
pub(crate) fn first_hits(
    tracer: &mut Tracer,
    camera_rays: &CameraRays,
    hidden: Hidden,
    hits: &mut Vec<Option<Hit>>,
) {
    let rays = Rays::from(&camera_rays.rays);
    tracer.intersect(rays, |i| camera_rays.time(i), hits);
    if hidden == Hidden::Emitters {
        let rays: Vec<Ray> = rays.iter().collect();
        skip_emitters(tracer, &rays, |i| camera_rays.time(i), hits);
    }
    if tracer.scene.has_alpha {
        let rays: Vec<Ray> = rays.iter().collect();
        let (time, sampler) = (|i| camera_rays.time(i), |i| camera_rays.samplers.get(i));
        skip_transparent(tracer, 0, &rays, hits, time, sampler, |_, _, _| {});
    }
}

/// Replaces hits on partly transparent surfaces by the next hit, while `goes_on` returns true. Its
/// arguments are the number of the ray, the number of surfaces passed before, the ray, the hit, and
/// the opacity, which is less than 1. `time` returns the time of a ray.
pub(super) fn continue_through(
    tracer: &mut Tracer,
    rays: &[Ray],
    time: impl Fn(usize) -> f32,
    hits: &mut [Option<Hit>],
    mut goes_on: impl FnMut(usize, u32, &Ray, &Hit, f32) -> bool,
) {
    let scene = tracer.scene;
    continue_while(tracer, rays, &time, hits, |i, count, hit| {
        let opacity = scene.opacity(&rays[i], hit, time(i));
        opacity < 1.0 && goes_on(i, count, &rays[i], hit, opacity)
    });
}

/// Replaces hits by the next hit, while `passes` returns true. Its arguments are the number of the
/// ray, the number of surfaces passed before, and the hit. `time` returns the time of a ray.
///
/// A ray continues just beyond its hit: the same ray meets the same triangle at the same distance,
/// which is then outside of its interval.
fn continue_while(
    tracer: &mut Tracer,
    rays: &[Ray],
    time: impl Fn(usize) -> f32,
    hits: &mut [Option<Hit>],
    mut passes: impl FnMut(usize, u32, &Hit) -> bool,
) {
    let mut under_way: Vec<usize> = (0..rays.len()).collect();
    let (mut again, mut found) = (Vec::new(), Vec::new());
    for count in 0.. {
        under_way.retain(|&i| hits[i].as_ref().is_some_and(|hit| passes(i, count, hit)));
        if under_way.is_empty() {
            return;
        }
        again.clear();
        again.extend(under_way.iter().map(|&i| {
            let behind = hits[i].map_or(rays[i].t_max, |hit| hit.t.next_up());
            Ray { t_min: behind, ..rays[i] }
        }));
        tracer.intersect(&again, |i| time(under_way[i]), &mut found);
        for (&i, hit) in under_way.iter().zip(&found) {
            hits[i] = *hit;
        }
    }
}

/// Fraction of the light that passes along each shadow ray; replaces the content of
/// `transmittance`. `time` returns the time of a ray.
pub(super) fn shadow_transmittance(
    tracer: &mut Tracer,
    rays: &[Ray],
    time: impl Fn(usize) -> f32,
    blocked: &[bool],
    transmittance: &mut Vec<f32>,
) {
    transmittance.clear();
    transmittance.extend(blocked.iter().map(|&b| if b { 0.0 } else { 1.0 }));
    if !tracer.scene.has_alpha {
        return;
    }
    let unclear: Vec<usize> = (0..rays.len()).filter(|&i| blocked[i]).collect();
    let of_unclear: Vec<Ray> = unclear.iter().map(|&i| rays[i]).collect();
    let mut passed = vec![1.0; unclear.len()];
    let mut hits = Vec::new();
    let time = |i: usize| time(unclear[i]);
    tracer.intersect(&of_unclear, time, &mut hits);
    continue_through(tracer, &of_unclear, time, &mut hits, |i, _, _, _, opacity| {
        passed[i] *= 1.0 - opacity;
        passed[i] > 0.0
    });
    for ((&i, hit), passed) in unclear.iter().zip(&hits).zip(passed) {
        if hit.is_none() {
            transmittance[i] = passed;
        }
    }
}
