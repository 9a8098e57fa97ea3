//! Instances: objects in object space that are placed in the world, some several times, and some
//! moving while the shutter is open. They form the upper level of a two-level hierarchy for ray
//! queries.
//!
//! Primitives of instances are numbered after all others, instance by instance. So a [`Hit`]
//! identifies the instance, and a primitive of an object has a different number in each of its
//! instances.

use std::sync::Arc;

use pt_bvh::{AnimatedBvh, AnimatedInstance, Bvh, Hit, InstanceHit};
use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, DVec3, Pdf, Ray, SolidAngle, Vec3, ray};

use crate::id::SurfaceId;
use crate::interaction::{Interaction, PrimitiveRef, SurfacePoint};
use crate::light::{AnimatedLight, AnyLight, LightSample, LightTables};
use crate::shapes::{ShapePoint, ShapeTables};
use crate::texture_eval_context::TextureEvalContext;
use crate::wedge;

/// An object in object space.
#[derive(Debug)]
pub struct InstancedObject {
    /// Triangles and spheres.
    pub shapes: ShapeTables,
    /// Ray queries of the shapes.
    pub bvh: Arc<Bvh>,
    /// Indices of the first triangle and the first sphere in the tables of per-primitive colours.
    pub first_colored: [u32; 2],
}

/// A placement of an object.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index of the object.
    pub object: u32,
    /// Number of primitives of all preceding instances.
    pub before: u32,
    /// Index of the object in the source scene.
    pub number: u32,
}

/// All instances. Times are fractions of the shutter interval.
#[derive(Debug)]
pub struct InstanceTable {
    objects: Vec<InstancedObject>,
    instances: Vec<Instance>,
    /// Upper level of the hierarchy, with the transforms of the instances.
    bvh: AnimatedBvh,
    /// Number of the first primitive of an instance.
    first: u32,
    moves: bool,
    /// Lights, in the order of their instances.
    lights: Vec<AnimatedLight>,
}

impl InstanceTable {
    /// Creates the table from objects, their instances and the lights on these, in the order of the
    /// instances. `bvh` has as many instances, and `first` is the number of primitives of the scene
    /// that are not instanced.
    pub(crate) fn new(
        objects: Vec<InstancedObject>,
        instances: Vec<Instance>,
        lights: Vec<AnimatedLight>,
        bvh: AnimatedBvh,
        first: u32,
    ) -> Self {
        let moves = bvh.instances().iter().any(AnimatedInstance::moves);
        Self { objects, instances, bvh, first, moves, lights }
    }

    /// Lights on instances, which are sampled at the time of a path.
    pub fn lights(&self) -> &[AnimatedLight] {
        &self.lights
    }

    /// Samples one of the lights at a time; see [`crate::light::Light::sample`].
    pub(crate) fn sample_light(
        &self,
        light: &AnimatedLight,
        tables: &LightTables,
        time: f32,
        p: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let to_world = self.bvh.instances()[light.placement as usize].to_world(time);
        light.sample(&to_world, tables, p, u)
    }

    /// Returns the light that was hit from `p` at a time, and the density with which it is sampled;
    /// `None` if none of the lights was hit.
    pub(crate) fn light_pdf(
        &self,
        tables: &LightTables,
        time: f32,
        p: Vec3,
        at: &Interaction,
    ) -> Option<(&AnyLight, Pdf<SolidAngle>)> {
        let number = at.primitive.checked_sub(self.first)?;
        let (place, primitive) = self.locate(self.first + number);
        let first = self.lights.partition_point(|light| light.placement < place as u32);
        let here = self.lights[first..].iter().take_while(|light| light.placement == place as u32);
        let light = { here }.find(|light| light.surface == at.surface)?;
        let InstancedObject { shapes, first_colored, .. } =
            &self.objects[self.instances[place].object as usize];
        let triangle = shapes.triangles.get(primitive as usize);
        let triangle = triangle.map(|t| t.map(|v| shapes.positions[v as usize]));
        let to_world = self.bvh.instances()[place].to_world(time);
        let of_object = (triangle, first_colored[0] + primitive);
        Some((&light.light, light.pdf(&to_world, tables, p, at, of_object)))
    }

