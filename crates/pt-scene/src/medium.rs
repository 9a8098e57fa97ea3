//! Participating media, which absorb, scatter and emit light between surfaces.

use std::sync::Arc;

use pt_math::DAffine3;

use crate::Span;

/// A named medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Name in the file.
    pub name: String,
    /// Extinction, albedo and emission.
    pub matter: MediumProperties,
    /// Phase function.
    pub phase: Phase,
    /// Location in the file.
    pub at: Span,
}

/// Extinction, albedo and emission of a medium.
#[derive(Clone, Debug, PartialEq)]
pub enum MediumProperties {
    /// Homogeneous medium.
    Homogeneous {
        /// Extinction σt per unit of length of the scene, per channel, finite and at least 0:
        /// probability per length of absorption or out-scattering.
        extinction: [f32; 3],
        /// Single-scattering albedo σs / σt, per channel in [0, 1].
        albedo: [f32; 3],
        /// Emitted radiance Le of an opaque layer that only absorbs; at least 0. The medium emits
        /// σa Le per unit of length.
        emission: [f32; 3],
    },
    /// Heterogeneous medium given by a grid; empty outside of it.
    Heterogeneous(Box<Heterogeneous>),
    /// Clouds of procedural noise.
    Cloud(Box<Cloud>),
}

impl MediumProperties {
    /// Returns true if the medium emits light.
    pub fn emits(&self) -> bool {
        match self {
            Self::Homogeneous { emission, .. } => *emission != [0.0; 3],
            Self::Heterogeneous(matter) => matter.emission != MediumEmission::Constant([0.0; 3]),
            Self::Cloud(_) => false,
        }
    }
}

/// A heterogeneous medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Heterogeneous {
    /// Extinction σt by position: a grid with one channel or three, with values of at least 0.
    pub extinction: PlacedGrid,
    /// Factor of `extinction` that gives the extinction per unit of length of the scene; at
    /// least 0.
    pub scale: f32,
    /// Single-scattering albedo, in [0, 1].
    pub albedo: Volume,
    /// Emitted radiance Le of an opaque layer that only absorbs. The medium emits σa Le per unit of
    /// length.
    pub emission: MediumEmission,
}

/// Emission of a medium.
#[derive(Clone, Debug, PartialEq)]
pub enum MediumEmission {
    /// Constant emission, at least 0.
    Constant([f32; 3]),
    /// Grid with one channel or three, with values of at least 0.
    Grid(PlacedGrid),
    /// Thermal emission.
    BlackBody(BlackBody),
}

/// Thermal emission by Planck's law, normalized: the peak of the spectrum has the same radiance at
/// each temperature.
#[derive(Clone, Debug, PartialEq)]
pub struct BlackBody {
    /// Temperatures in kelvins: a grid with one channel, with values of at least 0.
    pub temperature: PlacedGrid,
    /// Spectral radiance of the peak, at least 0. A spectrum with this value at all wavelengths has
    /// this luminance.
    pub scale: f32,
}

/// Procedural clouds as in pbrt-v4: dense at the bottom, thinning out towards y = 1, and empty
/// above.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Maximum extinction σt per unit of length of the scene, at least 0.
    pub extinction: [f32; 3],
    /// Single-scattering albedo, in [0, 1].
    pub albedo: [f32; 3],
    /// Density, at least 0; values above 1 are clamped to the maximum density.
    pub density: f32,
    /// Wispiness of the edges, at least 0.
    pub wispiness: f32,
    /// Approximate number of clumps along each axis from 0 to 1; above 0.
    pub frequency: f32,
    /// Lower corner of the box of the clouds, in their own coordinates.
    pub low: [f32; 3],
    /// Upper corner of the box.
    pub high: [f32; 3],
    /// Cloud coordinates to world.
    pub to_world: DAffine3,
}

