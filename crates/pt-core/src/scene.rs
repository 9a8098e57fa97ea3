//! The compiled scene: flat, immutable tables that backends read.

use pt_bvh::{Bvh, Hit};
use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, DVec3, Pdf, Ray, SolidAngle, Spectrum, Vec3, ray};

use crate::bsdf::{Bsdf, LobeRecord, LobeTables, emitted_through};
use crate::camera::Camera;
use crate::camera_motion::CameraMotion;
use crate::footprint::Footprint;
use crate::id::{Id, Table};
use crate::instances::InstanceTable;
use crate::light::{AnimatedLight, AnyLight, LightHit, LightSample, LightSourceIds, LightTables};
use crate::material::{EvaluatedMaterial, Material, Materials};
use crate::medium::{Media, MediumRecord};
use crate::meter::Meter;
use crate::shapes::{ShapePoint, ShapeTables};
use crate::texture::{FloatTexture, TextureRecord};
use crate::wedge;

/// How a part of a shape scatters and glows.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceRecord {
    /// Its scattering, unless `material` says it.
    pub lobe: Id<LobeRecord>,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// What makes its scattering differ from point to point, if something does.
    pub material: Option<Id<Material>>,
    /// Share of it that is there; `None` is all.
    pub opacity: Option<FloatTexture>,
    /// True if rays that come to its back go on as if it were not there.
    pub cull_backfaces: bool,
    /// Which sides glow.
    pub emissive_sides: EmissiveSides,
    /// Radiance emitted; 1 where a texture says it.
    pub emission: Spectrum,
    /// The texture that says it.
    pub emission_texture: Option<Id<TextureRecord>>,
    /// The share of the surface that is under a clear coat, which weakens what it emits; see
    /// [`emitted_through`].
    pub emission_coat: f32,
    /// The light by which the emission is sampled; `None` if it is only found by chance.
    pub light: Option<Id<AnyLight>>,
}

/// Which sides of a surface emit light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissiveSides {
    /// The side of the normal.
    Front,
    /// The other side.
    Back,
    /// Both sides.
    Both,
}

/// Everything a renderer reads. Made by [`crate::compile()`], never edited.
#[expect(
    clippy::struct_excessive_bools,
    reason = "they are options that are independent of each other"
)]
pub struct RenderScene {
    /// True if rays leave triangles with normals at their corners from the round shape that these
    /// belong to, and light is held to the plane across the shading normal there.
    pub smooth_shadows: bool,
    /// See [`pt_scene::RenderHints::sides_by_shading_normal`].
    pub sides_by_shading_normal: bool,
    /// All that is not placed, in world coordinates.
    pub shapes: ShapeTables,
    /// What is placed in the world, and may move; `None` if nothing is.
    pub instances: Option<Box<InstanceTable>>,
    /// True if [`Interaction::normal`] is the plain interpolation of normals at corners, which is
    /// shorter than 1 between different ones: what the university course's program shows.
    pub unnormalized_shading_normals: bool,
    /// Numbers of triangles and of spheres of all objects up to each.
    pub object_ends: Vec<[u32; 2]>,
    /// Surfaces.
    pub surfaces: Table<SurfaceRecord>,
    /// Of each surface the number of its material in the scene that was compiled, if it has one.
    pub surface_materials: Vec<Option<u32>>,
    /// Scattering lobes.
    pub lobes: Table<LobeRecord>,
    /// Tables that lobes refer to.
    pub lobe_tables: LobeTables,
    /// Materials that vary, with their textures.
    pub materials: Materials,
    /// True if light goes through some surfaces as if they were not there.
    pub has_alpha: bool,
    /// Lights.
    pub lights: Table<AnyLight>,
    /// Number of lights there were before some of them became one of many; a glowing mesh is one.
    pub light_count: usize,
    /// What they were made of; see [`Self::light_source_ids`].
    pub light_origins: LightSourceIds,
    /// Lights that are seen by rays that leave the scene.
    pub infinite_lights: Vec<Id<AnyLight>>,
    /// Tables that lights refer to.
    pub light_tables: LightTables,
    /// What fills the space between surfaces.
    pub media: Media,
    /// The camera, where it is when the shutter opens.
    pub camera: Camera,
    /// The measurement in place of the camera's picture, if there is one.
    pub meter: Option<Meter>,
    /// How the camera moves, if it does.
    pub camera_motion: Option<CameraMotion>,
    /// The ray queries of what is not placed.
    pub bvh: Bvh,
}

