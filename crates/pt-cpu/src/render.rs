//! The render loop.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pt_core::film::{ExactSum, InvalidSamples, Region, Tile};
use pt_core::filter::{FilterError, FilterSampler};
use pt_core::settings::{Adaptive, DirectLight, Settings};
use pt_core::{Film, Observer, ProgressUpdate, RenderScene};
use pt_math::sampler::LANES;

use crate::batch::Worker;
use crate::integrator::{
    self, Feature, Integrator, LightGroupIntegrator, MAX_REUSE, MAX_SPLIT, Registration,
};
use crate::light_groups::LightGroups;
use crate::reuse_tiles::{ReuseTiles, SAMPLES_PER_TILING};
use crate::sample_range::batches;

/// Statistics of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RenderStatistics {
    /// Number of samples taken.
    pub samples: u64,
    /// Number of rays traced.
    pub rays: u64,
    /// Number of primitives tested, if counting is enabled.
    pub tests: u64,
    /// Wall-clock time.
    pub time: Duration,
}

/// Outcome of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Finished,
    /// The observer cancelled the render; the samples taken so far are in the film.
    Cancelled,
}

/// Reason for which nothing can be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No integrator has this name.
    #[error("there is no integrator \"{name}\"; choose one of {known}")]
    UnknownIntegrator {
        /// Unknown name.
        name: String,
        /// Known names.
        known: String,
    },
    /// The scene is compiled for another estimator.
    #[error(
        "the scene is compiled for multiple importance sampling with one light sample, which these \
         settings do not do; compile it without CompileOptions::compensated"
    )]
    Compensated,
    /// The side of the squares of path reuse is not supported.
    #[error("path reuse needs squares of 1, 2 or 4 pixels along a side, not {0}")]
    Reuse(u32),
    /// The integrator does not support path reuse.
    #[error("path reuse is supported only by the integrator path, not by {0}")]
    NoReuse(&'static str),
    /// Path reuse is not supported with motion, since each path has its own time.
    #[error(
        "path reuse is not supported in scenes with motion; render without it, or with a closed shutter"
    )]
    ReuseInMotion,
    /// The number of paths per split is not supported.
    #[error("path splitting must be a power of two up to 64, not {0}")]
    Split(u32),
    /// The integrator does not support path splitting, or not together with path reuse.
    #[error(
        "path splitting is supported only by the integrators path and direct, without path reuse"
    )]
    NoSplit,
    /// The integrator cannot record paths: its samples are not sums of contributions of single
    /// paths.
    #[error(
        "samples of the integrator {name} cannot be explained; those of {known} can, without path reuse \
         and splitting, which do not change the mean"
    )]
    NotRecorded {
        /// Name of the integrator.
        name: &'static str,
        /// Names of the integrators whose samples can be explained.
        known: String,
    },
    /// The settings do not allow contributions to be separated by light.
    #[error(
        "light groups require one of the integrators {0}, without path reuse or splitting, and light \
         sampling for direct light (DirectLight::Mis or Light)"
    )]
    NoLightGroups(String),
    /// The reconstruction filter is invalid.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// Threads cannot be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// Number of threads.
        threads: usize,
        /// Error of the system.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Renderer of a scene on the threads of this machine.
pub struct Renderer<'a> {
    pub(crate) scene: &'a RenderScene,
    pub(crate) settings: &'a Settings,
    pub(crate) filter: Option<FilterSampler>,
    pub(crate) integrator: &'static Registration,
    pool: rayon::ThreadPool,
    tile_size: u32,
    pub(crate) batch_size: usize,
    counts_tests: bool,
    light_groups: Option<&'a LightGroups>,
}

/// Samples of a pixel in the first pass: few, so that a render that is stopped early has a complete
/// image.
const FIRST_PASS: u32 = SAMPLES_PER_TILING;

/// Samples of a pixel per visit in later passes: rays of one pixel are coherent.
const PASS: u32 = 64;

/// Samples per batch: enough for batched ray queries, few enough that their state stays in the
/// second-level cache.
const BATCH: usize = 1024;

