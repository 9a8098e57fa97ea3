//! Contents of a scene: counts, bounds, memory and names.

use std::collections::HashSet;
use std::sync::Arc;

use pt_core::{CompileError, CompileOptions, Settings};
use pt_scene::medium::{MediumEmission, MediumProperties, PlacedGrid, Volume};
use pt_scene::{Geometry, Hidden, LightKind, Mesh, Object, Projection, Scene, SourceFile, framing};
use serde::Serialize;

use crate::{BuildOptions, Quality, Session, memory};

/// Contents of a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneStats {
    /// Name of the scene.
    pub name: String,
    /// Metres per unit of length.
    pub metres_per_unit: f64,
    /// Counts by kind.
    pub counts: SceneCounts,
    /// Minimum and maximum coordinates of surfaces in world space, or `None` without surfaces.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Memory by use.
    pub memory: Memory,
    /// Materials, with the kind of their surface.
    pub materials: Vec<Item>,
    /// Lights, except for emissive materials.
    pub lights: Vec<Item>,
    /// Media.
    pub media: Vec<Item>,
    /// Cameras, of which the last one is used.
    pub cameras: Vec<Item>,
    /// Settings of the file.
    pub settings: Vec<Item>,
    /// Files that were read, with the BLAKE3 hash of their content.
    pub files: Vec<Item>,
}

/// A name with a kind or a value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Item {
    /// Name in the scene.
    pub name: String,
    /// Kind or value.
    pub kind: String,
}

/// Counts by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Number of objects placed in the world.
    pub objects: usize,
    /// Number of objects whose mesh is that of an earlier object.
    pub instances: usize,
    /// Number of objects that are spheres.
    pub spheres: usize,
    /// Number of objects of points and segments.
    pub clouds: usize,
    /// Number of animated objects.
    pub moving: usize,
    /// Number of distinct meshes.
    pub meshes: usize,
    /// Number of vertices of the distinct meshes.
    pub vertices: usize,
    /// Number of triangles of the distinct meshes.
    pub triangles: usize,
    /// Number of triangles, with all instances.
    pub triangles_placed: usize,
    /// Number of points, with all instances.
    pub points: usize,
    /// Number of segments between points, with all instances.
    pub segments: usize,
    /// Number of emissive materials.
    pub emissive_materials: usize,
}

/// Memory in bytes, by use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// Meshes and points, before compilation.
    pub meshes: u64,
    /// Textures of materials, with their mipmaps, and images of lights.
    pub textures: u64,
    /// Grids of media.
    pub grids: u64,
    /// Upper bound of the tables and the hierarchy of a render, by [`memory::bytes_of_tables`].
    pub tables: u64,
}

impl SceneStats {
    /// Collects the contents of a scene that was read from `sources`; compiles it to determine the
    /// size of its textures.
    ///
    /// # Errors
    /// If the scene cannot be rendered.
    pub fn of(scene: &Scene, sources: &[SourceFile]) -> Result<Self, CompileError> {
        let session = compiled(scene)?;
        let item = |name: &str, kind: &str| Item { name: name.to_owned(), kind: kind.to_owned() };
        let files = sources.iter().map(|s| item(&s.path.display().to_string(), &s.hash));
        let mut seen = HashSet::new();
        Ok(Self {
            name: scene.name.clone(),
            metres_per_unit: scene.metres_per_unit,
            counts: counts(scene),
            bounds: bounds(scene),
            memory: Memory {
                meshes: meshes(scene).map(Mesh::bytes).sum::<u64>() + bytes_of_points(scene),
                textures: session.scene().materials.textures.bytes() as u64 + of_lights(scene),
                grids: grids(scene),
                tables: memory::bytes_of_tables(scene, None),
            },
            materials: scene.materials.iter().map(|m| item(&m.name, m.surface.kind())).collect(),
            lights: scene.lights.iter().map(|l| item(&l.name, l.kind.name())).collect(),
            media: scene.media.iter().map(|m| item(&m.name, kind_of_matter(&m.matter))).collect(),
            cameras: scene
                .cameras
                .iter()
                .map(|c| item(&c.name, kind_of_projection(&c.projection)))
                .collect(),
            settings: settings(scene),
            files: files.filter(|file| seen.insert(file.name.clone())).collect(),
        })
    }
}

