//! Wavefront path tracing: the paths of a batch advance together, bounce by bounce, so that rays
//! are traced many at a time. [Laine, Karras & Aila 2013, "Megakernels Considered Harmful"]
//! [`super::reference`] has the same steps for one path.
//!
//! Paths have only buffers in common, and all sums of a path are in the order of its bounces and of
//! its light samples. So its radiance does not depend on other paths, except for those of its group
//! with path reuse ([`super::reuse`]).

use arrayvec::ArrayVec;
use pt_core::bsdf::Bsdf;
use pt_core::material::EvaluatedMaterial;
use pt_core::scene::RenderScene;
use pt_core::settings::{Clamp, Settings};
use pt_math::sampler::LANES;
use pt_math::{Rays, Spectrum};

use super::batch::{Batch, ByProducts};
use super::context::{Context, SurfaceHit};
use super::dimensions::{BlockSamples, BounceDimensions, bounce_stream};
use super::direct::{DirectLighting, ShadingBlock};
use super::estimator::{
    PathEstimator, ScatteredPath, add_emission, add_hit_emission, add_sky, continue_by_roulette,
};
use super::lobe_order::LobeOrder;
use super::observer::{PathObserver, PathRecorder};
use super::path_queue::{PathQueue, PathState};
use super::reuse::{Reuse, SurfaceVertex};
use super::scatterer::{ScatterNumbers, Scatterer};
use super::space::shading::ShadingPoint;
use super::space::{Departure, Flight, FlightEnd, Space, VertexInteraction};
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CameraRays, Integrator, TracedIntegrator};
use crate::Tracer;
use crate::trace::{ScatterSample, Trace, Vertex};

/// Driver of all path tracers.
pub(super) struct Wavefront<'a, R, S: Space, W = ()> {
    estimator: R,
    cx: Context<'a>,
    space: S,
    /// Maximum number of interactions that count.
    max_depth: u32,
    /// Sampler dimensions of a bounce.
    dimensions: BounceDimensions,
    /// Active paths.
    queue: PathQueue<S::PathState>,
    /// Paths of the next bounce.
    next_queue: PathQueue<S::PathState>,
    /// Number of paths of each camera ray.
    splitting: PathSplitting,
    scattering: ScatteringBuffers<S::Hit>,
    /// Order of the paths that scatter, if some lobes are in blocks.
    lobe_order: Option<LobeOrder<PathHit<S::Hit>>>,
    /// Interactions of a block of paths.
    interactions: Vec<S::Interaction>,
    direct_lighting: DirectLighting<S::ShadowState>,
    reuse: Option<Reuse>,
    transparency: Transparency,
    by_products: ByProducts<W>,
}

/// Vertex reached by a path.
#[derive(Clone, Copy)]
struct PathHit<H> {
    /// Index of the path.
    path: u32,
    hit: H,
}

/// Evaluated materials of a block of paths, if not all materials of the scene are constant.
type BlockMaterials = Option<Vec<Option<EvaluatedMaterial>>>;

/// Buffers of the paths that scatter.
struct ScatteringBuffers<H> {
    /// Paths that scatter at a vertex.
    paths: Vec<PathHit<H>>,
    materials: BlockMaterials,
}

/// A block of paths at vertices.
struct VertexBlock<'b, S: Space> {
    paths: &'b [PathHit<S::Hit>],
    samples: BlockSamples,
    materials: &'b BlockMaterials,
    vertices: ArrayVec<ShadingPoint<'b, S>, LANES>,
}

/// Evaluated material of a path of a block, if it is not constant.
#[inline(always)]
fn material(materials: &BlockMaterials, lane: usize) -> Option<&EvaluatedMaterial> {
    materials.as_ref().and_then(|materials| materials[lane].as_ref())
}

