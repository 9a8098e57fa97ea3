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
        let spp = self.settings.spp;
        let area = film.region().area();
        let [first, second] = [spp.div_ceil(2), spp / 2].map(|n| vec![n; area]);
        self.take_samples_up_to(film, [&first, &second], shared)
    }

    /// Takes samples in rounds, until the error target or the maximum number of samples is reached.
    fn to_target(&self, film: &mut Film, target: &Target, shared: &mut SharedState) -> Outcome {
        let most = self.settings.spp / 2;
        let reuse = self.settings.reuse;
        let progress = loop {
            let plan = match film.plan() {
                Some(plan) => plan.clone(),
                None => target.first_plan(film, most, self.background_pixels(film.region())),
            };
            (shared.error, shared.totals_foreseen) = (plan.error, plan.expected);
            let wanted = (0..film.region().area()).map(|i| plan.wanted(i).min(most));
            let wanted = wanted.collect::<Vec<_>>();
            film.set_plan(plan);
            if self.take_samples_up_to(film, [&wanted; 2], shared) == Outcome::Cancelled {
                break Outcome::Cancelled;
            }
            let Some(look) = target.evaluate(film, reuse) else { break Outcome::Finished };
            let next =
                if look.is_met() { None } else { target.next_plan(film, &look, reuse, most) };
            let Some(next) = next else { break Outcome::Finished };
            film.set_plan(next);
        };
        if progress == Outcome::Finished {
            shared.end();
        }
        progress
    }

    /// Takes samples of both halves until each pixel has the number in `wanted`.
    fn take_samples_up_to(
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
