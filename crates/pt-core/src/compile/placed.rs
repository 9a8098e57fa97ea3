//! Objects that stay in coordinates of their own: those that move, and large meshes that are placed
//! more than once.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::Arc;

use pt_bvh::{BuildOptions, Knot, MovingBvh, MovingInstance};
use pt_math::{Bounds3, DAffine3};
use pt_scene::{Geometry, Object, Scene, Sides};

use super::geometry::{Collector, Shapes};
use super::{CompileError, build_bvh};
use crate::placed::{Placed, PlacedObject, Placement};

/// See [`super::CompileOptions::most_copied_triangles`].
const MOST_COPIED: usize = 1 << 21;

/// Objects with the numbers that they have in the scene, and where they are.
pub(super) type Tracks = Vec<(usize, Vec<Knot>)>;

/// What tells whether two objects are the same but for their place: the mesh, by its address, the
/// materials, and the media.
type Likeness = (usize, Vec<Option<u32>>, Option<Sides>);

fn likeness(object: &Object) -> Option<Likeness> {
    let Geometry::Mesh(mesh) = &object.geometry else { return None };
    Some((Arc::as_ptr(mesh) as usize, object.materials.clone(), object.media))
}

fn triangles(object: &Object) -> usize {
    match &object.geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Sphere { .. } => 0,
    }
}

/// Which objects are worth keeping once: those of the meshes with the most triangles of copies, until
/// the copies of all others together have no more than `most`. `may` says which may be.
pub(super) fn worth_sharing(
    scene: &Scene,
    most: Option<usize>,
    may: impl Fn(usize, &Object) -> bool,
) -> Vec<bool> {
    let mut places: HashMap<Likeness, Vec<usize>> = HashMap::new();
    for (number, object) in scene.objects.iter().enumerate() {
        if let Some(likeness) = likeness(object).filter(|_| may(number, object)) {
            places.entry(likeness).or_default().push(number);
        }
    }
    // Triangles of all copies but the first, and where they are.
    let extra = |numbers: Vec<usize>| {
        (triangles(&scene.objects[numbers[0]]) * (numbers.len() - 1), numbers)
    };
    let mut meshes: Vec<_> = places.into_values().map(extra).collect();
    meshes.sort_by_key(|(extra, numbers)| (Reverse(*extra), numbers[0]));
    let mut left: usize = meshes.iter().map(|(extra, _)| extra).sum();
    let mut shared = vec![false; scene.objects.len()];
    for (extra, numbers) in meshes {
        if left <= most.unwrap_or(MOST_COPIED) {
            break;
        }
        left -= extra;
        for number in numbers {
            shared[number] = true;
        }
    }
    shared
}

/// Placed objects on their way.
#[derive(Default)]
pub(super) struct PlacedShapes {
    objects: Vec<PlacedObject>,
    placements: Vec<Placement>,
    instances: Vec<MovingInstance>,
    /// Whether some of what moves glows.
    pub(super) glows: bool,
    /// Shapes that no ray can hit.
    pub(super) skipped: u32,
}

impl PlacedShapes {
    /// Collects the shapes of objects behind all others.
    pub(super) fn collect(
        collector: &mut Collector,
        tracks: Tracks,
        options: BuildOptions,
        notes: &mut Vec<String>,
    ) -> Result<Self, CompileError> {
        let mut placed = Self::default();
        let mut known: HashMap<Likeness, u32> = HashMap::new();
        let (mut before, mut first_colored) = (0u64, collector.shapes.triangles.len() as u32);
        for (number, knots) in tracks {
            let object = &collector.scene.objects[number];
            let likeness = likeness(object);
            let shared = likeness.as_ref().and_then(|likeness| known.get(likeness)).copied();
            let index = if let Some(index) = shared {
                index
            } else {
                let made = placed.add(collector, object, first_colored, options, notes)?;
                first_colored += made.shapes.triangles.len() as u32;
                placed.objects.push(made);
                let index = placed.objects.len() as u32 - 1;
                likeness.map(|likeness| known.insert(likeness, index));
                index
            };
            let bvh = Arc::clone(&placed.objects[index as usize].bvh);
            let primitives = bvh.primitives() as u64;
            let refuse = |message| CompileError::Value { at: object.at.clone(), message };
            let instance = MovingInstance::new(bvh, knots)
                .map_err(|error| refuse(format!("the shape cannot be placed: {error}")))?;
            placed.instances.push(instance);
            let placement =
                Placement { object: index, before: before as u32, number: number as u32 };
            placed.placements.push(placement);
            before += primitives;
            if before > u64::from(u32::MAX / 2) {
                let message =
                    "with this one, more than 2^31 shapes are placed; use fewer instances";
                return Err(refuse(message.to_owned()));
            }
        }
        Ok(placed)
    }

    /// The shapes of one object, in its own coordinates.
    fn add(
        &mut self,
        collector: &mut Collector,
        object: &Object,
        first_colored: u32,
        options: BuildOptions,
        notes: &mut Vec<String>,
    ) -> Result<PlacedObject, CompileError> {
        let mut own = Shapes::default();
        collector.shapes.exchange(&mut own);
        collector.first_colored = first_colored as usize;
        let added = collector.add(object, DAffine3::IDENTITY, notes);
        collector.shapes.exchange(&mut own);
        added?;
        self.glows |= !own.emitters.is_empty();
        let bvh = build_bvh(&own, options)?;
        self.skipped += bvh.skipped();
        Ok(PlacedObject { shapes: own.into_tables(), bvh: Arc::new(bvh), first_colored })
    }

    /// The box around all of them at all times.
    pub(super) fn bounds(&self) -> Bounds3 {
        self.instances.iter().fold(Bounds3::EMPTY, |all, moving| all.union(moving.bounds()))
    }

    /// How many of them move.
    pub(super) fn moving(&self) -> usize {
        self.instances.iter().filter(|instance| instance.moves()).count()
    }

    /// Ready for queries, behind `first` primitives that are not placed; `None` if there are none.
    pub(super) fn finish(self, first: usize) -> Result<Option<Box<Placed>>, CompileError> {
        if self.instances.is_empty() {
            return Ok(None);
        }
        let bvh = MovingBvh::build(self.instances)?;
        let placed = Placed::new(self.objects, self.placements, bvh, first as u32);
        Ok(Some(Box::new(placed)))
    }
}
