//! Patterns that are computed from the coordinates of their mapping.

use pt_math::noise;

/// A pattern that is computed from the coordinates (u, v, w) of its mapping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Procedural {
    /// Checkerboard with cubes of side ½: the first colour where an even number of the fractional
    /// parts of u, v and w is above ½, the second elsewhere.
    Checkerboard3d([[f32; 3]; 2]),
    /// Dots of radius 0.35, of the first colour, on the second one: about two in five of the unit
    /// squares around integer points have one, slightly off centre. [Pharr, Jakob & Humphreys,
    /// "Physically Based Rendering", 3rd ed., §10.5.2]
    Dots([[f32; 3]; 2]),
    /// Fractional Brownian motion: a sum of octaves of signed noise. [ibid., §10.6.3]
    Fbm(Noise),
    /// Turbulence: a sum of octaves of the magnitude of noise, which has creases. [ibid., §10.6.3]
    Wrinkled(Noise),
    /// Wind-driven waves, whose height varies: |fbm(p / 10)| · fbm(p), of 3 and 6 octaves. [ibid.,
    /// §10.6.5]
    Windy,
    /// Layers of marble along v, distorted by noise. [ibid., §10.6.6]
    Marble(Marble),
}

/// Fraction of the area that [`Procedural::Dots`] cover: 0.394 of the squares have a dot.
const DOTS: f32 = 0.394 * std::f32::consts::PI * 0.35 * 0.35;
/// Approximate mean of [`Procedural::Marble`].
const MARBLE: [f32; 3] = [0.82, 0.82, 0.85];

impl Procedural {
    /// Returns the approximate mean.
    pub fn mean(self) -> [f32; 3] {
        match self {
            Self::Checkerboard3d([a, b]) => [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])),
            Self::Dots([inside, outside]) => {
                [0, 1, 2].map(|c| outside[c] + (inside[c] - outside[c]) * DOTS)
            }
            Self::Fbm(_) | Self::Windy => [0.0; 3],
            Self::Wrinkled(Noise { octaves, roughness }) => {
                let worth = std::iter::successors(Some(1.0), |worth| Some(worth * roughness));
                let sum: f32 = worth.take(octaves as usize).sum();
                [sum * noise::MEAN_MAGNITUDE; 3]
            }
            Self::Marble(_) => MARBLE,
        }
    }

    /// Returns the pattern with its colours converted, if it has one of two colours everywhere.
    #[must_use]
    pub fn recolored(self, convert: impl Fn([f32; 3]) -> [f32; 3]) -> Option<Self> {
        match self {
            Self::Checkerboard3d(colors) => Some(Self::Checkerboard3d(colors.map(convert))),
            Self::Dots(colors) => Some(Self::Dots(colors.map(convert))),
            Self::Fbm(_) | Self::Wrinkled(_) | Self::Windy | Self::Marble(_) => None,
        }
    }
}

/// Parameters of a sum of octaves of noise; at most [`Self::MAX_OCTAVES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Number of octaves.
    pub octaves: u32,
    /// Ratio of the amplitudes of successive octaves, from 0 to 2.
    pub roughness: f32,
}

impl Noise {
    /// Maximum number of octaves; single precision does not resolve more.
    pub const MAX_OCTAVES: u32 = 32;
}

impl Default for Noise {
    fn default() -> Self {
        Self { octaves: 8, roughness: 0.5 }
    }
}

/// Parameters of marble: layers distorted by noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marble {
    /// Parameters of the noise.
    pub noise: Noise,
    /// Amplitude of the distortion; 2π is the thickness of a layer.
    pub variation: f32,
}
