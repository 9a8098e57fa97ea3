//! Wavefront path tracing: the paths of a batch advance together, bounce by bounce, so that rays
//! are traced many at a time. [Laine, Karras & Aila 2013, "Megakernels Considered Harmful"]
//! [`super::reference`] has the same steps for one path.
//!
//! ```text
//! for each bounce:
//!     nearest hits of all rays             Tracer::intersect, pass_alpha
//!     emission at the ends of paths        add_emission_and_sky
//!     block by block:                      scatter_paths
//!         samples of the block                 sample_block_dimensions
//!         surface points and emission          shade_hits
//!         materials and BSDFs                  evaluate_materials, shading_points
//!         light samples                        DirectLighting::sample_lights
//!         BSDF samples, Russian roulette       sample_bsdf_and_roulette
//!     shadow rays                          DirectLighting::trace
//! ```
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
use pt_math::{Ray, Rays, Spectrum};

use super::accumulator::RadianceAccumulator;
use super::context::{Context, SurfaceHit};
use super::dimensions::{BlockSamples, BounceDimensions};
use super::direct::{DirectLighting, ShadingBlock};
use super::estimator::{PathEstimator, add_emission, add_sky, transmittance_after};
use super::observer::{self, PathObserver, PathRecorder};
use super::path_queue::{PathQueue, PathState};
use super::reuse::{Reuse, SurfaceVertex};
use super::shading::{ShadingPoint, SharedRadiance};
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CameraRays, Integrator, TracedIntegrator, alpha};
use crate::Tracer;
use crate::trace::{ScatterSample, Trace};

/// Driver of all path tracers.
pub(super) struct Wavefront<'a, R, W = ()> {
    estimator: R,
    cx: Context<'a>,
    /// Maximum number of surface interactions.
    max_depth: u32,
    /// Sampler dimensions of a bounce.
    dimensions: BounceDimensions,
    /// Active paths.
    queue: PathQueue,
    /// Paths after splitting; empty at all other bounces.
    split_queue: PathQueue,
    /// Number of paths of each camera ray.
    splitting: PathSplitting,
    hits: Vec<Option<Hit>>,
    /// Paths that scatter at a surface, with their hits.
    scattering: Vec<(u32, Hit)>,
    /// Interactions of a block of these, and their evaluated materials if they vary.
    interactions: Vec<Interaction>,
    materials: Vec<Option<EvaluatedMaterial>>,
    direct_lighting: DirectLighting,
    reuse: Option<Reuse>,
    transparency: Transparency,
    /// See [`Integrator::take_clamped`].
    clamped: ExactSum,
    observer: W,
}

impl<R: PathEstimator, W: PathObserver> Integrator for Wavefront<'_, R, W> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        self.generate_camera_paths(camera_rays);
        radiance.clear();
        let n = camera_rays.samplers.len();
        radiance.resize(n, Spectrum::ZERO);
        let clamp = if self.estimator.clamps() { self.cx.settings.clamp } else { Clamp::NONE };
        let mut clamped = ExactSum::default();
        let mut observer = std::mem::take(&mut self.observer);
        observer.on_batch(camera_rays);
        let mut accumulator = RadianceAccumulator::new(radiance, clamp, &mut clamped, observer);
        for bounces in 0.. {
            let time = |i: usize| self.splitting.time(camera_rays, &self.queue.paths, i);
            tracer.intersect(&self.queue.rays, time, &mut self.hits);
            accumulator.set_bounces(bounces);
            if bounces == 0 && self.transparency.hides_emitters() {
                alpha::skip_emitters(
                    tracer,
                    &self.queue.rays,
                    |i| camera_rays.time(i),
                    &mut self.hits,
                );
            }
            if tracer.scene.has_alpha {
                self.pass_alpha(bounces, tracer, camera_rays, &mut accumulator);
            }
            self.add_emission_and_sky(bounces, camera_rays, &mut accumulator);
            if self.scattering.is_empty() {
                break;
            }
            self.scatter_paths(bounces, tracer, camera_rays, &mut accumulator);
            self.direct_lighting.trace(tracer, camera_rays, &mut accumulator);
        }
        if let Some(reuse) = &mut self.reuse {
            accumulator.set_bounces(2);
            reuse.share_radiance(tracer, camera_rays, &mut accumulator);
        }
        self.observer = accumulator.observer;
        radiance.truncate(n);
        self.clamped.merge(clamped);
    }

    fn take_clamped(&mut self) -> ExactSum {
        std::mem::take(&mut self.clamped)
    }

    fn transparency(&self) -> &[f32] {
        self.transparency.values()
    }
}

