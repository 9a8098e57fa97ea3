//! Particles of different kinds side by side.

use pt_math::{Pdf, SolidAngle, Vec3};

use super::{HenyeyGreenstein, PhaseFunction, Rayleigh};

/// Most shares with a mean cosine of their own.
const MOST: usize = 4;

/// p = Σ wᵢpᵢ: shares of Henyey and Greenstein's function, each with its g (0 is isotropic), and one of Rayleigh's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// Share and function; the first [`Self::count`] count.
    lobes: [(f32, HenyeyGreenstein); MOST],
    count: usize,
    /// What the others leave of 1.
    rayleigh: f32,
}

impl Blend {
    /// Of shares that add up to 1, where `None` is Rayleigh's function. Functions that are the same become one.
    ///
    /// # Errors
    /// If more than four of them have different g.
    pub fn new(parts: &[(f32, Option<HenyeyGreenstein>)]) -> Result<Self, String> {
        let mut blend =
            Self { lobes: [(0.0, HenyeyGreenstein { g: 0.0 }); MOST], count: 0, rayleigh: 0.0 };
        for &(share, part) in parts.iter().filter(|(share, _)| *share > 0.0) {
            let Some(part) = part else {
                blend.rayleigh += share;
                continue;
            };
            let known = blend.lobes[..blend.count].iter_mut().find(|(_, lobe)| *lobe == part);
            if let Some(known) = known {
                known.0 += share;
            } else if blend.count < MOST {
                blend.lobes[blend.count] = (share, part);
                blend.count += 1;
            } else {
                return Err(format!(
                    "more than {MOST} phase functions with different g are blended; leave out the one with the smallest share"
                ));
            }
        }
        Ok(blend)
    }

    fn lobes(&self) -> &[(f32, HenyeyGreenstein)] {
        &self.lobes[..self.count]
    }
}

impl PhaseFunction for Blend {
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let lobes = self.lobes().iter().map(|(share, lobe)| share * lobe.pdf(wo, wi).get());
        Pdf::new(lobes.sum::<f32>() + self.rayleigh * Rayleigh.pdf(wo, wi).get())
    }

    /// One of them is chosen by its share, and what is left of the first number draws from it.
    fn sample(&self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        let mut below = 0.0;
        let rescaled = |u: f32, below: f32, share: f32| {
            ((u - below) / share).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
        };
        for &(share, lobe) in self.lobes() {
            // Shares may add up to a little less than 1: the last one has the rest.
            if u < below + share {
                return lobe.sample(wo, [rescaled(u, below, share), v]);
            }
            below += share;
        }
        match self.lobes().last() {
            Some((share, lobe)) if self.rayleigh == 0.0 => {
                lobe.sample(wo, [rescaled(u, below - share, *share), v])
            }
            _ => Rayleigh.sample(wo, [rescaled(u, below, self.rayleigh), v]),
        }
    }

    fn examples() -> Vec<Self> {
        let hg = |g| Some(HenyeyGreenstein { g });
        let all: [&[_]; 4] = [
            &[(0.6, hg(0.7)), (0.4, hg(-0.3))],
            &[(0.25, None), (0.75, hg(0.5))],
            &[(0.1, hg(0.0)), (0.2, hg(0.85)), (0.3, hg(-0.6)), (0.15, hg(0.3)), (0.25, None)],
            &[(0.5, None), (0.5, None)],
        ];
        all.map(|parts| Self::new(parts).expect("few of them")).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_functions_are_one_and_five_different_ones_are_refused() {
        let hg = |g| Some(HenyeyGreenstein { g });
        let same = [0.5, 0.5, 0.1, 0.5, 0.1, 0.5].map(|g| (1.0 / 6.0, hg(g)));
        assert_eq!(Blend::new(&same).map(|blend| blend.count), Ok(2));
        let five = [0.1, 0.2, 0.3, 0.4, 0.5].map(|g| (0.2, hg(g)));
        assert!(Blend::new(&five).unwrap_err().contains("more than 4"));
        assert!(Blend::new(&[(1.0, hg(0.5)), (0.0, hg(0.6))]).is_ok_and(|b| b.count == 1));
    }
}