/// Maximum number of light samples at the first surfaces of a batch: batches are smaller if each
/// path needs many, so that a render can be stopped soon.
const LIGHT_SAMPLES: usize = 16 * BATCH;

impl<'a> Renderer<'a> {
    /// Creates a renderer with `threads` threads (0: one per core), which process tiles of
    /// `tile_size`² pixels. Neither changes the image.
    ///
    /// # Errors
    /// If the integrator is unknown, the filter is invalid, the scene is compiled for another
    /// estimator, or threads cannot be started.
    pub fn new(
        scene: &'a RenderScene,
        settings: &'a Settings,
        threads: usize,
        tile_size: u32,
        counts_tests: bool,
    ) -> Result<Self, RenderError> {
        let integrator = integrator::by_name(&settings.integrator).ok_or_else(|| {
            let names: Vec<_> = integrator::INTEGRATORS.iter().map(|r| r.name).collect();
            RenderError::UnknownIntegrator {
                name: settings.integrator.clone(),
                known: names.join(", "),
            }
        })?;
        if scene.light_tables.compensated && !integrator::uses_mis_compensation(settings) {
            return Err(RenderError::Compensated);
        }
        if !MAX_REUSE.is_multiple_of(settings.reuse) {
            return Err(RenderError::Reuse(settings.reuse));
        }
        if settings.reuse > 1 && !integrator.supports(Feature::Reuse) {
            return Err(RenderError::NoReuse(integrator.name));
        }
        if settings.reuse > 1 && scene.is_animated() {
            return Err(RenderError::ReuseInMotion);
        }
        if !settings.split.is_power_of_two() || settings.split > MAX_SPLIT {
            return Err(RenderError::Split(settings.split));
        }
        if settings.split > 1 && (!integrator.supports(Feature::Split) || settings.reuse > 1) {
            return Err(RenderError::NoSplit);
        }
        let filter = FilterSampler::new(&settings.filter)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|source| RenderError::Threads { threads, source })?;
        let light_samples = settings.light_samples.max(1) as usize;
        let most = BATCH / settings.split as usize;
        let batch_size = (LIGHT_SAMPLES / light_samples).clamp(LANES, most);
        let tile_size = tile_size.max(1);
        let light_groups = None;
        Ok(Self {
            scene,
            settings,
            filter,
            integrator,
            pool,
            tile_size,
            batch_size,
            counts_tests,
            light_groups,
        })
    }

    /// Enables the radiance of these light groups for films that store it; the samples are the
    /// same.
    ///
    /// # Errors
    /// If the settings do not allow light groups.
    pub fn with_light_groups(self, groups: &'a LightGroups) -> Result<Self, RenderError> {
        let Settings { reuse, split, direct, .. } = self.settings;
        let is_reported = (*reuse, *split) == (1, 1)
            && matches!(direct, DirectLight::Mis | DirectLight::Light)
            && self.integrator.new_traced.is_some();
        if !is_reported {
            return Err(RenderError::NoLightGroups(integrator::traced_names()));
        }
        Ok(Self { light_groups: Some(groups), ..self })
    }

    /// Creates an integrator for a thread.
    fn new_integrator(&self) -> Box<dyn Integrator + 'a> {
        let Self { scene, settings, integrator, light_groups, .. } = *self;
        match (light_groups, integrator.new_traced) {
            (Some(groups), Some(new)) => {
                Box::new(LightGroupIntegrator::new(new(scene, settings), scene, groups))
            }
            _ => (integrator.new)(scene, settings),
        }
    }

    /// Sets the number of samples per batch, which does not change the image either.
    pub fn with_batch_size(self, samples: usize) -> Self {
        Self { batch_size: samples.max(1), ..self }
    }

    /// Maximum number of samples of a pixel per pass, all within one [`ReuseTiles`].
    pub(crate) fn longest_pass(&self) -> u32 {
        if self.settings.reuse > 1 { SAMPLES_PER_TILING } else { PASS }
    }

    /// Runs `work` on the threads of the renderer.
    pub(crate) fn in_pool<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Takes the samples that `film` lacks.
    ///
    /// # Panics
    /// If the settings require half buffers, and the film has none.
    pub fn render(&self, film: &mut Film, observer: &dyn Observer) -> (Outcome, RenderStatistics) {
        self.measured(film, observer, |film, samples, shared| {
            if film.has_half_buffers() {
                self.render_half_buffers(film, shared)
            } else {
                self.passes(film, samples, shared)
            }
        })
    }

    /// Takes the samples that `film` lacks and whose numbers, in each half buffer if there are two,
    /// are below `end`. An error target is not evaluated: samples are those of the plan.
    ///
    /// # Panics
    /// As [`Self::render`].
    pub fn advance(
        &self,
        film: &mut Film,
        end: u32,
        observer: &dyn Observer,
    ) -> (Outcome, RenderStatistics) {
        self.measured(film, observer, |film, samples, shared| {
            if film.has_half_buffers() {
                let wanted = self.wanted(film, end);
                self.take_samples_up_to(film, wanted.each_ref().map(Vec::as_slice), shared)
            } else {
                self.passes(film, samples.start..samples.end.min(end).max(samples.start), shared)
            }
        })
    }

    /// Measures the taking of samples, among those that the film may have.
    fn measured(
        &self,
        film: &mut Film,
        observer: &dyn Observer,
        take: impl FnOnce(&mut Film, Range<u32>, &mut SharedState) -> Outcome,
    ) -> (Outcome, RenderStatistics) {
        assert_eq!(
            film.has_half_buffers(),
            self.settings.in_halves(),
            "a film as the settings want it"
        );
        let start = Instant::now();
        let samples = film.first()..self.settings.spp.max(film.first());
        let total = film.region().area() as u64 * samples.len() as u64;
        let mut shared = SharedState {
            totals_foreseen: [total; 3],
            done: AtomicU64::new(film.samples()),
            rays: AtomicU64::new(0),
            error: film.relative_error(),
            totals: Mutex::new(RenderStatistics::default()),
            observer,
        };
        let progress = take(film, samples, &mut shared);
        let mut statistics = *lock(&shared.totals);
        statistics.time = start.elapsed();
        (progress, statistics)
    }

    /// Takes these samples of each pixel, unless it converges before.
    fn passes(&self, film: &mut Film, samples: Range<u32>, shared: &mut SharedState) -> Outcome {
        for pass in passes(samples, self.longest_pass()) {
            self.pass(film, &pass, None, shared);
            shared.error = film.relative_error();
            if shared.observer.cancelled() {
                return Outcome::Cancelled;
            }
        }
        Outcome::Finished
    }

    /// Takes samples until every pixel has as many as the end of the pass, or as many as `wanted`
    /// (for the pixels of the film, in rows from the top) if these are fewer.
    pub(crate) fn pass(
        &self,
        film: &mut Film,
        pass: &Range<u32>,
        wanted: Option<&[u32]>,
        shared: &SharedState,
    ) {
        let targets = SampleTargets {
            pass: pass.clone(),
            wanted,
            first: film.first(),
            region: film.region(),
        };
        let resolution = self.scene.camera.resolution;
        let reuse_tiles = ReuseTiles::of_sample(self.settings.reuse, pass.start, resolution);
        let mut tiles: Vec<_> =
            film.tiles(self.tile_size, reuse_tiles.shift()).into_iter().map(Some).collect();
        let order = scattered(tiles.len());
        let tiles = Mutex::new(order.filter_map(|i| tiles[i].take()));
        let losses = Mutex::new((InvalidSamples::default(), ExactSum::default()));
        let work = || {
            let Self { scene, settings, counts_tests, .. } = *self;
            let filter = self.filter.as_ref();
            let integrator = self.new_integrator();
            let mut worker = Worker::new(scene, settings, filter, integrator, counts_tests);
            while !shared.observer.cancelled()
                && let Some(mut tile) = { lock(&tiles).next() }
            {
                let (had, rays) = (samples_before(&tile, pass), worker.tracer.rays);
                let before = worker.samples;
                self.tile(&mut tile, reuse_tiles, &targets, &mut worker, shared.observer);
                let (rejections, clamped) = &mut *lock(&losses);
                rejections.merge(tile.invalid_samples());
                clamped.merge(tile.clamped_energy());
                let taken = worker.samples - before;
                let news = if wanted.is_some() || shared.observer.cancelled() {
                    taken
                } else {
                    targets.of_tile(&tile) - had
                };
                shared.report(news, worker.tracer.rays - rays);
            }
            shared.add(&worker);
        };
        self.pool.scope(|scope| (0..self.threads()).for_each(|_| scope.spawn(|_| work())));
        drop(tiles);
        let (rejections, clamped) = &*lock(&losses);
        film.add_invalid_samples(rejections);
        film.add_clamped(*clamped);
    }

    /// Takes samples until every pixel of a tile has its target number, unless it converges before.
    ///
    /// The samples of each pixel are taken in order, so if this stops between two batches, the film
    /// can be continued.
    fn tile(
        &self,
        tile: &mut Tile,
        reuse_tiles: ReuseTiles,
        targets: &SampleTargets,
        worker: &mut Worker<dyn Integrator + '_>,
        observer: &dyn Observer,
    ) {
        loop {
            let mut due = Vec::with_capacity(tile.region().area());
            reuse_tiles.sample_ranges(
                tile.region(),
                |pixel| self.due(tile, pixel, targets),
                &mut due,
            );
            if due.is_empty() {
                return;
            }
            for batch in batches(&due, self.batch_size) {
                if observer.cancelled() {
                    return;
                }
                worker.render_batch(batch, tile);
            }
            if due
                .iter()
                .all(|range| range.kept.is_empty() || range.kept.end == targets.end(range.pixel))
            {
                return;
            }
        }
    }

    /// Samples that a pixel needs until its next convergence test, if any.
    #[inline]
    fn due(&self, tile: &Tile, pixel: [u32; 2], targets: &SampleTargets) -> Option<Range<u32>> {
        let (n, end) = (tile.next_sample(pixel), targets.end(pixel));
        if n >= end || self.converged(tile, pixel, n) {
            return None;
        }
        let check = match self.settings.adaptive {
            Some(Adaptive { batch, .. }) => (n / batch + 1).saturating_mul(batch),
            None => u32::MAX,
        };
        let full = n.saturating_add(self.batch_size as u32);
        Some(n..end.min(check).min(full))
    }

    /// Returns true if the n samples of a pixel suffice: 1.96 σ/√n ≤ tolerance · μ.
    ///
    /// σ² is the variance of samples times their filter weights, once there are enough samples to
    /// estimate it. If the film stores coverage, the interval of the coverage must also be narrower
    /// than the tolerance, as a fraction of full coverage.
    fn converged(&self, tile: &Tile, pixel: [u32; 2], n: u32) -> bool {
        let Some(Adaptive { batch, tolerance }) = self.settings.adaptive else { return false };
        let least = self.filter.as_ref().map_or(0, FilterSampler::least_samples);
        if n == 0 || n < least || !n.is_multiple_of(batch) {
            return false;
        }
        let (mean, error) = tile.pixel(pixel).luminance();
        let tolerance = f64::from(tolerance);
        let is_covered = tile.alpha(pixel).is_none_or(|(_, error)| 1.96 * error <= tolerance);
        is_covered && 1.96 * error <= tolerance * mean
    }
}

