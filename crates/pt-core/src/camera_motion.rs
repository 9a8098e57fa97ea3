//! Cameras that move while their shutter is open.

use pt_bvh::MotionKey;
use pt_math::{DAffine3, DVec3};

use crate::camera::Camera;

/// How a camera moves. Times are shares of the time for which the shutter is open.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraMotion {
    /// Where its node is; between these, transforms are linear.
    knots: Vec<MotionKey>,
}

impl CameraMotion {
    /// By where its node is, in metres, at some times, at least one, which increase.
    pub(crate) fn new(knots: Vec<MotionKey>) -> Self {
        Self { knots }
    }

    /// The camera at a time.
    pub fn at(&self, camera: &Camera, time: f32) -> Camera {
        camera.placed(&MotionKey::at(&self.knots, time))
    }
}

impl Camera {
    /// The same camera with its node elsewhere: it looks along −z of that, with +y up; what is not
    /// at right angles or of unit length there is made so.
    pub(crate) fn placed(&self, to_world: &DAffine3) -> Self {
        let m = to_world.matrix3;
        let forward = (-m.z_axis).normalize_or(DVec3::NEG_Z);
        let right = forward.cross(m.y_axis).normalize_or(forward.any_orthonormal_vector());
        let up = right.cross(forward);
        // What is seen through a mirrored node is mirrored.
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
