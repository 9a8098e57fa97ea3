//! Lights other than emissive materials.

mod daylight;
pub mod ies;
mod portal;

use std::sync::Arc;

pub use daylight::{DateTime, Daylight, GeoLocation, TimeRange};
pub use ies::IesProfile;
pub use portal::Portal;
use pt_math::DAffine3;

use crate::image::Image;
use crate::{Span, Texture};

/// A light in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Node to world. Lights with a direction emit along −z of their node.
    pub to_world: DAffine3,
    /// Kind and parameters.
    pub kind: LightKind,
    /// Location in the file.
    pub at: Span,
}

/// Kinds of lights. All colours are linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Constant radiance from the upper (+y in the world) hemisphere.
    Hemisphere {
        /// Radiance.
        radiance: [f32; 3],
    },
    /// Constant radiance from all directions.
    Constant {
        /// Radiance.
        radiance: [f32; 3],
        /// Portal through which the light arrives; `None` if it arrives everywhere.
        portal: Option<Portal>,
    },
    /// An environment map in latitude and longitude. In the coordinates of the node, its upper row
    /// is +y, its left edge is −x, and the column at a quarter of its width is +z. The node may
    /// rotate and mirror; its scale is ignored.
    Environment {
        /// Radiance, finite and not negative.
        image: Arc<Image>,
        /// Factor of the image.
        scale: f32,
        /// Polar angles of the rows.
        rows: Rows,
        /// Portal through which the light arrives; `None` if it arrives everywhere.
        portal: Option<Portal>,
    },
    /// Parallel light along −z of the node.
    Directional {
        /// Irradiance on a surface that faces the light.
        irradiance: [f32; 3],
    },
    /// A disk in the direction +z of the node, at infinity, such as the sun. Rays that leave the
    /// scene hit it.
    DistantDisk {
        /// Irradiance on a surface that faces the centre of the disk.
        irradiance: [f32; 3],
        /// Angular radius in degrees, up to 90. Below 0.0058 the light is parallel, and no ray hits
        /// it.
        angular_radius: f64,
    },
    /// A point light at the origin of the node.
    Point {
        /// Radiant intensity.
        intensity: [f32; 3],
    },
    /// A point light at the origin of the node that emits into a cone around −z.
    Spot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Full opening angle of the cone, in degrees. The intensity is 0 outside.
        falloff_angle: f64,
        /// Exponent of the cosine between direction and axis, by which the intensity falls off.
        falloff_exponent: f64,
    },
    /// A point light at the origin of the node that emits into a cone around −z. Between two angles
    /// to that axis, its intensity falls off linearly in the angle to 0.
    LinearSpot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Angle to the axis, in degrees, up to which the intensity is constant.
        beam_angle: f64,
        /// Angle to the axis, in degrees, beyond which the intensity is 0.
        cutoff_angle: f64,
        /// Factor of the intensity, as by a slide in front of the light: the axis is at the centre
        /// of the slide, and its edges are at the cutoff angle, which is below 90 then; u increases
        /// with x of the node, and v with y. The node may rotate, mirror and scale.
        texture: Option<Arc<Texture>>,
    },
    /// A point light at the origin of the node that emits into a cone around −z. Between two angles
    /// to that axis, its intensity falls off to 0 with the square of a linear function of the
    /// cosine. [glTF 2.0, KHR_lights_punctual]
    PunctualSpot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Angle to the axis, in degrees, up to which the intensity is constant.
        inner_angle: f64,
        /// Angle to the axis, in degrees, beyond which the intensity is 0.
        outer_angle: f64,
    },
    /// A point light at the origin of the node that projects a picture along −z. A plane
    /// perpendicular to that axis is lit evenly: the intensity at the angle θ to the axis is that
    /// of the axis over cos³ θ.
    Projector {
        /// Radiant intensity along the axis for a picture of value 1.
        intensity: [f32; 3],
        /// Horizontal angle of the picture in degrees, in (0, 180), along x of the node.
        x_fov: f64,
        /// Vertical angle of the picture in degrees, in (0, 180), along y of the node.
        y_fov: f64,
        /// The picture: u increases with x of the node, and v with y. There is no light beyond the
        /// unit square. The node may rotate, mirror and scale.
        texture: Arc<Texture>,
    },
    /// A point light at the origin of the node with the intensity distribution of a luminaire that
    /// points along −z, the vertical angle 0. The horizontal angle is 0 at +x and 90° at +y.
    Ies {
        /// Intensity distribution.
        profile: Arc<IesProfile>,
        /// Radiant intensity of one candela.
        scale: [f32; 3],
    },
    /// The sun and a clear sky. +y of the node is up.
    Daylight(Daylight),
    /// A unit square in the node's xy plane, centred at its origin, that emits towards −z.
    Area {
        /// Emitted radiance.
        radiance: [f32; 3],
    },
}