/// Splits the samples of a pixel into passes of at most `longest`.
pub(crate) fn passes(samples: Range<u32>, longest: u32) -> impl Iterator<Item = Range<u32>> {
    let mut end = samples.start;
    std::iter::from_fn(move || {
        let start = end;
        end = if start < FIRST_PASS {
            FIRST_PASS
        } else {
            (start / longest + 1).saturating_mul(longest)
        };
        end = end.min(samples.end);
        (start < end).then_some(start..end)
    })
}

/// Permutation of the numbers below `n` whose prefixes are spread evenly: multiples of about the
/// golden ratio.
fn scattered(n: usize) -> impl Iterator<Item = usize> {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (n as f64 * 0.618_034) as usize;
    let step = (golden.max(1)..=n).find(|&step| divisor(n, step) == 1).unwrap_or(1);
    (0..n).map(move |i| i * step % n)
}

/// Target numbers of samples at the end of a pass.
struct SampleTargets<'a> {
    /// Range of sample numbers of the pass.
    pass: Range<u32>,
    /// Target of each pixel of the region, if they differ.
    wanted: Option<&'a [u32]>,
    /// Number of the first sample.
    first: u32,
    region: Region,
}

impl SampleTargets<'_> {
    /// End of the sample numbers of a pixel.
    #[inline]
    fn end(&self, [x, y]: [u32; 2]) -> u32 {
        let Some(wanted) = self.wanted else { return self.pass.end };
        let Region { x: left, y: top, width, .. } = self.region;
        let pixel = (y - top) as usize * width as usize + (x - left) as usize;
        self.pass.end.min(self.first + wanted[pixel])
    }

    /// Number of samples of the pass in a tile, including those that the film already has or does
    /// not need.
    fn of_tile(&self, tile: &Tile) -> u64 {
        self.pass.len() as u64 * tile.region().area() as u64
    }
}

