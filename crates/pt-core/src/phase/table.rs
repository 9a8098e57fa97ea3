//! Tabulated phase functions, measured or computed elsewhere.

use std::f64::consts::PI;
use std::sync::Arc;

use pt_math::{Pdf, SolidAngle, Vec3};

use super::{PhaseFunction, turned};

/// Values at equidistant cosines of the scattering angle, interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
pub struct TabulatedPhase {
    /// Values of the phase function, for cosines from −1 to 1.
    values: Arc<[f32]>,
    /// Cumulative distribution of the cosine, at each value.
    shares: Arc<[f64]>,
}

impl TabulatedPhase {
    /// Creates the table from values of any scale.
    ///
    /// # Errors
    /// If there are fewer than two values, one is negative or not finite, or all are 0.
    pub fn new(values: &[f32]) -> Result<Self, String> {
        if values.len() < 2 {
            return Err(format!(
                "the table of the phase function has {} values; expected two or more",
                values.len()
            ));
        }
        if let Some(bad) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(format!(
                "a value of the phase function's table is {bad}; expected finite numbers from 0 up"
            ));
        }
        let mut sums = vec![0.0];
        for pair in values.windows(2) {
            let below = sums[sums.len() - 1];
            sums.push(below + 0.5 * (f64::from(pair[0]) + f64::from(pair[1])));
        }
        let all = sums[sums.len() - 1];
        if all == 0.0 {
            return Err("the table of the phase function is 0 everywhere".to_owned());
        }
        // ∫ p dω = 2π ∫ p dcos, where a step is 2 / (count − 1).
        let whole = all * 4.0 * PI / (values.len() - 1) as f64;
        let value = |v: &f32| (f64::from(*v) / whole) as f32;
        Ok(Self {
            values: values.iter().map(value).collect(),
            shares: sums.iter().map(|sum| sum / all).collect(),
        })
    }

    /// Inverse of the cumulative distribution of the cosine at u.
    fn cosine(&self, u: f32) -> f64 {
        let (u, intervals) = (f64::from(u), self.values.len() - 1);
        let i = (self.shares.partition_point(|share| *share <= u) - 1).min(intervals - 1);
        let inside = (u - self.shares[i]) / (self.shares[i + 1] - self.shares[i]);
        let (a, b) = (f64::from(self.values[i]), f64::from(self.values[i + 1]));
        // The root x of a x + (b − a) x² / 2 = inside (a + b) / 2, without cancellation.
        let root = (a * a + inside * (b * b - a * a)).max(0.0).sqrt();
        let x = if a + root > 0.0 { inside * (a + b) / (a + root) } else { 0.0 };
        ((i as f64 + x) * 2.0 / intervals as f64 - 1.0).clamp(-1.0, 1.0)
    }
}

impl PhaseFunction for TabulatedPhase {
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let intervals = (self.values.len() - 1) as f32;
        let at = (0.5 * (1.0 - wo.dot(wi)) * intervals).clamp(0.0, intervals);
        let i = (at as usize).min(self.values.len() - 2);
        let (a, b) = (self.values[i], self.values[i + 1]);
        Pdf::new(a + (b - a) * (at - i as f32))
    }

    fn sample(&self, wo: Vec3, [u, v]: [f32; 2]) -> Vec3 {
        turned(wo, self.cosine(u), v)
    }

    fn examples() -> Vec<Self> {
        let tables: [&[f32]; 3] =
            [&[1.0, 1.0], &[0.5, 0.1, 0.4, 2.0, 7.0], &[3.0, 0.25, 0.25, 0.5, 1.0, 0.125]];
        tables.map(|values| Self::new(values).expect("a table")).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::super::{HenyeyGreenstein, Rayleigh};
    use super::*;

    /// A fine table of a known function agrees with it, and so do its samples.
    #[test]
    fn tables_of_known_functions_are_these() {
        const COUNT: u16 = 20_001;
        let sideways = |cos: f32| {
            let wi = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, -cos);
            [HenyeyGreenstein { g: 0.5 }.pdf(Vec3::Z, wi), Rayleigh.pdf(Vec3::Z, wi)]
        };
        for kind in [0, 1] {
            let cos = |i: u16| f32::from(i) * 2.0 / f32::from(COUNT - 1) - 1.0;
            // The scale is arbitrary.
            let values: Vec<_> = (0..COUNT).map(|i| 3.0 * sideways(cos(i))[kind].get()).collect();
            let table = TabulatedPhase::new(&values).expect("a table");
            let mut random = Random::new(1);
            for _ in 0..1000 {
                let wi = random.direction();
                let (found, wanted) = (table.pdf(Vec3::Z, wi).get(), sideways(-wi.z)[kind].get());
                assert!((found - wanted).abs() < 1e-4 * wanted, "{wi}: {found} for {wanted}");
                let u = random.unit_2d();
                let known = HenyeyGreenstein { g: 0.5 }.sample(Vec3::Z, u);
                let drawn = table.sample(Vec3::Z, u);
                assert!(kind == 1 || (known - drawn).length() < 1e-3, "{drawn} for {known}");
            }
        }
    }

    #[test]
    fn directions_of_no_light_are_not_drawn() {
        let table =
            TabulatedPhase::new(&[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]).expect("a table");
        for i in 0..10_000u16 {
            let wi = table.sample(Vec3::Z, [f32::from(i) / 10_000.0, 0.25]);
            let place = 3.5 * (1.0 - wi.z);
            let is_lit = (0.9999..3.0001).contains(&place) || (3.9999..6.0001).contains(&place);
            assert!(is_lit, "{place}");
        }
    }

    #[test]
    fn tables_that_are_none_are_refused() {
        let cases: [(&[f32], &str); 4] = [
            (&[1.0], "has 1 values; expected two or more"),
            (&[1.0, -1.0], "is -1; expected finite numbers from 0 up"),
            (&[f32::INFINITY, 1.0], "is inf"),
            (&[0.0, 0.0], "0 everywhere"),
        ];
        for (values, wanted) in cases {
            let message = TabulatedPhase::new(values).unwrap_err();
            assert!(message.contains(wanted), "{message}");
        }
    }
}
