//! Steps of paths from one scattering event to the next.

use pt_bvh::Hit;
use pt_core::medium::{MediumRecord, MediumSample};
use pt_core::scene::RenderScene;
use pt_math::Ray;

use super::{VolPath, VolPathState};
use crate::integrator::accumulator::RadianceAccumulator;
use crate::integrator::batch::Batch;
use crate::integrator::context::Context;
use crate::integrator::estimator::add_hit_emission;
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

/// Ray of a path up to the next surface.
struct Segment<'a> {
    scene: &'a RenderScene,
    hit: Option<Hit>,
    time: f32,
    /// True after the last allowed interaction.
    is_last: bool,
    hides_emitters: bool,
}

/// Result of following a ray to the next surface.
enum Step {
    /// The step ends with an event.
    Ends(PathEvent),
    /// The ray passes a transparent surface.
    Passes(Hit),
}

/// Pair of sampler dimensions for the distance in a medium.
const DISTANCE_PAIR: u32 = 0;

impl<W: PathObserver> VolPath<'_, W> {
    /// Follows all paths until they are scattered or leave the scene; adds the emission of media,
    /// and of the transparent surfaces that the paths pass.
    pub(super) fn sample_medium(&mut self, bounces: u32, batch: &mut Batch<W>) {
        let Self { scene, settings, estimator, dimensions, paths, events, .. } = self;
        let MediumStep { under_way, rays, hits } = &mut self.medium_step;
        let Batch { tracer, camera_rays, accumulator } = batch;
        let cx = Context { scene, settings };
        let hides_emitters = self.transparency.hides_emitters();
        accumulator.set_bounces(bounces);
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
                let start = path.state.start as usize;
                let (hit, time) = (found.next().copied().flatten(), camera_rays.time(start));
                let counted = bounces - path.free;
                let shown = settings.shows(counted);
                let is_last = counted >= self.max_depth;
                let segment = Segment { scene, hit, time, is_last, hides_emitters };
                if shown {
                    segment.add_medium_emission(path, accumulator);
                }
                let numbers = |path: &mut VolPathState| match part {
                    0 => dimensions.pair(camera_rays.samplers.get(start), bounces, DISTANCE_PAIR),
                    _ => path.stream.next_2d(),
                };
                match segment.step(path, numbers) {
                    Step::Ends(event) => {
                        events[i] = event;
                        false
                    }
                    Step::Passes(hit) => {
                        if shown && !segment.is_hidden(path, &hit) {
                            let VolPathState { state, ray, .. } = &*path;
                            add_hit_emission(estimator, cx, state, ray, &hit, time, accumulator);
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

impl Segment<'_> {
    /// Part of a path's ray up to the next surface.
    fn ray(&self, path: &VolPathState) -> Ray {
        Ray { t_max: self.hit.map_or(path.ray.t_max, |hit| hit.t), ..path.ray }
    }

    /// Adds the emission of a path's medium up to the next surface.
    fn add_medium_emission(
        &self,
        path: &mut VolPathState,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        let Some(id) = path.medium else { return };
        let medium = &self.scene.media.table[id];
        if medium.is_emissive() {
            let ray = self.ray(path);
            let radiance = medium.le(&ray, path.state.beta, &mut path.stream);
            let source = || LightSource::Medium {
                medium: id.index() as u32,
                direction: ray.direction,
                radiance,
            };
            accumulator.add_emission(path.state.target, path.state.beta * radiance, source);
        }
    }

    /// Returns true if a surface is an emitter that is hidden from the camera.
    fn is_hidden(&self, path: &VolPathState, hit: &Hit) -> bool {
        self.hides_emitters && path.state.camera_transmittance != 0.0 && self.scene.is_emissive(hit)
    }

    /// Advances a path to its next surface, unless it is scattered in its medium.
    fn step(
        &self,
        path: &mut VolPathState,
        numbers: impl Fn(&mut VolPathState) -> [f32; 2],
    ) -> Step {
        if let Some(medium) = path.medium {
            let medium = &self.scene.media.table[medium];
            if let Some(event) = self.cross_medium(medium, path, numbers) {
                return Step::Ends(event);
            }
        }
        let Some(hit) = self.hit else { return Step::Ends(PathEvent::Escaped) };
        if self.is_hidden(path, &hit) {
            return Step::Passes(hit);
        }
        if self.scene.has_alpha {
            let opacity = self.scene.opacity(&path.ray, &hit, self.time);
            if opacity < 1.0 && path.stream.next_1d() >= opacity {
                return Step::Passes(hit);
            }
        }
        Step::Ends(PathEvent::Surface(hit))
    }

    /// Samples a distance in a medium; returns the event if the path does not reach the next
    /// surface. After the last allowed interaction, scattering in media does not count, so the
    /// transmittance is used instead.
    fn cross_medium(
        &self,
        medium: &MediumRecord,
        path: &mut VolPathState,
        numbers: impl Fn(&mut VolPathState) -> [f32; 2],
    ) -> Option<PathEvent> {
        let ray = self.ray(path);
        let sample = if self.is_last {
            MediumSample::Transmitted { weight: medium.transmittance(&ray, &mut path.stream) }
        } else {
            let u = numbers(path);
            medium.sample(&ray, path.state.beta, u, &mut path.stream)
        };
        let scattered = match sample {
            MediumSample::Scattered { t, weight } => {
                path.state.beta *= weight;
                Some(PathEvent::Scattered { t })
            }
            MediumSample::Transmitted { weight } => {
                path.state.beta *= weight;
                path.state.camera_transmittance *= weight.mean();
                None
            }
        };
        if path.state.beta.is_black() { Some(PathEvent::Absorbed) } else { scattered }
    }
}
