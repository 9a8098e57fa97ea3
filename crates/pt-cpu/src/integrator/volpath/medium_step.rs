//! Steps of paths from one scattering event to the next.

use pt_bvh::Hit;
use pt_core::medium::MediumSample;
use pt_core::scene::RenderScene;
use pt_math::Ray;

use super::{Layout, VolPath, VolPathState};
use crate::Tracer;
use crate::integrator::CameraRays;
use crate::integrator::accumulator::RadianceAccumulator;
use crate::integrator::context::{Context, SurfaceHit};
use crate::integrator::estimator::add_emission;
use crate::integrator::observer::PathObserver;
use crate::trace::LightSource;

/// Event at the end of a step.
#[derive(Clone, Copy)]
pub(super) enum PathEvent {
    /// The path hit a surface.
    Surface(Hit),
    /// The path was scattered in its medium, at the parameter `t` of its ray.
    Scattered { t: f32 },
    /// The path left the scene.
    Escaped,
    /// The throughput is zero.
    Absorbed,
}

/// Buffers of [`VolPath::sample_medium`].
#[derive(Default)]
pub(super) struct MediumStep {
    under_way: Vec<usize>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
}

/// Result of following a ray to the next surface.
enum Step {
    /// The step ends with an event.
    Ends(PathEvent),
    /// The ray passes a transparent surface.
    Passes(Hit),
}

impl<W: PathObserver> VolPath<'_, W> {
    /// Follows all paths until they are scattered or leave the scene; adds the emission of the
    /// transparent surfaces that they pass. After the last allowed interaction, scattering in media
    /// does not count, so the transmittance is used instead of sampling a distance.
    pub(super) fn sample_medium(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let cx = Context { scene: self.scene, settings: &self.settings };
        let hides_emitters = self.transparency.hides_emitters();
        let Self {
            scene,
            estimator,
            layout,
            paths,
            events,
            medium_step: travel,
            max_depth: depth,
            ..
        } = self;
        let MediumStep { under_way, rays, hits } = travel;
        events.clear();
        events.resize(paths.len(), PathEvent::Escaped);
        under_way.clear();
        under_way.extend(0..paths.len());
        for part in 0u32.. {
            rays.clear();
            rays.extend(under_way.iter().map(|&i| paths[i].ray));
            let time = |i: usize| camera_rays.time(paths[under_way[i]].state.start as usize);
            tracer.intersect(&rays[..], time, hits);
            let mut found = hits.iter();
            under_way.retain(|&i| {
                let path = &mut paths[i];
                let counted = bounces - path.free;
                let (shown, last) = (cx.settings.shows(counted), counted >= *depth);
                let numbers = |path: &mut VolPathState| match part {
                    0 => {
                        let sampler = camera_rays.samplers.get(path.state.start as usize);
                        Layout::distance(*layout, sampler, bounces)
                    }
                    _ => path.stream.next_2d(),
                };
                let hit = found.next().copied().flatten();
                let time = camera_rays.time(path.state.start as usize);
                if shown {
                    add_medium_emission(scene, path, hit.as_ref(), accumulator);
                }
                match step(scene, path, hit, time, (last, hides_emitters), numbers) {
                    Step::Ends(event) => {
                        events[i] = event;
                        false
                    }
                    Step::Passes(hit) => {
                        let is_invisible = hides_emitters && path.state.camera_transmittance != 0.0;
                        if shown && !is_invisible && scene.is_emissive(&hit) {
                            let at = &scene.interaction(&path.ray, &hit, time);
                            add_emission(
                                estimator,
                                cx,
                                &path.state,
                                SurfaceHit { at, hit: &hit, time },
                                accumulator,
                            );
                        }
                        path.medium =
                            scene.medium_after_crossing(&path.ray, &hit, time, path.medium);
                        path.ray.t_min = hit.t.next_up();
                        true
                    }
                }
            });
            if under_way.is_empty() {
                return;
            }
        }
    }
}

/// Segment of a path's ray up to the next surface.
fn ray_up_to(path: &VolPathState, hit: Option<&Hit>) -> Ray {
    Ray { t_max: hit.map_or(path.ray.t_max, |hit| hit.t), ..path.ray }
}

/// Adds the emission of a path's medium up to the next surface.
fn add_medium_emission(
    scene: &RenderScene,
    path: &mut VolPathState,
    hit: Option<&Hit>,
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let Some(id) = path.medium else { return };
    let medium = &scene.media.table[id];
    if medium.is_emissive() {
        let ray = ray_up_to(path, hit);
        let radiance = medium.le(&ray, path.state.beta, &mut path.stream);
        let source = || LightSource::Medium {
            medium: id.index() as u32,
            direction: ray.direction,
            radiance,
        };
        accumulator.add_emission(path.state.target, path.state.beta * radiance, source);
    }
}

/// Advances a path to its next surface, unless it is scattered in its medium.
fn step(
    scene: &RenderScene,
    path: &mut VolPathState,
    hit: Option<Hit>,
    time: f32,
    (last, hides_emitters): (bool, bool),
    numbers: impl Fn(&mut VolPathState) -> [f32; 2],
) -> Step {
    if let Some(medium) = path.medium {
        let medium = &scene.media.table[medium];
        let ray = ray_up_to(path, hit.as_ref());
        let flight = if last {
            MediumSample::Transmitted { weight: medium.transmittance(&ray, &mut path.stream) }
        } else {
            let u = numbers(path);
            medium.sample(&ray, path.state.beta, u, &mut path.stream)
        };
        match flight {
            MediumSample::Scattered { t, weight } => {
                path.state.beta *= weight;
                let is_black = path.state.beta.is_black();
                return Step::Ends(if is_black {
                    PathEvent::Absorbed
                } else {
                    PathEvent::Scattered { t }
                });
            }
            MediumSample::Transmitted { weight } => {
                path.state.beta *= weight;
                path.state.camera_transmittance *= weight.mean();
            }
        }
        if path.state.beta.is_black() {
            return Step::Ends(PathEvent::Absorbed);
        }
    }
    let Some(hit) = hit else { return Step::Ends(PathEvent::Escaped) };
    if hides_emitters && path.state.camera_transmittance != 0.0 && scene.is_emissive(&hit) {
        return Step::Passes(hit);
    }
    if scene.has_alpha {
        let opacity = scene.opacity(&path.ray, &hit, time);
        if opacity < 1.0 && path.stream.next_1d() >= opacity {
            return Step::Passes(hit);
        }
    }
    Step::Ends(PathEvent::Surface(hit))
}
