//! Context of a light sample: the receiving point, its shading normal and the accepted sides.

use pt_math::Vec3;

use crate::bsdf::Bsdf;

/// Receiving point of a light sample.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// World-space position.
    pub p: Vec3,
    /// Unit shading normal; zero without a surface.
    pub normal: Vec3,
    /// Sides of the surface on which light is received.
    pub sides: ReceiverSides,
}

/// Sides of a surface on which light is received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReceiverSides {
    /// Side of the normal.
    Front,
    /// Front and back, since the surface transmits light.
    Both,
    /// All directions without a cosine factor, since there is no surface.
    All,
}

impl LightSampleContext {
    /// Creates the context of a point that is not on a surface.
    #[inline(always)]
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::ZERO, sides: ReceiverSides::All }
    }

    /// Creates the context of a point with this BSDF.
    #[inline(always)]
    pub fn of_bsdf(p: Vec3, bsdf: &Bsdf) -> Self {
        Self::on_surface(p, bsdf.frame().n, bsdf.transmits())
    }

    /// Creates the context of a point on a surface with this unit normal.
    #[inline(always)]
    pub fn on_surface(p: Vec3, normal: Vec3, transmits: bool) -> Self {
        Self {
            p,
            normal,
            sides: if transmits { ReceiverSides::Both } else { ReceiverSides::Front },
        }
    }
}