impl<R: PathEstimator, S: Space, W: PathObserver> Integrator for Wavefront<'_, R, S, W> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        let clamp = if self.estimator.clamps() { self.cx.settings.clamp } else { Clamp::NONE };
        let splitting = PathSplitting::of_settings(self.cx.settings);
        let mut batch = self.by_products.begin(tracer, camera_rays, radiance, splitting, clamp);
        let mut buffers = std::mem::replace(&mut self.scattering, ScatteringBuffers::new(false));
        let ScatteringBuffers { paths: scattering, materials } = &mut buffers;
        self.generate_camera_paths(camera_rays);
        for bounces in 0.. {
            self.fly(bounces, &mut batch);
            self.add_emission_and_sky(bounces, scattering, &mut batch);
            if scattering.is_empty() {
                break;
            }
            if let Some(order) = &mut self.lobe_order {
                order.sort(self.cx.scene, scattering, |at| S::surface_hit(&at.hit));
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
            self.direct_lighting.trace(self.cx.settings, &mut self.space, &mut batch);
        }
        self.share_radiance(&mut batch);
        self.scattering = buffers;
        self.by_products.end(batch);
    }

    fn take_clamped(&mut self) -> Vec<(u32, f32)> {
        self.by_products.take_clamped()
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}

impl<R: PathEstimator, S: Space> TracedIntegrator for Wavefront<'_, R, S, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.by_products.take_traces()
    }
}

impl<H> ScatteringBuffers<H> {
    fn new(has_textures: bool) -> Self {
        Self { paths: Vec::new(), materials: has_textures.then(Vec::new) }
    }
}

impl<'a, R: PathEstimator, S: Space, W: PathObserver> Wavefront<'a, R, S, W> {
    pub(super) fn new(estimator: R, scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let cx = Context { scene, settings };
        let hemisphere = estimator.hemisphere(cx);
        let has_textures = !scene.materials.table.as_slice().is_empty();
        Self {
            cx,
            max_depth: estimator.max_depth(settings),
            dimensions: S::dimensions(&estimator, cx),
            estimator,
            space: S::default(),
            queue: PathQueue::new(scene.uses_footprints()),
            next_queue: PathQueue::new(scene.uses_footprints()),
            splitting: PathSplitting::NONE,
            scattering: ScatteringBuffers::new(has_textures),
            lobe_order: LobeOrder::new(scene).filter(|_| settings.reuse <= 1),
            interactions: Vec::new(),
            direct_lighting: DirectLighting::new(hemisphere),
            reuse: (settings.reuse > 1).then(|| Reuse::new(hemisphere.is_none())),
            transparency: Transparency::new(scene, settings),
            by_products: ByProducts::default(),
        }
    }

    fn generate_camera_paths(&mut self, camera_rays: &CameraRays) {
        let Self { cx, queue, .. } = self;
        let scene = cx.scene;
        let camera_transmittance = self.transparency.begin(camera_rays.samplers.len());
        if let Some(reuse) = &mut self.reuse {
            reuse.begin(camera_rays.samplers.len());
        }
        self.splitting = PathSplitting::NONE;
        let splitting = PathSplitting::of_settings(cx.settings);
        queue.clear();
        queue.rays.extend(Rays::from(&camera_rays.rays).iter());
        let rays = (0..).zip(&queue.rays);
        let importance = scene.importance();
        queue.paths.extend(rays.clone().map(|(start, ray)| {
            let path = PathState::at_camera(importance, ray, start, camera_transmittance);
            PathState { target: splitting.path_index(start, 0), ..path }
        }));
        queue.space.extend((0..queue.paths.len()).map(|start| {
            S::at_camera(scene, || bounce_stream(camera_rays.samplers.get(start), 0, None))
        }));
        if let Some(cones) = &mut queue.cones {
            cones.extend(rays.map(|(start, ray)| {
                scene.camera_cone(ray.direction, camera_rays.time(start as usize))
            }));
        }
    }

