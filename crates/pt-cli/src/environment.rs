//! Layouts of environment maps.

use clap::ValueEnum;
use pathtracer::SkyLayout;

/// Layouts of environment maps.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum EnvironmentLayout {
    /// Latitude and longitude, twice as wide as high
    #[value(name = "latlong")]
    LatitudeLongitude,
    /// A light probe: a disk with distances from the middle, which looks along -z, proportional to
    /// the angle
    Angular,
    /// A mirrored ball seen along -z
    MirrorBall,
    /// A square of equal areas with +y in its middle, as in pbrt-v4
    Octahedral,
}

impl EnvironmentLayout {
    /// Layout of a square image, or `None` for latitude and longitude.
    pub(crate) fn square(self) -> Option<SkyLayout> {
        match self {
            Self::LatitudeLongitude => None,
            Self::Angular => Some(SkyLayout::Angular),
            Self::MirrorBall => Some(SkyLayout::MirrorBall),
            Self::Octahedral => Some(SkyLayout::Octahedral),
        }
    }
}