/// An albedo that may vary with position.
#[derive(Clone, Debug, PartialEq)]
pub enum Volume {
    /// Constant value.
    Constant([f32; 3]),
    /// Grid with one channel or three.
    Grid(PlacedGrid),
}

/// A grid placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedGrid {
    /// The grid.
    pub grid: Arc<Grid>,
    /// Unit cube [0, 1]³, which the grid fills, to world.
    pub to_world: DAffine3,
    /// Interpolation between cell centres.
    pub filter: GridFilter,
}

/// Interpolation between cell centres. Beyond the outermost centres, the values are constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridFilter {
    /// Trilinear interpolation.
    #[default]
    Trilinear,
    /// Constant in each cell.
    Nearest,
}

/// Values in the cells of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Number of cells along x, y and z, each at least 1.
    pub resolution: [u32; 3],
    /// Number of values per cell: 1, 3, or the 6 of [`Phase::Microflakes`].
    pub channels: u32,
    /// Values, ordered by z, y, x and channel, the last of which varies fastest.
    pub values: Vec<f32>,
}

impl Grid {
    /// Creates a grid of one cell with one channel.
    pub fn uniform(value: f32) -> Self {
        Self { resolution: [1; 3], channels: 1, values: vec![value] }
    }

    /// Creates a grid of one cell with a colour.
    pub fn uniform_color(color: [f32; 3]) -> Self {
        Self { resolution: [1; 3], channels: 3, values: color.to_vec() }
    }

    /// Returns the mean of the values of each channel; without three channels, that of the first
    /// one three times.
    pub fn mean(&self) -> [f32; 3] {
        let channels = self.channels as usize;
        let mean = |c: usize| {
            let numbers = self.values.iter().skip(c).step_by(channels.max(1));
            let sum: f64 = numbers.map(|x| f64::from(*x)).sum();
            (sum / self.cells().max(1) as f64) as f32
        };
        if channels == 3 { [mean(0), mean(1), mean(2)] } else { [mean(0); 3] }
    }

    /// Returns the number of cells by the resolution.
    pub fn cells(&self) -> usize {
        self.resolution.iter().map(|&n| n as usize).product()
    }
}

/// Phase function of a medium.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Phase {
    /// Isotropic scattering.
    #[default]
    Isotropic,
    /// Henyey–Greenstein phase function. [Henyey & Greenstein 1941]
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle, in (−1, 1).
        g: f32,
    },
    /// Rayleigh scattering, by particles much smaller than a wavelength: equal forwards and
    /// backwards, and half as strong to the sides. [Chandrasekhar 1960, "Radiative Transfer", §4]
    Rayleigh,
    /// Tabulated phase function.
    Table {
        /// Values at equidistant cosines of the scattering angle, from −1 to 1, interpolated
        /// linearly; a constant factor has no effect.
        values: Vec<f32>,
    },
    /// Scattering by aligned specular microflakes. The extinction depends on the direction: it is
    /// multiplied by √(ωᵀ S ω). [Heitz, Dupuy, Crassin & Dachsbacher 2015, "The SGGX Microflake
    /// Distribution"]
    Microflakes {
        /// Positive definite matrices S in world coordinates, as xx, yy, zz, xy, xz, yz: a grid
        /// with six channels. Grids of more than one cell require a heterogeneous medium.
        matrices: PlacedGrid,
    },
    /// Blend of two phase functions.
    Blend(Box<PhaseBlend>),
}

/// A blend of two phase functions.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseBlend {
    /// Phase function of the first kind of particles.
    pub first: Phase,
    /// Phase function of the second kind.
    pub second: Phase,
    /// Fraction of light that the second kind scatters, in [0, 1].
    pub amount: f32,
}

/// The media on both sides of a surface, as indices into [`crate::Scene::media`]; `None` is empty
/// space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Sides {
    /// Medium behind the surface.
    pub interior: Option<u32>,
    /// Medium in front of the surface, on the side of its normal.
    pub exterior: Option<u32>,
}
