//! Timing: all competitors in turn, repeatedly, so that disturbances of the machine affect all. Ray
//! rates use processor time; builds, which run on several threads, wall-clock time.

use std::hint::black_box;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use pt_bvh::{BuildOptions, Bvh};
use pt_math::RayColumns;

use super::clock;
use super::embree::{self, Embree, EmbreePacket, EmbreeQuality, EmbreeScene, Single};
use super::input::TriangleMesh;
use super::sets::{RaySet, RaySetKind};

/// Maximum number of builds with spatial splits.
const MAX_HIGH: usize = 3;
/// Time for which short builds are repeated further, and their maximum number.
const QUICK_BUILDS: Duration = Duration::from_millis(500);
const MAX_BUILDS: usize = 50;
/// Rays per call of our batches.
const BATCH: usize = 1024;

/// Competitor. Packets have 8 or 16 consecutive rays, all of them active.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Who {
    /// Embree's default (medium quality, no flags), ray by ray.
    Single,
    Robust,
    Eight,
    EightRobust,
    Sixteen,
    SixteenRobust,
    /// Embree's best tree, with spatial splits, ray by ray.
    High,
    HighEight,
    HighSixteen,
    Ours,
    OursBatch,
}

/// All competitors, with the headings of their columns.
pub(super) const COMPETITORS: [(Who, &str); 11] = [
    (Who::Single, "single"),
    (Who::Robust, "robust"),
    (Who::Eight, "pack8"),
    (Who::EightRobust, "robust"),
    (Who::Sixteen, "pack16"),
    (Who::SixteenRobust, "robust"),
    (Who::High, "high"),
    (Who::HighEight, "high8"),
    (Who::HighSixteen, "high16"),
    (Who::Ours, "ours"),
    (Who::OursBatch, "batch"),
];

/// Kind of query.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum QueryKind {
    /// Nearest hit.
    Closest,
    /// Occlusion.
    Any,
}

/// Million rays per second of each competitor.
#[derive(Clone, Copy)]
pub(super) struct Rates([f64; COMPETITORS.len()]);

impl Rates {
    pub(super) fn of(&self, who: Who) -> f64 {
        self.0[who as usize]
    }

    /// Best rate of some competitors.
    pub(super) fn best(&self, of: &[Who]) -> f64 {
        of.iter().map(|&who| self.of(who)).fold(0.0, f64::max)
    }
}

/// Trees of a mesh.
pub(super) struct Trees {
    pub(super) default: EmbreeScene,
    pub(super) robust: EmbreeScene,
    pub(super) high: EmbreeScene,
    pub(super) ours: Bvh,
}

impl Trees {
    /// Builds all trees.
    ///
    /// # Errors
    /// If one cannot be built.
    pub(super) fn build(embree: &Embree, mesh: &TriangleMesh) -> Result<Self> {
        let geometry = mesh.geometry();
        Ok(Self {
            default: embree.build(&geometry, EmbreeQuality::Medium, false, 2)?,
            robust: embree.build(&geometry, EmbreeQuality::Medium, true, 2)?,
            high: embree.build(&geometry, EmbreeQuality::High, false, 2)?,
            ours: Bvh::build(geometry, &BuildOptions::default())?,
        })
    }
}

/// Rays in the layouts of all competitors.
pub(super) struct PreparedRays<'a> {
    set: &'a RaySet,
    single: Vec<Single>,
    eight: Vec<EmbreePacket<8>>,
    sixteen: Vec<EmbreePacket<16>>,
    /// By columns, like packets.
    batches: Vec<RayColumns>,
}

impl<'a> PreparedRays<'a> {
    pub(super) fn new(set: &'a RaySet) -> Self {
        Self {
            set,
            single: set.rays.iter().map(embree::single).collect(),
            eight: embree::packets(&set.rays),
            sixteen: embree::packets(&set.rays),
            batches: set.rays.chunks(BATCH).map(|rays| rays.iter().copied().collect()).collect(),
        }
    }

    /// Rates on one thread, from the minimum time of `repeats` passes over all rays.
    pub(super) fn race(&self, trees: &Trees, query: QueryKind, repeats: usize) -> Rates {
        let mut least = [f64::INFINITY; COMPETITORS.len()];
        for _ in 0..repeats.max(1) {
            for (who, _) in COMPETITORS {
                let start = clock::now();
                black_box(self.pass(trees, query, who));
                let seconds = clock::now().saturating_sub(start).as_secs_f64();
                least[who as usize] = least[who as usize].min(seconds);
            }
        }
        Rates(least.map(|seconds| self.set.rays.len() as f64 / seconds * 1e-6))
    }

