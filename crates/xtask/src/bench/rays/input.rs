//! Meshes, and the cameras that look at them.

use pt_math::Vec3;

/// Triangles in world space.
#[derive(Default)]
pub(super) struct TriangleMesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Camera; `None` for a default position from which the whole mesh is visible.
    pub(super) view: Option<PinholeCamera>,
}

/// A pinhole camera with +y up.
#[derive(Clone, Copy)]
pub(super) struct PinholeCamera {
    pub(super) eye: Vec3,
    pub(super) look: Vec3,
    /// Horizontal and vertical field of view.
    pub(super) fov_degrees: f32,
}
