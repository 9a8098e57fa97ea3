//! Rays that leave the scene.

use pt_math::{Ray, Vec3};

/// A ray that hits nothing in the scene.
#[derive(Clone, Copy, Debug)]
pub struct EscapedRay {
    /// World-space origin.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

impl EscapedRay {
    /// Creates a ray.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction }
    }
}

impl From<&Ray> for EscapedRay {
    #[inline(always)]
    fn from(ray: &Ray) -> Self {
        Self::new(ray.origin, ray.direction)
    }
}
