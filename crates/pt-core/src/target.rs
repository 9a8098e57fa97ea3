//! Error targets: distribution of samples among pixels, and the stopping criterion, of renders that
//! end when their error is small enough.
//!
//! The film has two independent half buffers, whose difference estimates the error
//! (`film/error_estimate.rs`). No decision may depend on the value that it affects:
//!
//! * Until densities are known, all pixels have the same number of samples (the pilot). Then the
//!   number of samples of a pixel is determined by the differences of the halves of its
//!   *neighbours* in the pilot, times a goal for all pixels. So its mean is that of a number of
//!   samples chosen independently of it, which has no bias.
//! * Only the goal depends on the error, a sum over all pixels, to which a single pixel contributes
//!   little.
//! * Repeated testing inflates the error rate, so the allowed failure probability is divided among
//!   all interim evaluations. Together they are wrong in a fraction of at most 1 − c of renders,
//!   with the confidence c.
//! * The error includes missing mass (`film/missing_mass.rs`), which determines the minimum number
//!   of samples of each pixel.
//! * Pixels that are known to show only a constant background hide no features, and get almost no
//!   samples.

use std::ops::Range;

use crate::film::{
    ErrorBudget, ErrorEstimate, Film, PixelSums, SamplePlan, SquaredErrors, deviations,
};
use crate::settings::Target;

/// Number of samples of a pixel in each half before the first evaluation.
const FIRST_GOAL: u32 = 8;

/// Ratio of the total number of samples of a pixel to that of the pilot.
const PILOT_SHARE: f64 = 6.0;

/// Exponent applied to the densities that are optimal for known variances. An exponent below 1 is
/// better if variances are estimated from few values with heavy tails, and if additional samples
/// are worth more than independent ones. On five scenes, 0.6 to 1 were tried: this one saves up to
/// a tenth of the samples and costs at most 0.02.
const DENSITY_EXPONENT: f64 = 0.8;

/// Smallest density relative to the average, so that every pixel is sampled.
const MIN_DENSITY: f64 = 0.05;

/// Radius, in columns and rows, of the neighbourhood from which the density of a pixel is
/// estimated. On seven scenes with 64 samples, 2 to 12 were tried: 2 is too small for noisy paths,
/// and 8 too large for small shapes.
const NEIGHBOR_RADIUS: usize = 4;

/// Side of the blocks of pixels in each of which [`Target::noise`] holds.
const BLOCK: usize = 8;

/// Fractions of the failure probability 1 − c: for missing mass; for evaluations during the pilot,
/// which hardly ever meet the target; for the first evaluation after the pilot, which is expected
/// to come too early; and for all later ones.
const WRONG_UNSEEN: f64 = 0.2;
const WRONG_EARLY: f64 = 0.02;
const WRONG_FIRST: f64 = 0.02;
const WRONG_LATER: f64 = 0.76;

/// Fractions of the squared error that missing mass may have, of which the one that needs the
/// fewest samples is chosen: the largest, the ratio of each to the one before, and their number.
const UNSEEN_SHARES: (f64, f64, i32) = (4.0, 0.7, 12);

/// Smallest ratio of the goals of consecutive evaluations: each evaluation costs confidence.
const MIN_STEP: f64 = 1.03;

/// Ratio of consecutive goals that are considered.
const STEP: f64 = 1.03;

/// Number of goals that are considered: up to a thousandfold.
const STEPS: usize = 234;

/// Largest ratio of the goals of consecutive evaluations, except when densities are first set.
const LARGEST_STEP: u32 = 2;

/// Exponents of the factor by which the variance still has to fall, for the samples to be planned.
/// The prediction assumes independent samples, but the points of a sequence converge faster. For
/// the round in which densities are first set, and for later ones; and for the lower bound, the
/// expected value and the upper bound of the total.
const FIRST: f64 = 0.7;
const LATER: f64 = 1.0;
const EXPECTED: [f64; 3] = [0.55, 0.85, 1.1];

