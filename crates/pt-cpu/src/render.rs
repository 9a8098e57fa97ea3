//! The render loop.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use pt_core::settings::{Adaptive, Settings};
use pt_core::{Film, Observer, Region, RenderScene};
use pt_math::Spectrum;
use pt_math::sampler::Sampler;

use crate::integrator::{self, Integrator};
use crate::tracer::Tracer;

/// What a render did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Samples taken.
    pub samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// Primitives tested, if they were counted.
    pub tests: u64,
    /// Wall-clock time.
    pub time: Duration,
}

/// Whether an image is finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// All samples are taken.
    Finished,
    /// The observer asked to stop; what is done is in the film.
    Cancelled,
}

/// Why nothing can be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// No integrator has this name.
    #[error("there is no integrator \"{name}\"; choose one of {known}")]
    UnknownIntegrator {
        /// The name.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The system refuses threads.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// How many.
        threads: usize,
        /// What went wrong.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Renders a scene on the threads of this machine.
pub struct Renderer<'a> {
    scene: &'a RenderScene,
    settings: &'a Settings,
    integrator: &'static dyn Integrator,
    pool: rayon::ThreadPool,
    tile_size: u32,
    counts_tests: bool,
}

/// Samples of a pixel between two visits: enough to keep a tile's part of the scene in the
/// cache, few enough that a stopped render has all of the image.
const PASS: u32 = 16;

impl<'a> Renderer<'a> {
    /// Sets up `threads` threads (0: one per core) that share tiles of `tile_size`² pixels.
    /// Neither changes the image.
    ///
    /// # Errors
    /// If the integrator is unknown or threads cannot be started.
    pub fn new(
        scene: &'a RenderScene,
        settings: &'a Settings,
        threads: usize,
        tile_size: u32,
        counts_tests: bool,
    ) -> Result<Self, RenderError> {
        let integrator = integrator::find(&settings.integrator).ok_or_else(|| {
            let names: Vec<_> = integrator::INTEGRATORS.iter().map(|r| r.name).collect();
            RenderError::UnknownIntegrator {
                name: settings.integrator.clone(),
                known: names.join(", "),
            }
        })?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|source| RenderError::Threads { threads, source })?;
        Ok(Self { scene, settings, integrator, pool, tile_size: tile_size.max(1), counts_tests })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Takes the samples that `film` lacks.
    pub fn render(&self, film: &mut Film, observer: &dyn Observer) -> (Progress, Statistics) {
        let start = Instant::now();
        let tiles = film.region().tiles(self.tile_size);
        let total = film.region().area() as u64 * u64::from(self.settings.spp);
        let shared = Shared {
            film: Mutex::new(film),
            done: AtomicU64::new(0),
            totals: Mutex::new(Statistics::default()),
        };
        let mut progress = Progress::Finished;
        for pass in 1..=self.settings.spp.div_ceil(PASS) {
            let target = (pass * PASS).min(self.settings.spp);
            self.pass(&tiles, target, &shared, total, observer);
            if observer.cancelled() {
                progress = Progress::Cancelled;
                break;
            }
        }
        let mut statistics =
            shared.totals.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        statistics.time = start.elapsed();
        (progress, statistics)
    }

    /// Brings every pixel to `target` samples.
    fn pass(
        &self,
        tiles: &[Region],
        target: u32,
        shared: &Shared,
        total: u64,
        observer: &dyn Observer,
    ) {
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(&tile) = tiles.get(next.fetch_add(1, Ordering::Relaxed)) {
                if observer.cancelled() {
                    return;
                }
                let mut part = shared.lock_film().tile(tile);
                let statistics = self.tile(&mut part, target, observer);
                shared.lock_film().put(&part);
                shared.add(&statistics);
                let skipped = self.skipped(&part, target, statistics.samples);
                let news = statistics.samples + skipped;
                let done = shared.done.fetch_add(news, Ordering::Relaxed) + news;
                observer.progress(done, total);
            }
        };
        self.pool.scope(|scope| (0..self.threads()).for_each(|_| scope.spawn(|_| work())));
    }

    /// Samples of this pass that adaptive sampling did not need.
    fn skipped(&self, part: &Film, target: u32, taken: u64) -> u64 {
        let due = u64::from(target - (target - 1) / PASS * PASS) * part.region().area() as u64;
        if self.settings.adaptive.is_some() { due.saturating_sub(taken) } else { 0 }
    }

    fn tile(&self, film: &mut Film, target: u32, observer: &dyn Observer) -> Statistics {
        let mut tracer = Tracer::new(self.scene, self.counts_tests);
        let mut samples = 0;
        let r = film.region();
        for y in r.y..r.y + r.height {
            for x in r.x..r.x + r.width {
                if observer.cancelled() {
                    break;
                }
                samples += self.pixel(film, x, y, target, &mut tracer);
            }
        }
        Statistics { samples, rays: tracer.rays, tests: tracer.tests, ..Statistics::default() }
    }

    /// Brings a pixel to `target` samples, unless it has converged; returns how many it took.
    fn pixel(&self, film: &mut Film, x: u32, y: u32, target: u32, tracer: &mut Tracer) -> u64 {
        let first = film.pixel(x, y).count();
        let sampler = Sampler::new(self.settings.sampler, self.settings.seed, [x, y], 0);
        let mut n = first;
        while n < target && !self.converged(film, x, y, n) {
            let l = self.sample([x as f32, y as f32], sampler.with_sample(n), tracer);
            film.add(x, y, n, l);
            n += 1;
        }
        u64::from(n - first)
    }

    /// Whether the n samples of a pixel are enough: 1.96 σ/√n ≤ tolerance · μ.
    fn converged(&self, film: &Film, x: u32, y: u32, n: u32) -> bool {
        let Some(Adaptive { batch, tolerance }) = self.settings.adaptive else { return false };
        if n == 0 || !n.is_multiple_of(batch) {
            return false;
        }
        let (mean, error) = film.pixel(x, y).luminance();
        1.96 * error <= f64::from(tolerance) * mean
    }

    /// A sample of the pixel with this upper left corner: a pure function of scene, settings,
    /// pixel and the number of the sample, the last two of which are in the sampler.
    #[inline(always)]
    fn sample(&self, [x, y]: [f32; 2], mut s: Sampler, tracer: &mut Tracer) -> Spectrum {
        let [u, v] = s.next_2d();
        let camera = &self.scene.camera;
        let lens = if camera.lens_radius > 0.0 { s.next_2d() } else { [0.0; 2] };
        let ray = camera.ray([x + u, y + v], lens);
        self.integrator.li(tracer, self.settings, ray, s)
    }
}

/// What the threads of a render share.
struct Shared<'a> {
    film: Mutex<&'a mut Film>,
    done: AtomicU64,
    totals: Mutex<Statistics>,
}

impl<'a> Shared<'a> {
    /// The film; a thread that panicked while it held it has not changed it by half, since
    /// tiles are put in whole.
    fn lock_film(&self) -> std::sync::MutexGuard<'_, &'a mut Film> {
        self.film.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn add(&self, more: &Statistics) {
        let mut t = self.totals.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        t.samples += more.samples;
        t.rays += more.rays;
        t.tests += more.tests;
    }
}
