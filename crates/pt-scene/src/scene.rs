//! The scene.

use std::sync::Arc;

use pt_math::DAffine3;

use crate::{
    Camera, Light, Material, Medium, Mesh, Motion, Placement, Points, RenderHints, Sides, Span,
    Warning,
};

/// A scene as its author wrote it.
///
/// The world is right-handed with +y up; lengths are in the author's unit (see
/// [`Scene::metres_per_unit`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name: the file name without its ending.
    pub name: String,
    /// Metres per unit of length of all coordinates.
    pub metres_per_unit: f64,
    /// Cameras in file order.
    pub cameras: Vec<Camera>,
    /// The camera that is used, as an index into `cameras`; `None` is the last one.
    pub used_camera: Option<u32>,
    /// Materials; objects refer to them by index.
    pub materials: Vec<Material>,
    /// Media; objects and cameras refer to them by index.
    pub media: Vec<Medium>,
    /// Shapes placed in the world.
    pub objects: Vec<Object>,
    /// Lights that are not the glow of a material.
    pub lights: Vec<Light>,
    /// Settings of the file; the command line overrides them.
    pub settings: RenderHints,
    /// Notes about reading the file.
    pub warnings: Vec<Warning>,
    /// Files that could not be used, where they are named, and what stands in for them: the
    /// picture is another one.
    pub missing: Vec<Warning>,
}

/// A shape placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the file.
    pub name: String,
    /// Its own coordinates to world, or, if it moves, to those that its motion takes to the world.
    pub to_world: DAffine3,
    /// How it moves; `None` if it does not. Objects that move together may share it.
    pub motion: Option<Arc<Motion>>,
    /// The shape; meshes may be shared by several objects.
    pub geometry: Geometry,
    /// Index into [`Scene::materials`] per material slot; `None` is the default material
    /// (matte, 0.5).
    pub materials: Vec<Option<u32>>,
    /// The media that meet at its surface; `None` if the same one is on both sides.
    pub media: Option<Sides>,
    /// Where it was written.
    pub at: Span,
}

/// What an object is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// A sphere around the origin, with slot 0 as its material.
    Sphere {
        /// Radius. If it is negative, its front looks inwards.
        radius: f64,
    },
    /// Spheres around points and cylinders along segments, with slot 0 as their material. They stay
    /// round where the object is stretched, unless by its motion.
    Points {
        /// The points; those of a mesh may be shared by several objects.
        points: Arc<Points>,
        /// Radius in the coordinates of the points, above 0; `None` is [`Points::radius`].
        radius: Option<f64>,
    },
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            name: String::new(),
            metres_per_unit: 1.0,
            cameras: Vec::new(),
            used_camera: None,
            materials: Vec::new(),
            media: Vec::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            settings: RenderHints::default(),
            warnings: Vec::new(),
            missing: Vec::new(),
        }
    }
}

impl Scene {
    /// Sets where the camera stands that is used, if there is one.
    pub fn place_camera(&mut self, placement: Placement) {
        let last = self.cameras.len().checked_sub(1);
        let used = self.used_camera.map(|index| index as usize).or(last);
        if let Some(camera) = used.and_then(|index| self.cameras.get_mut(index)) {
            camera.placement = placement;
        }
    }

    /// The camera that is used; `None` if there is none.
    pub fn camera(&self) -> Option<&Camera> {
        match self.used_camera {
            Some(index) => self.cameras.get(index as usize),
            None => self.cameras.last(),
        }
    }
}
