//! Properties that surfaces of several kinds share.

use super::Surface;

impl Surface {
    /// Returns true if rays that arrive at the back pass through undisturbed; see
    /// [`Hair::two_sided`](super::Hair::two_sided).
    pub fn culls_backfaces(&self) -> bool {
        match self {
            Self::Hair(hair) => !hair.two_sided,
            Self::Mix(mix) => mix.first.culls_backfaces() || mix.second.culls_backfaces(),
            Self::SurfaceDetail(embossed) => embossed.surface.culls_backfaces(),
            _ => false,
        }
    }

    /// Returns true if the surface, or one that it contains, transmits light anywhere.
    pub fn transmits(&self) -> bool {
        match self {
            Self::Glass(_)
            | Self::ThinGlass(_)
            | Self::Refraction(_)
            | Self::PrincipledThin(_)
            | Self::DiffuseTransmission(_)
            | Self::Hair(_) => true,
            Self::Diffuse(_)
            | Self::RoughDiffuse(_)
            | Self::Mirror(_)
            | Self::Conductor(_)
            | Self::CoatedDiffuse(_)
            | Self::RoughCoatedDiffuse(_)
            | Self::FresnelPlastic(_)
            | Self::CoatedConductor(_)
            | Self::Plastic(_)
            | Self::Measured(_)
            | Self::Black(_) => false,
            Self::Principled(principled) => principled.transmits(),
            Self::MetallicRoughness(look) => look.transmits(),
            Self::Mix(mix) => mix.first.transmits() || mix.second.transmits(),
            Self::TwoSided(sides) => sides.front.transmits() || sides.back.transmits(),
            Self::SurfaceDetail(embossed) => embossed.surface.transmits(),
        }
    }

    /// Returns the field that states whether the back side scatters as the front side does. `None`
    /// for kinds that have none: those with the same scattering on both sides or with a different
    /// one on each, and those that contain other surfaces.
    pub fn two_sided_mut(&mut self) -> Option<&mut bool> {
        match self {
            Self::Diffuse(surface) => Some(&mut surface.two_sided),
            Self::RoughDiffuse(surface) => Some(&mut surface.two_sided),
            Self::Conductor(surface) => Some(&mut surface.two_sided),
            Self::CoatedDiffuse(surface) => Some(&mut surface.two_sided),
            Self::RoughCoatedDiffuse(surface) => Some(&mut surface.two_sided),
            Self::FresnelPlastic(surface) => Some(&mut surface.two_sided),
            Self::CoatedConductor(surface) => Some(&mut surface.two_sided),
            Self::Plastic(surface) => Some(&mut surface.two_sided),
            Self::Principled(surface) => Some(&mut surface.two_sided),
            Self::MetallicRoughness(surface) => Some(&mut surface.two_sided),
            Self::Hair(surface) => Some(&mut surface.two_sided),
            Self::Measured(surface) => Some(&mut surface.two_sided),
            Self::Mirror(_)
            | Self::Glass(_)
            | Self::ThinGlass(_)
            | Self::Refraction(_)
            | Self::PrincipledThin(_)
            | Self::DiffuseTransmission(_)
            | Self::Black(_)
            | Self::Mix(_)
            | Self::TwoSided(_)
            | Self::SurfaceDetail(_) => None,
        }
    }
}