/// Result of the evaluation of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Error of the image.
    pub measured: ErrorEstimate,
    /// Error of pixels in the block of 8 × 8 with the largest error: see [`Target::noise`].
    pub noise: f64,
    squares: SquaredErrors,
    /// Largest sum of squared errors that meets the target; `None` if there is no target for it.
    allowed: Option<f64>,
    /// Ratio of the variance to the allowed one, for each block of pixels; empty if there is no
    /// target for blocks.
    excess_of_squares: Vec<f64>,
}

impl Evaluation {
    /// Returns true if the film meets the target.
    pub fn is_met(&self) -> bool {
        self.greatest_excess() <= 1.0
    }

    fn greatest_excess(&self) -> f64 {
        let of_image = self.excess(1.0, self.squares.fewest);
        self.excess_of_squares.iter().copied().fold(of_image, f64::max)
    }

    /// Returns the ratio of the squared error to the allowed one if the noise is multiplied by
    /// `share` and pixels have at least `fewest` samples; 0 if there is no target for it.
    fn excess(&self, share: f64, fewest: u32) -> f64 {
        self.allowed.map_or(0.0, |allowed| self.squares.upper_bound(share, fewest) / allowed)
    }
}

impl Target {
    /// Returns the initial plan of a render. `vacant` marks pixels that show only background: see
    /// [`SamplePlan::vacant`].
    pub fn first_plan(&self, film: &Film, most: u32, vacant: Vec<bool>) -> SamplePlan {
        let goal = FIRST_GOAL.min(most);
        let mut plan = SamplePlan { goal, least: goal, vacant, ..SamplePlan::default() };
        // Nothing is known yet: as many as before the first evaluation.
        let wanted = (0..film.region().area()).map(|i| u64::from(plan.wanted(i)));
        plan.expected = [2 * wanted.sum::<u64>(); 3];
        plan
    }

    /// Evaluates a film whose plan is fulfilled, with paths reused in squares of `reuse`² pixels.
    /// `None` unless it has two half buffers with samples.
    pub fn evaluate(&self, film: &Film, reuse: u32) -> Option<Evaluation> {
        let squares_of_all = film.squared_errors(self.white, self.budget(film.plan()), reuse)?;
        let allowed = self.error.map(|error| squares_of_all.allowed(error));
        let width = deviations(0.5 * (1.0 - self.confidence));
        let errors = film.square_errors(self.white)?;
        // Number of channels of each block, which is smaller at the edges.
        let ones = of_squares(film, &vec![3.0; errors.len()]);
        let squares = of_squares(film, &errors).into_iter().zip(ones).map(|(sum, n)| sum / n);
        let squares: Vec<f64> = squares.collect();
        let worst = squares.iter().copied().fold(0.0, f64::max);
        let excess_of_squares = self.noise.map_or(Vec::new(), |noise| {
            squares.iter().map(|square| square * (width / noise).powi(2)).collect()
        });
        let (measured, noise) = (squares_of_all.estimate(), width * worst.sqrt());
        Some(Evaluation { measured, noise, squares: squares_of_all, allowed, excess_of_squares })
    }

    /// Returns the probabilities with which an evaluation may underestimate the error of an image.
    /// Without a plan, a single evaluation gets the whole probability.
    fn budget(&self, plan: Option<&SamplePlan>) -> ErrorBudget {
        let of_look = |k: u32| 1.0 / (f64::from(k) * (f64::from(k) + 1.0));
        let evaluation = match plan {
            None => 1.0 - WRONG_UNSEEN,
            Some(SamplePlan { densities: None, rounds, .. }) => WRONG_EARLY * of_look(rounds + 1),
            Some(SamplePlan { rounds: 0, .. }) => WRONG_FIRST,
            Some(SamplePlan { rounds, .. }) => WRONG_LATER * of_look(*rounds),
        };
        let budget = 1.0 - self.confidence;
        ErrorBudget { noise: budget * evaluation, missing_mass: budget * WRONG_UNSEEN }
    }

