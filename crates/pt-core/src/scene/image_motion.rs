//! Motion of surfaces in the image, by their motion and that of the camera.

use pt_math::{Vec2, Vec3};

use super::RenderScene;
use crate::camera::Projection;

/// Times at which the shutter opens and closes, as fractions of its interval.
const SHUTTER: [f32; 2] = [0.0, 1.0];

impl RenderScene {
    /// Returns the difference of the image points, in pixels to the right and down, at which the
    /// point of a primitive that is at `p` at a time is seen when the shutter closes and when it
    /// opens. `None` if it has no image point at one of these times. In a panorama, the shorter way
    /// around is taken.
    pub fn image_motion(&self, p: Vec3, primitive: u32, time: f32) -> Option<Vec2> {
        if !self.is_animated() {
            return Some(Vec2::ZERO);
        }
        let positions = match self.shapes.primitive_surface.get(primitive as usize) {
            Some(_) => [p; 2],
            None => self.with_instances(|table| table.positions(p, primitive, time, SHUTTER)),
        };
        let image_point = |i: usize| Some(self.camera_at(SHUTTER[i]).project(positions[i])?.into());
        let (open, close): (Vec2, Vec2) = (image_point(0)?, image_point(1)?);
        let motion = close - open;
        match self.camera.projection {
            Projection::Panorama => {
                let width = self.camera.resolution[0] as f32;
                Some(Vec2::new(motion.x - width * (motion.x / width).round(), motion.y))
            }
            Projection::Perspective | Projection::Orthographic => Some(motion),
        }
    }
}
