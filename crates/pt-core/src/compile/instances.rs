//! Objects that stay in coordinates of their own: those that move, and large meshes that are placed
//! more than once.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::Arc;

use pt_bvh::{AnimatedBvh, AnimatedInstance, BuildOptions, Bvh, MotionKey};
use pt_math::DAffine3;
use pt_scene::{Geometry, Object, Scene, Sides};

use super::geometry::{Collector, Emitter, Shapes};
use super::{CompileError, build_bvh};
use crate::id::Id;
use crate::instances::{Instance, InstanceTable, InstancedObject};
use crate::light::{AnimatedLight, AnyLight};
use crate::scene::SurfaceRecord;

/// The default of [`super::CompileOptions::most_copied_triangles`].
pub const MAX_FLATTENED_TRIANGLES: usize = 1 << 21;

/// Lights on what moves are sampled one by one; if they are more, paths find them by chance.
pub(super) const MAX_MOVING_LIGHTS: usize = 16;

/// Objects with the numbers that they have in the scene, and where they are.
pub(super) type Tracks = Vec<(usize, Vec<MotionKey>)>;

/// The identity of an object but for its place: the mesh or the points, by their address, the
/// radius of these, the materials, and the media.
type InstanceKey = (usize, Option<u64>, Vec<Option<u32>>, Option<Sides>);

fn instance_key(object: &Object) -> Option<InstanceKey> {
    let (address, radius) = match &object.geometry {
        Geometry::Mesh(mesh) => (Arc::as_ptr(mesh).addr(), None),
        Geometry::Points { points, radius } => (Arc::as_ptr(points).addr(), *radius),
        Geometry::Sphere { .. } => return None,
    };
    let radius = radius.map(f64::to_bits);
    Some((address, radius, object.materials.clone(), object.media))
}

/// The number of its triangles and spheres.
fn primitives(object: &Object) -> usize {
    match &object.geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Points { points, .. } => points.positions.len() + points.triangles(),
        Geometry::Sphere { .. } => 1,
    }
}

/// Which objects are worth keeping once: those of the meshes with the most triangles of copies,
/// until the copies of all others together have no more than `most`. `may` says which may be.
pub(super) fn choose_instances(
    scene: &Scene,
    most: Option<usize>,
    may: impl Fn(usize, &Object) -> bool,
) -> Vec<bool> {
    let mut places: HashMap<InstanceKey, Vec<usize>> = HashMap::new();
    for (number, object) in scene.objects.iter().enumerate() {
        if let Some(key) = instance_key(object).filter(|_| may(number, object)) {
            places.entry(key).or_default().push(number);
        }
    }
    // Triangles of all copies but the first, and where they are.
    let extra = |numbers: Vec<usize>| {
        (primitives(&scene.objects[numbers[0]]) * (numbers.len() - 1), numbers)
    };
    let mut meshes: Vec<_> = places.into_values().map(extra).collect();
    meshes.sort_by_key(|(extra, numbers)| (Reverse(*extra), numbers[0]));
    let mut left: usize = meshes.iter().map(|(extra, _)| extra).sum();
    let mut shared = vec![false; scene.objects.len()];
    for (extra, numbers) in meshes {
        if left <= most.unwrap_or(MAX_FLATTENED_TRIANGLES) {
            break;
        }
        left -= extra;
        for number in numbers {
            shared[number] = true;
        }
    }
    shared
}

/// An object on its way.
struct ObjectShapes {
    shapes: Shapes,
    bvh: Arc<Bvh>,
    /// Emitters of the object.
    lights: Vec<(Id<SurfaceRecord>, AnyLight)>,
}

/// Placed objects on their way.
#[derive(Default)]
pub(super) struct InstancedShapes {
    objects: Vec<ObjectShapes>,
    instances: Vec<Instance>,
    moving: Vec<AnimatedInstance>,
    lights: Vec<AnimatedLight>,
    /// Shapes that no ray can hit.
    pub(super) skipped: u32,
    /// Those of them that are out of the range of coordinates.
    pub(super) out_of_range: u32,
}

