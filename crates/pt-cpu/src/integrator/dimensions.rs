//! Sampler dimensions of a bounce.

use pt_core::light::AnyLight;
use pt_math::sampler::{LANES, Lanes, RngStream, Sampler, Samplers};

use super::CAMERA_DIMENSIONS;
use super::context::Context;
use super::estimator::PathEstimator;
use super::light_sampling::light_sample_count;
use super::scatterer::ScatterNumbers;

/// Sampler dimensions of one bounce, in pairs: with media, one for the distance; one for each light
/// sample, one for the direction of the BSDF, one for Russian roulette and the choice of a BSDF
/// component, and one for stochastic materials.
#[derive(Clone, Copy)]
pub(super) struct BounceDimensions {
    /// Number of pairs.
    pairs: u32,
    /// First pair for direct light; a pair before it is for distances in media.
    first_light_pair: u32,
    /// Number of pairs for direct light.
    light_pairs: u32,
    /// True if some materials are stochastic; their pair is the last.
    stochastic_materials: bool,
}

/// Random numbers of a bounce for an unknown number of events: those of a path itself, or those of
/// one of its light samples.
pub(super) fn bounce_stream(
    sampler: Sampler,
    bounces: u32,
    light_sample: Option<u32>,
) -> RngStream {
    sampler.stream([bounces, light_sample.map_or(0, |number| number.wrapping_add(1))])
}

impl BounceDimensions {
    pub(super) fn new(estimator: &impl PathEstimator, cx: Context) -> Self {
        let Context { scene, settings } = cx;
        let lights = scene.lights.as_slice();
        let count = |is: fn(&AnyLight) -> bool| lights.iter().filter(|l| is(l)).count() as u32;
        let (delta, invisible) = (count(AnyLight::is_delta), count(AnyLight::is_invisible));
        let area = lights.len() as u32 - delta - invisible + scene.animated_lights().len() as u32;
        let hemisphere = estimator.hemisphere(cx).map_or(0, |hemisphere| hemisphere.samples);
        let stochastic_materials = scene.materials.is_stochastic();
        let others = delta + 2 + u32::from(stochastic_materials);
        let extended = area.max(1) + invisible;
        Self {
            // Beyond 2³² dimensions, numbers repeat.
            pairs: extended.wrapping_mul(settings.light_samples).wrapping_add(others),
            first_light_pair: 0,
            light_pairs: light_sample_count(cx, estimator).wrapping_add(hemisphere),
            stochastic_materials,
        }
    }

    /// Dimensions of a bounce in a scene with media: a pair for distances comes before all others,
    /// and the pair for stochastic materials is always there.
    pub(super) fn with_media(estimator: &impl PathEstimator, cx: Context) -> Self {
        let light_pairs = light_sample_count(cx, estimator);
        Self {
            pairs: light_pairs.wrapping_add(4),
            first_light_pair: 1,
            light_pairs,
            stochastic_materials: cx.scene.materials.is_stochastic(),
        }
    }

    /// First dimension of a bounce.
    fn first(self, bounces: u32) -> u32 {
        bounces.wrapping_mul(self.pairs.wrapping_mul(2)).wrapping_add(CAMERA_DIMENSIONS)
    }

    /// First pair for the scattering of a path, depending on whether lights are sampled at this
    /// bounce, and on whether its BSDF is specular. In a vacuum, the pairs for lights serve for the
    /// BSDF where no light is sampled.
    pub(super) fn scattering_pair(self, is_lit: bool, is_delta: bool) -> u32 {
        let reuses_light_pairs = self.first_light_pair == 0 && (!is_lit || is_delta);
        if reuses_light_pairs { 0 } else { self.first_light_pair.wrapping_add(self.light_pairs) }
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

    /// Numbers for the scattering of one path: pair `i` and the next one.
    pub(super) fn scattering(self, sampler: Sampler, bounces: u32, i: u32) -> ScatterNumbers {
        let [x, y] = self.pair(sampler, bounces, i);
        let [roulette, component] = self.pair(sampler, bounces, i.wrapping_add(1));
        ScatterNumbers { direction: [x, y, component], roulette }
    }
}

/// Samples of a block of paths at one bounce.
pub(super) struct BlockSamples {
    samplers: Samplers,
    dimensions: BounceDimensions,
    /// First dimension of the bounce.
    first: u32,
}

impl BlockSamples {
    pub(super) fn new(dimensions: BounceDimensions, bounces: u32, samplers: Samplers) -> Self {
        let first = dimensions.first(bounces);
        Self { samplers, dimensions, first }
    }

    /// Pair number `i` for direct light.
    #[inline(always)]
    pub(super) fn light_pair(&self, i: u32) -> [Lanes<f32>; 2] {
        self.pair(self.dimensions.first_light_pair.wrapping_add(i))
    }

    /// Pair number `i`.
    #[inline]
    fn pair(&self, i: u32) -> [Lanes<f32>; 2] {
        self.samplers.points(self.first.wrapping_add(i.wrapping_mul(2)))
    }

    /// See [`BounceDimensions::material_choice`].
    pub(super) fn material_choices(&self) -> Lanes<f32> {
        if self.dimensions.stochastic_materials {
            self.pair(self.dimensions.pairs.wrapping_sub(1))[0]
        } else {
            [0.0; LANES]
        }
    }

    /// Numbers for the scattering of each path: pair `i` and the next one.
    pub(super) fn scattering(&self, i: u32) -> BlockScatterNumbers {
        let [x, y] = self.pair(i);
        let [roulette, component] = self.pair(i.wrapping_add(1));
        BlockScatterNumbers { direction: [x, y, component], roulette }
    }
}

/// [`ScatterNumbers`] of a block of paths.
#[derive(Clone, Copy)]
pub(super) struct BlockScatterNumbers {
    direction: [Lanes<f32>; 3],
    roulette: Lanes<f32>,
}

impl BlockScatterNumbers {
    /// Numbers of one path.
    #[inline(always)]
    pub(super) fn lane(&self, lane: usize) -> ScatterNumbers {
        let direction = self.direction.each_ref().map(|numbers| numbers[lane]);
        ScatterNumbers { direction, roulette: self.roulette[lane] }
    }
}