/// Where a primitive belongs in the scene that was compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveRef {
    /// The number of its object; see [`RenderScene::object`].
    pub object: u32,
    /// Its number among the triangles of the object, or among its spheres.
    pub index: u32,
    /// True if it is a sphere.
    pub is_sphere: bool,
}

/// A point on a surface that rays leave.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Where.
    pub p: Vec3,
    /// Unit normal of the true surface.
    pub normal: Vec3,
    /// Along which unit vector rays start from `p`, and on which side of the surface: `normal`, or
    /// the shading normal where shadows are smooth.
    pub along: Vec3,
    /// How far along `along`, and against it, rays start from `p`, which is not exact: see
    /// [`pt_math::ray::offset`].
    pub offsets: [f32; 2],
}

/// Where rays end that ask whether something is in the way.
const SHADOW_EPSILON: f32 = 1.0 - 1.0 / 16384.0;

impl SurfacePoint {
    /// A point that is on no surface: rays leave it where it is.
    #[inline]
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::Z, along: Vec3::Z, offsets: [0.0; 2] }
    }

    /// A point that is known to the rounding of double precision, of a surface with a unit normal.
    #[inline(always)]
    pub(crate) fn on(p: DVec3, normal: Vec3) -> Self {
        let p = p.as_vec3();
        Self::off(p, normal, ray::offset(p, p.abs() * EPSILON, normal))
    }

    /// A point of a surface with a unit normal, which rays leave at this distance.
    #[inline(always)]
    pub(crate) fn off(p: Vec3, normal: Vec3, offset: f32) -> Self {
        Self { p, normal, along: normal, offsets: [offset; 2] }
    }

    /// The same where rays begin so much farther off.
    #[inline(always)]
    pub(crate) fn raised(self, margin: f32) -> Self {
        Self { offsets: self.offsets.map(|offset| offset + margin), ..self }
    }

    /// How far from the true point rays begin at most, by the offset and by rounding twice.
    #[inline(always)]
    pub(crate) fn reach(&self) -> f32 {
        self.offsets[0] + self.p.abs().element_sum() * (2.0 * EPSILON)
    }

    /// The origins of rays that leave the point on either side.
    pub(crate) fn origins(&self) -> [DVec3; 2] {
        [self.along, -self.along].map(|w| self.origin(w).as_dvec3())
    }

    /// The origin of a ray from here in direction `w`.
    #[inline(always)]
    fn origin(&self, w: Vec3) -> Vec3 {
        let [front, back] = self.offsets;
        self.p + self.along * if w.dot(self.along).is_sign_negative() { -back } else { front }
    }

    /// A ray from here in the unit direction `w`.
    #[inline(always)]
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.origin(w), w)
    }

    /// The ray that asks whether something is in the way of a light, and hits neither this
    /// surface nor the light.
    ///
    /// It ends a little before the light: where coordinates of the light vanish, so does the error
    /// by which `end` is moved off it, but not that of the depth in which a query finds it.
    /// That is 14ε of the most distant vertex, so it suffices for triangles 70 times as large
    /// as they are far away.
    #[inline(always)]
    pub fn spawn_to(&self, light: &LightSample) -> Ray {
        let origin = self.origin(light.wi);
        match light.end {
            None => Ray::new(origin, light.wi),
            Some(end) => Ray::to(origin, end - origin, SHADOW_EPSILON),
        }
    }

    /// The ray that asks whether something is between this point and another one, which is in the
    /// unit direction `w`, and hits neither surface.
    #[inline(always)]
    pub fn spawn_at(&self, other: &Self, w: Vec3) -> Ray {
        let origin = self.origin(w);
        Ray::to(origin, other.origin(-w) - origin, SHADOW_EPSILON)
    }
}

