//! Cameras.

use pt_math::DAffine3;

/// A perspective camera. It looks along −z of its node, with +y up and +x to the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// Node to world.
    pub to_world: DAffine3,
    /// Horizontal field of view in degrees, in (0, 180).
    pub x_fov: f64,
    /// Vertical field of view in degrees, in (0, 180).
    pub y_fov: f64,
    /// Distance before which nothing is seen, along the viewing axis.
    pub near: f64,
    /// Distance behind which nothing is seen, along the viewing axis.
    pub far: f64,
    /// Radius of the lens; 0 is a pinhole.
    pub lens_radius: f64,
    /// Distance of the plane in focus, along the viewing axis.
    pub focal_distance: f64,
}
