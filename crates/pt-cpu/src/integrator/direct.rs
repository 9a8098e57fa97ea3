//! Direct light at a surface point.

use pt_core::bsdf::Bsdf;
use pt_core::light::{AnyLight, LightSample};
use pt_core::scene::Interaction;
use pt_core::settings::{DirectLight, Settings};
use pt_math::measure::power_heuristic;
use pt_math::sampler::Sampler;
use pt_math::{Pdf, SolidAngle, Spectrum, warp};

use crate::Tracer;

/// f · |cos| · L / p of one sample of a light, if nothing is in its way; also the sample.
#[inline(always)]
pub(super) fn sample_light(
    tracer: &mut Tracer,
    at: &Interaction,
    bsdf: &Bsdf,
    light: &AnyLight,
    u: [f32; 2],
) -> Option<(Spectrum, LightSample)> {
    let sample = light.sample(&tracer.scene.light_tables, at.p, u)?;
    let f = bsdf.eval(sample.wi);
    if f.is_black() || sample.radiance.is_black() || tracer.occluded(&at.spawn_to(&sample)) {
        return None;
    }
    let p = sample.pdf.map_or(1.0, Pdf::get);
    Some((f * sample.radiance / p, sample))
}

/// Number of samples of a light: one is enough if all its light comes from one direction.
#[inline(always)]
pub(super) fn light_samples(light: &AnyLight, settings: &Settings) -> u32 {
    if light.is_delta() { 1 } else { settings.light_samples }
}

/// Light that arrives directly and is scattered towards `at.wo`, by the estimator of the settings.
#[inline(always)]
pub(super) fn direct_light(
    tracer: &mut Tracer,
    settings: &Settings,
    at: &Interaction,
    bsdf: &Bsdf,
    s: &mut Sampler,
) -> Spectrum {
    let from_hemisphere = match settings.direct {
        DirectLight::Mis | DirectLight::Light => None,
        DirectLight::UniformHemisphere => Some(false),
        DirectLight::CosineHemisphere => Some(true),
    };
    let mut l = Spectrum::ZERO;
    let scene = tracer.scene;
    for light in scene.lights.as_slice() {
        if from_hemisphere.is_some() && !light.is_delta() {
            continue;
        }
        let n = light_samples(light, settings);
        let mut sum = Spectrum::ZERO;
        for _ in 0..n {
            if let Some((value, sample)) = sample_light(tracer, at, bsdf, light, s.next_2d()) {
                sum += value * light_weight(settings, bsdf, &sample, n);
            }
        }
        l += sum / n as f32;
    }
    match from_hemisphere {
        Some(cosine) => l + hemisphere_light(tracer, settings, at, bsdf, s, cosine),
        None => l,
    }
}

/// Weight of a light sample against BSDF sampling, which takes one sample and finds the same
/// light.
#[inline(always)]
fn light_weight(settings: &Settings, bsdf: &Bsdf, sample: &LightSample, n: u32) -> f32 {
    match (settings.direct, sample.pdf) {
        (DirectLight::Mis, Some(pdf)) => power_heuristic(pdf.times(n as f32), bsdf.pdf(sample.wi)),
        _ => 1.0,
    }
}

/// Weight of light that a ray found by chance.
///
/// `arrival` is the density with which its direction was sampled (`None`: no other technique
/// samples it), and `light` gives the density of light sampling, if the light is sampled at all.
#[inline(always)]
pub(super) fn found_weight(
    settings: &Settings,
    arrival: Option<Pdf<SolidAngle>>,
    light: Option<(&AnyLight, Pdf<SolidAngle>)>,
) -> f32 {
    let Some(pdf) = arrival else { return 1.0 };
    match (settings.direct, light) {
        (DirectLight::Mis, Some((light, light_pdf))) => {
            power_heuristic(pdf, light_pdf.times(light_samples(light, settings) as f32))
        }
        (DirectLight::Mis | DirectLight::Light, None) => 1.0,
        _ => 0.0,
    }
}

/// Light found by rays in random directions of the hemisphere: as many as light sampling would
/// take.
fn hemisphere_light(
    tracer: &mut Tracer,
    settings: &Settings,
    at: &Interaction,
    bsdf: &Bsdf,
    s: &mut Sampler,
    cosine: bool,
) -> Spectrum {
    let scene = tracer.scene;
    let extended = scene.lights.as_slice().iter().filter(|l| !l.is_delta()).count();
    let n = extended.max(1) as u32 * settings.light_samples;
    let mut sum = Spectrum::ZERO;
    for _ in 0..n {
        let u = s.next_2d();
        let (local, pdf) = if cosine {
            let w = warp::cosine_hemisphere(u);
            (w, warp::cosine_hemisphere_pdf(w.z))
        } else {
            let w = warp::uniform_hemisphere(u);
            (w, warp::uniform_hemisphere_pdf(w.z))
        };
        let wi = bsdf.frame().to_world(local);
        let f = bsdf.eval(wi);
        if f.is_black() {
            continue;
        }
        let l = match tracer.intersect(&at.spawn(wi)) {
            Some(hit) => scene.emitted(&hit),
            None => scene.sky(wi),
        };
        sum += f * l / pdf.get();
    }
    sum / n as f32
}
