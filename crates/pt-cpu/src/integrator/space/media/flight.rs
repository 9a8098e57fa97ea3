//! Free flight of paths through media.

use pt_bvh::Hit;
use pt_core::medium::{MediumRecord, MediumSample};
use pt_core::scene::RenderScene;
use pt_math::Ray;

use super::{Media, MediaHit, PathInMedia};
use crate::integrator::accumulator::RadianceAccumulator;
use crate::integrator::batch::Batch;
use crate::integrator::estimator::{PathEstimator, add_hit_emission};
use crate::integrator::observer::PathObserver;
use crate::integrator::path_queue::{PathQueue, PathState};
use crate::integrator::space::{Flight, FlightEnd, Space};
use crate::trace::LightSource;

/// Buffers of [`Self::fly`].
#[derive(Default)]
pub(super) struct FlightBuffers {
    /// Ends of the last flight, by path.
    ends: Vec<FlightEnd<MediaHit>>,
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

/// Path that flies along a segment.
struct FlyingPath<'a> {
    state: &'a mut PathState,
    /// Ray whose interval is the part that is still to be traversed.
    ray: &'a mut Ray,
    space: &'a mut PathInMedia,
}

/// Result of following a ray to the next surface.
enum Step {
    /// The flight ends.
    Ends(FlightEnd<MediaHit>),
    /// The ray passes a transparent surface.
    Passes(Hit),
}

/// Pair of sampler dimensions for the distance in a medium.
const DISTANCE_PAIR: u32 = 0;

impl FlightBuffers {
    /// Follows all paths until they are scattered or leave the scene; adds the emission of media,
    /// and of the transparent surfaces that the paths pass.
    pub(super) fn fly<W: PathObserver>(
        &mut self,
        flight: Flight<impl PathEstimator, PathInMedia>,
        batch: &mut Batch<W>,
    ) {
        let Self { ends, under_way, rays, hits } = self;
        let Flight {
            estimator,
            cx,
            dimensions,
            bounces,
            max_depth,
            hides_emitters,
            splitting,
            queue,
        } = flight;
        let PathQueue { paths, rays: path_rays, space, .. } = queue;
        let Batch { tracer, camera_rays, accumulator } = batch;
        accumulator.set_bounces(bounces);
        ends.clear();
        ends.resize(paths.len(), FlightEnd::Escaped);
        under_way.clear();
        under_way.extend(0..paths.len());
        for part in 0u32.. {
            rays.clear();
            rays.extend(under_way.iter().map(|&i| path_rays[i]));
            let time = |i: usize| splitting.time(camera_rays, paths, under_way[i]);
            tracer.intersect(&rays[..], time, hits);
            let mut found = hits.iter();
            under_way.retain(|&i| {
                let time = splitting.time(camera_rays, paths, i);
                let (state, ray, space) = (&mut paths[i], &mut path_rays[i], &mut space[i]);
                let mut path = FlyingPath { state, ray, space };
                let hit = found.next().copied().flatten();
                let counted = Media::counted(bounces, path.space);
                let shown = cx.settings.shows(counted);
                let is_last = counted >= max_depth;
                let segment = Segment { scene: cx.scene, hit, time, is_last, hides_emitters };
                if shown {
                    segment.add_medium_emission(&mut path, accumulator);
                }
                let numbers = |path: &mut FlyingPath| match part {
                    0 => {
                        let sampler = splitting.sampler(camera_rays, path.state.start);
                        dimensions.pair(sampler, bounces, DISTANCE_PAIR)
                    }
                    _ => path.space.stream.next_2d(),
                };
                match segment.step(&mut path, numbers) {
                    Step::Ends(end) => {
                        ends[i] = end;
                        false
                    }
                    Step::Passes(hit) => {
                        let FlyingPath { state, ray, space } = path;
                        if shown && !segment.is_hidden(state, &hit) {
                            add_hit_emission(estimator, cx, state, ray, &hit, time, accumulator);
                        }
                        space.medium =
                            cx.scene.medium_after_crossing(ray, &hit, time, space.medium);
                        ray.t_min = hit.t.next_up();
                        true
                    }
                }
            });
            if under_way.is_empty() {
                return;
            }
        }
    }

    /// Ends of the last flight, path by path.
    pub(super) fn ends(&self) -> impl Iterator<Item = FlightEnd<MediaHit>> {
        self.ends.iter().copied()
    }
}

impl Segment<'_> {
    /// Part of a path's ray up to the next surface.
    fn ray(&self, path: &FlyingPath) -> Ray {
        Ray { t_max: self.hit.map_or(path.ray.t_max, |hit| hit.t), ..*path.ray }
    }

    /// Adds the emission of a path's medium up to the next surface.
    fn add_medium_emission(
        &self,
        path: &mut FlyingPath,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        let Some(id) = path.space.medium else { return };
        let medium = &self.scene.media.table[id];
        if medium.is_emissive() {
            let ray = self.ray(path);
            let radiance = medium.le(&ray, path.state.beta, &mut path.space.stream);
            let source = || LightSource::Medium {
                medium: id.index() as u32,
                direction: ray.direction,
                radiance,
            };
            accumulator.add_emission(path.state.target, path.state.beta * radiance, source);
        }
    }

    /// Returns true if a surface is an emitter that is hidden from the camera.
    fn is_hidden(&self, path: &PathState, hit: &Hit) -> bool {
        self.hides_emitters && path.camera_transmittance != 0.0 && self.scene.is_emissive(hit)
    }

    /// Advances a path to its next surface, unless it is scattered in its medium.
    fn step(&self, path: &mut FlyingPath, numbers: impl Fn(&mut FlyingPath) -> [f32; 2]) -> Step {
        if let Some(end) = self.cross_medium(path, numbers) {
            return Step::Ends(end);
        }
        let Some(hit) = self.hit else { return Step::Ends(FlightEnd::Escaped) };
        if self.is_hidden(path.state, &hit) {
            return Step::Passes(hit);
        }
        if self.scene.has_alpha {
            let opacity = self.scene.opacity(path.ray, &hit, self.time);
            if opacity < 1.0 && path.space.stream.next_1d() >= opacity {
                return Step::Passes(hit);
            }
        }
        Step::Ends(FlightEnd::Vertex(MediaHit::Surface(hit)))
    }

    /// Samples a distance in the medium of a path; returns the end of its flight if it does not
    /// reach the next surface. After the last allowed interaction, scattering in media does not
    /// count, so the transmittance is used instead.
    fn cross_medium(
        &self,
        path: &mut FlyingPath,
        numbers: impl Fn(&mut FlyingPath) -> [f32; 2],
    ) -> Option<FlightEnd<MediaHit>> {
        let id = path.space.medium?;
        let medium: &MediumRecord = &self.scene.media.table[id];
        let ray = self.ray(path);
        let sample = if self.is_last {
            MediumSample::Transmitted { weight: medium.transmittance(&ray, &mut path.space.stream) }
        } else {
            let u = numbers(path);
            medium.sample(&ray, path.state.beta, u, &mut path.space.stream)
        };
        let scattered = match sample {
            MediumSample::Scattered { t, weight } => {
                path.state.beta *= weight;
                Some(FlightEnd::Vertex(MediaHit::Medium { t, medium: id }))
            }
            MediumSample::Transmitted { weight } => {
                path.state.beta *= weight;
                path.state.camera_transmittance *= weight.mean();
                None
            }
        };
        if path.state.beta.is_black() { Some(FlightEnd::Absorbed) } else { scattered }
    }
}
