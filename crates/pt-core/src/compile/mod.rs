//! From the author's scene to the tables that renderers read: a pure function.

mod camera;
mod checks;
mod daylight;
mod ellipsoid;
mod emission;
mod geometry;
mod instances;
mod left_out;
mod light_trees;
mod lights;
mod materials;
mod media;
mod mesh_values;
mod meter;
mod motion;
mod normals;
mod points;
mod studio;
mod surface;
mod textures;

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pt_bvh::{BuildError, BuildOptions, Bvh, Geometry};
use pt_scene::{Scene, Span};

use crate::camera_motion::CameraMotion;
use crate::light::EnvironmentMap;
use crate::medium::Media;
use crate::scene::RenderScene;

pub use instances::MAX_FLATTENED_TRIANGLES;

/// How to compile.
#[derive(Default)]
#[expect(clippy::struct_excessive_bools, reason = "they have nothing to do with each other")]
pub struct CompileOptions {
    /// Width and height of the image; `None` takes the file's, or a size that suits the camera.
    pub resolution: Option<[u32; 2]>,
    /// Read the scene as the university course's program does: its framing, lights, materials
    /// and normals.
    pub course: bool,
    /// How to build the hierarchy of boxes.
    pub bvh: BuildOptions,
    /// Beyond how many lights one of them is chosen for each sample, by how much it may matter; up
    /// to as many, each is sampled. `None` is a small number.
    pub most_single_lights: Option<usize>,
    /// Most triangles of copies of meshes that are placed more than once, without the first of
    /// each. Of more, those with the most are kept once and referred to, unless they glow.
    /// Copies are found faster, but take more memory. `None` is [`MAX_FLATTENED_TRIANGLES`].
    pub most_copied_triangles: Option<usize>,
    /// Light from all around, besides the scene's own.
    pub environment: Option<EnvironmentMap>,
    /// True if a scene without any light gets soft light from three sides, and one without a
    /// camera is looked at from the front, the right and above; else the one is black, and the
    /// other looked at from +z.
    pub studio: bool,
    /// True if maps of the sky are sampled by [`EnvironmentMap::compensate`]: for an estimator
    /// that weighs one sample of each light against one of the BSDF, which finds all of the
    /// sky as well.
    pub compensated: bool,
    /// True if texture coordinates are kept where no texture asks for them.
    pub texture_coordinates: bool,
    /// A camera in place of the scene's.
    pub camera: Option<pt_scene::Camera>,
    /// Where the camera stands, in place of where its author says.
    pub placement: Option<pt_scene::Placement>,
    /// Radius of the lens, in the scene's unit, in place of the camera's.
    pub lens_radius: Option<f32>,
    /// Opening of the lens in place of the camera's.
    pub aperture: Option<pt_scene::Aperture>,
    /// Distance of the plane in focus, in the scene's unit, in place of the camera's.
    pub focal_distance: Option<f32>,
    /// Show all directions around the camera in place of what it shows.
    pub panorama: bool,
    /// Light meshes with normals at their corners as the round shapes that these belong to: see
    /// [`RenderScene::smooth_shadows`]. Not in scenes with media, nor on what moves or is kept
    /// once.
    pub smooth_shadows: bool,
}

/// See [`CompileOptions::most_single_lights`].
const MAX_SINGLE_LIGHTS: usize = 8;

/// What is said of a scene without light that gets some.
const STUDIO_LIGHT: &str =
    "the scene has no light: it is shown in the light of a studio. -e FILE.exr gives it another";
/// What is said of a scene without light.
const DARK: &str = "the scene has no light: the image will be black. Give it an environment with -e \
                    FILE.exr, or look at its shape with --integrator normals";

/// A compiled scene, and what there is to say about it.
pub struct Compiled {
    /// Tables that renderers read.
    pub scene: RenderScene,
    /// Notes for the user.
    pub notes: Vec<String>,
    /// Wall-clock time of turning shapes into triangles and spheres in the world, and of the
    /// hierarchies of those that are placed there.
    pub geometry_time: Duration,
    /// Wall-clock time of building the hierarchy.
    pub bvh_time: Duration,
}

/// Why a scene cannot be rendered.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// A mesh names a vertex that it does not have.
    #[error("{at}: {what} {index} is out of range: there are {count}")]
    Index {
        /// Where.
        at: Span,
        /// What is indexed.
        what: &'static str,
        /// The index.
        index: u32,
        /// Count.
        count: usize,
    },
    /// A number that must be finite is not, or one that must be positive is not.
    #[error("{at}: {message}")]
    Value {
        /// Where.
        at: Span,
        /// What is wrong and what was expected.
        message: String,
    },
    /// The pixels asked for are not all in the image.
    #[error(
        "the region of {}x{} pixels at column {}, row {} (from the top) does not lie in the image \
         of {}x{} pixels", region.width, region.height, region.x, region.y, resolution[0],
        resolution[1]
    )]
    Region {
        /// The pixels asked for.
        region: crate::Region,
        /// Width and height of the image.
        resolution: [u32; 2],
    },
    /// The groups of lights that are asked for make no sense.
    #[error("--light-groups: {0}")]
    LightGroups(String),
    /// The hierarchy cannot be built.
    #[error(transparent)]
    Bvh(#[from] BuildError),
}

