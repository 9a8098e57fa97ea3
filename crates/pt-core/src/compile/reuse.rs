//! Reuse of an earlier compilation, of another version of the scene.
//!
//! Large data are identified by their place in memory, which the earlier scene keeps occupied, and
//! never by name. All that is taken over has the bits of a compilation from scratch: hits do not
//! depend on the topology of a hierarchy.

use std::collections::HashMap;
use std::sync::Arc;

use pt_bvh::Bvh;
use pt_scene::image::Image;
use pt_scene::measured::Measurements;
use pt_scene::{Geometry, Notes, Object, Rows, Scene};

use super::{CompileOptions, Compiled};
use crate::bsdf::MeasuredTables;
use crate::image_texture::Texels;
use crate::light::EnvironmentMap;
use crate::scene::RenderScene;
use crate::shapes::{ShapeArrays, ShapeTables};

/// Record of a compilation, by which the next one finds what has not changed.
#[derive(Clone)]
pub struct Kept {
    scene: Scene,
    options: Arc<CompileOptions>,
    /// True if an environment map was added to the lights of the scene.
    has_environment: bool,
    /// See [`Compiled::shutter`].
    shutter: [f64; 2],
    /// See [`Compiled::notes`].
    notes: Notes,
    shapes: Arc<KeptShapes>,
}

/// Record of the compilation of shapes and materials.
#[derive(Default)]
pub(super) struct KeptShapes {
    /// For each object, true if it is not instanced.
    pub(super) flattened: Vec<bool>,
    /// Number of an object of the scene for each instanced object.
    pub(super) placed: Vec<usize>,
    /// True if there are texture coordinates.
    pub(super) uses_coordinates: bool,
    /// Compiled images, and tables of measured materials, by the addresses of their originals.
    pub(super) images: HashMap<usize, Arc<Texels>>,
    pub(super) measured: HashMap<usize, Arc<MeasuredTables>>,
    /// Cost of queries of the hierarchy when it was built; see [`Bvh::query_cost`].
    pub(super) tree_cost: f32,
}

/// An earlier compilation.
#[derive(Clone)]
pub struct Earlier {
    /// The compiled scene.
    pub scene: Arc<RenderScene>,
    /// Record of the compilation.
    pub kept: Kept,
}

impl Kept {
    /// Record of a compilation with these options, which have no environment any more.
    pub(super) fn new(
        scene: &Scene,
        options: &CompileOptions,
        has_environment: bool,
        (shutter, notes): ([f64; 2], &Notes),
        shapes: KeptShapes,
    ) -> Self {
        Self {
            scene: scene.clone(),
            options: Arc::new(options.without_environment()),
            has_environment,
            shutter,
            notes: notes.clone(),
            shapes: Arc::new(shapes),
        }
    }

    /// Returns true if the scene has the objects of the record.
    pub fn has_objects_of(&self, scene: &Scene) -> bool {
        self.scene.objects.is_one_with(&scene.objects)
    }

    pub(super) fn shutter(&self) -> [f64; 2] {
        self.shutter
    }

    /// Result of a compilation in which only the camera is another one.
    pub(super) fn with_view(
        &self,
        (scene, options): (&Scene, &CompileOptions),
        view: RenderScene,
        camera_notes: Notes,
    ) -> Compiled {
        let (scene, options) = (scene.clone(), Arc::new(options.without_environment()));
        Compiled {
            scene: view,
            notes: self.notes.clone(),
            camera_notes,
            shutter: self.shutter,
            geometry_time: std::time::Duration::ZERO,
            bvh_time: std::time::Duration::ZERO,
            kept: Self { scene, options, ..self.clone() },
        }
    }

    /// Returns true if scene and options differ from those of the record only by the camera.
    pub(super) fn differs_by_view(&self, scene: &Scene, options: &CompileOptions) -> bool {
        let own = &self.scene;
        self.has_same_units(scene, options)
            && !self.has_environment
            && has_options_of_shapes(&self.options, options)
            && own.objects.is_one_with(&scene.objects)
            && own.materials.is_one_with(&scene.materials)
            && own.lights.is_one_with(&scene.lights)
            && own.media.is_one_with(&scene.media)
            && own.settings.sides_by_shading_normal == scene.settings.sides_by_shading_normal
    }

    /// Returns true if both scenes are compiled by physics and in one unit.
    pub(super) fn has_same_units(&self, scene: &Scene, options: &CompileOptions) -> bool {
        self.options.policies.is_physical()
            && options.policies.is_physical()
            && self.scene.metres_per_unit.to_bits() == scene.metres_per_unit.to_bits()
    }
}

