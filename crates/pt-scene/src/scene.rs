//! The scene description.

use std::sync::Arc;

use pt_math::DAffine3;

use crate::geometry::Geometry;
use crate::{
    Camera, Light, Material, Medium, Motion, Placement, RenderHints, Shared, Sides, Span, Warning,
};

/// A scene as written by its author. Clones share what they have in common.
///
/// The world is right-handed with +y up; lengths are in the author's unit (see
/// [`Scene::metres_per_unit`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name: the file name without its extension.
    pub name: String,
    /// Metres per unit of length of all coordinates.
    pub metres_per_unit: f64,
    /// Cameras in file order.
    pub cameras: Vec<Camera>,
    /// Active camera, as an index into `cameras`; `None` is the last one.
    pub used_camera: Option<u32>,
    /// Materials; objects refer to them by index.
    pub materials: Shared<Material>,
    /// Media; objects and cameras refer to them by index.
    pub media: Shared<Medium>,
    /// Objects placed in the world.
    pub objects: Shared<Object>,
    /// Lights other than emissive materials.
    pub lights: Shared<Light>,
    /// Settings of the file; the command line overrides them.
    pub settings: RenderHints,
    /// True if the settings are those of the active camera, and other cameras have others.
    pub settings_of_camera: bool,
    /// Warnings about the file.
    pub warnings: Vec<Warning>,
    /// Files that could not be read, with the place of the reference and the replacement. The
    /// rendered image differs from the intended one.
    pub missing: Vec<Warning>,
}

/// An object placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the file.
    pub name: String,
    /// Object to world; for an animated object, object to the coordinates that [`Self::motion`]
    /// transforms to the world.
    pub to_world: DAffine3,
    /// Animation; `None` for a static object. May be shared by objects that move together.
    pub motion: Option<Arc<Motion>>,
    /// Shape; meshes may be shared by several objects.
    pub geometry: Geometry,
    /// Index into [`Scene::materials`] per material slot; `None` is the default material
    /// (matte, 0.5).
    pub materials: Vec<Option<u32>>,
    /// Media on the two sides of the surface; `None` if the surface is no boundary between media.
    pub media: Option<Sides>,
    /// Location in the file.
    pub at: Span,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            name: String::new(),
            metres_per_unit: 1.0,
            cameras: Vec::new(),
            used_camera: None,
            materials: Shared::default(),
            media: Shared::default(),
            objects: Shared::default(),
            lights: Shared::default(),
            settings: RenderHints::default(),
            settings_of_camera: false,
            warnings: Vec::new(),
            missing: Vec::new(),
        }
    }
}

impl Scene {
    /// Sets the placement of the active camera, if there is one.
    pub fn place_camera(&mut self, placement: Placement) {
        let last = self.cameras.len().checked_sub(1);
        let used = self.used_camera.map(|index| index as usize).or(last);
        if let Some(camera) = used.and_then(|index| self.cameras.get_mut(index)) {
            camera.placement = placement;
        }
    }

    /// Returns the active camera; `None` if there is none.
    pub fn camera(&self) -> Option<&Camera> {
        match self.used_camera {
            Some(index) => self.cameras.get(index as usize),
            None => self.cameras.last(),
        }
    }
}