/// Compiles a scene.
///
/// # Errors
/// If the scene refers to something that it does not contain, or is too large.
pub fn compile(scene: &Scene, mut options: CompileOptions) -> Result<Compiled, CompileError> {
    let start = Instant::now();
    let mut notes = Vec::new();
    let metres = if options.course { 1.0 } else { scene.metres_per_unit };
    emission::check(scene, &mut notes)?;
    let shutter = motion::shutter(scene, &options, &mut notes)?;
    let mut shapes = geometry::collect(scene, metres, shutter, &options, &mut notes)?;
    tell_what_moves(&shapes.placed, shutter, &mut notes);
    let mut lights = lights::Lights::default();
    lights.tables.textures = Arc::clone(&shapes.materials.textures);
    lights.add_nodes(scene, &mut shapes, metres, options.course, &mut notes)?;
    lights.add_emissive(&mut shapes, options.course);
    if !options.course {
        lights.plant_trees(&mut shapes, options.most_single_lights.unwrap_or(MAX_SINGLE_LIGHTS));
    }
    lights.add_moving(&mut shapes, &mut notes);
    lights.add_environment(options.environment.take());
    if lights.are_out(&shapes) {
        lights.add_environment(options.studio.then(studio::environment));
        notes.push(if options.studio { STUDIO_LIGHT.into() } else { DARK.into() });
    }
    if options.compensated {
        lights.compensate();
    }
    let camera = camera::compile(scene, metres, shutter, &options, &mut notes)?;
    let meter = camera::meter(scene, metres, shutter, &options)?;
    let media = media::compile(scene, &shapes.sides, metres, &options)?;
    let geometry_time = start.elapsed();

    let start = Instant::now();
    let bvh = build_bvh(&shapes, options.bvh)?;
    let left_out = bvh.skipped() + shapes.placed.skipped;
    if left_out > 0 {
        left_out::note(left_out, shapes.out_of_range() + shapes.placed.out_of_range, &mut notes);
    }
    let bvh_time = start.elapsed();
    let first = shapes.triangles.len() + shapes.spheres.len();
    let placed = std::mem::take(&mut shapes.placed).finish(first)?;
    let sides_by_shading_normal = scene.settings.sides_by_shading_normal;
    let mut scene = assemble(shapes, lights, media, camera, bvh);
    scene.instances = placed;
    scene.meter = meter;
    scene.unnormalized_shading_normals = options.course;
    scene.sides_by_shading_normal = sides_by_shading_normal;
    scene.smooth_shadows = options.smooth_shadows && scene.media.is_empty();
    if options.smooth_shadows && !scene.smooth_shadows {
        notes.push("--smooth-shadows does nothing in a scene with media".into());
    }
    Ok(Compiled { scene, notes, geometry_time, bvh_time })
}

/// Tells the user that something moves.
fn tell_what_moves(
    placed: &instances::InstancedShapes,
    [open, close]: [f64; 2],
    notes: &mut Vec<String>,
) {
    let count = placed.moving();
    if count > 0 {
        notes.push(format!(
            "shapes that move while the shutter is open, from {open} to {close} s: {count}"
        ));
    }
}

/// Builds the hierarchy over all triangles and spheres.
fn build_bvh(shapes: &geometry::Shapes, options: BuildOptions) -> Result<Bvh, BuildError> {
    // Spheres whose front looks inwards have a radius below 0; without them, no copy is made.
    let mut spheres = Cow::from(&shapes.spheres);
    if spheres.iter().any(|s| s.radius < 0.0) {
        spheres.to_mut().iter_mut().for_each(|s| s.radius = s.radius.abs());
    }
    let geometry =
        Geometry { positions: &shapes.positions, triangles: &shapes.triangles, spheres: &spheres };
    Bvh::build(geometry, &options)
}

fn assemble(
    mut shapes: geometry::Shapes,
    lights: lights::Lights,
    media: Media,
    (camera, camera_motion): (crate::Camera, Option<CameraMotion>),
    bvh: Bvh,
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
        light_tables: lights.tables,
        media,
        camera,
        camera_motion,
        meter: None,
        bvh,
    }
}