/// Number of samples of a pass that a tile already has.
fn samples_before(tile: &Tile, pass: &Range<u32>) -> u64 {
    let of_pixel =
        |pixel| u64::from(tile.next_sample(pixel).clamp(pass.start, pass.end) - pass.start);
    tile.region().pixels().map(of_pixel).sum()
}

/// State shared by the threads of a render.
pub(crate) struct SharedState<'a> {
    /// Estimated total number of samples: lower bound, expected value, upper bound.
    pub(crate) totals_foreseen: [u64; 3],
    /// Number of samples done.
    done: AtomicU64,
    rays: AtomicU64,
    /// Estimated error of the film at the start of the pass.
    pub(crate) error: Option<f64>,
    totals: Mutex<RenderStatistics>,
    pub(crate) observer: &'a dyn Observer,
}

impl SharedState<'_> {
    /// Reports more samples, and their number of rays.
    fn report(&self, samples: u64, rays: u64) {
        let done = self.done.fetch_add(samples, Ordering::Relaxed) + samples;
        let rays = self.rays.fetch_add(rays, Ordering::Relaxed) + rays;
        let totals = self.totals_foreseen.map(|total| total.max(done));
        self.observer.progress(&ProgressUpdate {
            done,
            estimated_totals: totals,
            rays,
            error: self.error,
        });
    }

    /// Sets the estimated totals to the samples done.
    pub(crate) fn end(&mut self) {
        self.totals_foreseen = [*self.done.get_mut(); 3];
        self.report(0, 0);
    }

    fn add(&self, worker: &Worker<dyn Integrator + '_>) {
        let mut t = lock(&self.totals);
        t.samples += worker.samples;
        t.rays += worker.tracer.rays;
        t.tests += worker.tracer.tests;
    }
}

