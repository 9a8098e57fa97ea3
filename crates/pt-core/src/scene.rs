//! The compiled scene: flat, immutable tables that backends read.

mod footprint;
mod hits;
mod image_motion;
mod light_sources;

pub use hits::HitPoint;

use std::sync::Arc;

use pt_bvh::{Bvh, Hit};
use pt_math::{Bounds3, Pdf, Ray, SolidAngle, Spectrum, Vec3};

use crate::bsdf::{Bsdf, LobeContext, LobeRecord, LobeTables, emitted_through};
use crate::camera::Camera;
use crate::camera_motion::CameraMotion;
use crate::footprint::Footprint;
use crate::id::{Id, SurfaceId, SurfaceMarker, Table};
use crate::instances::InstanceTable;
use crate::interaction::{Interaction, PrimitiveRef, SurfacePoint};
use crate::light::{
    AnimatedLight, AnyLight, EscapedRay, LightHit, LightSample, LightSourceIds, LightTables,
};
use crate::material::{EvaluatedMaterial, Materials};
use crate::medium::{Media, MediumRecord};
use crate::meter::Meter;
use crate::shapes::{ShapePoint, ShapeTables};
use crate::surface::{EmissiveSides, SurfaceRecord};
use crate::texture_record::{FloatTexture, TextureRecord};
use crate::wedge;

/// The compiled scene: all data that a renderer reads. Created by [`crate::compile()`] and
/// immutable; clones share large tables.
#[derive(Clone)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "they are options that are independent of each other"
)]
pub struct RenderScene {
    /// True if rays leave triangles with vertex normals from the round shape that the normals
    /// describe, and the shading normal decides there from which side light comes.
    pub smooth_shadows: bool,
    /// See [`pt_scene::RenderHints::sides_by_shading_normal`].
    pub sides_by_shading_normal: bool,
    /// Shapes that are not instanced, in world coordinates.
    pub shapes: ShapeTables,
    /// Instances, which may move; `None` if there are none.
    pub instances: Option<Arc<InstanceTable>>,
    /// True if [`Interaction::normal`] is interpolated without normalisation, so that its length
    /// is below 1 between different vertex normals.
    pub unnormalized_shading_normals: bool,
    /// Cumulative numbers of triangles and spheres, up to and including each object.
    pub object_ends: Vec<[u32; 2]>,
    /// Surfaces.
    pub surfaces: Table<SurfaceRecord, SurfaceMarker>,
    /// Index of the material of each surface in the source scene, if it has one.
    pub surface_materials: Vec<Option<u32>>,
    /// Scattering lobes.
    pub lobes: Table<LobeRecord>,
    /// Tables referenced by lobes.
    pub lobe_tables: LobeTables,
    /// Materials that vary over surfaces, with their textures.
    pub materials: Materials,
    /// True if rays may pass through some surfaces as if they were not there.
    pub has_alpha: bool,
    /// Lights.
    pub lights: Table<AnyLight>,
    /// Number of lights before lights were combined into trees; an emissive mesh is one light.
    pub light_count: usize,
    /// Sources of the lights; see [`Self::light_source_ids`].
    pub light_origins: LightSourceIds,
    /// Lights at infinity that rays hit when they leave the scene.
    pub infinite_lights: Vec<Id<AnyLight>>,
    /// Tables referenced by lights.
    pub light_tables: Arc<LightTables>,
    /// Participating media.
    pub media: Media,
    /// The camera at the time when the shutter opens.
    pub camera: Camera,
    /// Meter that replaces the image of the camera, if any.
    pub meter: Option<Meter>,
    /// Motion of the camera, or `None` if it is static.
    pub camera_motion: Option<CameraMotion>,
    /// Ray queries of the shapes that are not instanced.
    pub bvh: Arc<Bvh>,
}

