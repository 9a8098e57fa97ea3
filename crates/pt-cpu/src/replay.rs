//! Replay of the samples of a pixel with recorded paths.

use std::ops::Range;

use pt_core::Film;
use pt_core::film::{ExactSum, InvalidReason, InvalidSamples, Region};

use crate::batch::Worker;
use crate::integrator::traced_names;
use crate::render::{RenderError, Renderer};
use crate::sample_range::SampleRange;
use crate::trace::Sample;

impl Renderer<'_> {
    /// Takes samples of a pixel in order, passes the record of each to `visit`, and returns their
    /// film. They are, to the bit, those of a render, since they are taken by the same code.
    ///
    /// # Errors
    /// If the samples are not sums of contributions of single paths.
    pub fn replay(
        &self,
        pixel: [u32; 2],
        samples: Range<u32>,
        mut visit: impl FnMut(Sample),
    ) -> Result<Film, RenderError> {
        self.replay_while(pixel, samples, |sample| {
            visit(sample);
            true
        })
    }

    /// Takes samples as [`replay`](Self::replay) does, until `visit` returns false.
    ///
    /// # Errors
    /// As [`replay`](Self::replay).
    pub fn replay_while(
        &self,
        [x, y]: [u32; 2],
        samples: Range<u32>,
        mut visit: impl FnMut(Sample) -> bool,
    ) -> Result<Film, RenderError> {
        let &Self { scene, settings, integrator, .. } = self;
        let paths_are_alone = settings.reuse == 1 && settings.split == 1;
        let Some(new) = integrator.new_traced.filter(|_| paths_are_alone) else {
            let known = traced_names();
            return Err(RenderError::NotRecorded { name: integrator.name, known });
        };
        let mut worker =
            Worker::new(scene, settings, self.filter.as_ref(), new(scene, settings), false);
        let region = Region { x, y, width: 1, height: 1 };
        let mut film = Film::new(region).starting_at(samples.start);
        let (mut rejections, mut clamped) = (InvalidSamples::default(), ExactSum::default());
        for mut tile in film.tiles(1, [0; 2]) {
            'batches: for first in samples.clone().step_by(self.batch_size) {
                let end = samples.end.min(first.saturating_add(self.batch_size as u32));
                worker.render_batch(&[SampleRange::single([x, y], first..end)], &mut tile);
                let traces = worker.integrator.take_traces();
                let taken = traces.into_iter().zip(worker.taken());
                for (number, (trace, (weight, light))) in (first..end).zip(taken) {
                    let (radiance, fault) = (light * weight, InvalidReason::of(light, weight));
                    if !visit(Sample { number, trace, weight, radiance, fault }) {
                        break 'batches;
                    }
                }
            }
            rejections.merge(tile.invalid_samples());
            clamped.merge(tile.clamped_energy());
        }
        film.add_invalid_samples(&rejections);
        film.add_clamped(clamped);
        Ok(film)
    }
}
