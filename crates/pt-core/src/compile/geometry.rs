//! Collects the shapes of a scene: those in world space, and those of instances.

use std::collections::HashMap;
use std::sync::Arc;

use pt_scene::{Notes, Scene};

use super::motion;
use super::reuse::{Earlier, KeptShapes};
use crate::compile::collector::Collector;
use crate::compile::instances::Tracks;
use crate::compile::shapes::{InstancedShapes, Shapes};
use crate::compile::surface::CompiledSurface;
use crate::compile::textures::Lowering;
use crate::compile::{CompileError, CompileOptions};

/// Collects the shapes of a scene, in metres.
pub(super) fn collect(
    scene: &Scene,
    metres: f64,
    shutter: [f64; 2],
    (options, earlier): (&CompileOptions, Option<&Earlier>),
    notes: &mut Notes,
) -> Result<Shapes, CompileError> {
    let mut lowering = Lowering::new(options.policies.surface, metres as f32, earlier);
    let looks = scene.materials.iter().map(|m| CompiledSurface::of(m, &mut lowering)).collect();
    let mut collector = Collector {
        scene,
        policies: options.policies.shapes,
        shapes: Shapes::default(),
        plain: vec![None; scene.materials.len() + 1],
        looks,
        default: CompiledSurface::default_one(&mut lowering),
        uses_coordinates: options.texture_coordinates || lowering.uses_coordinates(),
        mesh_colors: Vec::new(),
        mesh_values: lowering.mesh_values.clone(),
        radii: HashMap::new(),
    };
    collector.note_points(notes);
    let track = |object| motion::track(object, metres, shutter);
    let tracks: Vec<_> = scene.objects.iter().map(track).collect();
    let shared = collector.shared(&tracks, options.most_copied_triangles);
    let is_flat = |(track, shared): (&Vec<_>, &bool)| track.len() == 1 && !shared;
    let flattened: Vec<_> = tracks.iter().zip(&shared).map(is_flat).collect();
    let uses_coordinates = collector.uses_coordinates;
    let same = earlier.and_then(|e| e.flattened(scene, shutter, &flattened, uses_coordinates));
    if let Some(arrays) = same {
        (collector.shapes.arrays, collector.shapes.are_kept) = (Arc::clone(arrays), true);
    }
    let mut placed = Tracks::new();
    for (number, (object, track)) in scene.objects.iter().zip(tracks).enumerate() {
        match track.as_slice() {
            [place] if flattened[number] => collector.add(object, place.to_world, notes)?,
            _ => {
                if track.len() > 1 {
                    motion::check_media(scene, object)?;
                }
                placed.push((number, track));
            }
        }
        let ends = collector.shapes.counts().map(|count| count as u32);
        collector.shapes.object_ends.push(ends);
    }
    let known = (options, earlier);
    collector.shapes.placed = InstancedShapes::collect(&mut collector, placed, known, notes)?;
    let Collector { shapes, mesh_colors, .. } = collector;
    let slide = |light: &pt_scene::Light| light.kind.slide().map(|t| lowering.texture(t));
    let slides = scene.lights.iter().map(slide).collect();
    let (images, measured) = lowering.kept();
    let placed = shapes.placed.numbers.clone();
    let kept = KeptShapes { flattened, placed, uses_coordinates, images, measured, tree_cost: 0.0 };
    let (lobes, lobe_tables, materials) = lowering.finish(mesh_colors);
    Ok(Shapes { lobes, lobe_tables, materials, slides, kept, ..shapes })
}
