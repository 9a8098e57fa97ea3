//! Compilation of the author's scene to the tables that renderers read: a pure function.

mod camera;
mod checks;
mod collector;
pub mod compat;
mod daylight;
mod ellipsoid;
mod emission;
mod emitters;
mod geometry;
mod hierarchies;
mod instance_choice;
mod instances;
mod left_out;
mod light_trees;
mod lights;
mod materials;
mod media;
mod mesh_values;
mod meter;
mod motion;
mod points;
pub mod policies;
mod reuse;
mod shapes;
mod studio;
mod surface;
mod textures;

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use camera::resolution;
pub use hierarchies::Hierarchies;
pub use instance_choice::MAX_FLATTENED_TRIANGLES;
use pt_bvh::{BuildError, BuildOptions, Bvh, Geometry};
use pt_scene::{Hint, Notes, Scene, Span};
pub use reuse::{Earlier, Kept};

use self::policies::Policies;
use self::reuse::KeptShapes;
use crate::camera_motion::CameraMotion;
use crate::id::Id;
use crate::light::EnvironmentMap;
use crate::medium::{Media, MediumRecord};
use crate::meter::Meter;
use crate::scene::RenderScene;
use crate::shapes::ShapeArrays;

/// Options of [`compile()`].
#[derive(Default)]
#[expect(clippy::struct_excessive_bools, reason = "they have nothing to do with each other")]
pub struct CompileOptions {
    /// Width and height of the image; `None` is that of the file, or a size that suits the camera.
    pub resolution: Option<[u32; 2]>,
    /// Interpretation of the scene where programs differ.
    pub policies: Policies,
    /// Build options of the bounding volume hierarchy.
    pub bvh: BuildOptions,
    /// Maximum number of lights that are sampled individually; of more, each sample chooses one by
    /// its estimated contribution. `None` is a small number.
    pub most_single_lights: Option<usize>,
    /// Maximum number of triangles in copies of meshes, excluding the first copy of each. Beyond
    /// it, the meshes with the most triangles in copies become instances, unless they emit light.
    /// Copies are faster to intersect, but take more memory. `None` is
    /// [`MAX_FLATTENED_TRIANGLES`].
    pub most_copied_triangles: Option<usize>,
    /// Environment light in addition to the scene's own lights.
    pub environment: Option<EnvironmentMap>,
    /// True if a scene without light gets soft light from three sides, and one without a camera is
    /// seen from the front, the right and above; otherwise the one is black, and the other is seen
    /// from +z.
    pub studio: bool,
    /// True if environment maps are sampled with [`EnvironmentMap::compensate`], for estimators
    /// that combine one sample of each light with one of the BSDF, which finds the whole sky as
    /// well.
    pub compensated: bool,
    /// True if texture coordinates are kept even if no texture uses them.
    pub texture_coordinates: bool,
    /// Camera that replaces the scene's.
    pub camera: Option<pt_scene::Camera>,
    /// Placement of the camera that replaces the author's.
    pub placement: Option<pt_scene::Placement>,
    /// Radius of the lens in units of the scene, which replaces the camera's.
    pub lens_radius: Option<f32>,
    /// Aperture of the lens, which replaces the camera's.
    pub aperture: Option<pt_scene::Aperture>,
    /// Distance of the plane in focus in units of the scene, which replaces the camera's.
    pub focal_distance: Option<f32>,
    /// True if a panorama of all directions replaces the camera's view.
    pub panorama: bool,
    /// True if meshes with normals at their corners are shaded as the round shapes that these
    /// belong to: see [`RenderScene::smooth_shadows`]. Has no effect in scenes with media, or on
    /// instances.
    pub smooth_shadows: bool,
    /// Hierarchies of an earlier compilation, which are used in place of new ones where they are of
    /// the same shapes. They change nothing but the duration.
    pub hierarchies: Hierarchies,
}

impl CompileOptions {
    /// Returns the options without the environment, which may be large, and the hierarchies.
    #[must_use]
    pub fn without_environment(&self) -> Self {
        Self {
            environment: None,
            hierarchies: Hierarchies::default(),
            camera: self.camera.clone(),
            aperture: self.aperture,
            policies: self.policies,
            bvh: self.bvh,
            ..*self
        }
    }
}