/// A point on a surface, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Where; its normal is on the side of `normal`.
    pub point: SurfacePoint,
    /// Shading normal; of unit length unless [`RenderScene::unnormalized_shading_normals`].
    pub normal: Vec3,
    /// Unit direction towards where it is seen from.
    pub wo: Vec3,
    /// Distance from there.
    pub distance: f32,
    /// The surface.
    pub surface: Id<SurfaceRecord>,
    /// The primitive.
    pub primitive: u32,
}

impl RenderScene {
    /// The medium beyond a surface that a ray, which came through `current`, hits and goes through.
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

    /// The box around all shapes, at all times.
    pub fn bounds(&self) -> Bounds3 {
        let instances =
            self.instances.as_ref().map_or(Bounds3::EMPTY, |instances| instances.bounds());
        self.bvh.bounds().union(instances)
    }

    /// Returns the number of triangles and spheres; those of objects that are placed count once.
    pub fn shape_counts(&self) -> [usize; 2] {
        let instances = self.instances.iter().flat_map(|instances| instances.objects());
        let tables = std::iter::once(&self.shapes).chain(instances.map(|object| &object.shapes));
        let counts = tables.map(|tables| [tables.triangles.len(), tables.spheres.len()]);
        counts.fold([0; 2], |sum, count| [sum[0] + count[0], sum[1] + count[1]])
    }

    /// Returns the number of instances, which are not copied into the world.
    pub fn instance_count(&self) -> usize {
        self.instances.as_ref().map_or(0, |instances| instances.instances().len())
    }

    /// Returns true if anything moves while the shutter is open, so that rays need a time: a share,
    /// from 0 to 1, of the time for which it is.
    #[inline]
    pub fn is_animated(&self) -> bool {
        self.camera_motion.is_some()
            || self.instances.as_ref().is_some_and(|instances| instances.moves())
    }

    /// Weight of the light of each camera ray: 1, but for a meter [`Meter::importance`].
    #[inline]
    pub fn importance(&self) -> f32 {
        self.meter.as_ref().map_or(1.0, Meter::importance)
    }

    /// The camera at a time.
    pub fn camera_at(&self, time: f32) -> Camera {
        let moved = self.camera_motion.as_ref().map(|motion| motion.at(&self.camera, time));
        moved.unwrap_or(self.camera)
    }

    /// What is asked of placed objects, for the number of a primitive that is one of theirs.
    ///
    /// # Panics
    /// If there are none.
    #[inline]
    pub(crate) fn with_instances<T>(&self, ask: impl FnOnce(&InstanceTable) -> T) -> T {
        ask(self.instances.as_ref().expect("primitives beyond all others are placed"))
    }

    /// The number of the object that a primitive belongs to; that of primitives that lights bring
    /// with them is the number of objects.
    pub fn object(&self, primitive: u32) -> u32 {
        self.locate_primitive(primitive).object
    }

    /// Where a primitive belongs.
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

    /// The surface point where a ray of unit direction met a primitive, at a time; see
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

    /// The lights on shapes that move, which are not among [`Self::lights`].
    #[inline]
    pub fn animated_lights(&self) -> &[AnimatedLight] {
        self.instances.as_ref().map_or(&[], |instances| instances.lights())
    }

    /// A sample of one of these at a time, as [`crate::light::Light::sample`] gives them.
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

    /// The one of these that a ray from `p` found at a time, if it did, and the density with which
    /// light sampling would have found it.
    pub fn animated_light(
        &self,
        at: &Interaction,
        time: f32,
        p: Vec3,
    ) -> Option<(&AnyLight, Pdf<SolidAngle>)> {
        self.instances.as_ref()?.light_pdf(&self.light_tables, time, p, at)
    }