/// Lists the kinds of lights once; each is a variant of [`LightKind`].
///
/// `light_kinds!(then)` is `then! { Hemisphere, Constant, … }`, a call of another macro with the
/// list.
///
/// ```
/// macro_rules! names {
///     ($($name:ident),*) => { [$(stringify!($name)),*] };
/// }
/// let names = pt_scene::light_kinds!(names);
/// assert_eq!(names[..2], ["Hemisphere", "Constant"]);
/// ```
#[macro_export]
macro_rules! light_kinds {
    ($then:ident) => {
        $then! {
            Hemisphere, Constant, Environment, Directional, DistantDisk, Point, Spot, LinearSpot, PunctualSpot, Projector, Ies, Daylight, Area
        }
    };
}

/// Implements the method for the name of a kind; it does not compile if the list lacks a variant.
macro_rules! light_names {
    ($($name:ident),*) => {
        impl LightKind {
            /// Returns the name of the kind.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$name { .. } => stringify!($name)),*
                }
            }
        }
    };
}
light_kinds!(light_names);

/// Matches a [`LightKind`] by reference, shared or mutable, to the colour of
/// [`LightKind::strength`].
macro_rules! strength {
    ($kind:expr) => {
        match $kind {
            LightKind::Hemisphere { radiance: color }
            | LightKind::Constant { radiance: color, .. }
            | LightKind::Directional { irradiance: color }
            | LightKind::DistantDisk { irradiance: color, .. }
            | LightKind::Point { intensity: color }
            | LightKind::Spot { intensity: color, .. }
            | LightKind::LinearSpot { intensity: color, .. }
            | LightKind::PunctualSpot { intensity: color, .. }
            | LightKind::Projector { intensity: color, .. }
            | LightKind::Ies { scale: color, .. }
            | LightKind::Area { radiance: color } => Some(color),
            LightKind::Environment { .. } | LightKind::Daylight(_) => None,
        }
    };
}

impl LightKind {
    /// Returns the colour by which the emission is scaled. `None` if it is scaled by a number, as
    /// that of an environment map, or by several.
    pub fn strength(&self) -> Option<&[f32; 3]> {
        strength!(self)
    }

    /// Variant of [`Self::strength`] that allows to change it.
    pub fn strength_mut(&mut self) -> Option<&mut [f32; 3]> {
        strength!(self)
    }

    /// Returns the texture that the light projects.
    pub fn slide(&self) -> Option<&Arc<Texture>> {
        match self {
            Self::LinearSpot { texture, .. } => texture.as_ref(),
            Self::Projector { texture, .. } => Some(texture),
            Self::Hemisphere { .. }
            | Self::Constant { .. }
            | Self::Environment { .. }
            | Self::Directional { .. }
            | Self::DistantDisk { .. }
            | Self::Point { .. }
            | Self::Spot { .. }
            | Self::PunctualSpot { .. }
            | Self::Ies { .. }
            | Self::Daylight(_)
            | Self::Area { .. } => None,
        }
    }

    /// Returns true if the light has a position; others are infinite.
    pub fn is_local(&self) -> bool {
        match self {
            Self::Point { .. }
            | Self::Spot { .. }
            | Self::LinearSpot { .. }
            | Self::PunctualSpot { .. }
            | Self::Projector { .. }
            | Self::Ies { .. }
            | Self::Area { .. } => true,
            Self::Hemisphere { .. }
            | Self::Constant { .. }
            | Self::Environment { .. }
            | Self::Directional { .. }
            | Self::DistantDisk { .. }
            | Self::Daylight(_) => false,
        }
    }