/// Largest cost of queries of a refitted hierarchy, relative to the one when it was built.
const MAX_REFIT_COST: f32 = 1.25;

/// Default of [`CompileOptions::most_single_lights`].
const MAX_SINGLE_LIGHTS: usize = 8;

/// Note on a scene without light that gets studio light.
const STUDIO_LIGHT: &str = "the scene has no light: studio lighting is used";
/// Note on a scene without light.
const DARK: &str = "the scene has no light: the image will be black";

/// A compiled scene, with notes.
pub struct Compiled {
    /// Tables that renderers read.
    pub scene: RenderScene,
    /// Notes for the user, other than about the camera.
    pub notes: Notes,
    /// Notes about the camera.
    pub camera_notes: Notes,
    /// Times at which the shutter opens and closes, in seconds.
    pub shutter: [f64; 2],
    /// Wall-clock time of converting shapes to triangles and spheres in world space, including the
    /// hierarchies of instanced objects.
    pub geometry_time: Duration,
    /// Wall-clock time of building the top-level hierarchy.
    pub bvh_time: Duration,
    /// Record for the compilation of an edited scene.
    pub kept: Kept,
}

/// Error that prevents a scene from being compiled.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// A mesh or object refers to an index that does not exist.
    #[error("{at}: {what} index {index} out of range; expected an index below {count}")]
    Index {
        /// Location in the file.
        at: Span,
        /// Name of the indexed element.
        what: &'static str,
        /// The index.
        index: u32,
        /// Number of elements.
        count: usize,
    },
    /// A value of the scene is invalid, such as a number that must be finite or positive.
    #[error("{at}: {message}")]
    Value {
        /// Location in the file.
        at: Span,
        /// Message that contains the found and the expected value.
        message: String,
    },
    /// The requested region is not inside of the image.
    #[error(
        "found the region of {}x{} pixels at column {}, row {} (from the top), expected a region \
         of the image of {}x{} pixels", region.width, region.height, region.x, region.y,
        resolution[0], resolution[1]
    )]
    Region {
        /// The requested region.
        region: crate::Region,
        /// Width and height of the image.
        resolution: [u32; 2],
    },
    /// The requested light groups are invalid.
    #[error("light groups: {0}")]
    LightGroups(String),
    /// The hierarchy cannot be built.
    #[error(transparent)]
    Bvh(#[from] BuildError),
}

/// Compiles a scene.
///
/// # Errors
/// If the scene refers to something that it does not contain, has invalid values, or is too large.
pub fn compile(scene: &Scene, options: CompileOptions) -> Result<Compiled, CompileError> {
    compile_with(scene, options, None)
}

/// Compiles a scene as [`compile`] does, bit for bit, and takes over from an earlier compilation
/// what has not changed: nothing but the camera is compiled if only it is another one. What nothing
/// else uses of the earlier compilation is changed in place.
///
/// # Errors
/// As [`compile`].
pub fn compile_edited(
    scene: &Scene,
    options: CompileOptions,
    mut earlier: Earlier,
) -> Result<Compiled, CompileError> {
    let Earlier { scene: before, kept } = &mut earlier;
    if kept.differs_by_view(scene, &options) {
        let view = Arc::make_mut(before);
        if let Some(notes) = compile_camera(scene, &options, kept.shutter(), view)? {
            let view = Arc::unwrap_or_clone(earlier.scene);
            return Ok(earlier.kept.with_view((scene, &options), view, notes));
        }
    }
    let is_usable = earlier.kept.has_same_units(scene, &options);
    compile_with(scene, options, is_usable.then_some(earlier))
}

