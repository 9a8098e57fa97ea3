//! Bounding volume hierarchies: build, and watertight ray queries.
//!
//! ```
//! use pt_bvh::{BuildOptions, Bvh, Geometry, Sphere};
//! use pt_math::{Ray, Vec3};
//!
//! // A triangle in front of a sphere.
//! let positions =
//!     [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];
//! let spheres = [Sphere { center: Vec3::new(0.0, 0.0, 10.0), radius: 3.0 }];
//! let geometry = Geometry { positions: &positions, triangles: &[[0, 1, 2]], spheres: &spheres };
//! let bvh = Bvh::build(geometry, &BuildOptions::default())?;
//!
//! let hit = bvh.intersect(&Ray::new(Vec3::ZERO, Vec3::Z)).unwrap();
//! assert_eq!((hit.primitive, hit.t), (0, 2.0));
//! let p = positions;
//! assert_eq!(p[0] * (1.0 - hit.b1 - hit.b2) + p[1] * hit.b1 + p[2] * hit.b2, Vec3::Z * 2.0);
//!
//! // Past the triangle, the ray meets the sphere: primitive 1, after the one triangle.
//! let hit = bvh.intersect(&Ray::new(Vec3::Y * 2.0, Vec3::Z)).unwrap();
//! assert_eq!(hit.primitive, 1);
//! assert!(!bvh.occluded(&Ray::to(Vec3::ZERO, Vec3::Z, 1.5)));
//! # Ok::<(), pt_bvh::BuildError>(())
//! ```
//!
//! # What holds
//!
//! * A query returns the hit with the least t in the open interval (`t_min`, `t_max`), and of
//!   several the one with the least primitive number. All builders and kernels return the same bits
//!   as a loop over all primitives: see the module `ray` for the proof and `laws` for tests.
//! * A closed mesh is watertight: no ray passes between two triangles that share an edge, or
//!   several that share a vertex.
//! * A ray whose origin [`pt_math::ray::offset_origin`] moved off a triangle or sphere does not hit
//!   it again from there, by rounding.
//! * Rays hit triangles and spheres from both sides. Triangles without area, and primitives with
//!   coordinates that are not finite or above [`LARGEST_COORDINATE`], are left out and counted.
//! * The tree is the same for any number of threads.
//!
//! # How it is built
//!
//! `build` makes a binary tree, [`Bvh2`], the hub, with as much care as [`Quality`] says; long thin
//! triangles are cut into pieces before. `wide` makes the eight-wide tree of it that queries use;
//! `traverse` has the scalar queries that say what is right.
//!
//! A tree can be kept as bytes ([`Bvh::to_bytes`], [`Bvh::from_bytes`]), and follow primitives that
//! move ([`Bvh::refit`]).
//!
//! # Beyond triangles and spheres
//!
//! [`InstanceBvh`] is a tree over objects that are placed by affine transforms, each a [`Bvh`] that
//! is built once. [`UserBvh`], of which it is a case, is a tree over any [`UserPrimitives`] that
//! know their boxes and where rays hit them. Both find what a loop over all would find.
//!
//! # How to ask
//!
//! Many rays are answered much faster by [`Bvh::intersect_batch`] and [`Bvh::occluded_batch`] than
//! one after the other: `cargo run --release -p pt-bvh --example rates` prints both. Some hundreds
//! are enough; rays that run side by side should be neighbours. Rays that are made by columns
//! ([`RayColumns`](pt_math::RayColumns)) need not be turned into rows.

mod aabb_tree;
mod build;
pub mod check;
mod counter;
#[cfg(any(fuzzing, test))]
#[doc(hidden)]
pub mod fuzz;
mod geometry;
mod instance;
#[cfg(test)]
mod laws;
mod node;
mod options;
mod ray;
mod refit;
mod serial;
mod sphere;
mod traverse;
mod triangle;
mod user;
mod wide;

use pt_math::{Bounds3, Ray, Rays};
use thiserror::Error;

use counter::{Counter, Off};
use traverse::List;
use wide::WideBvh;

pub use geometry::{Geometry, Hit, LARGEST_COORDINATE, Sphere};
pub use instance::{
    AnimatedBvh, AnimatedInstance, Instance, InstanceBvh, InstanceHit, MotionKey, TransformError,
};
pub use node::{Bvh2, MAX_DEPTH, Node};
pub use options::{BuildOptions, Builder, Quality};
pub use refit::RefitError;
pub use serial::ReadError;
pub use user::{DEFAULT_ERROR_BOUND, UserBvh, UserPrimitives};
pub use wide::prefetch::prefetch;