/// Locks a mutex, even if a thread panicked while holding it: no update is left half done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_visited_once_each_and_soon_all_over() {
        for n in (0..200).chain([1000, 4096]) {
            let order: Vec<_> = scattered(n).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..n), "{n}");
            for eighth in 0..if n < 200 { 0 } else { 8 } {
                let part = n * eighth / 8..n * (eighth + 1) / 8;
                let soon = order[..n / 10].iter().filter(|i| part.contains(i)).count();
                assert!(soon.abs_diff(n / 80) <= 2, "{n}, {eighth}: {soon}");
            }
        }
    }

    #[test]
    fn passes_take_all_samples_in_order() {
        for spp in [0, 1, 15, 16, 17, 63, 64, 65, 200, 4096] {
            let samples: Vec<u32> = passes(0..spp, PASS).flatten().collect();
            assert!(samples.into_iter().eq(0..spp), "{spp}");
        }
        let all = |samples, longest| passes(samples, longest).collect::<Vec<_>>();
        assert_eq!(all(0..130, PASS), [0..16, 16..64, 64..128, 128..130]);
        assert_eq!(all(0..40, 16), [0..16, 16..32, 32..40]);
        assert_eq!(all(5..70, PASS), [5..16, 16..64, 64..70]);
        assert_eq!(all(70..200, PASS), [70..128, 128..192, 192..200]);
    }
}