    /// Objects that are instanced.
    pub fn objects(&self) -> &[InstancedObject] {
        &self.objects
    }

    /// Placements of the objects.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Returns true if an instance moves.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// Returns the bounding box of each instance over all times.
    pub fn boxes(&self) -> impl Iterator<Item = Bounds3> {
        self.bvh.instances().iter().map(AnimatedInstance::bounds)
    }

    /// Returns the bounding box of all instances over all times.
    pub fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    /// Returns the nearest hit at a time.
    #[inline]
    pub fn intersect(&self, ray: &Ray, time: f32) -> Option<Hit> {
        self.bvh.intersect(ray, time).map(|hit| self.numbered(hit))
    }

    /// Returns true if anything is hit at a time.
    #[inline]
    pub fn occluded(&self, ray: &Ray, time: f32) -> bool {
        self.bvh.occluded(ray, time)
    }

    /// [`Self::intersect`], which adds the number of primitives tested to `tests`.
    pub fn intersect_counted(&self, ray: &Ray, time: f32, tests: &mut u64) -> Option<Hit> {
        self.bvh.intersect_counted(ray, time, tests).map(|hit| self.numbered(hit))
    }

    /// [`Self::occluded`], which adds the number of primitives tested to `tests`.
    pub fn occluded_counted(&self, ray: &Ray, time: f32, tests: &mut u64) -> bool {
        self.bvh.occluded_counted(ray, time, tests)
    }

    #[inline]
    fn numbered(&self, InstanceHit { instance, hit }: InstanceHit) -> Hit {
        let before = self.instances[instance as usize].before;
        Hit { primitive: self.first + before + hit.primitive, ..hit }
    }

    /// Returns the index of a primitive's instance, and the primitive's index in its object.
    fn locate(&self, primitive: u32) -> (usize, u32) {
        let primitive = primitive - self.first;
        let place = self.instances.partition_point(|p| p.before <= primitive) - 1;
        (place, primitive - self.instances[place].before)
    }

    /// Returns the positions at other times of the point of a primitive that is at `p` at a time.
    pub(crate) fn positions(
        &self,
        p: Vec3,
        primitive: u32,
        time: f32,
        others: [f32; 2],
    ) -> [Vec3; 2] {
        let instance = &self.bvh.instances()[self.locate(primitive).0];
        let in_object = instance.to_world(time).inverse().transform_point3(p.as_dvec3());
        others.map(|other| instance.to_world(other).transform_point3(in_object).as_vec3())
    }

    /// Returns the object of a primitive, and the primitive's index in it.
    fn object_of(&self, primitive: u32) -> (&InstancedObject, usize) {
        let (place, primitive) = self.locate(primitive);
        let object = self.instances[place].object;
        (&self.objects[object as usize], primitive as usize)
    }

    /// See [`crate::RenderScene::locate_primitive`].
    pub(crate) fn locate_primitive(&self, primitive: u32) -> PrimitiveRef {
        let (place, primitive) = self.locate(primitive);
        let Instance { object, number, .. } = self.instances[place];
        let triangles = self.objects[object as usize].shapes.triangles.len() as u32;
        let sphere = primitive.checked_sub(triangles);
        let index = sphere.unwrap_or(primitive);
        PrimitiveRef { object: number, index, is_sphere: sphere.is_some() }
    }

    /// Returns the surface of a primitive.
    #[cold]
    pub(crate) fn surface(&self, primitive: u32) -> SurfaceId {
        let (object, primitive) = self.object_of(primitive);
        object.shapes.primitive_surface[primitive]
    }

    /// See [`crate::RenderScene::is_flat`].
    pub(crate) fn is_flat(&self, primitive: u32) -> bool {
        let (object, primitive) = self.object_of(primitive);
        object.shapes.is_flat(primitive)
    }