impl InstancedShapes {
    /// Collects the shapes of objects behind all others.
    pub(super) fn collect(
        collector: &mut Collector,
        tracks: Tracks,
        options: BuildOptions,
        notes: &mut Vec<String>,
    ) -> Result<Self, CompileError> {
        let mut instances = Self::default();
        let mut known: HashMap<InstanceKey, u32> = HashMap::new();
        let Shapes { triangles, spheres, .. } = &collector.shapes;
        let (mut before, mut first_colored) = (0u64, [triangles.len(), spheres.len()]);
        for (number, knots) in tracks {
            let object = &collector.scene.objects[number];
            let key = instance_key(object);
            let shared = key.as_ref().and_then(|key| known.get(key)).copied();
            let index = if let Some(index) = shared {
                index
            } else {
                let made = instances.add(collector, object, first_colored, options, notes)?;
                first_colored[0] += made.shapes.triangles.len();
                first_colored[1] += made.shapes.spheres.len();
                instances.objects.push(made);
                let index = instances.objects.len() as u32 - 1;
                key.map(|key| known.insert(key, index));
                index
            };
            let bvh = Arc::clone(&instances.objects[index as usize].bvh);
            let primitives = bvh.primitives() as u64;
            let refuse = |message| CompileError::Value { at: object.at.clone(), message };
            let instance = AnimatedInstance::new(bvh, knots)
                .map_err(|error| refuse(format!("the shape cannot be placed: {error}")))?;
            instances.moving.push(instance);
            let placement =
                Instance { object: index, before: before as u32, number: number as u32 };
            instances.instances.push(placement);
            before += primitives;
            if before > u64::from(u32::MAX / 2) {
                let message =
                    "with this one, more than 2^31 shapes are placed; use fewer instances";
                return Err(refuse(message.to_owned()));
            }
        }
        Ok(instances)
    }

    /// The shapes of one object, in its own coordinates.
    fn add(
        &mut self,
        collector: &mut Collector,
        object: &Object,
        first_colored: [usize; 2],
        options: BuildOptions,
        notes: &mut Vec<String>,
    ) -> Result<ObjectShapes, CompileError> {
        let mut own = Shapes { first_colored, ..Shapes::default() };
        collector.shapes.exchange(&mut own);
        let added = collector.add(object, DAffine3::IDENTITY, notes);
        collector.shapes.exchange(&mut own);
        added?;
        let bvh = build_bvh(&own, options)?;
        self.skipped += bvh.skipped();
        self.out_of_range += if bvh.skipped() > 0 { own.out_of_range() } else { 0 };
        Ok(ObjectShapes { shapes: own, bvh: Arc::new(bvh), lights: Vec::new() })
    }

    /// Returns the number of animated instances.
    pub(super) fn moving(&self) -> usize {
        self.moving.iter().filter(|instance| instance.moves()).count()
    }

    /// Returns true if some of what moves glows.
    pub(super) fn glow(&self) -> bool {
        self.objects.iter().any(|own| !own.shapes.emitters.is_empty())
    }

    /// Makes lights of what glows, which are sampled if they are few; says how many they are.
    /// `light` makes one of an emitter of the shapes that it is given.
    pub(super) fn add_lights(
        &mut self,
        shapes: &mut Shapes,
        mut light: impl FnMut(&Shapes, &Emitter) -> Option<AnyLight>,
    ) -> usize {
        for own in &mut self.objects {
            shapes.exchange(&mut own.shapes);
            let made = |emitter: &Emitter| Some((emitter.surface, light(shapes, emitter)?));
            own.lights = shapes.emitters.iter().filter_map(made).collect();
            shapes.exchange(&mut own.shapes);
        }
        for (placement, place) in (0..).zip(&self.instances) {
            let made = &self.objects[place.object as usize].lights;
            let animated = |&(surface, light)| AnimatedLight { placement, surface, light };
            self.lights.extend(made.iter().map(animated));
        }
        let count = self.lights.len();
        if count > MAX_MOVING_LIGHTS {
            // Nothing finds those that nobody sees by chance.
            self.lights.retain(|moving| moving.light.is_invisible());
        }
        count
    }

    /// Ready for queries, behind `first` primitives that are not placed; `None` if there are none.
    pub(super) fn finish(self, first: usize) -> Result<Option<Box<InstanceTable>>, CompileError> {
        if self.instances.is_empty() {
            return Ok(None);
        }
        let bvh = AnimatedBvh::build(self.moving)?;
        let object = |own: ObjectShapes| InstancedObject {
            bvh: own.bvh,
            first_colored: own.shapes.first_colored.map(|count| count as u32),
            shapes: own.shapes.into_tables(),
        };
        let objects = self.objects.into_iter().map(object).collect();
        let instances = InstanceTable::new(objects, self.instances, self.lights, bvh, first as u32);
        Ok(Some(Box::new(instances)))
    }
}
