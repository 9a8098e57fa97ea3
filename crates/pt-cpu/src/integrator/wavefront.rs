//! Wavefront path tracing: the paths of a batch advance together, bounce by bounce, so that rays
//! are traced many at a time. [Laine, Karras & Aila 2013, "Megakernels Considered Harmful"]
//! [`super::reference`] has the same steps for one path.
//!
//! Paths have only buffers in common, and all sums of a path are in the order of its bounces and of
//! its light samples. So its radiance does not depend on other paths, except for those of its group
//! with path reuse ([`super::reuse`]).

use arrayvec::ArrayVec;
use pt_bvh::Hit;
use pt_core::film::ExactSum;
use pt_core::interaction::Interaction;
use pt_core::material::EvaluatedMaterial;
use pt_core::scene::RenderScene;
use pt_core::settings::{Clamp, Settings};
use pt_math::sampler::{LANES, Sampler};
use pt_math::{Rays, Spectrum};

use super::batch::{Batch, ByProducts};
use super::context::{Context, SurfaceHit};
use super::dimensions::{BlockSamples, BounceDimensions};
use super::direct::{DirectLighting, ShadingBlock};
use super::estimator::{
    PathEstimator, ScatteredPath, add_emission, add_hit_emission, add_sky, sample_bsdf_and_roulette,
};
use super::observer::{self, PathObserver, PathRecorder};
use super::path_queue::{PathQueue, PathState};
use super::reuse::{Reuse, SurfaceVertex};
use super::shading::ShadingPoint;
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CameraRays, Integrator, TracedIntegrator, alpha};
use crate::Tracer;
use crate::trace::{ScatterSample, Trace};

/// Driver of all path tracers without media.
pub(super) struct Wavefront<'a, R, W = ()> {
    estimator: R,
    cx: Context<'a>,
    /// Maximum number of surface interactions.
    max_depth: u32,
    /// Sampler dimensions of a bounce.
    dimensions: BounceDimensions,
    /// Active paths.
    queue: PathQueue,
    /// Paths of the next bounce.
    next_queue: PathQueue,
    /// Number of paths of each camera ray.
    splitting: PathSplitting,
    hits: Vec<Option<Hit>>,
    surfaces: SurfaceBuffers,
    /// Interactions of a block of paths.
    interactions: Vec<Interaction>,
    direct_lighting: DirectLighting,
    reuse: Option<Reuse>,
    transparency: Transparency,
    by_products: ByProducts<W>,
}

/// Surface hit by a path.
#[derive(Clone, Copy)]
struct PathHit {
    /// Index of the path.
    path: u32,
    hit: Hit,
}

/// Evaluated materials of a block of paths, if not all materials of the scene are constant.
type BlockMaterials = Option<Vec<Option<EvaluatedMaterial>>>;

/// Buffers of the paths that scatter.
#[derive(Default)]
struct SurfaceBuffers {
    /// Paths that scatter at a surface.
    scattering: Vec<PathHit>,
    materials: BlockMaterials,
}

/// A block of paths at surfaces.
struct SurfaceBlock<'b> {
    paths: &'b [PathHit],
    samples: BlockSamples,
    materials: &'b BlockMaterials,
    surfaces: ArrayVec<ShadingPoint<'b>, LANES>,
}

/// Evaluated material of a path of a block, if it is not constant.
#[inline(always)]
fn material(materials: &BlockMaterials, lane: usize) -> Option<&EvaluatedMaterial> {
    materials.as_ref().and_then(|materials| materials[lane].as_ref())
}