impl<R: PathEstimator> TracedIntegrator for Wavefront<'_, R, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.observer.take()
    }
}

impl<'a, R: PathEstimator, W: PathObserver> Wavefront<'a, R, W> {
    pub(super) fn new(estimator: R, scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let cx = Context { scene, settings };
        let hemisphere = estimator.hemisphere(cx);
        Self {
            cx,
            max_depth: estimator.max_depth(settings),
            dimensions: BounceDimensions::new(&estimator, cx),
            estimator,
            queue: PathQueue::default(),
            split_queue: PathQueue::default(),
            splitting: PathSplitting::NONE,
            hits: Vec::new(),
            scattering: Vec::new(),
            interactions: Vec::new(),
            materials: Vec::new(),
            direct_lighting: DirectLighting::new(hemisphere),
            reuse: (settings.reuse > 1).then(|| Reuse::new(hemisphere.is_none())),
            transparency: Transparency::new(scene, settings),
            clamped: ExactSum::default(),
            observer: W::default(),
        }
    }

    fn generate_camera_paths(&mut self, camera_rays: &CameraRays) {
        let camera_transmittance = self.transparency.begin(camera_rays.samplers.len());
        if let Some(reuse) = &mut self.reuse {
            reuse.begin(camera_rays.samplers.len());
        }
        self.splitting = PathSplitting::NONE;
        self.queue.rays.clear();
        self.queue.rays.extend(Rays::from(&camera_rays.rays).iter());
        let scene = self.cx.scene;
        let path = |(start, ray): (u32, &Ray)| {
            PathState::at_camera(scene, ray, start, camera_transmittance)
        };
        self.queue.paths.clear();
        self.queue.paths.extend((0..).zip(&self.queue.rays).map(path));
        self.queue.cones.clear();
        if scene.uses_footprints() {
            let cone =
                |(i, ray): (usize, &Ray)| scene.camera_cone(ray.direction, camera_rays.time(i));
            self.queue.cones.extend(self.queue.rays.iter().enumerate().map(cone));
        }
    }

