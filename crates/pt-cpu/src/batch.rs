//! Rendering of batches of samples.

use pt_core::RenderScene;
use pt_core::film::{ExactSum, Tile};
use pt_core::filter::FilterSampler;
use pt_core::settings::{Hidden, Settings};
use pt_math::sampler::{LANES, Lanes, SamplerBlocks};
use pt_math::{Ray8, RayColumns, Spectrum};

use crate::aov::Aovs;
use crate::integrator::{CameraRays, Integrator, ReuseGroup, TIME_DIMENSION};
use crate::sample_range::SampleRange;
use crate::tracer::Tracer;

/// State of a thread, reused from batch to batch.
pub(crate) struct Worker<'a, I: ?Sized> {
    pub(crate) tracer: Tracer<'a>,
    pub(crate) integrator: Box<I>,
    camera_rays: CameraRays,
    /// Reconstruction filter; `None` for the box filter.
    filter: Option<&'a FilterSampler>,
    /// Filter weights of the samples, if not all are 1.
    weights: Vec<f32>,
    radiance: Vec<Spectrum>,
    aovs: Aovs,
    hidden: Hidden,
    /// Number of samples taken.
    pub(crate) samples: u64,
}

impl<'a, I: Integrator + ?Sized> Worker<'a, I> {
    pub(crate) fn new(
        scene: &'a RenderScene,
        settings: &'a Settings,
        filter: Option<&'a FilterSampler>,
        integrator: Box<I>,
        counts_tests: bool,
    ) -> Self {
        Self {
            tracer: Tracer::new(scene, counts_tests),
            integrator,
            camera_rays: CameraRays {
                rays: RayColumns::default(),
                samplers: SamplerBlocks::new(settings.points()),
                groups: Vec::new(),
                times: scene.is_animated().then(Vec::new),
            },
            filter,
            weights: Vec::new(),
            radiance: Vec::new(),
            aovs: Aovs::default(),
            hidden: settings.hidden,
            samples: 0,
        }
    }

    /// Takes samples and adds them to a tile.
    ///
    /// Each is a pure function of scene, settings, pixel and sample number.
    pub(crate) fn render_batch(&mut self, batch: &[SampleRange], tile: &mut Tile) {
        self.generate_camera_rays(batch);
        self.integrator.radiance(&mut self.tracer, &self.camera_rays, &mut self.radiance);
        add_clamped(&self.integrator.take_clamped(), batch, tile);
        let weights = self.weighs().then_some(&*self.weights);
        let light_groups = self.integrator.light_group_radiance();
        let transparency = self.integrator.transparency().filter(|_| tile.keeps_alpha());
        let mut next = 0;
        for SampleRange { pixel, samples, kept, .. } in batch {
            if !kept.is_empty() {
                let [start, end] =
                    [kept.start, kept.end].map(|i| next + (i - samples.start) as usize);
                let weights = weights.map(|weights| &weights[start..end]);
                let samples = &self.radiance[start..end];
                tile.add(*pixel, kept.start, samples, weights);
                if let Some(transparency) = transparency {
                    tile.add_coverage(*pixel, &transparency[start..end], weights);
                }
                if let Some(parts) = light_groups {
                    let groups = parts.len() / self.radiance.len();
                    let parts = &parts[start * groups..end * groups];
                    tile.add_light_groups(*pixel, samples, parts, weights);
                }
            }
            next += samples.len();
        }
        if tile.needs_first_hits() {
            self.aovs.add(&mut self.tracer, &self.camera_rays, batch, self.hidden, tile);
        }
        self.samples += batch.iter().map(|range| range.kept.len() as u64).sum::<u64>();
    }

    /// Returns true if not all filter weights are 1.
    fn weighs(&self) -> bool {
        self.filter.is_some_and(|filter| !filter.is_positive())
    }

    /// Filter weight and radiance of each sample of the last batch.
    pub(crate) fn taken(&self) -> impl Iterator<Item = (f32, Spectrum)> {
        let weight = |i| if self.weighs() { self.weights[i] } else { 1.0 };
        self.radiance.iter().enumerate().map(move |(i, &l)| (weight(i), l))
    }

