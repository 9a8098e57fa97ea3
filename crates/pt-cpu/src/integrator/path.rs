//! The unidirectional path tracer.

use pt_core::light::AnyLight;
use pt_core::scene::Interaction;
use pt_core::settings::{Roulette, Settings};
use pt_math::sampler::Sampler;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3};

use super::direct::{direct_light, found_weight};
use super::{CAMERA_DIMENSIONS, Integrator, bounce_dimensions};
use crate::Tracer;

/// Path tracing with direct light at every surface. [Kajiya 1986; Veach 1997, §10.3]
///
/// The radiance is a sum over the number k of surface interactions:
/// L = Σₖ β₁ β₂ … βₖ Le, with βⱼ = f |cos θ| / p of interaction j. Term k is estimated at
/// interaction k by direct light, and at interaction k + 1 by what the BSDF's sample found; the
/// weights of the two sum to one.
pub(super) struct Path {
    /// Largest number of surface interactions, if the settings do not want fewer.
    pub(super) depth: u32,
}

/// Short paths carry most of the light; to end them early would only add noise.
const FREE_BOUNCES: u32 = 3;

/// A path that goes on with probability q brings its light with weight 1/q; a bound on q bounds
/// the length of paths between perfect mirrors.
const MOST_SURVIVAL: f32 = 0.95;

/// How a ray came to its direction: the density, if light sampling could have found it too.
type Arrival = Option<Pdf<SolidAngle>>;

impl Integrator for Path {
    fn li(&self, tracer: &mut Tracer, settings: &Settings, ray: Ray, s: Sampler) -> Spectrum {
        let depth = self.depth.min(settings.max_depth).min(settings.max_bounce);
        let dimensions = bounce_dimensions(tracer, settings);
        let (mut ray, mut arrival, mut origin) = (ray, None, ray.origin);
        let (mut l, mut beta) = (Spectrum::ZERO, Spectrum::ONE);
        let mut squeeze = 1.0;
        for bounces in 0.. {
            let mut s = s.at_dimension(CAMERA_DIMENSIONS + bounces * dimensions);
            let Some(at) = tracer.intersect(&ray) else {
                if settings.shows(bounces) {
                    l += beta * sky(tracer, settings, origin, ray.direction, arrival);
                }
                break;
            };
            if settings.shows(bounces) {
                l += beta * emitted(tracer, settings, origin, &at, arrival);
            }
            if bounces >= depth {
                break;
            }
            let bsdf = tracer.scene.bsdf(&at);
            if !bsdf.is_delta() && settings.shows(bounces + 1) {
                l += beta * direct_light(tracer, settings, &at, &bsdf, &mut s);
            }
            let Some(scattered) = bsdf.sample(s.next_2d()) else { break };
            beta *= scattered.weight;
            squeeze *= scattered.squeeze;
            arrival = scattered.pdf;
            let finds_nothing = found_weight_is_zero(settings, arrival);
            if beta.is_black() || (bounces + 1 >= depth && finds_nothing) {
                break;
            }
            match survive(settings, beta * squeeze, bounces + 1, s.next_1d()) {
                Some(q) => beta *= 1.0 / q,
                None => break,
            }
            (ray, origin) = (at.spawn(scattered.wi), at.p);
        }
        l
    }
}

/// Whether light that a ray finds after a BSDF sample never counts.
#[inline(always)]
fn found_weight_is_zero(settings: &Settings, arrival: Arrival) -> bool {
    use pt_core::settings::DirectLight::{CosineHemisphere, UniformHemisphere};
    arrival.is_some() && matches!(settings.direct, CosineHemisphere | UniformHemisphere)
}

/// Weighted radiance that a surface emits towards the ray that found it.
#[inline(always)]
fn emitted(
    tracer: &Tracer,
    settings: &Settings,
    origin: Vec3,
    at: &Interaction,
    arrival: Arrival,
) -> Spectrum {
    let scene = tracer.scene;
    let l = scene.emitted(at);
    if l.is_black() {
        return l;
    }
    let light = scene.surfaces[at.surface].light.map(|id| {
        let light: &AnyLight = &scene.lights[id];
        let hit = Some(at.light_hit());
        (light, light.pdf(&scene.light_tables, origin, -at.wo, hit))
    });
    l * found_weight(settings, arrival, light)
}

/// Weighted radiance of the sky towards a ray that left the scene.
#[inline(always)]
fn sky(tracer: &Tracer, settings: &Settings, origin: Vec3, d: Vec3, arrival: Arrival) -> Spectrum {
    let scene = tracer.scene;
    let weighted = |light: &AnyLight| {
        let pdf = light.pdf(&scene.light_tables, origin, d, None);
        light.escaped(&scene.light_tables, d) * found_weight(settings, arrival, Some((light, pdf)))
    };
    scene.skies.iter().map(|&id| weighted(&scene.lights[id])).sum()
}

/// Russian roulette: the probability with which a path that lives on did so, or `None`; by the
/// throughput without what refraction takes and gives back.
#[inline(always)]
fn survive(settings: &Settings, beta: Spectrum, bounces: u32, u: f32) -> Option<f32> {
    let q = match settings.roulette {
        _ if bounces < FREE_BOUNCES => return Some(1.0),
        Roulette::Fixed(q) => q,
        Roulette::Throughput => beta.max_channel().min(MOST_SURVIVAL),
    };
    (u < q).then_some(q)
}
