//! Sampler dimensions of a bounce.

use pt_core::light::AnyLight;
use pt_math::sampler::{Lanes, Sampler, Samplers};

use crate::integrator::CAMERA_DIMENSIONS;
use crate::integrator::context::Context;
use crate::integrator::estimator::PathEstimator;

/// Sampler dimensions of one bounce, in pairs: one for each light sample, one for the direction of
/// the BSDF, one for Russian roulette and the choice of a BSDF component, and one for stochastic
/// materials.
#[derive(Clone, Copy)]
pub(super) struct BounceDimensions {
    /// Number of pairs.
    pairs: u32,
    /// Number of pairs for direct light; they come first.
    pub(super) light_pairs: u32,
    /// True if some materials are stochastic; their pair is the last.
    pub(super) stochastic_materials: bool,
}

impl BounceDimensions {
    pub(super) fn new(estimator: &impl PathEstimator, cx: Context) -> Self {
        let Context { scene, settings } = cx;
        let lights = scene.lights.as_slice();
        let animated = scene.animated_lights();
        let count = |is: fn(&AnyLight) -> bool| lights.iter().filter(|l| is(l)).count() as u32;
        let (delta, invisible) = (count(AnyLight::is_delta), count(AnyLight::is_invisible));
        let area = lights.len() as u32 - delta - invisible + animated.len() as u32;
        let all = lights.iter().chain(animated.iter().map(|animated| &animated.light));
        let samples = all.map(|light| estimator.light_samples(settings, light));
        let light_pairs = samples.fold(0, u32::wrapping_add);
        let hemisphere = estimator.hemisphere(cx).map_or(0, |hemisphere| hemisphere.samples);
        let stochastic_materials = scene.materials.is_stochastic();
        let others = delta + 2 + u32::from(stochastic_materials);
        let extended = area.max(1) + invisible;
        Self {
            // Beyond 2³² dimensions, numbers repeat.
            pairs: extended.wrapping_mul(settings.light_samples).wrapping_add(others),
            light_pairs: light_pairs.wrapping_add(hemisphere),
            stochastic_materials,
        }
    }

    /// First dimension of a bounce.
    fn first(self, bounces: u32) -> u32 {
        bounces.wrapping_mul(self.pairs.wrapping_mul(2)).wrapping_add(CAMERA_DIMENSIONS)
    }

    /// Pair number `i` of a bounce of one path.
    pub(super) fn pair(self, sampler: Sampler, bounces: u32, i: u32) -> [f32; 2] {
        sampler.at_dimension(self.first(bounces).wrapping_add(i.wrapping_mul(2))).next_2d()
    }

    /// Number in [0, 1) for the choice of a stochastic material of one path; 0 if there are none.
    pub(super) fn material_choice(self, sampler: Sampler, bounces: u32) -> f32 {
        if self.stochastic_materials {
            self.pair(sampler, bounces, self.pairs.wrapping_sub(1))[0]
        } else {
            0.0
        }
    }
}

/// Samples of a block of paths at one bounce.
pub(super) struct BlockSamples {
    samplers: Samplers,
    first: u32,
    /// Number of the last pair.
    last: u32,
}

impl BlockSamples {
    pub(super) fn new(
        dimensions: BounceDimensions,
        bounces: u32,
        samplers: impl Iterator<Item = Sampler>,
    ) -> Self {
        let (first, last) = (dimensions.first(bounces), dimensions.pairs.wrapping_sub(1));
        Self { samplers: Samplers::new(samplers), first, last }
    }

    /// Pair number `i`.
    #[inline]
    pub(super) fn pair(&self, i: u32) -> [Lanes<f32>; 2] {
        self.samplers.points(self.first.wrapping_add(i.wrapping_mul(2)))
    }

    /// The last pair of the bounce.
    pub(super) fn last(&self) -> [Lanes<f32>; 2] {
        self.pair(self.last)
    }

    /// Pair number `i`, for the direction of the BSDF, and the next one, for Russian roulette and
    /// the choice of a BSDF component.
    pub(super) fn pairs(&self, i: u32) -> [[Lanes<f32>; 2]; 2] {
        [self.pair(i), self.pair(i.wrapping_add(1))]
    }
}
