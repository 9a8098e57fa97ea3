//! The radiance of starts, added up contribution by contribution.

use pt_core::film::ExactSum;
use pt_core::settings::Clamp;
use pt_math::Spectrum;

/// Sums of contributions, which are cut off at a luminance.
pub(super) struct Sums<'a> {
    radiance: &'a mut Vec<Spectrum>,
    /// How many of them are starts; those behind are parts of their light.
    starts: usize,
    clamp: Clamp,
    /// That of the contributions that come next.
    limit: f32,
    /// Luminance that was cut off.
    removed: &'a mut ExactSum,
}

impl<'a> Sums<'a> {
    /// Adds to `radiance`, and to `removed` what is cut off.
    pub(super) fn new(
        radiance: &'a mut Vec<Spectrum>,
        clamp: Clamp,
        removed: &'a mut ExactSum,
    ) -> Self {
        let starts = radiance.len();
        Self { radiance, starts, clamp, limit: clamp.limit(0), removed }
    }

    /// The contributions that come next are of light scattered `bounces` times.
    #[inline(always)]
    pub(super) fn scattered(&mut self, bounces: u32) {
        self.limit = self.clamp.limit(bounces);
    }

    /// Adds a contribution to the radiance of a start.
    #[inline(always)]
    pub(super) fn add(&mut self, start: u32, value: Spectrum) {
        let kept = if self.limit < f32::INFINITY { self.cut(start, value) } else { value };
        self.radiance[start as usize] += kept;
    }

    /// Another sum, for a part of the light of a start; nothing is cut off from it.
    pub(super) fn part(&mut self) -> u32 {
        self.radiance.push(Spectrum::ZERO);
        self.radiance.len() as u32 - 1
    }

    /// What a start or a part has so far.
    pub(super) fn of(&self, target: u32) -> Spectrum {
        self.radiance[target as usize]
    }

    /// What is left of a contribution. What is no number stays, to be refused by the film.
    #[cold]
    fn cut(&mut self, start: u32, value: Spectrum) -> Spectrum {
        let y = value.luminance();
        if start as usize >= self.starts || !(y > self.limit && y < f32::INFINITY) {
            return value;
        }
        self.removed.add((y - self.limit).min(ExactSum::LIMIT));
        value * (self.limit / y)
    }
}