/// Fewer rays than this are faster one by one.
const MIN_BATCH: usize = 8;

/// Why there is no tree.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum BuildError {
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {index}, but there are {vertices}")]
    IndexOutOfRange {
        /// The first such triangle.
        triangle: usize,
        /// Its first wrong index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// More primitives than indices can tell apart.
    #[error("{primitives} primitives are more than 2^30")]
    TooManyPrimitives {
        /// Number of primitives.
        primitives: usize,
    },
}

/// Numbers about a tree. Without one ([`Builder::None`]) all but `bytes` and `skipped` are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Nodes of the binary tree, leaves included.
    pub nodes: usize,
    /// Leaves of the binary tree.
    pub leaves: usize,
    /// References to primitives in these leaves: one for each usable primitive, and one more for
    /// each cut through a triangle.
    pub references: usize,
    /// Memory that the finished [`Bvh`] holds, in bytes.
    pub bytes: usize,
    /// Expected cost of a query by the surface area heuristic: a node costs 1, a block of
    /// primitives 2.
    pub sah_cost: f32,
    /// Depth of the deepest leaf of the binary tree; the root has depth 0.
    pub depth: u32,
    /// Primitives left out because no ray can hit them.
    pub skipped: u32,
}

#[derive(Clone, Debug)]
enum Kernel {
    Wide(WideBvh),
    List(List),
}

impl Kernel {
    fn bytes(&self) -> usize {
        match self {
            Self::Wide(wide) => wide.bytes(),
            Self::List(list) => list.bytes(),
        }
    }
}

/// What a tree was made of, and how.
#[derive(Clone, Copy, Debug)]
struct Source {
    triangles: u32,
    spheres: u32,
    options: BuildOptions,
}

impl Source {
    fn new(geometry: &Geometry<'_>, options: BuildOptions) -> Self {
        let [triangles, spheres] =
            [geometry.triangles.len(), geometry.spheres.len()].map(|n| n as u32);
        Self { triangles, spheres, options }
    }

    fn primitives(&self) -> u64 {
        u64::from(self.triangles) + u64::from(self.spheres)
    }
}

/// Primitives, ready for ray queries. It owns all that it needs.
#[derive(Clone, Debug)]
pub struct Bvh {
    kernel: Kernel,
    bounds: Bounds3,
    statistics: Statistics,
    source: Source,
}

impl Bvh {
    /// Makes the primitives ready for queries.
    ///
    /// # Errors
    /// An index out of range, or too many primitives.
    pub fn build(geometry: Geometry<'_>, options: &BuildOptions) -> Result<Self, BuildError> {
        if options.builder == Builder::None {
            return Self::without_tree(&geometry, *options);
        }
        let hub = Bvh2::build(&geometry, options)?;
        Ok(Self::of(&hub, &geometry, *options))
    }

    /// The tree for queries made of the binary tree over `geometry`.
    fn of(hub: &Bvh2, geometry: &Geometry<'_>, options: BuildOptions) -> Self {
        let count = || Statistics {
            nodes: hub.nodes.len(),
            leaves: hub.nodes.iter().filter(|n| n.is_leaf()).count(),
            references: hub.order.len(),
            // Not known before the wide tree is made, which is at the same time.
            bytes: 0,
            sah_cost: build::tree_cost(&hub.nodes),
            depth: hub.depth(),
            skipped: hub.skipped,
        };
        let (wide, statistics) = rayon::join(|| WideBvh::new(hub, geometry), count);
        let statistics = Statistics { bytes: wide.bytes(), ..statistics };
        let source = Source::new(geometry, options);
        Self { kernel: Kernel::Wide(wide), bounds: hub.bounds(), statistics, source }
    }

    fn without_tree(geometry: &Geometry<'_>, options: BuildOptions) -> Result<Self, BuildError> {
        build::check(geometry)?;
        let (list, skipped) = List::new(geometry);
        let statistics = Statistics { bytes: list.bytes(), skipped, ..Statistics::default() };
        let source = Source::new(geometry, options);
        Ok(Self { bounds: list.bounds(), kernel: Kernel::List(list), statistics, source })
    }

