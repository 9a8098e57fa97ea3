//! Cameras.

use pt_math::DAffine3;

use crate::{Geometry, Motion};

/// A camera. It looks along −z of its node, with +y up and +x to the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// Node to world, or, if it moves, to the coordinates that its motion takes to the world.
    pub to_world: DAffine3,
    /// How it moves; `None` if it does not.
    pub motion: Option<Motion>,
    /// When its shutter opens and closes, in seconds. What moves in between is blurred; if it is
    /// open for no time, everything is seen where it is then.
    pub shutter: [f64; 2],
    /// What it shows.
    pub projection: Projection,
    /// Which side of what it shows an image of another shape keeps.
    pub fit: Fit,
    /// Distance before which nothing is seen: along the viewing axis, or along each ray of a
    /// panorama.
    pub near: f64,
    /// Distance behind which nothing is seen, measured likewise.
    pub far: f64,
    /// Radius of the lens; 0 is a pinhole. Perspective cameras alone have one.
    pub lens_radius: f64,
    /// The opening of the lens; `None` is a disk.
    pub aperture: Option<Aperture>,
    /// Distance of the plane in focus, along the viewing axis.
    pub focal_distance: f64,
    /// How far the film is moved, as shares of its width and height: what without it is shown at
    /// (x, y), counted from the upper left corner, is then shown at (x −
    /// `principal_point_offset[0]` · width, y − `principal_point_offset[1]` · height).
    pub principal_point_offset: [f64; 2],
    /// The medium that it is in, as an index into [`crate::Scene::media`]; `None` is empty space.
    pub medium: Option<u32>,
    /// Where it stands.
    pub placement: Placement,
    /// What it measures in place of a picture: each pixel is then an estimate of one number, and
    /// what the camera shows, its lens and its place do not count.
    pub meter: Option<Meter>,
}

/// A measurement by a surface, which need not be one of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Meter {
    /// The quantity.
    pub quantity: Quantity,
    /// The surface.
    pub geometry: Geometry,
    /// The surface to the world.
    pub to_world: DAffine3,
}

/// Quantity of a meter: a mean over the area of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance: the power per area that comes to the front of the surface, around its normals.
    Irradiance,
    /// The radiance that arrives from beyond all surfaces of the scene along the viewing axis of
    /// the camera's node, at rays towards the surface; whatever is in front of it is seen in
    /// its place.
    Radiance,
}

/// Where a camera stands. What moves it, its medium, and what is near or far of it count at its
/// node alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// At its node.
    #[default]
    Node,
    /// Where the program of the course CS184 puts it: it looks at the middle of the box around all
    /// surfaces, from 1.5 diagonals of that box away, with +y up. From the middle it is in the
    /// direction in which the point one unit in front of the node is from the origin of the world.
    /// In perspective, images of any size show what that program's images of 480 × 360 pixels
    /// do.
    Course,
    /// Along the viewing axis of its node from the middle of the box around all surfaces, as near
    /// as shows all of that box.
    Fit,
}

/// Which side of the view is that of the image, where their shapes differ: the other side follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fit {
    /// The one with which all of the view is in the image.
    #[default]
    Whole,
    /// The width: a wide image shows less above and below.
    Width,
    /// The height: a narrow image shows less at the sides.
    Height,
}

/// Which rays an image is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All through one point.
    Perspective {
        /// Horizontal field of view in degrees, in (0, 180).
        x_fov: f64,
        /// Vertical field of view in degrees, in (0, 180).
        y_fov: f64,
    },
    /// All parallel to the viewing axis.
    Orthographic {
        /// Half of the width of what is seen, in units of the node.
        half_width: f64,
        /// Half of its height.
        half_height: f64,
    },
    /// All directions around one point, in latitude and longitude: the viewing axis is in the
    /// middle of the image, and +y of the node is its upper edge.
    Panorama,
}

/// A regular polygon, as the blades of a diaphragm form it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Number of its sides, at least 3. Its corners lie on the rim of the lens.
    pub blades: u32,
    /// Turn in degrees, counter-clockwise for an eye behind the camera; at 0, a corner is at the
    /// right.
    pub rotation: f64,
}
