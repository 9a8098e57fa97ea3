//! Cones of camera rays, and whether textures depend on footprints.

use pt_math::Vec3;

use super::RenderScene;
use crate::footprint::Cone;

impl RenderScene {
    /// Returns the cone of a camera ray in a unit direction at a time. Rays of a meter have no
    /// width.
    pub fn camera_cone(&self, direction: Vec3, time: f32) -> Cone {
        match self.camera_motion {
            _ if self.meter.is_some() => Cone::default(),
            None => self.camera.cone(direction),
            Some(_) => self.camera_at(time).cone(direction),
        }
    }

    /// Returns true if a texture depends on the footprint.
    #[inline]
    pub fn uses_footprints(&self) -> bool {
        self.materials.textures.uses_footprints
    }

    /// Returns true if a primitive is a triangle without vertex normals.
    #[inline]
    pub fn is_flat(&self, primitive: u32) -> bool {
        match self.shapes.primitive_surface.get(primitive as usize) {
            Some(_) => self.shapes.is_flat(primitive as usize),
            None => self.with_instances(|placed| placed.is_flat(primitive)),
        }
    }
}