    /// Generates the camera rays of the samples of a batch, in order.
    fn generate_camera_rays(&mut self, batch: &[SampleRange]) {
        let CameraRays { rays, samplers, times, groups } = &mut self.camera_rays;
        groups.clear();
        let mut next = 0;
        while let Some(range) = batch.get(next) {
            let pixels = range.rest_of_group + 1;
            groups.push(ReuseGroup { pixels, samples: range.samples.len() as u32 });
            next += pixels as usize;
        }
        self.weights.clear();
        if let Some(times) = times {
            times.clear();
        }
        samplers.refill(batch.iter().map(|range| (range.pixel, range.samples.clone())));
        let scene = self.tracer.scene;
        let camera = &scene.camera;
        let eights = rays.resize(samplers.len().next_multiple_of(LANES));
        for (block, rays) in eights.as_chunks_mut().0.iter_mut().enumerate() {
            let numbers = samplers.points(block, 0);
            let mut at = numbers;
            if let Some(filter) = self.filter {
                self.weights.extend(filter.place(&mut at));
            }
            for (points, corners) in at.iter_mut().zip(samplers.pixels(block)) {
                points.iter_mut().zip(corners).for_each(|(p, &corner)| *p += corner as f32);
            }
            let lens = if camera.has_lens() || scene.meter.is_some() {
                samplers.points(block, 2)
            } else {
                [[0.0; LANES]; 2]
            };
            if let Some(times) = times {
                let block_times = samplers.points(block, TIME_DIMENSION)[0];
                times.extend(block_times);
                if scene.meter.is_none() && scene.camera_motion.is_some() {
                    moving_rays(scene, &block_times, &at, &lens, rays);
                    continue;
                }
            }
            match &scene.meter {
                Some(meter) => meter.rays([&numbers, &lens], rays),
                None => camera.rays(&at, &lens, rays),
            }
        }
        if let Some(times) = times {
            times.truncate(samplers.len());
        }
        rays.truncate(samplers.len());
    }
}

/// Adds luminance removed by clamping from camera rays whose samples are kept.
fn add_clamped(clamped: &[(u32, f32)], batch: &[SampleRange], tile: &mut Tile) {
    if clamped.is_empty() {
        return;
    }
    let is_kept = |range: &SampleRange| {
        let SampleRange { samples, kept, .. } = range.clone();
        samples.map(move |sample| kept.contains(&sample))
    };
    let is_kept: Vec<bool> = batch.iter().flat_map(is_kept).collect();
    let mut sum = ExactSum::default();
    for &(_, luminance) in clamped.iter().filter(|(ray, _)| is_kept[*ray as usize]) {
        sum.add(luminance);
    }
    tile.add_clamped(sum);
}

/// Generates rays of a moving camera, at their times, through points of the image and of the lens.
fn moving_rays(
    scene: &RenderScene,
    times: &Lanes<f32>,
    at: &[Lanes<f32>; 2],
    lens: &[Lanes<f32>; 2],
    rays: &mut [Ray8; LANES / 8],
) {
    for (i, &time) in times.iter().enumerate() {
        let ray = scene.camera_at(time).ray(at.map(|x| x[i]), lens.map(|x| x[i]));
        rays[i / 8].set(i % 8, &ray);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_range::batches;

    #[test]
    fn batches_hold_all_runs_in_order_and_no_more_than_their_size() {
        for size in [1, 2, 5, 7, 100] {
            let ranges: Vec<_> = (0..40).map(|i| SampleRange::single([i, 0], 0..i % 6)).collect();
            let mut pixels = Vec::new();
            for batch in batches(&ranges, size) {
                let samples: usize = batch.iter().map(|r| r.samples.len()).sum();
                assert!(samples <= size || batch.len() == 1, "{size}: {batch:?}");
                pixels.extend(batch.iter().map(|r| r.pixel[0]));
            }
            assert!(pixels.into_iter().eq(0..40));
        }
    }
}