    /// Returns the next plan after an evaluation that did not meet the target. A pixel gets at most
    /// `most` samples in each half; paths are reused in squares of `reuse`² pixels. `None` if no
    /// pixel may have more.
    pub fn next_plan(
        &self,
        film: &Film,
        evaluation: &Evaluation,
        reuse: u32,
        most: u32,
    ) -> Option<SamplePlan> {
        let now = film.plan()?;
        let model = Model::new(film, film.square_errors(self.white)?, now, most);
        let is_new = now.densities.is_none();
        let apart = if is_new {
            SamplePlan {
                rounds: 0,
                densities: Some(self.densities(film, now, reuse)?),
                ..now.clone()
            }
        } else {
            SamplePlan { rounds: now.rounds + 1, ..now.clone() }
        };
        // The next evaluation has another failure probability.
        let squares = evaluation.squares.with_budget(self.budget(Some(&apart)));
        let evaluation = &Evaluation { squares, ..evaluation.clone() };
        let expected =
            EXPECTED.map(|power| 2 * model.total(&model.plan(evaluation, (now, &apart), power)));
        let news = SamplePlan { error: Some(evaluation.measured.error), expected, ..apart };
        let mut next = model.plan(evaluation, (now, &news), if is_new { FIRST } else { LATER });
        let largest = now.goal.saturating_mul(LARGEST_STEP);
        if is_new {
            let mean = model.total(&next) as f64 / model.occupied(now) as f64;
            let pilot = ((mean / PILOT_SHARE) as u32).min(most);
            if now.goal + now.goal / 4 < pilot {
                let goal = pilot.min(largest);
                let rounds = now.rounds + 1;
                return Some(SamplePlan { goal, rounds, least: goal, densities: None, ..next });
            }
        } else {
            next.goal = next.goal.min(largest);
        }
        if model.total(&next) <= model.total(now) {
            // By the prediction, the present samples meet the target, but the next evaluation must
            // be of another film.
            let more = (MIN_STEP * f64::from(now.least)) as u32;
            next.least = next.least.max(more).max(now.least.saturating_add(1));
        }
        Some(next).filter(|next| model.total(next) > model.total(now))
    }

    /// Returns the variance of the mean luminance of a pixel, estimated from its samples; 0 if it
    /// is displayed as white or has too few samples.
    fn variance_of_mean(&self, pixel: PixelSums) -> f64 {
        let (mean, error) = pixel.luminance();
        if mean < self.white && error.is_finite() { error * error } else { 0.0 }
    }

