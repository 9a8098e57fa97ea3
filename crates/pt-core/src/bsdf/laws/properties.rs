//! Properties of lobes that the laws take into account.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::AnyLobe;
use crate::bsdf::{BsdfSample, LobeContext};

/// Properties of a lobe that the laws take into account and cannot derive.
///
/// A lobe has to state those by which laws become weaker. The methods with a default describe
/// exceptions: without them, a law of a lobe that needs them fails.
pub(in crate::bsdf) trait LobeLaws {
    /// Properties of the lobe for all parameters.
    fn properties(&self) -> LobeProperties;
    /// The lobe with another roughness α; `None` if it has no roughness.
    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>>;
    /// Probability with which [`Lobe::sample`](crate::bsdf::Lobe::sample) selects the map that it
    /// selected for the third number `choice`, given the sampled `wi`.
    fn map_probability(&self, _wo: Vec3, _wi: Vec3, _choice: f32) -> f32 {
        1.0
    }
    /// Returns true if all light that arrives from `wo` is scattered.
    fn is_lossless(&self, _wo: Vec3) -> bool {
        false
    }
    /// η² in f(wo, wi) η² = f(wi, wo), for `wi` in a medium of relative index η; `None` for pairs
    /// of directions for which a reciprocal lobe makes an exception.
    fn reciprocity(&self, _wo: Vec3, _wi: Vec3) -> Option<f32> {
        Some(1.0)
    }
}

/// Properties of a lobe for all parameters.
#[derive(Clone, Copy, Debug)]
pub(in crate::bsdf) struct LobeProperties {
    /// True if f(wo, wi) = f(wi, wo), or f(wo, wi)/η² for refraction. It may be false only for the
    /// models of the course, for hair, which does not determine the offset at which light leaves,
    /// and for measured materials.
    pub(in crate::bsdf) is_reciprocal: bool,
    /// True if part of the lobe, but not all of it, is a Dirac delta.
    pub(in crate::bsdf) has_delta_part: bool,
    /// Maps between which sampling selects.
    pub(in crate::bsdf) maps: SamplingMaps,
    /// Upper bound of the albedo, with the error of its computation; `None` if the lobe may gain
    /// energy, as the models of the course do.
    pub(in crate::bsdf) max_albedo: Option<f32>,
    /// True if the lobe scatters all light for some parameters, of which one of its examples has
    /// to have some; see [`LobeLaws::is_lossless`].
    pub(in crate::bsdf) can_be_lossless: bool,
}

/// [`LobeProperties::max_albedo`] of lobes that conserve energy.
pub(in crate::bsdf) const CONSERVING: Option<f32> = Some(1.0 + 1e-3);

/// [`LobeProperties::max_albedo`] of lobes that conserve energy to the precision of the Kulla &
/// Conty tables.
pub(in crate::bsdf) const CONSERVING_BY_TABLES: Option<f32> = Some(1.0 + super::gains::TABLES);

/// Maps from random numbers to directions between which a lobe selects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::bsdf) enum SamplingMaps {
    /// Each direction is reached by one map from the unit square.
    Disjoint,
    /// Several maps from the unit square reach the same direction, so that the density is more than
    /// that of one map.
    Overlapping,
    /// Directions depend on three numbers, and no two of them are such a map.
    OfThreeNumbers,
}

/// Examples are evaluated as they are in renders: as records, with the tables of
/// the examples.
impl AnyLobe<'_> {
    pub(in crate::bsdf) fn is_delta(&self) -> bool {
        self.record().is_delta()
    }

    pub(in crate::bsdf) fn transmits(&self) -> bool {
        self.record().transmits()
    }

    pub(in crate::bsdf) fn lobe_width(&self) -> f32 {
        self.record().lobe_width(LobeContext::examples())
    }

    pub(in crate::bsdf) fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.record().eval(LobeContext::examples(), wo, wi)
    }

    pub(in crate::bsdf) fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        self.record().pdf(LobeContext::examples(), wo, wi)
    }

    pub(in crate::bsdf) fn eval_and_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        self.record().eval_and_pdf(LobeContext::examples(), wo, wi)
    }

    pub(in crate::bsdf) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        self.record().sample(LobeContext::examples(), wo, u)
    }
}
