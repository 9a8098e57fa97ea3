//! Films of two halves, whose samples know nothing of each other: how much they differ is how large the error is.

use pt_math::sampler::SECOND_HALF;

use super::{Film, Moments};

/// One of the halves of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// Samples from number 0 on.
    First,
    /// Samples from number [`SECOND_HALF`] on.
    Second,
}

impl Half {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];
}

/// How many samples each pixel of a film of two halves is to have, until more is decided.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Samples of a pixel in each half: of all pixels on average, or of each as long as nothing is known of
    /// how they differ.
    pub goal: u32,
    /// How often it was decided that more are needed, since pixels are told apart or before.
    pub rounds: u32,
    /// Samples that each pixel is to have in each half at least.
    pub least: u32,
    /// Once pixels are told apart, how many each is to have for each of the goal.
    pub densities: Option<Vec<f32>>,
    /// The error when this was decided.
    pub error: Option<f64>,
    /// How many samples of all pixels were then foreseen: hardly less, likely, and hardly more.
    pub expected: [u64; 3],
}

impl Plan {
    /// How many samples pixel number `pixel` is to have in each half.
    #[inline]
    pub fn wanted(&self, pixel: usize) -> u32 {
        match &self.densities {
            None => self.goal,
            Some(densities) => {
                self.least.max((f64::from(self.goal) * f64::from(densities[pixel])) as u32)
            }
        }
    }
}

impl Film {
    /// The same with a second half beside the samples that it takes: those of each have scramblings of their own.
    ///
    /// # Panics
    /// If it has samples, or does not begin with sample 0.
    pub fn in_halves(self) -> Self {
        assert_eq!((self.samples(), self.first), (0, 0), "halves begin with their first sample");
        let second = Self::with_aovs(self.region, &self.aovs).starting_at(SECOND_HALF);
        let second = second.with_light_groups(&self.light_groups);
        Self { second: Some(Box::new(second)), ..self }
    }

    /// Whether it has two halves.
    pub fn is_in_halves(&self) -> bool {
        self.second.is_some()
    }

    /// A half, to which samples can be added.
    ///
    /// # Panics
    /// If it has none.
    pub fn half_mut(&mut self, half: Half) -> &mut Self {
        match half {
            Half::First => self,
            Half::Second => self.second.as_mut().expect("it is in halves"),
        }
    }

    /// How many samples each pixel has in a half.
    pub fn counts_of(&self, half: Half) -> impl Iterator<Item = u32> {
        self.moments(half).map(|moments| moments.count)
    }

    /// What a half knows of each pixel.
    pub(super) fn moments(&self, half: Half) -> impl ExactSizeIterator<Item = Moments> {
        let film = match half {
            Half::First => self,
            Half::Second => self.second.as_deref().unwrap_or(self),
        };
        film.sums.iter().zip(&film.counts).map(|(&sums, &count)| Moments { sums, count })
    }

    /// How many samples each pixel is to have, if that was decided.
    pub fn plan(&self) -> Option<&Plan> {
        self.plan.as_ref()
    }

    /// Decides how many samples each pixel is to have.
    pub fn set_plan(&mut self, plan: Plan) {
        self.plan = Some(plan);
    }
}