    /// Returns the number of samples of each pixel relative to the goal, estimated from its
    /// neighbours outside of the squares of `reuse`² pixels that it may share with them; empty if
    /// all pixels are to have the same number. `None` if a pixel lacks samples.
    ///
    /// For the smallest error of the image, densities are proportional to the standard deviation of
    /// a sample; for the same error everywhere, to the variance. The variance is estimated, with
    /// equal weights, from (a) the half-buffer difference averaged over a large neighbourhood,
    /// since it is noisy per pixel, and (b) the same times the within-half sample variance over the
    /// adjacent pixels relative to that over the large neighbourhood. The latter is more precise,
    /// but ignores the convergence rate of the sample sequence. Vacant pixels are no neighbours.
    fn densities(&self, film: &Film, plan: &SamplePlan, reuse: u32) -> Option<Vec<f32>> {
        if self.uniform {
            return Some(Vec::new());
        }
        let power = if self.noise.is_none() { DENSITY_EXPONENT * 0.5 } else { DENSITY_EXPONENT };
        let errors = film.square_errors(self.white)?.into_iter().map(|e| libm::pow(e, power));
        let errors: Vec<f64> = errors.collect();
        let spread: Vec<f64> =
            film.pixels().map(|pixel| libm::pow(self.variance_of_mean(pixel), power)).collect();
        let width = film.region().width as usize;
        let occupied = (0..errors.len()).map(|i| f64::from(u8::from(!plan.is_background_only(i))));
        let occupied: Vec<f64> = occupied.collect();
        let around = |values: &[f64], reach: usize| {
            let sums = |values: &[f64]| {
                let inner = sums_around(values, width, reuse as usize - 1);
                let outer = sums_around(values, width, reach + reuse as usize - 1);
                outer.into_iter().zip(inner).map(|(outer, inner)| (outer - inner).max(0.0))
            };
            let sizes = sums(&occupied);
            sums(values).zip(sizes).map(|(sum, n)| sum / n.max(1.0)).collect::<Vec<f64>>()
        };
        let (errors, next_to) = (around(&errors, NEIGHBOR_RADIUS), around(&spread, 1));
        let spread = around(&spread, NEIGHBOR_RADIUS).into_iter().zip(next_to);
        let finer = |far: f64, near: f64| if far > 0.0 { 0.5 * (1.0 + near / far) } else { 1.0 };
        let densities: Vec<f64> =
            errors.into_iter().zip(spread).map(|(e, (far, near))| e * finer(far, near)).collect();
        let sum: f64 = densities.iter().zip(&occupied).map(|(d, occupied)| d * occupied).sum();
        let mean = sum / occupied.iter().sum::<f64>().max(1.0);
        // 1, or 0 if all neighbours are vacant.
        let has_neighbors = around(&occupied, NEIGHBOR_RADIUS);
        let relative = |d: f64, has_neighbors: f64| {
            if mean > 0.0 && has_neighbors > 0.0 { d / mean } else { 1.0 }
        };
        let mixed =
            |d: f64, has_neighbors| MIN_DENSITY + (1.0 - MIN_DENSITY) * relative(d, has_neighbors);
        Some(
            densities
                .into_iter()
                .zip(has_neighbors)
                .map(|(d, has_neighbors)| mixed(d, has_neighbors) as f32)
                .collect(),
        )
    }
}

/// Returns the sums of the values of the pixels of each block of [`BLOCK`]² pixels, row by row.
fn of_squares(film: &Film, values: &[f64]) -> Vec<f64> {
    let width = film.region().width as usize;
    let columns = width.div_ceil(BLOCK);
    let mut sums = vec![0.0; columns * (film.region().height as usize).div_ceil(BLOCK)];
    for (y, row) in values.chunks_exact(width.max(1)).enumerate() {
        for (x, value) in row.iter().enumerate() {
            sums[y / BLOCK * columns + x / BLOCK] += value;
        }
    }
    sums
}

/// Returns, for each pixel, the sum of the values of all pixels at most `reach` columns and rows
/// away, including itself.
fn sums_around(values: &[f64], width: usize, reach: usize) -> Vec<f64> {
    let height = values.len() / width.max(1);
    let near = |i: usize, end: usize| -> Range<usize> {
        i.saturating_sub(reach)..(i + reach + 1).min(end)
    };
    let along_rows: Vec<f64> = (0..values.len())
        .map(|i| near(i % width, width).map(|x| values[i / width * width + x]).sum())
        .collect();
    (0..values.len())
        .map(|i| near(i / width, height).map(|y| along_rows[y * width + i % width]).sum())
        .collect()
}

/// Prediction of the error of an image with more samples, if these are as good as independent ones.
struct Model<'a> {
    film: &'a Film,
    most: u32,
    /// Squared error of each pixel, times its number of samples.
    variances: Vec<f64>,
    /// Present sum of squared errors of each block.
    now: Vec<f64>,
}

impl<'a> Model<'a> {
    /// Creates the model of a film whose plan is fulfilled, from the squared errors of its pixels.
    fn new(film: &'a Film, errors: Vec<f64>, plan: &SamplePlan, most: u32) -> Self {
        let now = of_squares(film, &errors);
        let mut model = Self { film, most, variances: errors, now };
        for i in 0..model.variances.len() {
            model.variances[i] *= f64::from(model.count(plan, i));
        }
        model
    }

    /// Returns the number of samples of a pixel in each half by the plan, at most `most`.
    fn count(&self, plan: &SamplePlan, pixel: usize) -> u32 {
        plan.wanted(pixel).min(self.most)
    }

    /// Returns the number of samples of all pixels in each half.
    fn total(&self, plan: &SamplePlan) -> u64 {
        (0..self.variances.len()).map(|i| u64::from(self.count(plan, i))).sum()
    }

