//! Media: what happens to light between surfaces.
//!
//! A ray's interval is the part of it that is in the medium. Lengths are in metres.

mod cloud;
mod emission;
mod flakes;
mod grid;
mod homogeneous;
#[cfg(test)]
mod laws;
mod majorant;

use std::borrow::Cow;

use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3};

use crate::id::{Id, Table};
use crate::phase::{AnyPhase, PhaseFunction};
use crate::scene::SurfaceRecord;

pub use cloud::Cloud;
pub use emission::{BlackbodyEmission, MediumEmission};
pub use flakes::Flakes;
pub use grid::{Albedo, Density, Field, GridMedium};
pub use homogeneous::Homogeneous;

/// A medium.
#[derive(Clone, Debug)]
pub struct MediumRecord {
    /// How much light it takes away, and how much of that it scatters.
    pub matter: MediumProperties,
    /// Where the scattered light goes.
    pub phase: Phase,
}

/// Where a medium scatters light to.
#[derive(Clone, Debug)]
pub enum Phase {
    /// The same everywhere.
    Same(AnyPhase),
    /// By flakes that differ from place to place; the matter is a grid then.
    Flakes(Box<Flakes>),
}

/// How dense a medium is, and where.
#[derive(Clone, Debug)]
pub enum MediumProperties {
    /// The same everywhere.
    Homogeneous(Homogeneous),
    /// By a grid.
    Grid(Box<GridMedium>),
}

/// How a path goes through a medium. Weights are what its throughput is multiplied by.
#[derive(Clone, Copy, Debug)]
pub enum MediumSample {
    /// It is scattered at the parameter `t` of its ray.
    Scattered {
        /// Where.
        t: f32,
        /// σs T / p, with T the transmittance up to there and p the density of the distance.
        weight: Spectrum,
    },
    /// It comes to the end of the interval.
    Transmitted {
        /// T / P, with P the probability of that.
        weight: Spectrum,
    },
}

impl Phase {
    /// No less than what extinction is multiplied by anywhere, in any direction.
    pub fn max_area(&self) -> f32 {
        match self {
            Self::Same(AnyPhase::Microflakes(flakes)) => flakes.greatest_area(),
            Self::Same(_) => 1.0,
            Self::Flakes(flakes) => flakes.most(),
        }
    }
}

impl MediumRecord {
    /// Draws where a path with throughput `beta` is scattered, by `u` or, where it takes more
    /// numbers than anybody can tell ahead, by the stream. What only absorbs lets all paths
    /// through.
    #[inline]
    pub fn sample(
        &self,
        ray: &Ray,
        beta: Spectrum,
        u: [f32; 2],
        stream: &mut RngStream,
    ) -> MediumSample {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => self.seen(medium, ray).sample(ray, beta, u),
            MediumProperties::Grid(medium) => medium.sample(ray, &self.phase, beta, stream),
        }
    }

    /// Returns true if it emits light.
    #[inline]
    pub fn is_emissive(&self) -> bool {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => !medium.emission.is_black(),
            MediumProperties::Grid(medium) => medium.glows(),
        }
    }

    /// The light that comes to the start of a ray from all of its interval, for a path with
    /// throughput `beta`, or an estimate of it that is right on average.
    pub fn le(&self, ray: &Ray, beta: Spectrum, stream: &mut RngStream) -> Spectrum {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => self.seen(medium, ray).emitted(ray),
            MediumProperties::Grid(medium) => medium.emitted(ray, &self.phase, beta, stream),
        }
    }

    /// The share of light that gets through, or an estimate of it that is right on average.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, stream: &mut RngStream) -> Spectrum {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => self.seen(medium, ray).transmittance(ray),
            MediumProperties::Grid(medium) => medium.transmittance(ray, &self.phase, stream),
        }
    }

    /// What is the same everywhere, with the extinction that it has along a ray.
    #[inline]
    fn seen(&self, medium: &Homogeneous, ray: &Ray) -> Homogeneous {
        match &self.phase {
            Phase::Same(AnyPhase::Microflakes(flakes)) => {
                let extinction = medium.extinction * flakes.area(ray.direction.normalize());
                Homogeneous { extinction, ..*medium }
            }
            Phase::Same(_) | Phase::Flakes(_) => *medium,
        }
    }

    /// The phase function at a point of the world.
    #[inline]
    pub fn phase_at(&self, p: Vec3) -> Cow<'_, AnyPhase> {
        match &self.phase {
            Phase::Same(phase) => Cow::Borrowed(phase),
            Phase::Flakes(flakes) => Cow::Owned(flakes.at(p).into()),
        }
    }
}

/// The media on both sides of a surface; `None` is empty space.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// Behind it.
    pub interior: Option<Id<MediumRecord>>,
    /// On the side of its normal.
    pub exterior: Option<Id<MediumRecord>>,
}

/// All media, and where they meet.
#[derive(Debug, Default)]
pub struct Media {
    /// The media.
    pub table: Table<MediumRecord>,
    /// What each surface separates; it may end early.
    pub boundaries: Vec<Option<Boundary>>,
    /// The medium that the camera is in.
    pub camera: Option<Id<MediumRecord>>,
}

impl Media {
    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.table.as_slice().is_empty()
    }

    /// The medium of a ray that leaves a surface, to the side of its normal if `outwards`, and came
    /// through `current`.
    #[inline]
    pub fn medium_after_crossing(
        &self,
        surface: Id<SurfaceRecord>,
        outwards: bool,
        current: Option<Id<MediumRecord>>,
    ) -> Option<Id<MediumRecord>> {
        match self.boundaries.get(surface.index()) {
            Some(Some(Boundary { exterior, .. })) if outwards => *exterior,
            Some(Some(Boundary { interior, .. })) => *interior,
            _ => current,
        }
    }
}