impl<R: PathEstimator, W: PathObserver> Integrator for Wavefront<'_, R, W> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        let clamp = if self.estimator.clamps() { self.cx.settings.clamp } else { Clamp::NONE };
        let mut batch = self.by_products.begin(tracer, camera_rays, radiance, clamp);
        let mut buffers = std::mem::take(&mut self.surfaces);
        let SurfaceBuffers { scattering, materials } = &mut buffers;
        self.generate_camera_paths(camera_rays);
        for bounces in 0.. {
            self.intersect(bounces, &mut batch);
            self.pass_alpha(bounces, &mut batch);
            self.add_emission_and_sky(bounces, scattering, &mut batch);
            if scattering.is_empty() {
                break;
            }
            for paths in scattering.chunks(LANES) {
                let mut block = self.shade(bounces, paths, materials, &mut batch);
                self.record_vertices(&block, &mut batch);
                self.record_for_reuse(bounces, &mut block, &mut batch);
                self.sample_lights(bounces, &block, &mut batch);
                if self.splits_at(bounces) {
                    self.sample_split_paths(&block, &mut batch);
                } else {
                    self.sample_bsdf_and_roulette(bounces, &block, &block.samples, &mut batch);
                }
            }
            self.next_bounce(bounces);
            self.direct_lighting.trace(&mut batch);
        }
        self.share_radiance(&mut batch);
        self.surfaces = buffers;
        self.by_products.end(batch);
    }

    fn take_clamped(&mut self) -> ExactSum {
        self.by_products.take_clamped()
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}

impl<R: PathEstimator> TracedIntegrator for Wavefront<'_, R, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.by_products.take_traces()
    }
}

impl<'a, R: PathEstimator, W: PathObserver> Wavefront<'a, R, W> {
    pub(super) fn new(estimator: R, scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let cx = Context { scene, settings };
        let hemisphere = estimator.hemisphere(cx);
        let has_textures = !scene.materials.table.as_slice().is_empty();
        Self {
            cx,
            max_depth: estimator.max_depth(settings),
            dimensions: BounceDimensions::new(&estimator, cx),
            estimator,
            queue: PathQueue::new(scene.uses_footprints()),
            next_queue: PathQueue::new(scene.uses_footprints()),
            splitting: PathSplitting::NONE,
            hits: Vec::new(),
            surfaces: SurfaceBuffers {
                scattering: Vec::new(),
                materials: has_textures.then(Vec::new),
            },
            interactions: Vec::new(),
            direct_lighting: DirectLighting::new(hemisphere),
            reuse: (settings.reuse > 1).then(|| Reuse::new(hemisphere.is_none())),
            transparency: Transparency::new(scene, settings),
            by_products: ByProducts::default(),
        }
    }

    fn generate_camera_paths(&mut self, camera_rays: &CameraRays) {
        let Self { cx: Context { scene, .. }, queue, .. } = self;
        let camera_transmittance = self.transparency.begin(camera_rays.samplers.len());
        if let Some(reuse) = &mut self.reuse {
            reuse.begin(camera_rays.samplers.len());
        }
        self.splitting = PathSplitting::NONE;
        queue.clear();
        queue.rays.extend(Rays::from(&camera_rays.rays).iter());
        let rays = (0..).zip(&queue.rays);
        queue.paths.extend(
            rays.clone()
                .map(|(start, ray)| PathState::at_camera(scene, ray, start, camera_transmittance)),
        );
        if let Some(cones) = &mut queue.cones {
            cones.extend(rays.map(|(start, ray)| {
                scene.camera_cone(ray.direction, camera_rays.time(start as usize))
            }));
        }
    }

    /// Finds the nearest hits of all rays; emitters that are hidden from the camera are omitted.
    fn intersect(&mut self, bounces: u32, batch: &mut Batch<W>) {
        let Self { queue, hits, splitting, .. } = self;
        let Batch { tracer, camera_rays, .. } = batch;
        let time = |i: usize| splitting.time(camera_rays, &queue.paths, i);
        tracer.intersect(&queue.rays, time, hits);
        if bounces == 0 && self.transparency.hides_emitters() {
            alpha::skip_emitters(tracer, &queue.rays, time, hits);
        }
    }

