//! Rendering of films with half buffers, and renders with an error target.

use std::ops::Range;

use pt_core::Film;
use pt_core::film::HalfBuffer;
use pt_core::settings::Target;

use crate::render::{Outcome, Renderer, SharedState, passes};

impl Renderer<'_> {
    /// Takes the samples that both halves lack: a fixed number per pixel, or until the error target
    /// is reached.
    pub(crate) fn render_half_buffers(&self, film: &mut Film, shared: &mut SharedState) -> Outcome {
        if let Some(target) = &self.settings.target {
            return self.to_target(film, target, shared);
        }
        let wanted = self.wanted(film, u32::MAX);
        self.take_samples_up_to(film, wanted.each_ref().map(Vec::as_slice), shared)
    }

    /// Takes samples in rounds, until the error target or the maximum number of samples is reached.
    fn to_target(&self, film: &mut Film, target: &Target, shared: &mut SharedState) -> Outcome {
        let progress = loop {
            if film.plan().is_none() {
                self.plan_first(film, target);
            }
            if let Some(plan) = film.plan() {
                (shared.error, shared.totals_foreseen) = (plan.error, plan.expected);
            }
            let wanted = self.wanted(film, u32::MAX);
            let wanted = wanted.each_ref().map(Vec::as_slice);
            if self.take_samples_up_to(film, wanted, shared) == Outcome::Cancelled {
                break Outcome::Cancelled;
            }
            if !self.plan_next(film, target) {
                break Outcome::Finished;
            }
        };
        if progress == Outcome::Finished {
            shared.end();
        }
        progress
    }

    /// Plans the samples of the next round of a film with an error target: the first ones, or, if
    /// those planned so far are taken, further ones. Returns false if no more are needed.
    pub fn plan_round(&self, film: &mut Film) -> bool {
        let Some(target) = &self.settings.target else { return false };
        if film.plan().is_none() {
            self.plan_first(film, target);
            return true;
        }
        self.plan_next(film, target)
    }

    fn plan_first(&self, film: &mut Film, target: &Target) {
        let vacant = self.background_pixels(film.region());
        film.set_plan(target.first_plan(film, self.settings.spp / 2, vacant));
    }

    fn plan_next(&self, film: &mut Film, target: &Target) -> bool {
        let (reuse, most) = (self.settings.reuse, self.settings.spp / 2);
        let Some(look) = target.evaluate(film, reuse) else { return false };
        let next = if look.is_met() { None } else { target.next_plan(film, &look, reuse, most) };
        let Some(next) = next else { return false };
        film.set_plan(next);
        true
    }

    /// Numbers of samples that each pixel is to have in each half, at most `end`.
    pub(crate) fn wanted(&self, film: &Film, end: u32) -> [Vec<u32>; 2] {
        let (spp, area) = (self.settings.spp, film.region().area());
        if self.settings.target.is_none() {
            return [spp.div_ceil(2), spp / 2].map(|n| vec![n.min(end); area]);
        }
        let most = end.min(spp / 2);
        let of_pixel = |i| film.plan().map_or(0, |plan| plan.wanted(i).min(most));
        let wanted: Vec<u32> = (0..area).map(of_pixel).collect();
        [wanted.clone(), wanted]
    }

    /// Takes samples of both halves until each pixel has the number in `wanted`.
    pub(crate) fn take_samples_up_to(
        &self,
        film: &mut Film,
        wanted: [&[u32]; 2],
        shared: &SharedState,
    ) -> Outcome {
        let end = wanted.into_iter().flatten().copied().max().unwrap_or(0);
        let fewest = HalfBuffer::BOTH.map(|half| film.counts_of(half).min().unwrap_or(0));
        for Range { start, end } in passes(fewest[0].min(fewest[1])..end, self.longest_pass()) {
            for (half, wanted) in HalfBuffer::BOTH.into_iter().zip(wanted) {
                let film = film.half_mut(half);
                let first = film.first();
                self.pass(film, &(first + start..first + end), Some(wanted), shared);
                if shared.observer.cancelled() {
                    return Outcome::Cancelled;
                }
            }
        }
        Outcome::Finished
    }
}