    /// Moves all paths to their next vertices.
    fn fly(&mut self, bounces: u32, batch: &mut Batch<W>) {
        let Self { estimator, cx, dimensions, max_depth, queue, splitting, .. } = self;
        let flight = Flight {
            estimator: &*estimator,
            cx: *cx,
            dimensions: *dimensions,
            bounces,
            max_depth: *max_depth,
            hides_emitters: self.transparency.hides_emitters(),
            splitting: *splitting,
            queue,
        };
        self.space.fly(flight, batch);
    }

    /// Adds the emission of surfaces and of the environment at the ends of paths, and collects the
    /// paths that scatter, whose emission [`Self::shade`] adds.
    fn add_emission_and_sky(
        &mut self,
        bounces: u32,
        scattering: &mut Vec<PathHit<S::Hit>>,
        batch: &mut Batch<W>,
    ) {
        let Self { estimator, cx, space, queue, splitting, .. } = self;
        let Batch { camera_rays, accumulator, .. } = batch;
        accumulator.set_bounces(bounces);
        scattering.clear();
        for (i, (end, in_space)) in space.ends().zip(&queue.space).enumerate() {
            let counted = S::counted(bounces, in_space);
            let shown = || cx.settings.shows(counted);
            match end {
                FlightEnd::Vertex(hit)
                    if counted < self.max_depth || S::may_pass(cx.settings, &hit) =>
                {
                    scattering.push(PathHit { path: i as u32, hit });
                }
                FlightEnd::Vertex(hit) => {
                    if let Some(hit) = S::surface_hit(&hit).filter(|_| shown()) {
                        let (path, ray) = (&queue.paths[i], &queue.rays[i]);
                        let time = splitting.time(camera_rays, &queue.paths, i);
                        add_hit_emission(estimator, *cx, path, ray, hit, time, accumulator);
                    }
                }
                FlightEnd::Escaped => {
                    let (path, ray) = (&queue.paths[i], &queue.rays[i]);
                    if self.transparency.on_escape(path, *splitting) && shown() {
                        add_sky(estimator, *cx, path, ray.direction, bounces, accumulator);
                    }
                }
                FlightEnd::Absorbed => {}
            }
        }
    }

