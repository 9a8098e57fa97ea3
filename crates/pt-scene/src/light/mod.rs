//! Lights that are not the glow of a material.

mod daylight;
pub mod ies;
mod portal;

use std::sync::Arc;

use pt_math::DAffine3;

use crate::image::Image;
use crate::{Span, Texture};
pub use daylight::{DateTime, Daylight, GeoLocation, TimeRange};
pub use ies::IesProfile;
pub use portal::Portal;

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
        /// Through what it arrives; `None` for no limits.
        portal: Option<Portal>,
    },
    /// An image in latitude and longitude, all around and far away. Seen in the node, its upper row
    /// is +y, its left edge looks along −x, and a quarter of the width further on, along +z. The
    /// node may turn and mirror; its size does not count.
    Environment {
        /// Radiance, finite and not negative.
        image: Arc<Image>,
        /// By what the image is multiplied.
        scale: f32,
        /// Where its rows lie.
        rows: Rows,
        /// Through what its light arrives; `None` for no limits.
        portal: Option<Portal>,
    },
    /// Parallel light along −z of the node.
    Directional {
        /// Irradiance on a surface that faces the light.
        irradiance: [f32; 3],
    },
    /// A disk towards +z of the node, infinitely far away: the sun. Rays that leave the scene see
    /// it.
    DistantDisk {
        /// Irradiance on a surface that faces the middle of the disk.
        irradiance: [f32; 3],
        /// Half of the angle under which it is seen, in degrees, up to 90. Below 0.0058 it is
        /// parallel light, which cannot be seen.
        angular_radius: f64,
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
    /// A point at the origin of the node that shines into a cone around −z; between two angles to
    /// that axis, its intensity falls to 0 linearly.
    LinearSpot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Angle to the axis, in degrees, up to which the intensity is that of the axis.
        beam_angle: f64,
        /// Angle to the axis, in degrees, beyond which there is no light.
        cutoff_angle: f64,
        /// By what the intensity is multiplied, as if it were a slide before the light: in the
        /// middle of the slide is the axis, and its edges are at the cutoff angle, which
        /// is below 90 then; u grows with x of the node, and v with y. The node may turn,
        /// mirror and scale.
        texture: Option<Arc<Texture>>,
    },
    /// A point at the origin of the node that shines into a cone around −z; between two angles to
    /// that axis, its intensity falls to 0 with the square of what is linear in the cosine. [glTF
    /// 2.0, KHR_lights_punctual]
    PunctualSpot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Angle to the axis, in degrees, up to which the intensity is that of the axis.
        inner_angle: f64,
        /// Angle to the axis, in degrees, beyond which there is no light.
        outer_angle: f64,
    },
    /// A point at the origin of the node that throws a picture along −z, which a plane across that
    /// axis shows evenly lit: the intensity at the angle θ to the axis is that of the axis over
    /// cos³ θ.
    Projector {
        /// Radiant intensity along the axis where the picture is 1.
        intensity: [f32; 3],
        /// Angle in degrees, in (0, 180), that the picture takes along x of the node.
        x_fov: f64,
        /// Angle in degrees, in (0, 180), that it takes along y.
        y_fov: f64,
        /// The picture: u grows with x of the node, and v with y. Nothing of it is shown beyond
        /// the unit square. The node may turn, mirror and scale.
        texture: Arc<Texture>,
    },
    /// A point at the origin of the node with the intensities of a luminaire, which hangs along −z:
    /// that is the vertical angle 0. The horizontal angle is 0 at +x and 90° at +y.
    Ies {
        /// The intensities.
        profile: Arc<IesProfile>,
        /// Radiant intensity of one candela.
        scale: [f32; 3],
    },
    /// The sun and a clear sky. In the node, +y is up.
    Daylight(Daylight),
    /// A unit square in the node's xy plane, centred at its origin, that shines towards −z.
    Area {
        /// Emitted radiance.
        radiance: [f32; 3],
    },
}

impl LightKind {
    /// The name of its kind.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Hemisphere { .. } => "Hemisphere",
            Self::Constant { .. } => "Constant",
            Self::Environment { .. } => "Environment",
            Self::Directional { .. } => "Directional",
            Self::DistantDisk { .. } => "DistantDisk",
            Self::Point { .. } => "Point",
            Self::Spot { .. } => "Spot",
            Self::LinearSpot { .. } => "LinearSpot",
            Self::PunctualSpot { .. } => "PunctualSpot",
            Self::Projector { .. } => "Projector",
            Self::Ies { .. } => "Ies",
            Self::Daylight(_) => "Daylight",
            Self::Area { .. } => "Area",
        }
    }
}

/// Where the rows of an image of the sky lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rows {
    /// The middle of row j of n is at the polar angle π(j + ½)/n: the rows share the sky.
    #[default]
    PixelCenters,
    /// It is at πj/(n − 1): the first and the last row are the poles, as in Mitsuba.
    EndpointsAtPoles,
}