impl RenderScene {
    /// Returns the medium behind a surface that a ray, which travelled through `current`, hits and
    /// passes.
    pub fn medium_after_crossing(
        &self,
        ray: &Ray,
        hit: &Hit,
        time: f32,
        current: Option<Id<MediumRecord>>,
    ) -> Option<Id<MediumRecord>> {
        if self.media.is_empty() {
            return None;
        }
        let at = self.interaction(ray, hit, time);
        let outwards = ray.direction.dot(at.point.normal) > 0.0;
        self.media.medium_after_crossing(at.surface, outwards, current)
    }

    /// Returns the bounding box of all shapes at all times.
    pub fn bounds(&self) -> Bounds3 {
        let instances =
            self.instances.as_ref().map_or(Bounds3::EMPTY, |instances| instances.bounds());
        self.bvh.bounds().union(instances)
    }

    /// Returns the numbers of triangles and spheres; those of instanced objects count once.
    pub fn shape_counts(&self) -> [usize; 2] {
        let instances = self.instances.iter().flat_map(|instances| instances.objects());
        let tables = std::iter::once(&self.shapes).chain(instances.map(|object| &object.shapes));
        let counts = tables.map(|tables| [tables.triangles.len(), tables.spheres.len()]);
        counts.fold([0; 2], |sum, count| [sum[0] + count[0], sum[1] + count[1]])
    }

    /// Returns the number of instances that are not flattened into world space.
    pub fn instance_count(&self) -> usize {
        self.instances.as_ref().map_or(0, |instances| instances.instances().len())
    }

    /// Returns true if anything moves while the shutter is open. Rays then need a time, as a
    /// fraction of the shutter interval from 0 to 1.
    #[inline]
    pub fn is_animated(&self) -> bool {
        self.camera_motion.is_some()
            || self.instances.as_ref().is_some_and(|instances| instances.moves())
    }

    /// Weight of the radiance of each camera ray: [`Meter::importance`] for a meter, otherwise 1.
    #[inline]
    pub fn importance(&self) -> f32 {
        self.meter.as_ref().map_or(1.0, Meter::importance)
    }

    /// Returns the camera at a time.
    pub fn camera_at(&self, time: f32) -> Camera {
        let moved = self.camera_motion.as_ref().map(|motion| motion.at(&self.camera, time));
        moved.unwrap_or(self.camera)
    }

    /// Evaluates `ask` for the instances, to which primitives beyond those of `shapes` belong.
    ///
    /// # Panics
    /// If there are no instances.
    #[inline]
    pub(crate) fn with_instances<T>(&self, ask: impl FnOnce(&InstanceTable) -> T) -> T {
        ask(self.instances.as_ref().expect("primitives beyond all others are placed"))
    }

    /// Returns the index of the object of a primitive; the number of objects for the geometry of
    /// light nodes.
    pub fn object(&self, primitive: u32) -> u32 {
        self.locate_primitive(primitive).object
    }

    /// Returns the object of a primitive, and the primitive's index in it.
    pub fn locate_primitive(&self, primitive: u32) -> PrimitiveRef {
        if primitive as usize >= self.shapes.primitive_surface.len() {
            return self.with_instances(|instances| instances.locate_primitive(primitive));
        }
        let sphere = primitive.checked_sub(self.shapes.triangles.len() as u32);
        let (kind, index) = sphere.map_or((0, primitive), |sphere| (1, sphere));
        let object = self.object_ends.partition_point(|end| end[kind] <= index);
        let before = object.checked_sub(1).map_or(0, |last| self.object_ends[last][kind]);
        PrimitiveRef { object: object as u32, index: index - before, is_sphere: sphere.is_some() }
    }

