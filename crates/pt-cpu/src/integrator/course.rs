//! Light as the program of the university course (CS184 / CSC4140, assignments 3-1 and 3-2)
//! computes it; `docs/cs184.md` says where it differs from physics.

use pt_core::bsdf::Bsdf;
use pt_core::scene::Interaction;
use pt_core::settings::{DirectLight, Roulette, Settings};
use pt_math::sampler::Sampler;
use pt_math::{Ray, Spectrum, warp};

use super::direct::{light_samples, sample_light};
use super::{CAMERA_DIMENSIONS, Integrator, bounce_dimensions};
use crate::Tracer;

/// The course's estimator: emission is seen by the camera and after mirrors and glass, all other
/// light is found by light sampling, or by uniform directions of the hemisphere.
pub(super) struct Course;

impl Integrator for Course {
    fn li(&self, tracer: &mut Tracer, settings: &Settings, ray: Ray, s: Sampler) -> Spectrum {
        let dimensions = bounce_dimensions(tracer, settings);
        let mut ray = ray;
        let mut sees_emission = true;
        let (mut l, mut beta) = (Spectrum::ZERO, Spectrum::ONE);
        for bounces in 0..=settings.max_depth {
            let mut s = s.at_dimension(CAMERA_DIMENSIONS + bounces * dimensions);
            let Some(at) = tracer.intersect(&ray) else {
                if bounces == 0 && settings.shows(0) {
                    l += tracer.scene.sky(ray.direction);
                }
                break;
            };
            if sees_emission && settings.shows(bounces) {
                l += beta * tracer.scene.emitted(&at);
            }
            if bounces == settings.max_depth {
                break;
            }
            let bsdf = tracer.scene.bsdf(&at);
            if !bsdf.is_delta() && settings.shows(bounces + 1) {
                l += beta * one_bounce(tracer, settings, &at, &bsdf, &mut s);
            }
            let Some(scattered) = bsdf.sample(s.next_2d()) else { break };
            beta *= scattered.weight;
            sees_emission = scattered.pdf.is_none();
            if bounces + 1 == settings.max_depth && !sees_emission {
                break;
            }
            // The first indirect bounce is always traced.
            if let (Roulette::Fixed(q), 1..) = (settings.roulette, bounces) {
                if s.next_1d() >= q {
                    break;
                }
                beta *= 1.0 / q;
            }
            ray = at.spawn(scattered.wi);
        }
        l
    }
}

#[inline(always)]
fn one_bounce(
    tracer: &mut Tracer,
    settings: &Settings,
    at: &Interaction,
    bsdf: &Bsdf,
    s: &mut Sampler,
) -> Spectrum {
    if settings.direct == DirectLight::UniformHemisphere {
        by_hemisphere(tracer, settings, at, bsdf, s)
    } else {
        by_lights(tracer, settings, at, bsdf, s)
    }
}

/// Light sampling. An area light counts times the distance to it (its density forgets to divide
/// by it once), and a point light does not fall off at all.
#[inline(always)]
fn by_lights(
    tracer: &mut Tracer,
    settings: &Settings,
    at: &Interaction,
    bsdf: &Bsdf,
    s: &mut Sampler,
) -> Spectrum {
    let scene = tracer.scene;
    let mut l = Spectrum::ZERO;
    for light in scene.lights.as_slice() {
        let n = light_samples(light, settings);
        let mut sum = Spectrum::ZERO;
        for _ in 0..n {
            if let Some((value, sample)) = sample_light(tracer, at, bsdf, light, s.next_2d()) {
                let d = sample.distance;
                sum += match (sample.end, sample.pdf) {
                    (None, _) => value,
                    (Some(_), Some(_)) => value * d,
                    (Some(_), None) => value * (d * d),
                };
            }
        }
        l += sum / n as f32;
    }
    l
}

/// Uniform directions of the hemisphere, which find glowing surfaces only.
fn by_hemisphere(
    tracer: &mut Tracer,
    settings: &Settings,
    at: &Interaction,
    bsdf: &Bsdf,
    s: &mut Sampler,
) -> Spectrum {
    let n = tracer.scene.lights.as_slice().len() as u32 * settings.light_samples;
    let mut sum = Spectrum::ZERO;
    for _ in 0..n {
        let local = warp::uniform_hemisphere(s.next_2d());
        let wi = bsdf.frame().to_world(local);
        let f = bsdf.eval(wi);
        if let Some(hit) = tracer.intersect(&at.spawn(wi)) {
            sum += f * tracer.scene.emitted(&hit) / warp::uniform_hemisphere_pdf(local.z).get();
        }
    }
    sum / n.max(1) as f32
}