    /// See [`crate::RenderScene::interaction`].
    #[cold]
    #[inline(never)]
    pub(crate) fn interaction(&self, ray: &Ray, hit: &Hit, time: f32) -> Interaction {
        let (place, primitive) = self.locate(hit.primitive);
        let instance = &self.bvh.instances()[place];
        let shapes = &self.objects[self.instances[place].object as usize].shapes;
        let primitive = primitive as usize;
        let to_world = instance.to_world(time);
        let to_object = to_world.inverse();
        let to_normal = to_object.matrix3.transpose();
        let turn = |n: Vec3| (to_normal * n.as_dvec3()).normalize_or_zero().as_vec3();
        let there = match primitive.checked_sub(shapes.triangles.len()) {
            None => shapes.triangle_point(primitive, hit, false, turn),
            Some(sphere) => {
                let at = shapes.sphere_point(sphere, &instance.to_object(ray, time), hit.t);
                let normal = turn(at.normal);
                ShapePoint { geometric_normal: normal, normal, ..at }
            }
        };
        let normal = there.geometric_normal;
        let on = |there: DVec3| {
            let p = to_world.transform_point3(there).as_vec3();
            // In object space, the origins of rays that leave the surface are rounded too.
            let rounded = there.abs() * f64::from(2.0 * EPSILON);
            let error = (to_world.matrix3.abs() * rounded).as_vec3() + p.abs() * (2.0 * EPSILON);
            SurfacePoint::off(p, normal, ray::offset(p, error, normal))
        };
        let mut point = on(there.p);
        let scale = to_world.matrix3.col(0).length().max(to_world.matrix3.col(1).length());
        let margin = wedge::margin(there.size) * scale.max(to_world.matrix3.col(2).length()) as f32;
        let raised = |p| on(p).raised(margin);
        let origins = |p| raised(p).origins().map(|origin| to_object.transform_point3(origin));
        let distances = origins(there.p).map(|origin| (origin - there.p).length());
        let reach = distances[0].max(distances[1]) as f32;
        if wedge::may_be_crossed(there.to_edge, reach) {
            let corners = shapes.corners(primitive);
            let hit = Hit { primitive: primitive as u32, ..*hit };
            let moved = wedge::clear(instance.object(), &hit, corners, reach, origins);
            point = moved.map_or(point, raised);
        }
        Interaction {
            point,
            normal: there.normal,
            wo: -ray.direction,
            distance: hit.t,
            surface: shapes.primitive_surface[primitive],
            primitive: hit.primitive,
        }
    }

    /// See [`crate::RenderScene::texture_eval_context`].
    #[cold]
    pub(crate) fn texture_eval_context(&self, p: Vec3, hit: &Hit, time: f32) -> TextureEvalContext {
        let (place, primitive) = self.locate(hit.primitive);
        let InstancedObject { shapes, first_colored, .. } =
            &self.objects[self.instances[place].object as usize];
        let to_world = self.bvh.instances()[place].to_world(time);
        let primitive = primitive as usize;
        let there = match primitive.checked_sub(shapes.triangles.len()) {
            None => shapes.on_triangle(primitive, hit),
            Some(sphere) => {
                let p = to_world.matrix3.inverse() * (p.as_dvec3() - to_world.translation);
                shapes.on_sphere(sphere, p.as_vec3())
            }
        };
        let along = |v: Vec3| (to_world.matrix3 * DVec3::from(v)).as_vec3();
        let mut on_triangle = there.on_triangle;
        if let Some(on_triangle) = &mut on_triangle {
            on_triangle.triangle += first_colored[0];
        }
        let sphere = there.sphere.map(|sphere| sphere + first_colored[1]);
        TextureEvalContext {
            along_u: there.along_u.map(along),
            along_v: there.along_v.map(along),
            on_triangle,
            sphere,
            ..there
        }
    }
}
