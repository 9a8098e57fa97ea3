//! Media: what fills the space between surfaces, and absorbs and scatters light.

use std::sync::Arc;

use pt_math::DAffine3;

use crate::Span;

/// A named medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Name in the file.
    pub name: String,
    /// How much light it takes away, and how much of that is scattered.
    pub matter: MediumProperties,
    /// Where the scattered light goes.
    pub phase: Phase,
    /// Where it was written.
    pub at: Span,
}

/// How dense a medium is, and where.
#[derive(Clone, Debug, PartialEq)]
pub enum MediumProperties {
    /// The same everywhere.
    Homogeneous {
        /// Extinction σt per unit of length of the scene, per channel, at least 0 and finite:
        /// light is absorbed and scattered out of its direction with this probability per
        /// length.
        extinction: [f32; 3],
        /// Share of that light which is scattered, per channel in [0, 1]: σs / σt.
        albedo: [f32; 3],
        /// Radiance Le of so much of it that nothing is seen through it, if it only absorbs; at
        /// least 0. It emits σa Le per unit of length.
        emission: [f32; 3],
    },
    /// By a grid; nothing outside of it.
    Heterogeneous(Box<Heterogeneous>),
    /// By noise.
    Cloud(Box<Cloud>),
}

impl MediumProperties {
    /// Returns true if it emits light.
    pub fn glows(&self) -> bool {
        match self {
            Self::Homogeneous { emission, .. } => *emission != [0.0; 3],
            Self::Heterogeneous(matter) => matter.emission != MediumEmission::Constant([0.0; 3]),
            Self::Cloud(_) => false,
        }
    }
}

/// What is not the same everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Heterogeneous {
    /// Extinction σt by its place: a grid of one channel, or of three, of numbers of at least 0.
    pub extinction: PlacedGrid,
    /// What its numbers are multiplied by to be per unit of length of the scene; at least 0.
    pub scale: f32,
    /// Share of that light which is scattered, in [0, 1].
    pub albedo: Volume,
    /// Radiance Le of so much of it that nothing is seen through it, if it only absorbs; it emits
    /// σa Le per unit of length.
    pub emission: MediumEmission,
}

/// The light that matter sends out.
#[derive(Clone, Debug, PartialEq)]
pub enum MediumEmission {
    /// The same everywhere; at least 0.
    Constant([f32; 3]),
    /// By a grid of one channel, or of three, of numbers of at least 0.
    Grid(PlacedGrid),
    /// That of heat.
    BlackBody(BlackBody),
}

/// Light by Planck's law, all of one brightness: the strongest wavelength of each place has the
/// same radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct BlackBody {
    /// Temperatures in kelvins: a grid of one channel, of numbers of at least 0.
    pub temperature: PlacedGrid,
    /// Radiance at the strongest wavelength, at least 0. A spectrum that has it at all wavelengths
    /// has this luminance.
    pub scale: f32,
}

/// Clouds of noise, as in pbrt-v4: dense below, thinner and thinner towards y = 1, above which
/// there is nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Extinction σt per unit of length of the scene where they are densest, at least 0.
    pub extinction: [f32; 3],
    /// Share of that light which is scattered, in [0, 1].
    pub albedo: [f32; 3],
    /// How dense they are; at least 0. All that is more than 1 is as dense as can be.
    pub density: f32,
    /// How torn their edges are; at least 0.
    pub wispiness: f32,
    /// Of how many lumps they are along each axis from 0 to 1, about; above 0.
    pub frequency: f32,
    /// The least corner of the box in which they are, in their own coordinates.
    pub low: [f32; 3],
    /// The greatest.
    pub high: [f32; 3],
    /// From their own coordinates to the world.
    pub to_world: DAffine3,
}

/// A share of light that may depend on the place.
#[derive(Clone, Debug, PartialEq)]
pub enum Volume {
    /// The same everywhere.
    Constant([f32; 3]),
    /// By a grid of one channel, or of three.
    Grid(PlacedGrid),
}

/// A grid in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedGrid {
    /// The numbers.
    pub grid: Arc<Grid>,
    /// From the unit cube [0, 1]³, which the grid fills, to the world.
    pub to_world: DAffine3,
    /// Interpolation between cell centres.
    pub filter: GridFilter,
}

/// What a grid is between the middles of its cells. Beyond the outermost ones it is as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridFilter {
    /// Linear along each axis.
    #[default]
    Trilinear,
    /// The same in each cell.
    Nearest,
}

/// Numbers in the cells of a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Cells along x, y and z, each at least 1.
    pub resolution: [u32; 3],
    /// Numbers per cell: 1, 3, or the 6 of [`Phase::Microflakes`].
    pub channels: u32,
    /// The numbers of each cell side by side; x runs fastest, then y, then z.
    pub values: Vec<f32>,
}

impl Grid {
    /// One cell with one number.
    pub fn uniform(value: f32) -> Self {
        Self { resolution: [1; 3], channels: 1, values: vec![value] }
    }

    /// One cell with a colour.
    pub fn uniform_color(color: [f32; 3]) -> Self {
        Self { resolution: [1; 3], channels: 3, values: color.to_vec() }
    }

    /// The mean of its numbers, the same for all channels if there is one.
    pub fn mean(&self) -> [f32; 3] {
        let channels = self.channels as usize;
        let mean = |c: usize| {
            let numbers = self.values.iter().skip(c).step_by(channels.max(1));
            let sum: f64 = numbers.map(|x| f64::from(*x)).sum();
            (sum / self.cells().max(1) as f64) as f32
        };
        if channels == 3 { [mean(0), mean(1), mean(2)] } else { [mean(0); 3] }
    }

    /// The number of cells that its sizes say.
    pub fn cells(&self) -> usize {
        self.resolution.iter().map(|&n| n as usize).product()
    }
}

/// Where scattered light goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Phase {
    /// Everywhere alike.
    #[default]
    Isotropic,
    /// More forwards or backwards. [Henyey & Greenstein 1941]
    HenyeyGreenstein {
        /// Mean cosine of the angle by which light is turned, in (−1, 1).
        g: f32,
    },
    /// As much forwards as backwards, and half as much to the sides: by what is much smaller than a
    /// wavelength. [Chandrasekhar 1960, "Radiative Transfer", §4]
    Rayleigh,
    /// By a table.
    Table {
        /// Values at equal steps of the cosine of the angle by which light is turned, from −1 to
        /// 1, and linear between; their scale does not matter.
        values: Vec<f32>,
    },
    /// By mirrors that are flat and small, and turned alike. How much light is taken away depends
    /// on its direction: the extinction is multiplied by √(ωᵀ S ω). [Heitz, Dupuy, Crassin &
    /// Dachsbacher 2015, "The SGGX Microflake Distribution"]
    Microflakes {
        /// The positive definite matrices S in the coordinates of the world, as xx, yy, zz, xy,
        /// xz, yz: a grid of six numbers. One of more cells is for heterogeneous media.
        matrices: PlacedGrid,
    },
    /// By particles of two kinds.
    Blend(Box<PhaseBlend>),
}

/// Two phase functions side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseBlend {
    /// That of the particles of the first kind.
    pub first: Phase,
    /// That of the others.
    pub second: Phase,
    /// The share of light that the second kind scatters, in [0, 1].
    pub amount: f32,
}

/// The media on both sides of a surface, as indices into [`crate::Scene::media`]; `None` is empty
/// space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Sides {
    /// Behind it.
    pub interior: Option<u32>,
    /// In front of it, on the side of its normal.
    pub exterior: Option<u32>,
}
