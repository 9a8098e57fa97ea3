//! Lights that are not the glow of a material.

use pt_math::DAffine3;

use crate::Span;

/// A light and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Node to world. Lights with a direction shine along −z of their node.
    pub to_world: DAffine3,
    /// What it is.
    pub kind: LightKind,
    /// Where it was written.
    pub at: Span,
}

/// The lights an author can write. All colours are linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// The same radiance from every direction of the upper (+y world) half.
    Hemisphere {
        /// Radiance.
        radiance: [f32; 3],
    },
    /// The same radiance from every direction.
    Constant {
        /// Radiance.
        radiance: [f32; 3],
    },
    /// Parallel light along −z of the node.
    Directional {
        /// Irradiance on a surface that faces the light.
        irradiance: [f32; 3],
    },
    /// A point at the origin of the node.
    Point {
        /// Radiant intensity.
        intensity: [f32; 3],
    },
    /// A point at the origin of the node that shines into a cone around −z.
    Spot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Full opening angle of the cone, in degrees. Outside of it there is no light.
        falloff_angle: f64,
        /// Exponent of the cosine to the axis by which the intensity falls.
        falloff_exponent: f64,
    },
    /// A unit square in the node's xy plane, centred at its origin, that shines towards −z.
    Area {
        /// Emitted radiance.
        radiance: [f32; 3],
    },
}