    /// The nearest hit with t in (`t_min`, `t_max`); of hits with equal t that on the primitive
    /// with the least number.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.nearest(ray, &mut Off)
    }

    /// Returns true if anything is hit with t in (`t_min`, `t_max`).
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.any(ray, &mut Off)
    }

    /// [`Self::intersect`] of each ray, in order, in place of what `hits` held: the same bits,
    /// sooner.
    pub fn intersect_batch<'a>(&self, rays: impl Into<Rays<'a>>, hits: &mut Vec<Option<Hit>>) {
        self.nearest_of_each(rays.into(), hits, &mut Off);
    }

    /// [`Self::occluded`] of each ray, in order, in place of what `occluded` held: the same,
    /// sooner.
    pub fn occluded_batch<'a>(&self, rays: impl Into<Rays<'a>>, occluded: &mut Vec<bool>) {
        self.any_of_each(rays.into(), occluded, &mut Off);
    }

    /// [`Self::intersect`], which adds the number of primitives tested to `tests`.
    pub fn intersect_counted(&self, ray: &Ray, tests: &mut u64) -> Option<Hit> {
        self.nearest(ray, tests)
    }

    /// [`Self::occluded`], which adds the number of primitives tested to `tests`.
    pub fn occluded_counted(&self, ray: &Ray, tests: &mut u64) -> bool {
        self.any(ray, tests)
    }

    /// [`Self::intersect_batch`], which adds the number of primitives tested to `tests`.
    pub fn intersect_batch_counted<'a>(
        &self,
        rays: impl Into<Rays<'a>>,
        hits: &mut Vec<Option<Hit>>,
        tests: &mut u64,
    ) {
        self.nearest_of_each(rays.into(), hits, tests);
    }

    /// [`Self::occluded_batch`], which adds the number of primitives tested to `tests`.
    pub fn occluded_batch_counted<'a>(
        &self,
        rays: impl Into<Rays<'a>>,
        occluded: &mut Vec<bool>,
        tests: &mut u64,
    ) {
        self.any_of_each(rays.into(), occluded, tests);
    }

    fn nearest_of_each(
        &self,
        rays: Rays<'_>,
        hits: &mut Vec<Option<Hit>>,
        counter: &mut impl Counter,
    ) {
        match &self.kernel {
            Kernel::Wide(wide) if rays.len() >= MIN_BATCH => {
                wide.intersect_batch(rays, hits, counter);
            }
            _ => {
                hits.clear();
                hits.extend(rays.iter().map(|ray| self.nearest(&ray, counter)));
            }
        }
    }

    fn any_of_each(&self, rays: Rays<'_>, occluded: &mut Vec<bool>, counter: &mut impl Counter) {
        match &self.kernel {
            Kernel::Wide(wide) if rays.len() >= MIN_BATCH => {
                wide.occluded_batch(rays, occluded, counter);
            }
            _ => {
                occluded.clear();
                occluded.extend(rays.iter().map(|ray| self.any(&ray, counter)));
            }
        }
    }

    #[inline]
    fn nearest(&self, ray: &Ray, counter: &mut impl Counter) -> Option<Hit> {
        match &self.kernel {
            Kernel::Wide(wide) => wide.intersect(ray, counter),
            Kernel::List(list) => list.intersect(ray, counter),
        }
    }

    #[inline]
    fn any(&self, ray: &Ray, counter: &mut impl Counter) -> bool {
        match &self.kernel {
            Kernel::Wide(wide) => wide.occluded(ray, counter),
            Kernel::List(list) => list.occluded(ray, counter),
        }
    }

    /// The box around everything that can be hit; empty when nothing can.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// Number of primitives that it was made of; [`Hit::primitive`] is below.
    pub fn primitives(&self) -> usize {
        self.source.primitives() as usize
    }

    /// What answers queries: a loop over all primitives (`list`), or a tree for vectors of eight
    /// numbers (`avx2`, or `portable` in builds without it), and of sixteen where the processor has
    /// them (`avx512`).
    pub fn kernel(&self) -> &'static str {
        match &self.kernel {
            Kernel::List(_) => "list",
            Kernel::Wide(wide) if wide.has_avx512() => "avx512",
            Kernel::Wide(_) if cfg!(target_feature = "avx2") => "avx2",
            Kernel::Wide(_) => "portable",
        }
    }

    /// The same as on a processor without AVX-512.
    #[cfg(test)]
    fn without_avx512(mut self) -> Self {
        if let Kernel::Wide(wide) = &mut self.kernel {
            wide.leave_out_avx512();
        }
        self
    }

    /// The same with the queries of a tree that does not fit the caches.
    #[cfg(test)]
    fn taken_for_large(mut self) -> Self {
        if let Kernel::Wide(wide) = &mut self.kernel {
            wide.make_large();
        }
        self
    }

    /// Numbers about the tree.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Primitives left out because no ray can hit them: coordinates that are not finite or above
    /// [`LARGEST_COORDINATE`], triangles without area, spheres without positive radius.
    pub fn skipped(&self) -> u32 {
        self.statistics.skipped
    }
}

/// The example of the readme.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
