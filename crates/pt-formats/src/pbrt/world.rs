//! Content of the files read.

use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use pt_scene::image::Image;
use pt_scene::{Mesh, Scalar, Scene, Span, Surface};

use crate::pbrt::camera::CameraSetup;
use crate::pbrt::entity::Entity;
use crate::pbrt::media::PbrtMedia;
use crate::pbrt::shape::PbrtMeshCache;
use crate::pbrt::texture::PbrtTextures;
use crate::pbrt::types::{MaterialKey, PlacedShape};
use crate::shared::registry::Registry;

/// Content of the files read.
pub(super) struct PbrtWorld {
    pub(super) scene: Scene,
    pub(super) sight: CameraSetup,
    pub(super) textures: PbrtTextures,
    pub(super) media: PbrtMedia,
    pub(super) materials: Vec<Rc<Entity>>,
    pub(super) named_materials: Registry<Rc<Entity>>,
    pub(super) objects: HashMap<String, Rc<[PlacedShape]>>,
    /// Times of the first and the second transform.
    pub(super) times: [f64; 2],
    pub(super) meshes: PbrtMeshCache,
    pub(super) shapes: Vec<PlacedShape>,
    /// Surfaces by material index or name.
    pub(super) surfaces: HashMap<MaterialKey, Rc<Option<Surface>>>,
    /// Media behind subsurface materials.
    pub(super) within: HashMap<MaterialKey, u32>,
    /// Indices of the materials of the scene, with the opacity, and true for hair on tubes, that
    /// they were created for.
    pub(super) made: HashMap<MaterialKey, Vec<(Scalar, bool, u32)>>,
    /// Source meshes, kept alive for their addresses, and their copies with texture coordinates.
    pub(super) laid_out: HashMap<*const Mesh, (Arc<Mesh>, Arc<Mesh>)>,
    /// Environment maps by path.
    pub(super) skies: HashMap<PathBuf, Arc<Image>>,
    /// Meshes of whole spheres, by the bits of the radius.
    pub(super) spheres: HashMap<u64, Arc<Mesh>>,
    pub(super) file: Span,
}