    /// Returns true if the light arrives at a point from a single direction.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Directional { .. }
            | Self::Point { .. }
            | Self::Spot { .. }
            | Self::LinearSpot { .. }
            | Self::PunctualSpot { .. }
            | Self::Projector { .. }
            | Self::Ies { .. } => true,
            Self::Hemisphere { .. }
            | Self::Constant { .. }
            | Self::Environment { .. }
            | Self::DistantDisk { .. }
            | Self::Daylight(_)
            | Self::Area { .. } => false,
        }
    }
}

impl LightKind {
    /// Returns the nearest light of the kinds that most programs have. `note` receives a note for
    /// each difference.
    pub fn simplified(&self, note: &mut dyn FnMut(&str)) -> SimpleLight {
        match *self {
            Self::Directional { irradiance } => SimpleLight::Directional { irradiance },
            Self::DistantDisk { irradiance, .. } => {
                note("the disk becomes a directional light, with sharp shadows");
                // The disk is towards +z, and directional lights face −z: the direction of light is
                // the same.
                SimpleLight::Directional { irradiance }
            }
            Self::Point { intensity } => SimpleLight::Point { intensity },
            Self::Ies { ref profile, scale } => {
                note("the profile becomes an isotropic intensity, its mean");
                SimpleLight::Point { intensity: scale.map(|c| c * profile.mean_candela()) }
            }
            Self::Spot { intensity, falloff_angle, falloff_exponent } => {
                let outer_angle = 0.5 * falloff_angle;
                let falls_off = falloff_exponent > 0.0;
                if falls_off {
                    note("the falloff from the axis to the edge becomes that of glTF");
                }
                let inner_angle = if falls_off { 0.0 } else { outer_angle };
                SimpleLight::Spot { intensity, inner_angle, outer_angle }
            }
            Self::PunctualSpot { intensity, inner_angle, outer_angle } => {
                SimpleLight::Spot { intensity, inner_angle, outer_angle }
            }
            Self::LinearSpot { intensity, beam_angle, cutoff_angle, ref texture } => {
                if beam_angle < cutoff_angle {
                    note("the falloff from the beam to the edge becomes that of glTF");
                }
                if texture.is_some() {
                    note("the projected image is omitted");
                }
                let [inner_angle, outer_angle] = [beam_angle, cutoff_angle];
                SimpleLight::Spot { intensity, inner_angle, outer_angle }
            }
            Self::Projector { intensity, x_fov, y_fov, .. } => {
                note(
                    "the projected image is omitted; the intensity does not increase towards the \
                     edge",
                );
                // The cone that encloses the picture.
                let tangent = |fov: f64| libm::tan(0.5 * fov.to_radians());
                let angle = libm::atan(libm::hypot(tangent(x_fov), tangent(y_fov))).to_degrees();
                SimpleLight::Spot { intensity, inner_angle: angle, outer_angle: angle }
            }
            Self::Area { radiance } => SimpleLight::Area { radiance },
            Self::Hemisphere { .. }
            | Self::Constant { .. }
            | Self::Environment { .. }
            | Self::Daylight(_) => SimpleLight::Environment,
        }
    }
}

/// A light of a kind that most programs have, as an approximation of others; see
/// [`LightKind::simplified`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SimpleLight {
    /// See [`LightKind::Directional`].
    Directional {
        /// Irradiance on a surface that faces the light.
        irradiance: [f32; 3],
    },
    /// See [`LightKind::Point`].
    Point {
        /// Radiant intensity.
        intensity: [f32; 3],
    },
    /// See [`LightKind::PunctualSpot`], whose falloff is that of glTF.
    Spot {
        /// Radiant intensity along the axis.
        intensity: [f32; 3],
        /// Angle to the axis, in degrees, up to which the intensity is constant.
        inner_angle: f64,
        /// Angle to the axis, in degrees, beyond which the intensity is 0.
        outer_angle: f64,
    },
    /// See [`LightKind::Area`].
    Area {
        /// Emitted radiance.
        radiance: [f32; 3],
    },
    /// Light from many directions, from beyond the scene.
    Environment,
}

/// Polar angles of the rows of an environment map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rows {
    /// The centre of row j of n is at the polar angle π(j + ½)/n, so that the rows divide the
    /// sphere evenly in angle.
    #[default]
    PixelCenters,
    /// The centre of row j of n is at πj/(n − 1): the first and the last row are the poles, as in
    /// Mitsuba.
    EndpointsAtPoles,
}