/// Compiles a scene with the fastest build quality of the hierarchy, which is needed only for the
/// few rays of the camera check, and with studio lighting, as renders do by default. A scene that
/// cannot be rendered is an error, and approximated features have a [note](Session::notes).
///
/// # Errors
/// If the scene cannot be rendered.
pub fn compiled(scene: &Scene) -> Result<Session, CompileError> {
    let options = CompileOptions {
        bvh: BuildOptions { quality: Quality::Fast, ..BuildOptions::default() },
        studio: true,
        ..CompileOptions::default()
    };
    let integrator = scene.settings.integrator.unwrap_or("path").to_owned();
    Session::new(scene, options, Settings { integrator, ..Settings::default() })
}

/// Distinct meshes.
fn meshes(scene: &Scene) -> impl Iterator<Item = &Mesh> {
    let mut seen = HashSet::new();
    scene.objects.iter().filter_map(move |object| match &object.geometry {
        Geometry::Mesh(mesh) => seen.insert(Arc::as_ptr(mesh)).then_some(&**mesh),
        Geometry::Sphere { .. } | Geometry::Points { .. } => None,
    })
}

/// Bytes of distinct points and segments.
fn bytes_of_points(scene: &Scene) -> u64 {
    let mut seen = HashSet::new();
    let mut bytes = |object: &Object| match &object.geometry {
        Geometry::Points { points, .. } if seen.insert(Arc::as_ptr(points)) => points.bytes(),
        _ => 0,
    };
    scene.objects.iter().map(&mut bytes).sum()
}

fn counts(scene: &Scene) -> SceneCounts {
    let mut counts = SceneCounts { objects: scene.objects.len(), ..SceneCounts::default() };
    for object in &scene.objects {
        counts.moving += usize::from(object.motion.is_some());
        match &object.geometry {
            Geometry::Mesh(mesh) => counts.triangles_placed += mesh.triangles.len(),
            Geometry::Sphere { .. } => counts.spheres += 1,
            Geometry::Points { points, .. } => {
                counts.points += points.positions.len();
                counts.segments += points.segments.len();
                counts.clouds += 1;
            }
        }
    }
    for mesh in meshes(scene) {
        counts.meshes += 1;
        counts.vertices += mesh.positions.len();
        counts.triangles += mesh.triangles.len();
    }
    counts.instances = counts.objects - counts.spheres - counts.clouds - counts.meshes;
    let emits = scene.materials.iter().filter(|m| m.emission != [0.0; 3].into());
    counts.emissive_materials = emits.count();
    counts
}

/// Bounds of all surfaces; animated ones count at their keys.
fn bounds(scene: &Scene) -> Option<[[f64; 3]; 2]> {
    framing::surface_extent(scene, None).map(|extent| extent.map(|corner| corner.to_array()))
}

/// Bytes of the distinct images of lights.
fn of_lights(scene: &Scene) -> u64 {
    let mut seen = HashSet::new();
    let images = scene.lights.iter().filter_map(|light| match &light.kind {
        LightKind::Environment { image, .. } => Some(image),
        _ => None,
    });
    images
        .filter(|image| seen.insert(Arc::as_ptr(image)))
        .map(|image| size_of_val(image.pixels.as_slice()) as u64)
        .sum()
}