    /// What the lights need to know of a light that was hit.
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

    /// The scattering at a point of a surface, which is what [`Self::evaluate_material`] says, or
    /// the same everywhere.
    #[inline(always)]
    pub fn bsdf<'a>(
        &'a self,
        at: &Interaction,
        resolved: Option<&'a EvaluatedMaterial>,
    ) -> Bsdf<'a> {
        let tables = &self.lobe_tables;
        let normal = self.side_normal(at);
        let bsdf = if let Some(EvaluatedMaterial { lobe, two_sided, orientation }) = resolved {
            Bsdf::oriented(lobe, tables, *two_sided, *orientation, normal, at.wo)
        } else {
            let surface = &self.surfaces[at.surface];
            let lobe = &self.lobes[surface.lobe];
            Bsdf::new(lobe, tables, surface.two_sided, self.unit_normal(at), normal, at.wo)
        };
        if self.smooth_shadows { bsdf.held_to(at.point.along) } else { bsdf }
    }

    /// Evaluates the textures of a surface at a point, at the time of its ray; `None` if the
    /// surface is constant. `choice`, from 0 to less than 1, chooses among the components of
    /// mixtures; `width` is the diameter of the ray's cone there, in metres, if it has one.
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

    /// The share of the surface that is there, where a ray met it.
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

    /// The normal that divides the front of a surface from its back.
    #[inline(always)]
    fn side_normal(&self, at: &Interaction) -> Vec3 {
        if self.sides_by_shading_normal { self.unit_normal(at) } else { at.point.normal }
    }

    #[inline(always)]
    fn unit_normal(&self, at: &Interaction) -> Vec3 {
        if self.unnormalized_shading_normals { at.normal.normalize() } else { at.normal }
    }

    /// The surface of a primitive.
    #[inline(always)]
    fn surface(&self, primitive: u32) -> Id<SurfaceRecord> {
        match self.shapes.primitive_surface.get(primitive as usize) {
            Some(surface) => *surface,
            None => self.with_instances(|instances| instances.surface(primitive)),
        }
    }

    /// Returns true if the primitive that was hit emits light on a side of it.
    #[inline(always)]
    pub fn is_emissive(&self, hit: &Hit) -> bool {
        let surface = self.surface(hit.primitive);
        !self.surfaces[surface].emission.is_black()
    }

    /// Radiance that the surface emits towards `at.wo`, where it was hit.
    #[inline(always)]
    pub fn le(&self, at: &Interaction, hit: &Hit, time: f32) -> Spectrum {
        let surface = &self.surfaces[at.surface];
        if surface.emission.is_black() {
            return Spectrum::ZERO;
        }
        let front = at.wo.dot(at.point.normal) > 0.0;
        let glows = match surface.emissive_sides {
            EmissiveSides::Front => front,
            EmissiveSides::Back => !front,
            EmissiveSides::Both => true,
        };
        let radiance = match surface.emission_texture {
            _ if !glows => Spectrum::ZERO,
            None => surface.emission,
            Some(texture) => self.radiance(texture, at, hit, time),
        };
        if surface.emission_coat > 0.0 {
            let cos = at.wo.dot(at.point.normal).abs();
            return radiance * emitted_through(surface.emission_coat, cos);
        }
        radiance
    }

    /// That of a texture.
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

    /// Radiance from these lights of the sky along a ray that leaves `p` in direction `d`, and the
    /// scene.
    #[inline(always)]
    pub fn le_infinite(&self, p: Vec3, d: Vec3, infinite_lights: &[Id<AnyLight>]) -> Spectrum {
        let radiance = |&id| self.lights[id].le_infinite(&self.light_tables, p, d);
        infinite_lights.iter().map(radiance).sum()
    }
}
