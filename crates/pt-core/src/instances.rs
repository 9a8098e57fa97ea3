//! Objects in coordinates of their own, which are placed in the world, some more than once, and
//! some so that they move while the shutter is open: the upper level of two, by which rays find
//! them.
//!
//! Primitives of placed objects are numbered after all others, placement by placement, so that a
//! [`Hit`] says where it is, and the same primitive has another number in each place.

use std::sync::Arc;

use pt_bvh::{AnimatedBvh, AnimatedInstance, Bvh, Hit, InstanceHit};
use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, DVec3, Pdf, Ray, SolidAngle, Vec3, ray};

use crate::id::Id;
use crate::light::{AnimatedLight, AnyLight, LightSample, LightTables};
use crate::scene::{Interaction, PrimitiveRef, SurfacePoint, SurfaceRecord};
use crate::shapes::{ShapePoint, ShapeTables};
use crate::texture_eval_context::TextureEvalContext;
use crate::wedge;

/// An object in coordinates of its own.
#[derive(Debug)]
pub struct InstancedObject {
    /// Its triangles and spheres.
    pub shapes: ShapeTables,
    /// Their ray queries.
    pub bvh: Arc<Bvh>,
    /// The numbers that its first triangle and its first sphere have among those with colours.
    pub first_colored: [u32; 2],
}

/// Where an object is placed.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index of the object.
    pub object: u32,
    /// Number of primitives of the instances before.
    pub before: u32,
    /// Number of the object in the scene that it was.
    pub number: u32,
}

/// All of them. Times are shares of the time for which the shutter is open.
#[derive(Debug)]
pub struct InstanceTable {
    objects: Vec<InstancedObject>,
    instances: Vec<Instance>,
    /// The placements.
    bvh: AnimatedBvh,
    /// The number of their first primitive.
    first: u32,
    moves: bool,
    /// In the order of their placements.
    lights: Vec<AnimatedLight>,
}

impl InstanceTable {
    /// Objects with their placements and the lights on these, in their order; `bvh` has as many
    /// instances, and `first` is the number of primitives of the scene that are not placed.
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

    /// The lights that are sampled where they are at the time of a path.
    pub fn lights(&self) -> &[AnimatedLight] {
        &self.lights
    }

    /// A sample of one of them at a time; see [`crate::light::Light::sample`].
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

    /// The light that was hit from `p` at a time, if it is one of them, and the density with which
    /// it is sampled.
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

    /// The objects.
    pub fn objects(&self) -> &[InstancedObject] {
        &self.objects
    }

    /// Where they are placed.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Returns true if some of them move.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// The box around each placement at all times.
    pub fn boxes(&self) -> impl Iterator<Item = Bounds3> {
        self.bvh.instances().iter().map(AnimatedInstance::bounds)
    }

    /// The box around all of them at all times.
    pub fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    /// The nearest hit at a time.
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

    /// The number of the placement of a primitive, and of the primitive in its object.
    fn locate(&self, primitive: u32) -> (usize, u32) {
        let primitive = primitive - self.first;
        let place = self.instances.partition_point(|p| p.before <= primitive) - 1;
        (place, primitive - self.instances[place].before)
    }

    /// The object of a primitive, and its number in that.
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

    /// The surface of a primitive.
    #[cold]
    pub(crate) fn surface(&self, primitive: u32) -> Id<SurfaceRecord> {
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
            // In the object, the origins of rays that leave are rounded too.
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