    /// Computes the shading points of a block of paths, and adds the emission there.
    #[inline(always)]
    fn shade<'b>(
        &mut self,
        bounces: u32,
        paths: &'b [PathHit<S::Hit>],
        materials: &'b mut BlockMaterials,
        batch: &mut Batch<W>,
    ) -> VertexBlock<'b, S>
    where
        'a: 'b,
    {
        let camera_rays = batch.camera_rays;
        let numbers = paths.iter().map(|at| self.queue.paths[at.path as usize].start);
        let samplers = self.splitting.samplers(camera_rays, numbers);
        let samples = BlockSamples::new(self.dimensions, bounces, samplers);
        self.find_interactions(paths, camera_rays);
        self.add_surface_emission(bounces, paths, batch);
        self.evaluate_materials(paths, camera_rays, &samples, materials);
        let vertices = self.shading_points(bounces, paths, materials);
        VertexBlock { paths, samples, materials, vertices }
    }

    /// Computes the vertices of a block of paths.
    fn find_interactions(&mut self, paths: &[PathHit<S::Hit>], camera_rays: &CameraRays) {
        let Self { cx: Context { scene, .. }, queue, splitting, interactions, .. } = self;
        interactions.clear();
        interactions.extend(paths.iter().map(|&PathHit { path, ref hit }| {
            let path = path as usize;
            let time = splitting.time(camera_rays, &queue.paths, path);
            S::interaction(scene, &queue.rays[path], hit, time)
        }));
    }

    /// Adds the emission at the surface points of a block of paths.
    fn add_surface_emission(&self, bounces: u32, paths: &[PathHit<S::Hit>], batch: &mut Batch<W>) {
        let Self { estimator, cx, queue, splitting, .. } = self;
        batch.accumulator.set_bounces(bounces);
        for (at, PathHit { path, hit }) in self.interactions.iter().zip(paths) {
            let (Some(at), Some(hit)) = (at.surface(), S::surface_hit(hit)) else { continue };
            if cx.scene.surfaces[at.surface].emission.is_black() {
                continue;
            }
            let path = *path as usize;
            if cx.settings.shows(S::counted(bounces, &queue.space[path])) {
                let time = splitting.time(batch.camera_rays, &queue.paths, path);
                let found = SurfaceHit { at, hit, time };
                add_emission(estimator, *cx, &queue.paths[path], found, &mut batch.accumulator);
            }
        }
    }

    /// Evaluates the materials of a block that are not constant.
    fn evaluate_materials(
        &self,
        paths: &[PathHit<S::Hit>],
        camera_rays: &CameraRays,
        samples: &BlockSamples,
        materials: &mut BlockMaterials,
    ) {
        let Some(materials) = materials else { return };
        let Self { cx: Context { scene, .. }, queue, splitting, .. } = self;
        let points = self.interactions.iter().zip(paths).zip(samples.material_choices());
        materials.clear();
        materials.extend(points.map(|((at, &PathHit { path, ref hit }), choice)| {
            let (at, hit) = (at.surface()?, S::surface_hit(hit)?);
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
        bounces: u32,
        paths: &[PathHit<S::Hit>],
        materials: &'b BlockMaterials,
    ) -> ArrayVec<ShadingPoint<'b, S>, LANES>
    where
        'a: 'b,
    {
        let mut vertices = ArrayVec::new();
        for (lane, (at, &PathHit { path, .. })) in self.interactions.iter().zip(paths).enumerate() {
            let PathState { beta, eta_scale, camera_transmittance, start, target, .. } =
                self.queue.paths[path as usize];
            let space = self.queue.space[path as usize];
            let is_last = S::counted(bounces, &space) >= self.max_depth;
            vertices.push(ShadingPoint {
                point: at.point(),
                scatterer: S::scatterer(self.cx.scene, at, material(materials, lane), is_last),
                space,
                beta,
                eta_scale,
                camera_transmittance,
                start,
                target,
                shared: None,
            });
        }
        vertices
    }

    /// Passes the vertices of a block to the observer.
    #[inline(always)]
    fn record_vertices(&self, block: &VertexBlock<S>, batch: &mut Batch<W>) {
        if !W::ENABLED {
            return;
        }
        for (vertex, at) in block.vertices.iter().zip(&self.interactions) {
            let ShadingPoint { point, scatterer, beta, start, .. } = vertex;
            if let Some(site) = S::site(at, scatterer) {
                let recorded = Vertex { p: point.p, site, throughput: *beta, scatter: None };
                batch.accumulator.observer.on_vertex(*start, || recorded);
            }
        }
    }

    /// Records the surfaces of a block for path reuse.
    #[inline(always)]
    fn record_for_reuse(&mut self, bounces: u32, block: &mut VertexBlock<S>, batch: &mut Batch<W>) {
        let Some(reuse) = &mut self.reuse else { return };
        if bounces > 1 {
            return;
        }
        for (lane, vertex) in block.vertices.iter_mut().enumerate() {
            let Some(at) = self.interactions[lane].surface() else { continue };
            let materials = material(block.materials, lane).copied();
            let seen = SurfaceVertex { at: *at, materials };
            if bounces == 0 {
                reuse.add_receiver(vertex.start, &seen);
            } else {
                let path = &self.queue.paths[block.paths[lane].path as usize];
                reuse.add_donor(path, &seen, vertex, &mut batch.accumulator);
            }
        }
    }

    /// Samples direct light at the vertices of a block.
    #[inline(always)]
    fn sample_lights(&mut self, bounces: u32, block: &VertexBlock<'_, S>, batch: &mut Batch<W>) {
        let Self { estimator, cx, space, direct_lighting, reuse, splitting, .. } = self;
        batch.accumulator.set_bounces(bounces + 1);
        let VertexBlock { vertices, samples, .. } = block;
        let (cx, splitting) = (*cx, *splitting);
        let block = ShadingBlock { estimator, cx, bounces, splitting, vertices, samples };
        direct_lighting.sample_lights(&block, space, batch, reuse.as_mut());
    }

    /// Samples BSDF and Russian roulette at the vertices of a block, with the numbers in `samples`;
    /// surviving paths are added to the next bounce.
    fn sample_bsdf_and_roulette(
        &mut self,
        bounces: u32,
        block: &VertexBlock<S>,
        samples: &BlockSamples,
        batch: &mut Batch<W>,
    ) {
        let Self { estimator, cx, dimensions, splitting, .. } = self;
        let Context { scene, settings } = *cx;
        let is_lit = settings.shows(bounces + 1);
        let [glossy, specular] =
            [false, true].map(|is_delta| dimensions.scattering_pair(is_lit, is_delta));
        let after_lights = samples.scattering(glossy);
        let any_delta = glossy != specular && block.vertices.iter().any(|v| v.scatterer.is_delta());
        let alone = if any_delta { samples.scattering(specular) } else { after_lights };
        let bsdfs = block.vertices.iter().map(|vertex| vertex.scatterer.bsdf());
        let together = Bsdf::sample_each(bsdfs, |lane| after_lights.lane(lane).direction);
        for (lane, vertex) in block.vertices.iter().enumerate() {
            let ShadingPoint { scatterer, point, .. } = vertex;
            let ScatterNumbers { direction, roulette } =
                if scatterer.is_delta() { &alone } else { &after_lights }.lane(lane);
            let path = vertex.path_state();
            let sample = together[lane].unwrap_or_else(|| scatterer.sample(direction));
            let next = sample.and_then(|sample| {
                let chosen = (sample, roulette);
                continue_by_roulette(estimator, settings, scatterer, path, chosen, bounces + 1)
            });
            let Some(ScatteredPath { mut state, sample, survival }) = next else { continue };
            let counted = S::counted(bounces, &vertex.space);
            let finds_emission_only = counted + 1 >= self.max_depth;
            if finds_emission_only && !estimator.counts_emission(settings, state.bsdf_pdf) {
                continue;
            }
            let scatter = || ScatterSample::new(&sample, survival);
            batch.accumulator.observer.on_scatter(state.start, scatter);
            let ray = point.spawn(sample.wi);
            if let Some(reuse) = &mut self.reuse {
                reuse.continue_path(vertex, &mut state, ray.direction, &mut batch.accumulator);
            }
            let departure = Departure { cx: *cx, vertex, is_last: counted >= self.max_depth };
            let index = block.paths[lane].path as usize;
            let before = &self.queue.paths[index];
            let start = state.start;
            let stream =
                || bounce_stream(splitting.sampler(batch.camera_rays, start), bounces + 1, None);
            if let Some(space) = S::leave(&departure, before, &mut state, sample.wi, stream) {
                let at = &self.interactions[lane];
                self.next_queue.push(state, ray, space, || {
                    let cone = self.queue.cone(index)?;
                    Some(cone.scattered(at.distance(), sample.pdf, at.is_flat(scene)))
                });
            }
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
    fn sample_split_paths(&mut self, block: &VertexBlock<S>, batch: &mut Batch<W>) {
        let camera_rays = batch.camera_rays;
        let splitting = PathSplitting::of_settings(self.cx.settings);
        let n = splitting.count() as f32;
        for way in 0..splitting.count() {
            let numbers = block.vertices.iter().map(|v| splitting.path_index(v.start, way));
            let samplers = splitting.samplers(camera_rays, numbers);
            let samples = BlockSamples::new(self.dimensions, 0, samplers);
            let first = self.next_queue.paths.len();
            self.sample_bsdf_and_roulette(0, block, &samples, batch);
            for path in &mut self.next_queue.paths[first..] {
                path.start = splitting.path_index(path.start, way);
                path.target = path.start;
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
            self.splitting = PathSplitting::of_settings(self.cx.settings);
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
