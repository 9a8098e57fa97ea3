//! Participating media.
//!
//! The interval of a ray is its part inside of the medium. Lengths are in metres.

mod cloud;
mod emission;
mod field;
mod flakes;
mod grid;
mod homogeneous;
#[cfg(test)]
mod laws;
mod majorant;

use std::borrow::Cow;
use std::sync::Arc;

pub use cloud::Cloud;
pub use emission::{BlackbodyEmission, MediumEmission};
pub use field::WorldGrid;
pub use flakes::Flakes;
pub use grid::{Albedo, Density, GridMedium};
pub use homogeneous::Homogeneous;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3};

use crate::id::{Id, SurfaceId, Table};
use crate::phase::{AnyPhase, PhaseFunction};

/// A medium.
#[derive(Clone, Debug)]
pub struct MediumRecord {
    /// Extinction, albedo and emission.
    pub matter: MediumProperties,
    /// Phase function.
    pub phase: Phase,
}

/// Phase function of a medium.
#[derive(Clone, Debug)]
pub enum Phase {
    /// The same phase function everywhere.
    Same(AnyPhase),
    /// Microflakes that vary in space; the medium is a grid then.
    Flakes(Arc<Flakes>),
}

/// Extinction, albedo and emission of a medium.
#[derive(Clone, Debug)]
pub enum MediumProperties {
    /// Homogeneous medium.
    Homogeneous(Homogeneous),
    /// Heterogeneous medium, by a grid or by noise.
    Grid(Arc<GridMedium>),
}

/// Result of sampling a medium along a ray. Weights are factors of the path's throughput.
#[derive(Clone, Copy, Debug)]
pub enum MediumSample {
    /// The path is scattered.
    Scattered {
        /// Ray parameter of the scattering.
        t: f32,
        /// σs T / p, with T the transmittance up to there and p the density of the distance.
        weight: Spectrum,
    },
    /// The path is transmitted to the end of the interval.
    Transmitted {
        /// T / P, with P the probability of transmission.
        weight: Spectrum,
    },
}

impl Phase {
    /// Upper bound of the factor of the extinction, over all points and directions.
    pub fn max_area(&self) -> f32 {
        match self {
            Self::Same(AnyPhase::Microflakes(flakes)) => flakes.greatest_area(),
            Self::Same(_) => 1.0,
            Self::Flakes(flakes) => flakes.most(),
        }
    }
}

impl MediumRecord {
    /// Samples scattering or transmission of a path with throughput `beta`, using `u`, or `stream`
    /// for delta tracking, which needs an unbounded number of random numbers. Media that only
    /// absorb transmit all paths.
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

    /// Returns true if the medium emits light.
    #[inline]
    pub fn is_emissive(&self) -> bool {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => !medium.emission.is_black(),
            MediumProperties::Grid(medium) => medium.emits(),
        }
    }

    /// Emitted radiance that reaches the start of a ray from its interval, for a path with
    /// throughput `beta`, or an unbiased estimate of it.
    pub fn le(&self, ray: &Ray, beta: Spectrum, stream: &mut RngStream) -> Spectrum {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => self.seen(medium, ray).emitted(ray),
            MediumProperties::Grid(medium) => medium.emitted(ray, &self.phase, beta, stream),
        }
    }

    /// Transmittance of the interval, or an unbiased estimate of it.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, stream: &mut RngStream) -> Spectrum {
        match &self.matter {
            MediumProperties::Homogeneous(medium) => self.seen(medium, ray).transmittance(ray),
            MediumProperties::Grid(medium) => medium.transmittance(ray, &self.phase, stream),
        }
    }

    /// A homogeneous medium with its extinction along a ray.
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

    /// Phase function at a point in world space.
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
    /// Medium on the side opposite to the normal.
    pub interior: Option<Id<MediumRecord>>,
    /// Medium on the side of the normal.
    pub exterior: Option<Id<MediumRecord>>,
}

/// All media, and the boundaries between them.
#[derive(Clone, Debug, Default)]
pub struct Media {
    /// The media.
    pub table: Table<MediumRecord>,
    /// Boundary of each surface, by its index; may be shorter than the surfaces.
    pub boundaries: Vec<Option<Boundary>>,
    /// Medium at the camera.
    pub camera: Option<Id<MediumRecord>>,
}

impl Media {
    /// Returns true if there are no media.
    pub fn is_empty(&self) -> bool {
        self.table.as_slice().is_empty()
    }

    /// Medium of a ray that leaves a surface, to the side of its normal if `outwards`, and arrived
    /// through `current`.
    #[inline]
    pub fn medium_after_crossing(
        &self,
        surface: SurfaceId,
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
