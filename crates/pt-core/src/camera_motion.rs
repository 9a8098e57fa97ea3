//! Cameras that move while the shutter is open.

use pt_bvh::MotionKey;
use pt_math::{DAffine3, DVec3};

use crate::camera::Camera;

/// Motion of a camera. Times are fractions of the shutter interval.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraMotion {
    /// Transform of its node at key times, linear in between.
    knots: Vec<MotionKey>,
}

impl CameraMotion {
    /// Creates a motion from the transforms of the camera's node, in metres, at one or more
    /// increasing times.
    pub(crate) fn new(knots: Vec<MotionKey>) -> Self {
        Self { knots }
    }

    /// Returns the camera at a time.
    pub fn at(&self, camera: &Camera, time: f32) -> Camera {
        camera.placed(&MotionKey::at(&self.knots, time))
    }
}

impl Camera {
    /// Returns the camera with its node at `to_world`: it looks along −z of the node, with +y up.
    /// Axes that are not perpendicular or of unit length are orthonormalised.
    pub(crate) fn placed(&self, to_world: &DAffine3) -> Self {
        let m = to_world.matrix3;
        let forward = (-m.z_axis).normalize_or(DVec3::NEG_Z);
        let right = forward.cross(m.y_axis).normalize_or(forward.any_orthonormal_vector());
        let up = right.cross(forward);
        // A mirrored node mirrors the image.
        let right = if m.determinant() < 0.0 { -right } else { right };
        Self {
            position: to_world.translation.as_vec3(),
            right: right.as_vec3(),
            up: up.as_vec3(),
            forward: forward.as_vec3(),
            ..*self
        }
    }
}