fn compile_with(
    scene: &Scene,
    mut options: CompileOptions,
    earlier: Option<Earlier>,
) -> Result<Compiled, CompileError> {
    let start = Instant::now();
    let mut notes = Notes::default();
    let policies = options.policies;
    let metres = policies.metres_per_unit(scene);
    emission::check(scene, &mut notes)?;
    let mut camera_notes = Notes::default();
    let shutter = motion::shutter(scene, &options, &mut camera_notes)?;
    let mut shapes =
        geometry::collect(scene, metres, shutter, (&options, earlier.as_ref()), &mut notes)?;
    tell_what_moves(&shapes.placed, shutter, &mut notes);
    let mut lights = lights::Lights::new(&shapes.materials.textures, options.compensated);
    let known = (scene, earlier.as_ref());
    lights.add_nodes(known, &mut shapes, metres, policies.lights.node, &mut notes)?;
    if policies.lights.samples_shapes {
        lights.add_emissive(&mut shapes);
    }
    if policies.lights.trees {
        lights.plant_trees(&mut shapes, options.most_single_lights.unwrap_or(MAX_SINGLE_LIGHTS));
    }
    lights.add_moving(&mut shapes, &mut notes);
    let environment = options.environment.take();
    let has_environment = environment.is_some();
    lights.add_environment(environment);
    if lights.are_out(&shapes) {
        lights.add_environment(options.studio.then(studio::environment));
        notes.push(if options.studio { STUDIO_LIGHT } else { DARK });
        notes.suggest(Hint::AddEnvironment);
        if !options.studio {
            notes.suggest(Hint::ShowNormals);
        }
    }
    let media = media::compile(scene, &shapes.sides, metres, &options)?;
    let view = View::new(scene, (metres, shutter), &media, &options, &mut camera_notes)?;
    let geometry_time = start.elapsed();

    let start = Instant::now();
    let (bvh, tree_cost) = tree(&shapes, &options, earlier)?;
    let left_out = bvh.skipped() + shapes.placed.skipped;
    if left_out > 0 {
        left_out::note(left_out, shapes.out_of_range() + shapes.placed.out_of_range, &mut notes);
    }
    let bvh_time = start.elapsed();
    let first = shapes.counts().iter().sum();
    let of_shapes = KeptShapes { tree_cost, ..std::mem::take(&mut shapes.kept) };
    let placed = std::mem::take(&mut shapes.placed).finish(first)?;
    let source = scene;
    let mut scene = assemble(shapes, lights, media, view, bvh);
    scene.instances = placed;
    scene.unnormalized_shading_normals = policies.shapes.vertex_normals.is_some();
    scene.sides_by_shading_normal = source.settings.sides_by_shading_normal;
    scene.smooth_shadows = options.smooth_shadows && scene.media.is_empty();
    if options.smooth_shadows && !scene.smooth_shadows {
        notes.push("smooth shadows have no effect in a scene with media");
    }
    let of_scene = (shutter, &notes);
    let kept = Kept::new(source, &options, has_environment, of_scene, of_shapes);
    Ok(Compiled { scene, notes, camera_notes, shutter, geometry_time, bvh_time, kept })
}

/// Camera of a compiled scene, and what depends on it.
struct View {
    camera: crate::Camera,
    motion: Option<CameraMotion>,
    meter: Option<Meter>,
    medium: Option<Id<MediumRecord>>,
}

impl View {
    fn new(
        scene: &Scene,
        (metres, shutter): (f64, [f64; 2]),
        media: &Media,
        options: &CompileOptions,
        notes: &mut Notes,
    ) -> Result<Self, CompileError> {
        let (camera, motion) = camera::compile(scene, metres, shutter, options, notes)?;
        let meter = camera::meter(scene, metres, shutter, options)?;
        Ok(Self { camera, motion, meter, medium: media::of_camera(scene, media, options)? })
    }
}

/// Replaces the camera of a compiled scene, as if [`compile`] had been called with this scene and
/// these options, of which only the camera and what replaces parts of it may differ from the ones
/// that were compiled. Returns notes about the camera; `None`, without a change, if its shutter has
/// other times than `shutter`, on which all shapes that move depend.
///
/// # Errors
/// If the camera has invalid values.
pub fn compile_camera(
    scene: &Scene,
    options: &CompileOptions,
    shutter: [f64; 2],
    compiled: &mut RenderScene,
) -> Result<Option<Notes>, CompileError> {
    let mut notes = Notes::default();
    if motion::shutter(scene, options, &mut notes)? != shutter {
        return Ok(None);
    }
    let units = (options.policies.metres_per_unit(scene), shutter);
    let view = View::new(scene, units, &compiled.media, options, &mut notes)?;
    compiled.camera = view.camera;
    compiled.camera_motion = view.motion;
    compiled.meter = view.meter;
    compiled.media.camera = view.medium;
    Ok(Some(notes))
}

