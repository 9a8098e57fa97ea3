//! From one place where paths are scattered to the next.

use pt_bvh::Hit;
use pt_core::medium::Flight;
use pt_core::scene::RenderScene;
use pt_math::Ray;

use super::{Layout, VolPath, Walker};
use crate::Tracer;
use crate::integrator::Starts;
use crate::integrator::rules::{Context, Found};
use crate::integrator::sums::Sums;
use crate::integrator::wavefront::find;
use crate::integrator::witness::Witness;
use crate::trace::Source;

/// How a path came to the end of its way.
#[derive(Clone, Copy)]
pub(super) enum Event {
    /// On a surface.
    Surface(Hit),
    /// In its medium, at the parameter `t` of its ray.
    Scattered { t: f32 },
    /// Out of the scene.
    Escaped,
    /// No light is left.
    Absorbed,
}

/// Memory to work in.
#[derive(Default)]
pub(super) struct Travel {
    under_way: Vec<usize>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
}

/// What a path meets next.
enum Step {
    /// The end of its way.
    Ends(Event),
    /// A hole, behind which it goes on.
    Passes(Hit),
}

impl<W: Witness> VolPath<'_, W> {
    /// Follows all paths until they are scattered or leave; adds what glows at the holes that they go
    /// through. After the last interaction that is allowed, media scatter nothing that counts: there,
    /// the share that gets through is taken.
    pub(super) fn travel(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<W>,
    ) {
        let cx = Context { scene: self.scene, settings: &self.settings };
        let hides_emitters = self.transparency.hides_emitters();
        let Self { scene, rules, layout, paths, events, travel, depth, .. } = self;
        let Travel { under_way, rays, hits } = travel;
        events.clear();
        events.resize(paths.len(), Event::Escaped);
        under_way.clear();
        under_way.extend(0..paths.len());
        for part in 0u32.. {
            rays.clear();
            rays.extend(under_way.iter().map(|&i| paths[i].ray));
            let time = |i: usize| starts.time(paths[under_way[i]].state.start as usize);
            tracer.intersect(&rays[..], time, hits);
            let mut found = hits.iter();
            under_way.retain(|&i| {
                let path = &mut paths[i];
                let counted = bounces - path.free;
                let (shown, last) = (cx.settings.shows(counted), counted >= *depth);
                let numbers = |path: &mut Walker| match part {
                    0 => {
                        let sampler = starts.samplers.get(path.state.start as usize);
                        Layout::distance(*layout, sampler, bounces)
                    }
                    _ => path.stream.next_2d(),
                };
                let hit = found.next().copied().flatten();
                let time = starts.time(path.state.start as usize);
                if shown {
                    glow(scene, path, hit.as_ref(), sums);
                }
                match step(scene, path, hit, time, (last, hides_emitters), numbers) {
                    Step::Ends(event) => {
                        events[i] = event;
                        false
                    }
                    Step::Passes(hit) => {
                        let is_hidden = hides_emitters && path.state.clear != 0.0;
                        if shown && !is_hidden && scene.glows(&hit) {
                            let at = &scene.interaction(&path.ray, &hit, time);
                            find(rules, cx, &path.state, Found { at, hit: &hit, time }, sums);
                        }
                        path.medium = scene.medium_beyond(&path.ray, &hit, time, path.medium);
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

/// The part of a path's ray up to the next surface.
fn until(path: &Walker, hit: Option<&Hit>) -> Ray {
    Ray { t_max: hit.map_or(path.ray.t_max, |hit| hit.t), ..path.ray }
}

/// Adds what the medium of a path emits on its way to the next surface.
fn glow(scene: &RenderScene, path: &mut Walker, hit: Option<&Hit>, sums: &mut Sums<impl Witness>) {
    let Some(id) = path.medium else { return };
    let medium = &scene.media.table[id];
    if medium.glows() {
        let ray = until(path, hit);
        let radiance = medium.emitted(&ray, path.state.beta, &mut path.stream);
        let source =
            || Source::Glow { medium: id.index() as u32, direction: ray.direction, radiance };
        sums.find(path.state.target, path.state.beta * radiance, source);
    }
}

/// Takes a path to its next surface, if its medium lets it through.
fn step(
    scene: &RenderScene,
    path: &mut Walker,
    hit: Option<Hit>,
    time: f32,
    (last, hides_emitters): (bool, bool),
    numbers: impl Fn(&mut Walker) -> [f32; 2],
) -> Step {
    if let Some(medium) = path.medium {
        let medium = &scene.media.table[medium];
        let ray = until(path, hit.as_ref());
        let flight = if last {
            Flight::Passed { weight: medium.transmittance(&ray, &mut path.stream) }
        } else {
            let u = numbers(path);
            medium.sample(&ray, path.state.beta, u, &mut path.stream)
        };
        match flight {
            Flight::Scattered { t, weight } => {
                path.state.beta *= weight;
                let is_black = path.state.beta.is_black();
                return Step::Ends(if is_black { Event::Absorbed } else { Event::Scattered { t } });
            }
            Flight::Passed { weight } => {
                path.state.beta *= weight;
                path.state.clear *= weight.mean();
            }
        }
        if path.state.beta.is_black() {
            return Step::Ends(Event::Absorbed);
        }
    }
    let Some(hit) = hit else { return Step::Ends(Event::Escaped) };
    if hides_emitters && path.state.clear != 0.0 && scene.glows(&hit) {
        return Step::Passes(hit);
    }
    if scene.has_holes {
        let opacity = scene.opacity(&path.ray, &hit, time);
        if opacity < 1.0 && path.stream.next_1d() >= opacity {
            return Step::Passes(hit);
        }
    }
    Step::Ends(Event::Surface(hit))
}
