//! Objects that keep their own coordinates: those that move, and large meshes with several
//! instances.

use std::collections::HashMap;
use std::sync::Arc;

use pt_bvh::{AnimatedBvh, AnimatedInstance, MotionKey};
use pt_math::DAffine3;
use pt_scene::Notes;
use pt_scene::Object;

use super::collector::Collector;
use super::reuse::Earlier;
use super::shapes::{Emitter, Shapes};
use super::{CompileError, CompileOptions, bvh_of};
use crate::compile::instance_choice::{InstanceKey, instance_key};
use crate::compile::shapes::{InstancedShapes, ObjectShapes};
use crate::instances::{Instance, InstanceTable, InstancedObject};
use crate::light::{AnimatedLight, AnyLight};

/// Maximum number of lights on instances that are sampled, one by one; of more, paths find the
/// visible ones by chance.
pub(super) const MAX_MOVING_LIGHTS: usize = 16;

/// Objects by their number in the scene, with their transforms over time.
pub(super) type Tracks = Vec<(usize, Vec<MotionKey>)>;

impl InstancedShapes {
    /// Collects instanced objects, whose primitives follow all others.
    pub(super) fn collect(
        collector: &mut Collector,
        tracks: Tracks,
        options: (&CompileOptions, Option<&Earlier>),
        notes: &mut Notes,
    ) -> Result<Self, CompileError> {
        let mut instances = Self::default();
        let mut known: HashMap<InstanceKey, u32> = HashMap::new();
        let (mut before, mut first_colored) = (0u64, collector.shapes.counts());
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
                instances.numbers.push(number);
                let index = instances.objects.len() as u32 - 1;
                key.map(|key| known.insert(key, index));
                index
            };
            let bvh = Arc::clone(&instances.objects[index as usize].bvh);
            let primitives = bvh.primitives() as u64;
            let refuse = |message| CompileError::Value { at: object.at.clone(), message };
            let instance = AnimatedInstance::new(bvh, knots)
                .map_err(|error| refuse(format!("the shape cannot be instanced: {error}")))?;
            instances.moving.push(instance);
            let placement =
                Instance { object: index, before: before as u32, number: number as u32 };
            instances.instances.push(placement);
            before += primitives;
            if before > u64::from(u32::MAX / 2) {
                let message = "more than 2^31 instances of shapes; use fewer instances";
                return Err(refuse(message.to_owned()));
            }
        }
        Ok(instances)
    }

    /// Collects the shapes of one object, in its own coordinates.
    fn add(
        &mut self,
        collector: &mut Collector,
        object: &Object,
        first_colored: [usize; 2],
        (options, earlier): (&CompileOptions, Option<&Earlier>),
        notes: &mut Notes,
    ) -> Result<ObjectShapes, CompileError> {
        let mut own = Shapes { first_colored, ..Shapes::default() };
        let uses_coordinates = collector.uses_coordinates;
        let known = earlier.and_then(|e| e.placed(object, options.bvh, uses_coordinates));
        if let Some((arrays, _)) = known {
            (own.arrays, own.are_kept) = (Arc::clone(arrays), true);
        }
        collector.shapes.exchange(&mut own);
        let added = collector.add(object, DAffine3::IDENTITY, notes);
        collector.shapes.exchange(&mut own);
        added?;
        let bvh = match known {
            Some((_, bvh)) => Arc::clone(bvh),
            None => bvh_of(&own.arrays, options)?,
        };
        self.skipped += bvh.skipped();
        self.out_of_range += if bvh.skipped() > 0 { own.out_of_range() } else { 0 };
        Ok(ObjectShapes { shapes: own, bvh, lights: Vec::new() })
    }

    /// Returns the number of animated instances.
    pub(super) fn moving(&self) -> usize {
        self.moving.iter().filter(|instance| instance.moves()).count()
    }

    /// Returns true if any instanced object emits light.
    pub(super) fn emits(&self) -> bool {
        self.objects.iter().any(|own| !own.shapes.emitters.is_empty())
    }

    /// Creates lights for the emitters of instances, and returns their number. If there are more
    /// than [`MAX_MOVING_LIGHTS`], only invisible ones are sampled. `light` creates the light of an
    /// emitter of the given shapes.
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
            // Paths cannot find invisible lights by chance.
            self.lights.retain(|moving| moving.light.is_invisible());
        }
        count
    }

    /// Builds the table for queries, whose primitives follow the `first` others; `None` without
    /// instances.
    pub(super) fn finish(self, first: usize) -> Result<Option<Arc<InstanceTable>>, CompileError> {
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
        Ok(Some(Arc::new(instances)))
    }
}