    /// Adds the emission of surfaces and of the environment at the ends of paths, and collects the
    /// paths that scatter.
    fn add_emission_and_sky(
        &mut self,
        bounces: u32,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let scene = self.cx.scene;
        let shown = self.cx.settings.shows(bounces);
        self.scattering.clear();
        for (i, hit) in self.hits.iter().enumerate() {
            match hit {
                Some(hit) if bounces < self.max_depth => self.scattering.push((i as u32, *hit)),
                Some(hit) if shown && scene.is_emissive(hit) => {
                    let (path, time) = (
                        &self.queue.paths[i],
                        self.splitting.time(camera_rays, &self.queue.paths, i),
                    );
                    let at = &scene.interaction(&self.queue.rays[i], hit, time);
                    add_emission(
                        &self.estimator,
                        self.cx,
                        path,
                        SurfaceHit { at, hit, time },
                        accumulator,
                    );
                }
                None => {
                    let (path, d) = (&self.queue.paths[i], self.queue.rays[i].direction);
                    if self.transparency.on_escape(path, self.splitting) && shown {
                        add_sky(&self.estimator, self.cx, path, (d, bounces), accumulator);
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Samples direct light and the BSDF at each surface, and continues the surviving paths.
    fn scatter_paths(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let Context { settings, .. } = self.cx;
        let context = settings.shows(bounces + 1);
        let light_pairs = if context { self.dimensions.light_pairs } else { 0 };
        let scattering = std::mem::take(&mut self.scattering);
        let mut materials = std::mem::take(&mut self.materials);
        let mut live = 0;
        let splits = bounces == 0 && settings.split > 1;
        if splits {
            self.split_queue.resize_like(scattering.len() * settings.split as usize, &self.queue);
        }
        for block in scattering.chunks(LANES) {
            let numbers = self.sample_block_dimensions(block, bounces, |start| {
                self.splitting.sampler(camera_rays, start)
            });
            accumulator.set_bounces(bounces);
            self.shade_hits(block, camera_rays, settings.shows(bounces), accumulator);
            self.evaluate_materials(block, camera_rays, &numbers, &mut materials);
            let mut surfaces = self.shading_points(block, &materials);
            observer::record_vertices(&surfaces, &self.interactions, &mut accumulator.observer);
            self.record_for_reuse(block, bounces, &materials, &mut surfaces, accumulator);
            accumulator.set_bounces(bounces + 1);
            if context {
                let shading_block = ShadingBlock {
                    estimator: &self.estimator,
                    settings,
                    surfaces: &surfaces,
                    numbers: &numbers,
                };
                self.direct_lighting.sample_lights(
                    &shading_block,
                    tracer,
                    camera_rays,
                    accumulator,
                    self.reuse.as_mut(),
                );
            }
            if splits {
                live = self.split_paths(
                    block,
                    &surfaces,
                    [light_pairs, live],
                    camera_rays,
                    accumulator,
                );
            } else {
                let pairs = [light_pairs, live];
                live = self.sample_bsdf_and_roulette(
                    block,
                    &surfaces,
                    bounces + 1,
                    pairs,
                    &numbers,
                    accumulator,
                );
            }
        }
        if splits {
            std::mem::swap(&mut self.queue, &mut self.split_queue);
            self.split_queue.paths.clear();
            self.splitting = PathSplitting::new(settings.split);
        }
        self.queue.truncate(live);
        self.scattering = scattering;
        self.materials = materials;
    }

    /// Continues rays through transparent surfaces, and adds the emission there, which does not
    /// depend on the opacity.
    fn pass_alpha(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let Self { estimator, cx, queue, hits, splitting, .. } = self;
        let scene = cx.scene;
        let shown = cx.settings.shows(bounces);
        let (paths, rays) = (&queue.paths, &queue.rays);
        let time = |i: usize| splitting.time(camera_rays, paths, i);
        let sampler = |i: usize| splitting.sampler(camera_rays, paths[i].start);
        alpha::skip_transparent(tracer, bounces, rays, hits, (time, sampler), |i, ray, hit| {
            if shown && scene.is_emissive(hit) {
                let time = time(i);
                let at = &scene.interaction(ray, hit, time);
                add_emission(estimator, *cx, &paths[i], SurfaceHit { at, hit, time }, accumulator);
            }
        });
    }

    /// Computes the surface points of a block of paths, and adds their emission if it is shown.
    fn shade_hits(
        &mut self,
        block: &[(u32, Hit)],
        camera_rays: &CameraRays,
        shown: bool,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let scene = self.cx.scene;
        let time = |i: u32| self.splitting.time(camera_rays, &self.queue.paths, i as usize);
        let at = |&(i, ref hit): &(u32, Hit)| {
            scene.interaction(&self.queue.rays[i as usize], hit, time(i))
        };
        self.interactions.clear();
        self.interactions.extend(block.iter().map(at));
        for (at, (i, hit)) in self.interactions.iter().zip(block) {
            if shown && !scene.surfaces[at.surface].emission.is_black() {
                let found = SurfaceHit { at, hit, time: time(*i) };
                add_emission(
                    &self.estimator,
                    self.cx,
                    &self.queue.paths[*i as usize],
                    found,
                    accumulator,
                );
            }
        }
    }

    /// Evaluates the materials of a block; empty if all are constant.
    fn evaluate_materials(
        &self,
        block: &[(u32, Hit)],
        camera_rays: &CameraRays,
        numbers: &BlockSamples,
        materials: &mut Vec<Option<EvaluatedMaterial>>,
    ) {
        let scene = self.cx.scene;
        materials.clear();
        if scene.materials.table.as_slice().is_empty() {
            return;
        }
        let choices =
            if self.dimensions.stochastic_materials { numbers.last()[0] } else { [0.0; LANES] };
        let points = self.interactions.iter().zip(block).zip(choices);
        let width = |i: u32, at: &Interaction| {
            self.queue.cones.get(i as usize).map(|cone| cone.width_at(at.distance))
        };
        let time = |i: u32| self.splitting.time(camera_rays, &self.queue.paths, i as usize);
        materials.extend(points.map(|((at, (i, hit)), choice)| {
            scene.evaluate_material(at, hit, time(*i), choice, width(*i, at))
        }));
    }

    /// Shading points of a block.
    ///
    /// A separate loop, short enough for the processor to overlap several paths: one loop together
    /// with the surface points costs 4 % of a render.
    fn shading_points<'s>(
        &self,
        block: &[(u32, Hit)],
        materials: &'s [Option<EvaluatedMaterial>],
    ) -> ArrayVec<ShadingPoint<'s>, LANES>
    where
        'a: 's,
    {
        let scene = self.cx.scene;
        let mut surfaces = ArrayVec::new();
        for (lane, (at, &(i, _))) in self.interactions.iter().zip(block).enumerate() {
            let PathState { beta, eta_scale, camera_transmittance, start, target, .. } =
                self.queue.paths[i as usize];
            let bsdf = scene.bsdf(at, materials.get(lane).and_then(Option::as_ref));
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

    /// Records the surfaces for path reuse.
    fn record_for_reuse(
        &mut self,
        block: &[(u32, Hit)],
        bounces: u32,
        materials: &[Option<EvaluatedMaterial>],
        surfaces: &mut [ShadingPoint],
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let Some(reuse) = &mut self.reuse else { return };
        if bounces > 1 {
            return;
        }
        for (lane, surface) in surfaces.iter_mut().enumerate() {
            let materials = materials.get(lane).copied().flatten();
            let seen = SurfaceVertex { at: self.interactions[lane], materials };
            if bounces == 0 {
                reuse.add_receiver(surface.start, &seen);
            } else {
                reuse.add_donor(
                    &self.queue.paths[block[lane].0 as usize],
                    &seen,
                    surface,
                    accumulator,
                );
            }
        }
    }

    /// Samples of the block's paths for direct light, BSDF, Russian roulette and materials.
    #[inline(always)]
    fn sample_block_dimensions(
        &self,
        block: &[(u32, Hit)],
        bounces: u32,
        sampler: impl Fn(u32) -> Sampler,
    ) -> BlockSamples {
        let sampler = |&(i, _): &(u32, Hit)| sampler(self.queue.paths[i as usize].start);
        BlockSamples::new(self.dimensions, bounces, block.iter().map(sampler))
    }

    /// [`Wavefront::sample_bsdf_and_roulette`] after the first surface, once for each split path,
    /// with its own random numbers.
    #[inline(never)]
    fn split_paths(
        &mut self,
        block: &[(u32, Hit)],
        surfaces: &[ShadingPoint],
        [light_pairs, mut live]: [u32; 2],
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) -> u32 {
        let splitting = PathSplitting::new(self.cx.settings.split);
        let n = splitting.count() as f32;
        for way in 0..splitting.count() {
            let sampler = |start| splitting.sampler(camera_rays, splitting.path_index(start, way));
            let numbers = self.sample_block_dimensions(block, 0, sampler);
            let first = live as usize;
            live = self.sample_bsdf_and_roulette(
                block,
                surfaces,
                1,
                [light_pairs, live],
                &numbers,
                accumulator,
            );
            for path in &mut self.split_queue.paths[first..live as usize] {
                path.start = splitting.path_index(path.start, way);
                path.beta *= 1.0 / n;
                path.camera_transmittance *= 1.0 / n;
                // Russian roulette uses the throughput before the split.
                path.eta_scale *= n;
            }
        }
        live
    }

    /// Continues the block's paths after interaction number `bounces`: surviving paths and their
    /// rays are stored from `live` on, in `split` if there is room. Returns the next free index.
    fn sample_bsdf_and_roulette(
        &mut self,
        block: &[(u32, Hit)],
        surfaces: &[ShadingPoint],
        bounces: u32,
        [light_pairs, mut live]: [u32; 2],
        numbers: &BlockSamples,
        accumulator: &mut RadianceAccumulator<W>,
    ) -> u32 {
        let behind_lights = numbers.pairs(light_pairs);
        // If only the BSDF is sampled, no numbers are used for lights.
        let any_delta = light_pairs > 0 && surfaces.iter().any(|s| s.bsdf.is_delta());
        let alone = if any_delta { numbers.pairs(0) } else { behind_lights };
        for (lane, surface) in surfaces.iter().enumerate() {
            let [[x, y], [z, w]] = if surface.bsdf.is_delta() { &alone } else { &behind_lights };
            let u = [x, y, w].map(|n| n[lane]);
            let next = self.sample_bsdf(surface, bounces, (u, z[lane]), &mut accumulator.observer);
            if let Some((mut path, ray)) = next {
                if let (Some(SharedRadiance::Glossy), Some(reuse)) =
                    (surface.shared, &mut self.reuse)
                {
                    reuse.continue_path(&mut path, ray.direction, accumulator);
                }
                let cone = self.queue.cones.get(block[lane].0 as usize).map(|cone| {
                    let at = &self.interactions[lane];
                    let is_flat = self.cx.scene.is_flat(at.primitive);
                    cone.scattered(at.distance, path.bsdf_pdf, is_flat)
                });
                let behind = if self.split_queue.paths.is_empty() {
                    &mut self.queue
                } else {
                    &mut self.split_queue
                };
                behind.put(live as usize, path, ray, cone);
                live += 1;
            }
        }
        live
    }

    /// Samples the BSDF and Russian roulette; returns the continued path, if there is one.
    #[inline(always)]
    fn sample_bsdf(
        &self,
        surface: &ShadingPoint,
        bounces: u32,
        (u, v): ([f32; 3], f32),
        observer: &mut W,
    ) -> Option<(PathState, Ray)> {
        let settings = self.cx.settings;
        let scattered = surface.bsdf.sample(u)?;
        let mut next = PathState {
            beta: surface.beta * scattered.weight,
            eta_scale: surface.eta_scale * scattered.eta_scale,
            origin: surface.light_sample_context(),
            bsdf_pdf: scattered.pdf,
            camera_transmittance: transmittance_after(
                surface.camera_transmittance,
                &surface.bsdf,
                scattered.wi,
            ),
            start: surface.start,
            target: surface.target,
        };
        let finds_nothing =
            bounces >= self.max_depth && !self.estimator.counts_emission(settings, next.bsdf_pdf);
        if next.beta.is_black() || finds_nothing {
            return None;
        }
        let survival = self.estimator.rr_survival_probability(settings, &next, bounces);
        if let Some(q) = survival {
            if v >= q {
                return None;
            }
            next.beta *= 1.0 / q;
            next.camera_transmittance *= 1.0 / q;
        }
        observer.on_scatter(surface.start, || ScatterSample::new(&scattered, survival));
        Some((next, surface.point.spawn(scattered.wi)))
    }
}
