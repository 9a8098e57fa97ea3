//! Mixture of phase functions.

use std::sync::Arc;

use pt_math::{Pdf, SolidAngle, Vec3};

use super::{AnyPhase, HenyeyGreenstein, PhaseFunction, Rayleigh, TabulatedPhase};

/// p = Σ wᵢpᵢ: a weighted sum of other phase functions.
#[derive(Clone, Debug, PartialEq)]
pub struct BlendPhase {
    /// Weight and function; weights are above 0.
    parts: Arc<[(f32, AnyPhase)]>,
}

impl BlendPhase {
    /// Creates a mixture from weights that sum to 1. Equal functions are merged.
    pub fn new(parts: impl IntoIterator<Item = (f32, AnyPhase)>) -> Self {
        let mut all: Vec<(f32, AnyPhase)> = Vec::new();
        for (share, part) in parts.into_iter().filter(|(share, _)| *share > 0.0) {
            match all.iter_mut().find(|(_, known)| *known == part) {
                Some(known) => known.0 += share,
                None => all.push((share, part)),
            }
        }
        Self { parts: all.into() }
    }
}

impl PhaseFunction for BlendPhase {
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        Pdf::new(self.parts.iter().map(|(share, part)| share * part.pdf(wo, wi).get()).sum())
    }

    /// Selects a function by its weight, and remaps the first number to sample it.
    fn sample(&self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        let mut below = 0.0;
        let chosen = self.parts.iter().find_map(|(share, part)| {
            let rest = (u - below) / share;
            below += share;
            (u < below).then_some((rest, part))
        });
        // The weights may sum to slightly less than 1: the last function gets the remainder.
        let last = || self.parts.last().map(|(_, part)| (1.0, part));
        let Some((rest, part)) = chosen.or_else(last) else { return -wo };
        part.sample(wo, [rest.clamp(0.0, 1.0 - f32::EPSILON / 2.0), v])
    }

    fn examples() -> Vec<Self> {
        let hg = |g| AnyPhase::from(HenyeyGreenstein { g });
        let table = TabulatedPhase::new(&[0.5, 0.1, 2.0]).expect("a table");
        vec![
            Self::new([(0.6, hg(0.7)), (0.4, hg(-0.3))]),
            Self::new([(0.25, Rayleigh.into()), (0.75, hg(0.5))]),
            Self::new([
                (0.1, hg(0.0)),
                (0.2, hg(0.85)),
                (0.3, hg(-0.6)),
                (0.15, table.into()),
                (0.25, Rayleigh.into()),
            ]),
            Self::new([(0.5, Rayleigh.into()), (0.5, Rayleigh.into())]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_functions_are_one_and_those_without_a_share_are_none() {
        let hg = |g| AnyPhase::from(HenyeyGreenstein { g });
        let same = [0.5, 0.5, 0.1, 0.5, 0.1, 0.5].map(|g| (1.0 / 6.0, hg(g)));
        assert_eq!(BlendPhase::new(same).parts.len(), 2);
        assert_eq!(BlendPhase::new([(1.0, hg(0.5)), (0.0, hg(0.6))]).parts.len(), 1);
    }
}
