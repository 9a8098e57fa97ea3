//! Films of two halves, whose samples know nothing of each other: how much they differ is how large
//! the error is.

use pt_math::sampler::HALF_B_OFFSET;

use super::{Film, Moments};

/// One of the halves of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HalfBuffer {
    /// Samples from number 0 on.
    First,
    /// Samples from number [`HALF_B_OFFSET`] on.
    Second,
}

impl HalfBuffer {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];
}

/// Target number of samples of each pixel of a film with half buffers, until the next evaluation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SamplePlan {
    /// Samples of a pixel in each half: of all pixels on average, or of each as long as nothing is
    /// known of how they differ.
    pub goal: u32,
    /// How often it was decided that more are needed, since pixels are told apart or before.
    pub rounds: u32,
    /// Samples that each pixel is to have in each half at least.
    pub least: u32,
    /// Once pixels are told apart, how many each is to have for each of the goal; empty if all are
    /// to have the same.
    pub densities: Option<Vec<f32>>,
    /// Pixels of which all samples are known to be the same, since they see nothing but an even
    /// sky; empty if there are none.
    pub vacant: Vec<bool>,
    /// The error when this was decided.
    pub error: Option<f64>,
    /// Estimated total number of samples at that time: lower bound, expected value, upper bound.
    pub expected: [u64; 3],
}

impl SamplePlan {
    /// Returns the target number of samples of pixel number `pixel` in each half. Where pixels
    /// differ these are powers of two, of which the points of a sequence are best: in two
    /// scenes, variance times samples was 6 to 15 % above what powers of two around them had at
    /// 1¼ to 1¾ times a power, and counts that are off by up to √2 take 2 % more samples for
    /// the same.
    #[inline]
    pub fn wanted(&self, pixel: usize) -> u32 {
        if self.is_background_only(pixel) {
            return self.goal.min(BACKGROUND_SAMPLES);
        }
        match self.densities.as_deref() {
            None => self.goal,
            Some([]) => self.least.max(self.goal),
            Some(densities) => {
                let count = f64::from(self.goal) * f64::from(densities[pixel]);
                self.least.max(nearest_power_of_two(count))
            }
        }
    }

    /// Returns true if all samples of pixel number `pixel` are known to be the same.
    #[inline]
    pub fn is_background_only(&self, pixel: usize) -> bool {
        self.vacant.get(pixel).is_some_and(|&vacant| vacant)
    }
}

/// Samples of a pixel of which all are the same, in each half: the variance of two is a number.
const BACKGROUND_SAMPLES: u32 = 2;

/// The power of two that is nearest to a number by their ratio, from 1 to 2³¹.
fn nearest_power_of_two(number: f64) -> u32 {
    let below = 1 << (number as u32).max(1).ilog2();
    let is_nearer = number < std::f64::consts::SQRT_2 * f64::from(below);
    if is_nearer || below == 1 << 31 { below } else { 2 * below }
}

impl Film {
    /// The same with a second half beside the samples that it takes: those of each have scramblings
    /// of their own.
    ///
    /// # Panics
    /// If it has samples, or does not begin with sample 0.
    pub fn with_half_buffers(self) -> Self {
        assert_eq!((self.samples(), self.first), (0, 0), "halves begin with their first sample");
        let second = Self::with_aovs(self.region, &self.aovs).starting_at(HALF_B_OFFSET);
        let second = second.with_light_groups(&self.light_groups);
        Self { second: Some(Box::new(second)), ..self }
    }

    /// Returns true if it has two halves.
    pub fn has_half_buffers(&self) -> bool {
        self.second.is_some()
    }

    /// A half, to which samples can be added.
    ///
    /// # Panics
    /// If it has none.
    pub fn half_mut(&mut self, half: HalfBuffer) -> &mut Self {
        match half {
            HalfBuffer::First => self,
            HalfBuffer::Second => self.second.as_mut().expect("it is in halves"),
        }
    }

    /// Returns the number of samples of each pixel in a half.
    pub fn counts_of(&self, half: HalfBuffer) -> impl Iterator<Item = u32> {
        self.moments(half).map(|moments| moments.count)
    }

    /// What a half knows of each pixel.
    pub(super) fn moments(&self, half: HalfBuffer) -> impl ExactSizeIterator<Item = Moments> {
        let film = match half {
            HalfBuffer::First => self,
            HalfBuffer::Second => self.second.as_deref().unwrap_or(self),
        };
        film.sums.iter().zip(&film.counts).map(|(&sums, &count)| Moments { sums, count })
    }

    /// Returns the target number of samples of each pixel, if there is one.
    pub fn plan(&self) -> Option<&SamplePlan> {
        self.plan.as_ref()
    }

    /// Decides how many samples each pixel is to have.
    pub fn set_plan(&mut self, plan: SamplePlan) {
        self.plan = Some(plan);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_differ_have_powers_of_two() {
        let numbers = [0.0, 1.0, 1.41, 1.42, 90.5, 90.6, 128.0, 1e20];
        let wanted = [1, 1, 1, 2, 64, 128, 128, 1 << 31];
        assert_eq!(numbers.map(nearest_power_of_two), wanted);
        let plan =
            |densities| SamplePlan { goal: 100, least: 40, densities, ..SamplePlan::default() };
        let apart = plan(Some(vec![0.1, 0.5, 1.0, 3.0]));
        assert_eq!([0, 1, 2, 3].map(|i| apart.wanted(i)), [40, 64, 128, 256]);
        assert_eq!([None, Some(Vec::new())].map(|densities| plan(densities).wanted(2)), [100; 2]);
    }
}