    /// Continues rays through transparent surfaces, and adds the emission there, which does not
    /// depend on the opacity.
    fn pass_alpha(&mut self, bounces: u32, batch: &mut Batch<W>) {
        let Self { estimator, cx, queue, hits, splitting, .. } = self;
        let Batch { tracer, camera_rays, accumulator } = batch;
        if !cx.scene.has_alpha {
            return;
        }
        accumulator.set_bounces(bounces);
        let shown = cx.settings.shows(bounces);
        let (paths, rays) = (&queue.paths, &queue.rays);
        let time = |i: usize| splitting.time(camera_rays, paths, i);
        let sampler = |i: usize| splitting.sampler(camera_rays, paths[i].start);
        alpha::skip_transparent(tracer, bounces, rays, hits, time, sampler, |i, ray, hit| {
            if shown {
                add_hit_emission(estimator, *cx, &paths[i], ray, hit, time(i), accumulator);
            }
        });
    }

    /// Adds the emission of surfaces and of the environment at the ends of paths, and collects the
    /// paths that scatter, whose emission [`Self::shade`] adds.
    fn add_emission_and_sky(
        &mut self,
        bounces: u32,
        scattering: &mut Vec<PathHit>,
        batch: &mut Batch<W>,
    ) {
        let Self { estimator, cx, queue, splitting, .. } = self;
        let Batch { camera_rays, accumulator, .. } = batch;
        accumulator.set_bounces(bounces);
        let shown = cx.settings.shows(bounces);
        scattering.clear();
        for (i, hit) in self.hits.iter().enumerate() {
            match hit {
                Some(hit) if bounces < self.max_depth => {
                    scattering.push(PathHit { path: i as u32, hit: *hit });
                }
                Some(hit) if shown => {
                    let (path, ray) = (&queue.paths[i], &queue.rays[i]);
                    let time = splitting.time(camera_rays, &queue.paths, i);
                    add_hit_emission(estimator, *cx, path, ray, hit, time, accumulator);
                }
                None => {
                    let (path, d) = (&queue.paths[i], queue.rays[i].direction);
                    if self.transparency.on_escape(path, *splitting) && shown {
                        add_sky(estimator, *cx, path, d, bounces, accumulator);
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Computes the shading points of a block of paths, and adds the emission there.
    #[inline(always)]
    fn shade<'b>(
        &mut self,
        bounces: u32,
        paths: &'b [PathHit],
        materials: &'b mut BlockMaterials,
        batch: &mut Batch<W>,
    ) -> SurfaceBlock<'b>
    where
        'a: 'b,
    {
        let camera_rays = batch.camera_rays;
        let samples =
            self.block_samples(bounces, paths, |start| self.splitting.sampler(camera_rays, start));
        self.find_interactions(paths, camera_rays);
        self.add_surface_emission(bounces, paths, batch);
        self.evaluate_materials(paths, camera_rays, &samples, materials);
        let surfaces = self.shading_points(paths, materials);
        SurfaceBlock { paths, samples, materials, surfaces }
    }

    /// Samples of the block's paths for direct light, BSDF, Russian roulette and materials.
    #[inline(always)]
    fn block_samples(
        &self,
        bounces: u32,
        paths: &[PathHit],
        sampler: impl Fn(u32) -> Sampler,
    ) -> BlockSamples {
        let start = |at: &PathHit| self.queue.paths[at.path as usize].start;
        BlockSamples::new(self.dimensions, bounces, paths.iter().map(|at| sampler(start(at))))
    }

    /// Computes the surface points of a block of paths.
    fn find_interactions(&mut self, paths: &[PathHit], camera_rays: &CameraRays) {
        let Self { cx: Context { scene, .. }, queue, splitting, interactions, .. } = self;
        interactions.clear();
        interactions.extend(paths.iter().map(|&PathHit { path, ref hit }| {
            let time = splitting.time(camera_rays, &queue.paths, path as usize);
            scene.interaction(&queue.rays[path as usize], hit, time)
        }));
    }

    /// Adds the emission at the surface points of a block of paths.
    fn add_surface_emission(&self, bounces: u32, paths: &[PathHit], batch: &mut Batch<W>) {
        let Self { estimator, cx, queue, splitting, .. } = self;
        batch.accumulator.set_bounces(bounces);
        if !cx.settings.shows(bounces) {
            return;
        }
        for (at, PathHit { path, hit }) in self.interactions.iter().zip(paths) {
            if !cx.scene.surfaces[at.surface].emission.is_black() {
                let time = splitting.time(batch.camera_rays, &queue.paths, *path as usize);
                let (path, found) = (&queue.paths[*path as usize], SurfaceHit { at, hit, time });
                add_emission(estimator, *cx, path, found, &mut batch.accumulator);
            }
        }
    }

    /// Evaluates the materials of a block that are not constant.
    fn evaluate_materials(
        &self,
        paths: &[PathHit],
        camera_rays: &CameraRays,
        samples: &BlockSamples,
        materials: &mut BlockMaterials,
    ) {
        let Some(materials) = materials else { return };
        let Self { cx: Context { scene, .. }, queue, splitting, .. } = self;
        let points = self.interactions.iter().zip(paths).zip(samples.material_choices());
        materials.clear();
        materials.extend(points.map(|((at, &PathHit { path, ref hit }), choice)| {
            let time = splitting.time(camera_rays, &queue.paths, path as usize);
            let width = queue.cone(path as usize).map(|cone| cone.width_at(at.distance));
            scene.evaluate_material(at, hit, time, choice, width)
        }));
    }

    /// Shading points of a block.
    ///
    /// A separate loop, short enough for the processor to overlap several paths: one loop together
    /// with the surface points costs 4 % of a render.
    fn shading_points<'b>(
        &self,
        paths: &[PathHit],
        materials: &'b BlockMaterials,
    ) -> ArrayVec<ShadingPoint<'b>, LANES>
    where
        'a: 'b,
    {
        let mut surfaces = ArrayVec::new();
        for (lane, (at, &PathHit { path, .. })) in self.interactions.iter().zip(paths).enumerate() {
            let PathState { beta, eta_scale, camera_transmittance, start, target, .. } =
                self.queue.paths[path as usize];
            let bsdf = self.cx.scene.bsdf(at, material(materials, lane));
            surfaces.push(ShadingPoint {
                point: at.point,
                bsdf,
                beta,
                eta_scale,
                camera_transmittance,
                start,
                target,
                shared: None,
            });
        }
        surfaces
    }

    /// Passes the vertices of a block to the observer.
    #[inline(always)]
    fn record_vertices(&self, block: &SurfaceBlock, batch: &mut Batch<W>) {
        let observer = &mut batch.accumulator.observer;
        observer::record_vertices(&block.surfaces, &self.interactions, observer);
    }

    /// Records the surfaces of a block for path reuse.
    #[inline(always)]
    fn record_for_reuse(&mut self, bounces: u32, block: &mut SurfaceBlock, batch: &mut Batch<W>) {
        let Some(reuse) = &mut self.reuse else { return };
        if bounces > 1 {
            return;
        }
        for (lane, surface) in block.surfaces.iter_mut().enumerate() {
            let materials = material(block.materials, lane).copied();
            let seen = SurfaceVertex { at: self.interactions[lane], materials };
            if bounces == 0 {
                reuse.add_receiver(surface.start, &seen);
            } else {
                let path = &self.queue.paths[block.paths[lane].path as usize];
                reuse.add_donor(path, &seen, surface, &mut batch.accumulator);
            }
        }
    }

    /// Samples direct light at the surfaces of a block.
    #[inline(always)]
    fn sample_lights(&mut self, bounces: u32, block: &SurfaceBlock, batch: &mut Batch<W>) {
        let Self { estimator, cx, direct_lighting, reuse, .. } = self;
        batch.accumulator.set_bounces(bounces + 1);
        if cx.settings.shows(bounces + 1) {
            let SurfaceBlock { surfaces, samples, .. } = block;
            let block = ShadingBlock { estimator, cx: *cx, surfaces, samples };
            direct_lighting.sample_lights(&block, batch, reuse.as_mut());
        }
    }

    /// Samples BSDF and Russian roulette at the surfaces of a block, with the numbers in `samples`;
    /// surviving paths are added to the next bounce.
    fn sample_bsdf_and_roulette(
        &mut self,
        bounces: u32,
        block: &SurfaceBlock,
        samples: &BlockSamples,
        batch: &mut Batch<W>,
    ) {
        let Self { estimator, cx: Context { scene, settings }, .. } = self;
        let is_last = bounces + 1 >= self.max_depth;
        let is_lit = settings.shows(bounces + 1);
        let light_pairs = if is_lit { self.dimensions.light_pairs } else { 0 };
        let after_lights = samples.scattering(light_pairs);
        // If only the BSDF is sampled, no numbers are used for lights.
        let any_delta = light_pairs > 0 && block.surfaces.iter().any(|s| s.bsdf.is_delta());
        let alone = if any_delta { samples.scattering(0) } else { after_lights };
        for (lane, surface) in block.surfaces.iter().enumerate() {
            let numbers = if surface.bsdf.is_delta() { &alone } else { &after_lights }.lane(lane);
            let (bsdf, path) = (&surface.bsdf, surface.path_state());
            let next =
                sample_bsdf_and_roulette(estimator, settings, bsdf, path, numbers, bounces + 1);
            let Some(ScatteredPath { mut state, sample, survival }) = next else { continue };
            if is_last && !estimator.counts_emission(settings, state.bsdf_pdf) {
                continue;
            }
            let scatter = || ScatterSample::new(&sample, survival);
            batch.accumulator.observer.on_scatter(state.start, scatter);
            let at = &self.interactions[lane];
            let cone = self.queue.cone(block.paths[lane].path as usize).map(|cone| {
                cone.scattered(at.distance, state.bsdf_pdf, scene.is_flat(at.primitive))
            });
            let ray = surface.point.spawn(sample.wi);
            if let Some(reuse) = &mut self.reuse {
                reuse.continue_path(surface, &mut state, ray.direction, &mut batch.accumulator);
            }
            self.next_queue.push(state, ray, cone);
        }
    }

    /// Returns true if paths are split after this number of bounces.
    #[inline(always)]
    fn splits_at(&self, bounces: u32) -> bool {
        bounces == 0 && self.cx.settings.split > 1
    }

    /// [`Self::sample_bsdf_and_roulette`] after the first surface, once for each split path, with
    /// its own random numbers.
    #[inline(never)]
    fn sample_split_paths(&mut self, block: &SurfaceBlock, batch: &mut Batch<W>) {
        let camera_rays = batch.camera_rays;
        let splitting = PathSplitting::new(self.cx.settings.split);
        let n = splitting.count() as f32;
        for way in 0..splitting.count() {
            let samples = self.block_samples(0, block.paths, |start| {
                splitting.sampler(camera_rays, splitting.path_index(start, way))
            });
            let first = self.next_queue.paths.len();
            self.sample_bsdf_and_roulette(0, block, &samples, batch);
            for path in &mut self.next_queue.paths[first..] {
                path.start = splitting.path_index(path.start, way);
                path.beta *= 1.0 / n;
                path.camera_transmittance *= 1.0 / n;
                // Russian roulette uses the throughput before the split.
                path.eta_scale *= n;
            }
        }
    }

    /// Proceeds to the paths that survived this number of bounces and the next one.
    fn next_bounce(&mut self, bounces: u32) {
        if self.splits_at(bounces) {
            self.splitting = PathSplitting::new(self.cx.settings.split);
        }
        std::mem::swap(&mut self.queue, &mut self.next_queue);
        self.next_queue.clear();
    }

    /// Adds the radiance that paths share with those of other pixels.
    fn share_radiance(&mut self, batch: &mut Batch<W>) {
        if let Some(reuse) = &mut self.reuse {
            reuse.share_radiance(batch);
        }
    }
}