    /// Returns the number of rays with a hit.
    fn pass(&self, trees: &Trees, query: QueryKind, who: Who) -> usize {
        let Trees { default, robust, high, ours } = trees;
        let coherent = self.set.kind == RaySetKind::Primary;
        let eight = |scene: &EmbreeScene| match query {
            QueryKind::Closest => scene.intersect8(&self.eight, coherent),
            QueryKind::Any => scene.occluded8(&self.eight, coherent),
        };
        let sixteen = |scene: &EmbreeScene| match query {
            QueryKind::Closest => scene.intersect16(&self.sixteen, coherent),
            QueryKind::Any => scene.occluded16(&self.sixteen, coherent),
        };
        match who {
            Who::Single => self.single(default, query),
            Who::Robust => self.single(robust, query),
            Who::High => self.single(high, query),
            Who::Eight => eight(default),
            Who::EightRobust => eight(robust),
            Who::Sixteen => sixteen(default),
            Who::SixteenRobust => sixteen(robust),
            Who::HighEight => eight(high),
            Who::HighSixteen => sixteen(high),
            Who::Ours => self.ours(ours, query),
            Who::OursBatch => self.batch(ours, query),
        }
    }

    fn single(&self, scene: &EmbreeScene, query: QueryKind) -> usize {
        let mut hits = 0;
        match query {
            QueryKind::Closest => {
                scene.intersect(&self.single, |hit| hits += usize::from(hit.is_some()));
            }
            QueryKind::Any => scene.occluded(&self.single, |hit| hits += usize::from(hit)),
        }
        hits
    }

    fn ours(&self, bvh: &Bvh, query: QueryKind) -> usize {
        let rays = self.set.rays.iter();
        match query {
            // The whole hit is computed, as in a call to an opaque library.
            QueryKind::Closest => {
                rays.filter(|ray| black_box(bvh.intersect(ray)).is_some()).count()
            }
            QueryKind::Any => rays.filter(|ray| bvh.occluded(ray)).count(),
        }
    }

    fn batch(&self, bvh: &Bvh, query: QueryKind) -> usize {
        let batches = self.batches.iter();
        match query {
            QueryKind::Closest => {
                let mut hits = Vec::with_capacity(BATCH);
                let count = |rays| {
                    bvh.intersect_batch(rays, &mut hits);
                    hits.iter().filter(|hit| hit.is_some()).count()
                };
                batches.map(count).sum()
            }
            QueryKind::Any => {
                let mut occluded = Vec::with_capacity(BATCH);
                let count = |rays| {
                    bvh.occluded_batch(rays, &mut occluded);
                    occluded.iter().filter(|&&hit| hit).count()
                };
                batches.map(count).sum()
            }
        }
    }
}

/// Times in seconds and memory in bytes of builds; times are for 1 and 2 threads.
pub(super) struct Builds {
    pub(super) medium: [f64; 2],
    pub(super) high: [f64; 2],
    pub(super) ours: [f64; 2],
    /// Memory of Embree's default tree and of ours.
    pub(super) bytes: [f64; 2],
}

/// Builds trees, `repeats` times each, and keeps the minimum times. Builds with spatial splits,
/// which take long, are repeated less often, and those of small meshes, which are disturbed most,
/// more often. No other Embree scene may be alive, since it would determine the number of threads.
///
/// # Errors
/// If one cannot be built.
pub(super) fn builds(embree: &Embree, mesh: &TriangleMesh, repeats: usize) -> Result<Builds> {
    let never = [f64::INFINITY; 2];
    let mut builds = Builds { medium: never, high: never, ours: never, bytes: [0.0; 2] };
    let geometry = mesh.geometry();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.context("threads cannot be started")?;
        let keep = |times: &mut [f64; 2], seconds: f64| {
            times[threads - 1] = times[threads - 1].min(seconds);
        };
        let begin = Instant::now();
        for repeat in 0.. {
            let is_quick = repeat < MAX_BUILDS && begin.elapsed() < QUICK_BUILDS;
            if repeat >= repeats.max(1) && !is_quick {
                break;
            }
            let scene = embree.build(&geometry, EmbreeQuality::Medium, false, threads)?;
            keep(&mut builds.medium, scene.seconds);
            builds.bytes[0] = scene.bytes() as f64;
            drop(scene);
            if repeat < MAX_HIGH {
                let scene = embree.build(&geometry, EmbreeQuality::High, false, threads)?;
                keep(&mut builds.high, scene.seconds);
            }
            let start = Instant::now();
            let bvh = pool.install(|| Bvh::build(geometry, &BuildOptions::default()))?;
            keep(&mut builds.ours, start.elapsed().as_secs_f64());
            builds.bytes[1] = bvh.statistics().bytes as f64;
        }
    }
    Ok(builds)
}