impl Earlier {
    /// Arrays of the shapes that are not instanced, if these are the same ones.
    pub(super) fn flattened(
        &self,
        scene: &Scene,
        shutter: [f64; 2],
        flattened: &[bool],
        uses_coordinates: bool,
    ) -> Option<&Arc<ShapeArrays>> {
        let Kept { scene: own, shapes, .. } = &self.kept;
        let is_same_time = self.kept.shutter == shutter;
        let is_same = |(number, new): (usize, &Object)| {
            let old = &own.objects[number];
            let may_move = new.motion.is_some() && !is_same_time;
            !flattened[number] || is_same_shape(old, new) && is_same_place(old, new) && !may_move
        };
        let are_same = shapes.flattened == flattened
            && shapes.uses_coordinates == uses_coordinates
            && (own.objects.is_one_with(&scene.objects) && is_same_time
                || scene.objects.iter().enumerate().all(is_same));
        are_same.then_some(&self.scene.shapes.arrays)
    }

    /// Arrays and hierarchy of an instanced object.
    pub(super) fn placed(
        &self,
        object: &Object,
        options: pt_bvh::BuildOptions,
        uses_coordinates: bool,
    ) -> Option<(&Arc<ShapeArrays>, &Arc<Bvh>)> {
        let Kept { scene, shapes, .. } = &self.kept;
        if shapes.uses_coordinates != uses_coordinates || self.kept.options.bvh != options {
            return None;
        }
        let is_of = |number: &usize| is_same_shape(&scene.objects[*number], object);
        let index = shapes.placed.iter().position(is_of)?;
        let known = self.scene.instances.as_ref()?.objects().get(index)?;
        Some((&known.shapes.arrays, &known.bvh))
    }

    /// The shapes that are not instanced, the hierarchy over them, and its cost when it was built.
    pub(super) fn into_tree(
        self,
        options: pt_bvh::BuildOptions,
    ) -> Option<(ShapeTables, Arc<Bvh>, f32)> {
        let cost = self.kept.shapes.tree_cost;
        let is_usable = self.kept.options.bvh == options;
        let RenderScene { shapes, bvh, .. } = Arc::unwrap_or_clone(self.scene);
        is_usable.then_some((shapes, bvh, cost))
    }

    pub(super) fn image(&self, image: &Arc<Image>) -> Option<&Arc<Texels>> {
        self.kept.shapes.images.get(&Arc::as_ptr(image).addr())
    }

    pub(super) fn measured(&self, of: &Arc<Measurements>) -> Option<&Arc<MeasuredTables>> {
        self.kept.shapes.measured.get(&Arc::as_ptr(of).addr())
    }

    /// Map of an image without invalid radiance, compensated or not.
    pub(super) fn environment(
        &self,
        image: &Arc<Image>,
        rows: Rows,
        compensated: bool,
    ) -> Option<&Arc<EnvironmentMap>> {
        let tables = &self.scene.light_tables;
        let maps = &tables.environments;
        let found = maps.iter().find(|map| map.is_of(image, rows));
        found.filter(|_| tables.compensated == compensated)
    }
}

/// Returns true if there is no environment, and two sets of options differ only by the camera. The
/// policies are those of physics.
fn has_options_of_shapes(before: &CompileOptions, now: &CompileOptions) -> bool {
    // All fields are named, so that a new option is assigned to one of the two.
    let CompileOptions {
        bvh,
        most_single_lights,
        most_copied_triangles,
        environment,
        studio,
        compensated,
        texture_coordinates,
        smooth_shadows,
        hierarchies: _,
        policies: _,
        resolution: _,
        camera: _,
        placement: _,
        lens_radius: _,
        aperture: _,
        focal_distance: _,
        panorama: _,
    } = now;
    environment.is_none()
        && before.bvh == *bvh
        && before.most_single_lights == *most_single_lights
        && before.most_copied_triangles == *most_copied_triangles
        && before.studio == *studio
        && before.compensated == *compensated
        && before.texture_coordinates == *texture_coordinates
        && before.smooth_shadows == *smooth_shadows
}

/// Returns true if two objects have one shape in memory.
fn is_same_shape(a: &Object, b: &Object) -> bool {
    match (&a.geometry, &b.geometry) {
        (Geometry::Mesh(a), Geometry::Mesh(b)) => Arc::ptr_eq(a, b),
        (Geometry::Sphere { radius: a }, Geometry::Sphere { radius: b }) => {
            a.to_bits() == b.to_bits()
        }
        // Default radii may depend on the other objects.
        (
            Geometry::Points { points: a, radius: Some(of_a) },
            Geometry::Points { points: b, radius: Some(of_b) },
        ) => Arc::ptr_eq(a, b) && of_a.to_bits() == of_b.to_bits(),
        _ => false,
    }
}

fn is_same_place(a: &Object, b: &Object) -> bool {
    let bits = |object: &Object| object.to_world.to_cols_array().map(f64::to_bits);
    let is_same_motion = match (&a.motion, &b.motion) {
        (None, None) => true,
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        _ => false,
    };
    bits(a) == bits(b) && is_same_motion
}
