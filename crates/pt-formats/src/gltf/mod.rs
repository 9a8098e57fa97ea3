//! Reader and writer of glTF 2.0 scenes, in JSON and binary. [Khronos, "glTF 2.0 Specification",
//! ISO/IEC 12113:2022, and the registry of its extensions]
//!
//! ```text
//! bytes ─ container ─▶ JSON ─ item ─▶ nodes ─▶ mesh ─▶ accessor ─▶ buffer ◀─ compressed
//!         and a buffer   objects with       ├▶ animation ─▶ keys
//!                        their paths        ├▶ deform (skins)
//!                                           ├▶ material ─▶ texture
//!                                           └▶ camera (cameras, lights)
//! ```
//!
//! Invalid content is an error with its path in the file, such as `nodes[2].mesh`. Approximated
//! features and unsupported extensions are reported as warnings; an unsupported extension that the
//! file requires is an error. Images that cannot be read are replaced by a placeholder, meshes of
//! missing buffers by boxes.
//!
//! Coordinates are kept: +y is up, lengths are in metres. Nodes, skins and morph targets have their
//! rest pose, or the pose of the animations at the requested time.
//!
//! Files may be hostile: all references are checked, each node is visited once, and there are
//! limits on values, numbers, texels, bytes and objects.

mod accessor;
mod animation;
mod buffer;
mod camera;
mod compressed;
mod container;
mod deform;
mod item;
mod keys;
mod material;
mod mesh;
mod mirrored;
mod nodes;
mod points;
mod texture;
mod transform;
mod write;

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use accessor::Accessors;
use animation::Pose;
use buffer::Buffers;
use item::Item;
use material::{MaterialIndices, MeshAttributes};
use pt_math::DAffine3;
use pt_scene::{Mesh, Points, Scene, Warning};
use texture::ImageCache;
pub(super) use write::encode;

use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;

/// Supported extensions, including those that a material reports as approximated.
const EXTENSIONS: [&str; 24] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];

/// Parses a scene.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let (mut json, binary) = container::open(bytes, path, context.limits())?;
    let root = Item::root(&json, path)?;
    let warnings = context.ok_or_report(check(&root))?.unwrap_or_default();
    let mut buffers = Buffers::read(&root, binary, path, context)?;
    compressed::decode(&mut json, &mut buffers, path, context)?;
    let root = Item::root(&json, path)?;
    let mut reader = GltfReader {
        file: path,
        context,
        accessors: Accessors::new(root.clone(), &buffers),
        buffers: &buffers,
        root,
        scene: Scene { warnings, ..Scene::default() },
        images: ImageCache::default(),
        uv_set: None,
        materials: HashMap::new(),
        mirrored: HashMap::new(),
        meshes: HashMap::new(),
        points: HashMap::new(),
        backs: HashMap::new(),
        joints: HashMap::new(),
        poses: HashMap::new(),
        shown: 0,
        warned: HashSet::new(),
    };
    let done = reader.nodes();
    context.ok_or_report(done)?;
    Ok(reader.finish())
}

/// State of the reader of a file.
struct GltfReader<'a> {
    file: &'a Path,
    context: &'a LoadContext,
    root: Item<'a>,
    buffers: &'a Buffers<'a>,
    accessors: Accessors<'a>,
    scene: Scene,
    images: ImageCache,
    /// Texture coordinate set of the material that is being read.
    uv_set: Option<usize>,
    /// Materials by index and mesh attributes that they use.
    materials: HashMap<(Option<usize>, MeshAttributes), MaterialIndices>,
    /// Index of the mirrored material of each material with a normal map or anisotropy, and vice
    /// versa.
    mirrored: HashMap<u32, u32>,
    /// Meshes by the indices of mesh and primitive, without the skin and the weights of a node.
    meshes: HashMap<(usize, usize), Option<Arc<Mesh>>>,
    /// Points and lines by the indices of mesh and primitive.
    points: HashMap<(usize, usize), Option<Arc<Points>>>,
    /// Back sides of meshes that emit on both sides.
    backs: HashMap<(usize, usize), Arc<Mesh>>,
    /// Joint transforms by skin index.
    joints: HashMap<usize, Arc<Vec<DAffine3>>>,
    /// Animated properties by node index.
    poses: HashMap<usize, Pose>,
    /// Number of primitives, counted once per instance.
    shown: usize,
    /// Warnings that were already reported.
    warned: HashSet<String>,
}

impl GltfReader<'_> {
    fn warn(&mut self, item: &Item<'_>, message: impl Into<String>) {
        let warning = Warning { at: item.span(), message: message.into() };
        // Nodes that share a mesh repeat its warnings.
        if self.warned.insert(warning.to_string()) {
            self.scene.warnings.push(warning);
        }
    }

    fn finish(mut self) -> Scene {
        if !self.scene.media.is_empty() {
            self.scene.settings.integrator = Some("volpath");
        }
        self.scene.used_camera = (self.scene.cameras.len() > 1).then_some(0);
        self.scene
    }
}

/// Checks the version and the extensions; returns warnings about unsupported extensions.
fn check(root: &Item<'_>) -> Result<Vec<Warning>, LoadError> {
    let asset = root.child("asset")?;
    let version = asset.map_or(Ok(None), |asset| asset.text("version"))?.unwrap_or_default();
    if version.split('.').next() != Some("2") {
        let message = format!("found version {}, expected \"2.0\"", quote(version));
        return Err(root.refuse("asset", message));
    }
    for name in root.texts("extensionsRequired")? {
        if !EXTENSIONS.contains(&name) {
            let message =
                format!("unsupported required extension {}; export without it", quote(name));
            return Err(root.refuse("extensionsRequired", message));
        }
    }
    let unread =
        root.texts("extensionsUsed")?.into_iter().filter(|name| !EXTENSIONS.contains(name));
    Ok(unread
        .map(|name| Warning {
            at: root.span_of("extensionsUsed"),
            message: format!("unsupported extension {}", quote(name)),
        })
        .collect())
}