    /// Returns the number of pixels that show more than background; at least 1.
    fn occupied(&self, plan: &SamplePlan) -> usize {
        (0..self.variances.len()).filter(|&i| !plan.is_background_only(i)).count().max(1)
    }

    /// Predicts [`Evaluation::greatest_excess`] for a plan.
    fn excess(&self, evaluation: &Evaluation, plan: &SamplePlan) -> f64 {
        let mut fewest = self.most;
        let errors = self.variances.iter().enumerate().map(|(i, v)| {
            let count = self.count(plan, i);
            if !plan.is_background_only(i) {
                fewest = fewest.min(count);
            }
            v / f64::from(count.max(1))
        });
        let then = of_squares(self.film, &errors.collect::<Vec<f64>>());
        let fall = |then: f64, now: f64| if now > 0.0 { then / now } else { 1.0 };
        let [all_then, all_now] = [&then, &self.now].map(|sums| sums.iter().sum::<f64>());
        let of_image = evaluation.excess(fall(all_then, all_now), fewest.saturating_mul(2));
        let of_squares = evaluation.excess_of_squares.iter().zip(then.iter().zip(&self.now));
        let of_squares = of_squares.map(|(excess, (&then, &now))| excess * fall(then, now));
        of_squares.fold(of_image, f64::max)
    }

    /// Returns the plan with the fewest samples that reduces the excess by this power of the
    /// required factor. `now` is the fulfilled plan. The result is `then` with another goal and
    /// another minimum number of samples of each pixel.
    fn plan(
        &self,
        evaluation: &Evaluation,
        (now, then): (&SamplePlan, &SamplePlan),
        power: f64,
    ) -> SamplePlan {
        let left = libm::pow(evaluation.greatest_excess().max(1.0), 1.0 - power);
        let (greatest, factor, shares) = UNSEEN_SHARES;
        let missing_mass = evaluation.allowed.into_iter().flat_map(|allowed| {
            let share = move |i| greatest * libm::pow(factor, f64::from(i)) * left * allowed;
            (0..shares).map(move |i| evaluation.squares.samples_for_missing_mass(share(i)))
        });
        let most = self.most.max(now.least);
        let least =
            missing_mass.map(|samples| ((0.5 * samples).ceil() as u32).clamp(now.least, most));
        let mut least: Vec<u32> = [now.least].into_iter().chain(least).collect();
        least.dedup();
        let plans = least.into_iter().map(|least| {
            let (plan, excess) =
                self.with_goal(evaluation, (now, &SamplePlan { least, ..then.clone() }), left);
            let missed = (excess / left).max(1.0);
            (plan, missed)
        });
        let better = |a: (SamplePlan, f64), b: (SamplePlan, f64)| {
            let order = a.1.total_cmp(&b.1).then_with(|| self.total(&a.0).cmp(&self.total(&b.0)));
            if order.is_le() { a } else { b }
        };
        plans.reduce(better).map_or_else(|| then.clone(), |(plan, _)| plan)
    }

    /// Returns the plan with the smallest considered goal at which the excess is at most `left`,
    /// and that excess. If no goal suffices, it is the largest one.
    fn with_goal(
        &self,
        evaluation: &Evaluation,
        (now, then): (&SamplePlan, &SamplePlan),
        left: f64,
    ) -> (SamplePlan, f64) {
        let mut goal = MIN_STEP * f64::from(now.goal);
        let mut goals = vec![now.goal.saturating_add(1).max(goal as u32)];
        for _ in 0..STEPS {
            goal *= STEP;
            goals.push((goal as u32).max(goals[0]));
        }
        let mut plan = then.clone();
        let first = goals.partition_point(|&goal| {
            plan.goal = goal;
            self.excess(evaluation, &plan) > left
        });
        plan.goal = goals[first.min(goals.len() - 1)];
        let excess = self.excess(evaluation, &plan);
        (plan, excess)
    }
}

#[cfg(test)]
mod tests;