    /// Returns the point at which a ray of unit direction hit a primitive, at a time; see
    /// [`Self::is_animated`].
    #[inline(always)]
    pub fn interaction(&self, ray: &Ray, hit: &Hit, time: f32) -> Interaction {
        let shapes = &self.shapes;
        let primitive = hit.primitive as usize;
        let at = match primitive.checked_sub(shapes.triangles.len()) {
            None => shapes.triangle_point(primitive, hit, self.unnormalized_shading_normals, |n| n),
            Some(sphere) if sphere < shapes.spheres.len() => {
                shapes.sphere_point(sphere, ray, hit.t)
            }
            Some(_) => {
                return self.with_instances(|instances| instances.interaction(ray, hit, time));
            }
        };
        let ShapePoint { mut p, size, to_edge, geometric_normal, normal } = at;
        let mut point = SurfacePoint::on(p, geometric_normal);
        let margin = wedge::margin(size);
        let reach = point.reach() + margin;
        if wedge::may_be_crossed(to_edge, reach) {
            let corners = shapes.corners(primitive);
            let on = |p| SurfacePoint::on(p, geometric_normal).raised(margin);
            let origins = |p| on(p).origins();
            if let Some(moved) = wedge::clear(&self.bvh, hit, corners, reach, origins) {
                (p, point) = (moved, on(moved));
            }
        }
        if self.smooth_shadows
            && let Some(rounded) = shapes.rounded(primitive, hit, p)
        {
            point = rounded.point(point, normal, -ray.direction);
        }
        Interaction {
            point,
            normal,
            wo: -ray.direction,
            distance: hit.t,
            surface: shapes.primitive_surface[primitive],
            primitive: hit.primitive,
        }
    }

    /// Lights on moving shapes, which are not among [`Self::lights`].
    #[inline]
    pub fn animated_lights(&self) -> &[AnimatedLight] {
        self.instances.as_ref().map_or(&[], |instances| instances.lights())
    }

    /// Samples one of the animated lights at a time, as [`crate::light::Light::sample`] does.
    pub fn sample_animated_light(
        &self,
        light: &AnimatedLight,
        time: f32,
        p: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let instances = self.instances.as_ref()?;
        instances.sample_light(light, &self.light_tables, time, p, u)
    }

    /// Returns the animated light that a ray from `p` hit at a time, and the density with which
    /// light sampling finds this point; `None` if it hit no such light.
    pub fn animated_light(
        &self,
        at: &Interaction,
        time: f32,
        p: Vec3,
    ) -> Option<(&AnyLight, Pdf<SolidAngle>)> {
        self.instances.as_ref()?.light_pdf(&self.light_tables, time, p, at)
    }

    /// Returns the data that lights need to compute the density of a point that was hit.
    #[inline(always)]
    pub fn light_hit(&self, at: &Interaction) -> LightHit {
        let corners = self.shapes.triangles.get(at.primitive as usize);
        LightHit {
            distance_squared: at.distance * at.distance,
            cos: at.point.normal.dot(at.wo).abs(),
            triangle: corners.map(|t| t.map(|v| self.shapes.positions[v as usize])),
            primitive: at.primitive,
        }
    }

