//! Cameras.

use pt_math::DAffine3;

use crate::{Geometry, Motion};

/// A camera. The viewing axis is −z of its node; +y is up and +x to the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// Node to world; for an animated camera, node to the coordinates that [`Self::motion`]
    /// transforms to the world.
    pub to_world: DAffine3,
    /// Animation; `None` for a static camera.
    pub motion: Option<Motion>,
    /// Times at which the shutter opens and closes, in seconds. Motion in between is blurred; if
    /// both are equal, the image shows that instant.
    pub shutter: [f64; 2],
    /// Projection and field of view.
    pub projection: Projection,
    /// Side of the view that is kept by images of another aspect ratio.
    pub fit: Fit,
    /// Distance of the near clipping plane along the viewing axis; for a panorama, the distance
    /// along each ray.
    pub near: f64,
    /// Distance of the far clipping plane, measured as [`Self::near`].
    pub far: f64,
    /// Radius of the lens; 0 is a pinhole. Only perspective cameras have a lens.
    pub lens_radius: f64,
    /// Shape of the lens opening; `None` is a disk.
    pub aperture: Option<Aperture>,
    /// Distance of the plane of focus, along the viewing axis.
    pub focal_distance: f64,
    /// Offset of the film, as fractions of its width and height: a point that appears at (x, y)
    /// from the upper left corner without the offset appears at (x − `principal_point_offset[0]` ·
    /// width, y − `principal_point_offset[1]` · height) with it.
    pub principal_point_offset: [f64; 2],
    /// Medium around the camera, as an index into [`crate::Scene::media`]; `None` is empty space.
    pub medium: Option<u32>,
    /// Placement relative to the node or to the scene.
    pub placement: Placement,
    /// Measurement that replaces the picture: each pixel is an estimate of the same number, and the
    /// projection, the lens and the placement are ignored.
    pub meter: Option<Meter>,
}

/// A measurement over a surface, which need not be part of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Meter {
    /// Measured quantity.
    pub quantity: Quantity,
    /// Surface over which the mean is taken.
    pub geometry: Geometry,
    /// Surface coordinates to world.
    pub to_world: DAffine3,
}

/// Quantity of a meter, averaged over the area of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance: power per area that arrives at the front of the surface, the side of its
    /// normals.
    Irradiance,
    /// Radiance along parallel rays through the surface, in the direction of the viewing axis of
    /// the camera's node. The rays start outside all surfaces of the scene, so that surfaces in
    /// front of the measured one occlude it.
    Radiance,
}

/// Placement of a camera. Motion, medium, clipping distances and lens apply to [`Self::Node`] only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// At its node.
    #[default]
    Node,
    /// By the rule of the course's program: the camera looks at the centre of the bounding
    /// box of all surfaces, from a distance of 1.5 diagonals of that box, with +y up. The direction
    /// from the centre to the camera is the direction from the world origin to the point one unit
    /// in front of the node. In perspective, images of any size have the field of view of that
    /// program's images of 480 × 360 pixels.
    Course,
    /// On the line through the centre of the bounding box of all surfaces, along the viewing axis
    /// of the node, at the smallest distance from which all of the box is visible.
    Fit,
}

/// Side of the view that determines the scale if image and view have different aspect ratios; the
/// other side follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// The side with which the image contains all of the view.
    #[default]
    Whole,
    /// The width: a wider image shows less above and below.
    Width,
    /// The height: a narrower image shows less at the sides.
    Height,
}

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective projection: rays through one point.
    Perspective {
        /// Horizontal field of view in degrees, in (0, 180).
        x_fov: f64,
        /// Vertical field of view in degrees, in (0, 180).
        y_fov: f64,
    },
    /// Orthographic projection: rays parallel to the viewing axis.
    Orthographic {
        /// Half of the width of the view, in units of the node.
        half_width: f64,
        /// Half of the height of the view.
        half_height: f64,
    },
    /// Equirectangular panorama: all directions around one point, by latitude and longitude. The
    /// viewing axis is at the centre of the image, and +y of the node is the upper edge.
    Panorama,
}

/// A regular polygon, such as the blades of a diaphragm form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Number of sides, at least 3. The corners lie on the rim of the lens.
    pub blades: u32,
    /// Rotation in degrees, counter-clockwise as seen from behind the camera; at 0, a corner is at
    /// the right.
    pub rotation: f64,
}
