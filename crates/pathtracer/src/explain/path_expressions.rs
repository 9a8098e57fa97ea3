//! Contributions by light path expression. [Heckbert 1990, §2]

use std::collections::BTreeMap;

use super::{Contribution, Sample, ScatterEvent, Trace, luminance_of};

/// Contributions to a pixel with the same light path expression.
#[derive(Clone, Debug, PartialEq)]
pub struct PathExpression {
    /// Light path expression; see [`expression`].
    pub expression: String,
    /// Number of samples with such contributions.
    pub samples: u32,
    /// Mean luminance of the contributions.
    pub luminance: f64,
    /// Fraction of the mean luminance of the pixel.
    pub share_of_mean: f64,
    /// Variance of the luminance of these contributions in a sample.
    pub variance: f64,
    /// Fraction of the variance of a sample. The sum of all fractions is not 1, since contributions
    /// with different expressions are correlated.
    pub share_of_variance: f64,
}

/// Returns the light path expression of a contribution, from the light to the camera: `L`, then for
/// each vertex `D` (diffuse), `G` (glossy), `S` (specular) or `V` (volume), then `E`.
pub fn expression(trace: &Trace, contribution: &Contribution) -> String {
    let letter = |event| match event {
        ScatterEvent::Diffuse => " D",
        ScatterEvent::Glossy => " G",
        ScatterEvent::Specular => " S",
        ScatterEvent::Volume => " V",
    };
    let way: String = trace.events(contribution).rev().map(letter).collect();
    format!("L{way} E")
}

/// Sums over the samples with contributions of one expression.
#[derive(Clone, Copy, Debug, Default)]
struct RunningMoments {
    samples: u32,
    sum: f64,
    squares: f64,
}

/// Sums of all expressions so far.
#[derive(Debug, Default)]
pub(super) struct PathExpressions {
    by_expression: BTreeMap<String, RunningMoments>,
}

impl PathExpressions {
    /// Adds a sample, and returns its luminance.
    pub(super) fn add(&mut self, sample: &Sample) -> f64 {
        let mut of_sample = BTreeMap::<String, f64>::new();
        for contribution in &sample.trace.contributions {
            let luminance = luminance_of(sample, contribution);
            if luminance != 0.0 {
                *of_sample.entry(expression(&sample.trace, contribution)).or_default() += luminance;
            }
        }
        let total = of_sample.values().sum();
        for (expression, luminance) in of_sample {
            let moments = self.by_expression.entry(expression).or_default();
            moments.samples += 1;
            moments.sum += luminance;
            moments.squares += luminance * luminance;
        }
        total
    }

    /// Returns the statistics of all expressions after `n` samples with this mean and variance.
    pub(super) fn finish(self, n: usize, mean: f64, variance: f64) -> Vec<PathExpression> {
        let n = n as f64;
        let of_type = |(expression, moments): (String, RunningMoments)| {
            let RunningMoments { samples, sum, squares } = moments;
            let of_type = (squares - sum * sum / n).max(0.0) / (n - 1.0).max(1.0);
            PathExpression {
                expression,
                samples,
                luminance: sum / n,
                share_of_mean: share(sum / n, mean),
                variance: of_type,
                share_of_variance: share(of_type, variance),
            }
        };
        let mut types: Vec<_> = self.by_expression.into_iter().map(of_type).collect();
        types.sort_by(|a, b| {
            let by_mean = || b.luminance.total_cmp(&a.luminance);
            b.variance.total_cmp(&a.variance).then_with(by_mean)
        });
        types
    }
}

fn share(part: f64, whole: f64) -> f64 {
    if whole == 0.0 { 0.0 } else { part / whole }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{sample, vertex};
    use super::*;

    #[test]
    fn expressions_go_from_the_light_to_the_eye() {
        let vertices = [vertex(ScatterEvent::Diffuse, false), vertex(ScatterEvent::Specular, true)];
        // A hit behind the mirror; a light sample at the first vertex; directly visible emission.
        let sample = sample(0, &vertices, &[(2, false, 1.0), (1, true, 1.0), (0, false, 1.0)]);
        let trace = &sample.trace;
        let ways: Vec<_> = trace.contributions.iter().map(|c| expression(trace, c)).collect();
        assert_eq!(ways, ["L S D E", "L D E", "L E"]);
    }

    /// For a coat with a Dirac delta, the vertex is specular for hits, and diffuse, by the base,
    /// for light samples.
    #[test]
    fn what_is_asked_for_knows_no_single_directions() {
        let vertices = [vertex(ScatterEvent::Diffuse, true)];
        let sample = sample(0, &vertices, &[(1, false, 1.0), (1, true, 1.0)]);
        let trace = &sample.trace;
        let ways: Vec<_> = trace.contributions.iter().map(|c| expression(trace, c)).collect();
        assert_eq!(ways, ["L S E", "L D E"]);
    }

    /// Two samples with 1 and 3 of one expression, and 3 and 1 of another: each has the variance 2,
    /// the sum has none.
    #[test]
    fn ways_that_make_up_for_each_other_have_variance_and_their_sum_has_none() {
        let vertices = [vertex(ScatterEvent::Diffuse, false)];
        let mut types = PathExpressions::default();
        let both = |a, b| sample(0, &vertices, &[(1, true, a), (0, false, b)]);
        assert_eq!([types.add(&both(1.0, 3.0)), types.add(&both(3.0, 1.0))], [4.0; 2]);
        let types = types.finish(2, 4.0, 0.0);
        assert_eq!(types.iter().map(|t| t.variance).collect::<Vec<_>>(), [2.0; 2]);
        assert!(types.iter().all(|t| t.share_of_mean == 0.5 && t.samples == 2));
    }
}
