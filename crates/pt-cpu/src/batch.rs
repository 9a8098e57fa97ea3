//! Samples that are taken together.

use std::ops::Range;

use pt_core::camera::Camera;
use pt_core::settings::Settings;
use pt_core::{Film, RenderScene};
use pt_math::Spectrum;
use pt_math::sampler::{LANES, Sampler, Samplers};

use crate::integrator::{Integrator, Registration, Start};
use crate::tracer::Tracer;

/// Consecutive samples of one pixel.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Column and row.
    pub(crate) pixel: [u32; 2],
    pub(crate) samples: Range<u32>,
}

/// Cuts runs into batches of at most `size` samples; a run that has more is a batch.
pub(crate) fn batches(mut runs: &[Run], size: usize) -> impl Iterator<Item = &[Run]> {
    std::iter::from_fn(move || {
        let mut samples = 0;
        let fits = |run: &&Run| {
            samples += run.samples.len();
            samples <= size
        };
        let n = runs.iter().take_while(fits).count().max(1);
        let (batch, rest) = runs.split_at_checked(n)?;
        runs = rest;
        Some(batch)
    })
}

/// What a thread works with, from batch to batch.
pub(crate) struct Worker<'a> {
    settings: &'a Settings,
    pub(crate) tracer: Tracer<'a>,
    integrator: Box<dyn Integrator + 'a>,
    starts: Vec<Start>,
    radiance: Vec<Spectrum>,
    /// Samples taken.
    pub(crate) samples: u64,
}

impl<'a> Worker<'a> {
    pub(crate) fn new(
        scene: &'a RenderScene,
        settings: &'a Settings,
        integrator: &Registration,
        counts_tests: bool,
    ) -> Self {
        Self {
            settings,
            tracer: Tracer::new(scene, counts_tests),
            integrator: (integrator.new)(scene, settings),
            starts: Vec::new(),
            radiance: Vec::new(),
            samples: 0,
        }
    }

    /// Takes samples and adds them to a film.
    ///
    /// Each is a pure function of scene, settings, pixel and the number of the sample.
    pub(crate) fn take(&mut self, batch: &[Run], film: &mut Film) {
        self.starts.clear();
        push_starts(&self.tracer.scene.camera, self.settings, batch, &mut self.starts);
        self.integrator.radiance(&mut self.tracer, &self.starts, &mut self.radiance);
        let mut radiance = self.radiance.iter();
        for Run { pixel: [x, y], samples } in batch {
            for (n, &l) in samples.clone().zip(&mut radiance) {
                film.add(*x, *y, n, l);
            }
        }
        self.samples += self.starts.len() as u64;
    }
}

/// The starts of the samples of a batch, in order.
fn push_starts(camera: &Camera, settings: &Settings, batch: &[Run], starts: &mut Vec<Start>) {
    let mut samples = batch.iter().flat_map(|Run { pixel, samples }| {
        let sampler = Sampler::new(settings.sampler, settings.seed, *pixel, 0);
        let [x, y] = pixel.map(|v| v as f32);
        samples.clone().map(move |n| ([x, y], sampler.with_sample(n)))
    });
    let mut block = Vec::with_capacity(LANES);
    loop {
        block.clear();
        block.extend(samples.by_ref().take(LANES));
        if block.is_empty() {
            return;
        }
        let numbers = Samplers::new(block.iter().map(|&(_, sampler)| sampler));
        let [u, v] = numbers.points(0);
        let lens = if camera.lens_radius > 0.0 { numbers.points(2) } else { [[0.0; LANES]; 2] };
        starts.extend(block.iter().enumerate().map(|(i, &([x, y], sampler))| {
            let ray = camera.ray([x + u[i], y + v[i]], [lens[0][i], lens[1][i]]);
            Start { ray, sampler }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_hold_all_runs_in_order_and_no_more_than_their_size() {
        for size in [1, 2, 5, 7, 100] {
            let runs: Vec<_> = (0..40).map(|i| Run { pixel: [i, 0], samples: 0..i % 6 }).collect();
            let mut pixels = Vec::new();
            for batch in batches(&runs, size) {
                let samples: usize = batch.iter().map(|r| r.samples.len()).sum();
                assert!(samples <= size || batch.len() == 1, "{size}: {batch:?}");
                pixels.extend(batch.iter().map(|r| r.pixel[0]));
            }
            assert!(pixels.into_iter().eq(0..40));
        }
    }
}
