//! What is lit.

use pt_math::Vec3;

/// A point that is lit, and what its surface says of where light may come from.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// Where, in world coordinates.
    pub p: Vec3,
    /// The unit normal with which the surface scatters; zero without one.
    pub normal: Vec3,
    /// On which sides of the surface light counts.
    pub sides: ReceiverSides,
}

/// Sides of a surface on which light counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReceiverSides {
    /// That of the normal.
    Front,
    /// Both, since light goes through the surface.
    Both,
    /// There is no surface: light counts from everywhere, without a cosine.
    All,
}

impl LightSampleContext {
    /// A point that is on no surface.
    #[inline(always)]
    pub fn in_space(p: Vec3) -> Self {
        Self { p, normal: Vec3::ZERO, sides: ReceiverSides::All }
    }

    /// A point of a surface with this unit normal.
    #[inline(always)]
    pub fn on_surface(p: Vec3, normal: Vec3, transmits: bool) -> Self {
        Self {
            p,
            normal,
            sides: if transmits { ReceiverSides::Both } else { ReceiverSides::Front },
        }
    }
}