    /// Returns the scattering at a point of a surface: the result of [`Self::evaluate_material`],
    /// or the constant lobe of the surface.
    #[inline(always)]
    pub fn bsdf<'a>(
        &'a self,
        at: &Interaction,
        resolved: Option<&'a EvaluatedMaterial>,
    ) -> Bsdf<'a> {
        let context = LobeContext { tables: &self.lobe_tables };
        let normal = self.side_normal(at);
        let bsdf = if let Some(EvaluatedMaterial { lobe, two_sided, orientation }) = resolved {
            Bsdf::oriented(lobe, context, *two_sided, *orientation, normal, at.wo)
        } else {
            let surface = &self.surfaces[at.surface];
            let lobe = &self.lobes[surface.lobe];
            Bsdf::new(lobe, context, surface.two_sided, self.unit_normal(at), normal, at.wo)
        };
        if self.smooth_shadows { bsdf.held_to(at.point.along) } else { bsdf }
    }

    /// Evaluates the material of a surface at a point, at the time of its ray; `None` if the
    /// surface has a constant lobe. `choice`, in [0, 1), chooses among the components of mixtures;
    /// `width` is the diameter of the ray's cone there, in metres, if it has one.
    #[inline(always)]
    pub fn evaluate_material(
        &self,
        at: &Interaction,
        hit: &Hit,
        time: f32,
        choice: f32,
        width: Option<f32>,
    ) -> Option<EvaluatedMaterial> {
        let material = self.surfaces[at.surface].material?;
        let mut parametrization = self.texture_eval_context(at, hit, time);
        if let Some(width) = width {
            parametrization.footprint = Footprint::new(at, width);
        }
        let normals = [self.unit_normal(at), self.side_normal(at)];
        let Self { lobes, materials, .. } = self;
        Some(materials.evaluate(lobes, material, at, normals, &parametrization, choice))
    }

    /// Returns the opacity of the surface that a ray hit; 0 for culled back faces.
    #[inline]
    pub fn opacity(&self, ray: &Ray, hit: &Hit, time: f32) -> f32 {
        let surface = &self.surfaces[self.surface(hit.primitive)];
        let is_behind = || {
            let normal = self.interaction(ray, hit, time).point.normal;
            ray.direction.dot(normal) > 0.0
        };
        if surface.cull_backfaces && is_behind() {
            return 0.0;
        }
        match surface.opacity {
            None => 1.0,
            Some(FloatTexture::Value(opacity)) => opacity,
            Some(texture) => {
                let at = self.interaction(ray, hit, time);
                let place = self.texture_eval_context(&at, hit, time);
                self.materials.textures.number(texture, &place).clamp(0.0, 1.0)
            }
        }
    }

    /// Returns the normal that separates the front of a surface from its back.
    #[inline(always)]
    fn side_normal(&self, at: &Interaction) -> Vec3 {
        if self.sides_by_shading_normal { self.unit_normal(at) } else { at.point.normal }
    }

    #[inline(always)]
    fn unit_normal(&self, at: &Interaction) -> Vec3 {
        if self.unnormalized_shading_normals { at.normal.normalize() } else { at.normal }
    }

    /// Returns the surface of a primitive.
    #[inline(always)]
    fn surface(&self, primitive: u32) -> SurfaceId {
        match self.shapes.primitive_surface.get(primitive as usize) {
            Some(surface) => *surface,
            None => self.with_instances(|instances| instances.surface(primitive)),
        }
    }

    /// Returns true if the primitive that was hit emits light on at least one side.
    #[inline(always)]
    pub fn is_emissive(&self, hit: &Hit) -> bool {
        let surface = self.surface(hit.primitive);
        !self.surfaces[surface].emission.is_black()
    }

    /// Lobe of the primitive that was hit, unless its material determines another.
    #[inline(always)]
    pub fn constant_lobe(&self, hit: &Hit) -> Id<LobeRecord> {
        self.surfaces[self.surface(hit.primitive)].lobe
    }

    /// Radiance emitted towards `at.wo` by the surface that was hit.
    #[inline(always)]
    pub fn le(&self, at: &Interaction, hit: &Hit, time: f32) -> Spectrum {
        let surface = &self.surfaces[at.surface];
        if surface.emission.is_black() {
            return Spectrum::ZERO;
        }
        let front = at.wo.dot(at.point.normal) > 0.0;
        let emits = match surface.emissive_sides {
            EmissiveSides::Front => front,
            EmissiveSides::Back => !front,
            EmissiveSides::Both => true,
        };
        let radiance = match surface.emission_texture {
            _ if !emits => Spectrum::ZERO,
            None => surface.emission,
            Some(texture) => self.radiance(texture, at, hit, time),
        };
        if surface.emission_coat > 0.0 {
            let cos = at.wo.dot(at.point.normal).abs();
            return radiance * emitted_through(surface.emission_coat, cos);
        }
        radiance
    }

    /// Radiance of an emission texture.
    #[inline(never)]
    fn radiance(
        &self,
        texture: Id<TextureRecord>,
        at: &Interaction,
        hit: &Hit,
        time: f32,
    ) -> Spectrum {
        self.materials.textures.radiance(texture, &self.texture_eval_context(at, hit, time))
    }

    /// Radiance from these infinite lights along a ray that leaves the scene.
    #[inline(always)]
    pub fn le_infinite(&self, ray: EscapedRay, infinite_lights: &[Id<AnyLight>]) -> Spectrum {
        let radiance = |&id| self.lights[id].le_infinite(&self.light_tables, ray);
        infinite_lights.iter().map(radiance).sum()
    }
}