/// Notes the number of shapes that move.
fn tell_what_moves(placed: &shapes::InstancedShapes, [open, close]: [f64; 2], notes: &mut Notes) {
    let count = placed.moving();
    if count > 0 {
        notes.push(format!(
            "shapes that move while the shutter is open, from {open} to {close} s: {count}"
        ));
    }
}

/// The hierarchy over the shapes that are not instanced, and its cost when it was built: the one of
/// an earlier compilation, that one with the shapes where they are, or a new one.
fn tree(
    shapes: &shapes::Shapes,
    options: &CompileOptions,
    earlier: Option<Earlier>,
) -> Result<(Arc<Bvh>, f32), CompileError> {
    if let Some((before, bvh, cost)) = earlier.and_then(|earlier| earlier.into_tree(options.bvh)) {
        if before.has_same_places(&shapes.arrays) {
            return Ok((bvh, cost));
        }
        let counts = [before.triangles.len(), before.spheres.len()];
        drop(before);
        if counts == shapes.counts() {
            let mut moved = Arc::unwrap_or_clone(bvh);
            let is_refitted =
                with_geometry(&shapes.arrays, |geometry| moved.refit(geometry)).is_ok();
            if is_refitted && moved.query_cost() <= cost * MAX_REFIT_COST {
                return Ok((Arc::new(moved), cost));
            }
        }
    }
    let bvh = bvh_of(&shapes.arrays, options)?;
    let cost = bvh.query_cost();
    Ok((bvh, cost))
}

/// The hierarchy over all triangles and spheres: a known one, or a new one.
fn bvh_of(arrays: &ShapeArrays, options: &CompileOptions) -> Result<Arc<Bvh>, BuildError> {
    match options.hierarchies.find(arrays, options.bvh) {
        Some(known) => Ok(known),
        None => with_geometry(arrays, |geometry| Bvh::build(geometry, &options.bvh)).map(Arc::new),
    }
}

/// Calls `ask` with the triangles and spheres.
fn with_geometry<T>(arrays: &ShapeArrays, ask: impl FnOnce(Geometry<'_>) -> T) -> T {
    let ShapeArrays { positions, triangles, spheres, .. } = arrays;
    // Spheres that face inwards have a negative radius; without them, no copy is made.
    let mut spheres = Cow::from(spheres);
    if spheres.iter().any(|s| s.radius < 0.0) {
        spheres.to_mut().iter_mut().for_each(|s| s.radius = s.radius.abs());
    }
    ask(Geometry { positions, triangles, spheres: &spheres })
}

fn assemble(
    mut shapes: shapes::Shapes,
    lights: lights::Lights,
    media: Media,
    view: View,
    bvh: Arc<Bvh>,
) -> RenderScene {
    use std::mem::take;
    let mut surfaces = shapes.surfaces.as_slice().iter();
    let has_holes = surfaces.any(|s| s.opacity.is_some() || s.cull_backfaces);
    RenderScene {
        instances: None,
        unnormalized_shading_normals: false,
        smooth_shadows: false,
        sides_by_shading_normal: false,
        object_ends: take(&mut shapes.object_ends),
        surfaces: take(&mut shapes.surfaces),
        surface_materials: take(&mut shapes.surface_materials),
        lobes: take(&mut shapes.lobes),
        lobe_tables: take(&mut shapes.lobe_tables),
        materials: take(&mut shapes.materials),
        shapes: shapes.into_tables(),
        has_alpha: has_holes,
        light_count: lights.table.as_slice().len() + lights.hidden,
        lights: lights.table,
        light_origins: lights.origins,
        infinite_lights: lights.infinite,
        light_tables: Arc::new(lights.tables),
        media: Media { camera: view.medium, ..media },
        camera: view.camera,
        camera_motion: view.motion,
        meter: view.meter,
        bvh,
    }
}

pub(super) fn refuse(element: &str, message: &str) -> CompileError {
    let at = Span { element: element.into(), ..Span::default() };
    CompileError::Value { at, message: message.into() }
}
