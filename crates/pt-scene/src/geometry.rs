//! Shape of an object.

use std::sync::Arc;

use crate::mesh::Mesh;
use crate::points::Points;

/// Shape of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// A sphere around the origin, with slot 0 as its material.
    Sphere {
        /// Radius; if negative, the front is inside.
        radius: f64,
    },
    /// Spheres around points and cylinders along segments, with slot 0 as their material. They stay
    /// round under a non-uniform scale of the object, except one of its motion.
    Points {
        /// The points; may be shared by several objects.
        points: Arc<Points>,
        /// Radius in the coordinates of the points, above 0; `None` for [`Points::radius`].
        radius: Option<f64>,
    },
}