/// Bytes of the distinct grids of media.
fn grids(scene: &Scene) -> u64 {
    let mut seen = HashSet::new();
    let mut bytes = |placed: &PlacedGrid| {
        let is_first = seen.insert(Arc::as_ptr(&placed.grid));
        if is_first { size_of_val(placed.grid.values.as_slice()) as u64 } else { 0 }
    };
    let mut sum = 0;
    for medium in &scene.media {
        let MediumProperties::Heterogeneous(matter) = &medium.matter else { continue };
        sum += bytes(&matter.extinction);
        if let Volume::Grid(albedo) = &matter.albedo {
            sum += bytes(albedo);
        }
        sum += match &matter.emission {
            MediumEmission::Constant(_) => 0,
            MediumEmission::Grid(placed) => bytes(placed),
            MediumEmission::BlackBody(heat) => bytes(&heat.temperature),
        };
    }
    sum
}

fn kind_of_matter(matter: &MediumProperties) -> &'static str {
    match matter {
        MediumProperties::Homogeneous { .. } => "homogeneous",
        MediumProperties::Heterogeneous(_) => "heterogeneous",
        MediumProperties::Cloud(_) => "cloud",
    }
}

fn kind_of_projection(projection: &Projection) -> &'static str {
    match projection {
        Projection::Perspective { .. } => "perspective",
        Projection::Orthographic { .. } => "orthographic",
        Projection::Panorama => "panorama",
    }
}

/// Settings that the file contains.
fn settings(scene: &Scene) -> Vec<Item> {
    let s = &scene.settings;
    let size = |[width, height]: [u32; 2]| format!("{width} x {height}");
    let crop = |[x, y, width, height]: [u32; 4]| {
        format!("{width} x {height} pixels from column {x}, row {y}")
    };
    let hidden = match s.hidden {
        Hidden::Nothing => None,
        Hidden::Background => Some("the background"),
        Hidden::Emitters => Some("the background and surfaces that emit"),
    };
    let aovs = (!s.aovs.is_empty()).then(|| s.aovs.join(", "));
    let said = [
        ("resolution", s.resolution.map(size)),
        ("crop", s.crop.map(crop)),
        ("samples per pixel", s.spp.map(|spp| spp.to_string())),
        ("max depth", s.max_depth.map(|depth| depth.to_string())),
        ("what goes straight on", s.straight_is_free.then(|| "not counted".to_owned())),
        ("integrator", s.integrator.map(str::to_owned)),
        ("other channels", aovs),
        ("filter", s.filter.map(|filter| format!("{filter:?}"))),
        ("not seen directly", hidden.map(str::to_owned)),
    ];
    let item = |(name, value): (&str, Option<String>)| {
        value.map(|kind| Item { name: name.to_owned(), kind })
    };
    said.into_iter().filter_map(item).collect()
}

#[cfg(test)]
mod tests {
    use pt_math::{DAffine3, DVec3};

    use super::*;

    #[test]
    fn copies_are_counted_apart_from_what_is_copied() {
        let mut scene = crate::default_scene();
        let once = SceneStats::of(&scene, &[]).expect("it can be rendered");
        let spheres = once.counts.spheres;
        assert!(spheres > 0 && once.counts.instances == 0 && once.counts.meshes > 0);
        let mut copies = scene.objects.clone();
        for copy in &mut copies {
            copy.to_world = DAffine3::from_translation(DVec3::X * 100.0) * copy.to_world;
        }
        scene.objects.extend(copies);
        let twice = SceneStats::of(&scene, &[]).expect("it can be rendered");
        assert_eq!(twice.counts.instances, once.counts.meshes);
        assert_eq!(twice.counts.triangles, once.counts.triangles);
        assert_eq!(twice.counts.triangles_placed, 2 * once.counts.triangles_placed);
        assert_eq!(twice.counts.spheres, 2 * spheres);
        assert_eq!(twice.memory.meshes, once.memory.meshes);
        let ([low, high], [low_2, high_2]) =
            (once.bounds.expect("a box"), twice.bounds.expect("a box"));
        assert_eq!((low_2, high_2), (low, [high[0] + 100.0, high[1], high[2]]));
    }
}
