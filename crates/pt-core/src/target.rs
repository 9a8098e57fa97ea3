//! Error targets: how a render that ends when its image is good enough shares out samples, and when
//! it ends.
//!
//! The film has two halves that know nothing of each other, and their difference tells the error
//! (`film/error_estimate.rs`). Nothing of it may depend on what it judges:
//!
//! * As long as pixels are not told apart, all have the same samples (the pilot). Then how many
//!   samples a pixel has follows from how much the halves of its *neighbours* differed in the
//!   pilot, times a goal for all pixels: so its mean is that of as many samples as something else
//!   had decided, which has no bias.
//! * The goal alone depends on the error, which is a sum over all pixels, and to which one adds as
//!   little as it is one of many.
//! * Whoever looks often finds a good moment by chance: looks share the probability with which one
//!   may be wrong, so that all together are wrong in a share 1 − c of renders at most.
//! * What no sample has found is in the error, too (`film/missing_mass.rs`): it says how many
//!   samples each pixel needs at least.
//! * Pixels that are known to see nothing but an even sky hide nothing, and get next to no samples.

use std::ops::Range;

use crate::film::{
    ErrorBudget, ErrorEstimate, Film, PixelSums, SamplePlan, SquaredErrors, deviations,
};
use crate::settings::Target;

/// Samples of each half of a pixel before the first look.
const FIRST_GOAL: u32 = 8;

/// The share of the pilot in all samples of a pixel, one in so many.
const PILOT_SHARE: f64 = 6.0;

/// The power of densities that is taken in place of the best one for known variances: it is better
/// where they are guessed from few numbers with long tails, and where more samples are worth more
/// than independent ones. Of five scenes, 0.6 to 1 were tried: it saves a tenth of the samples at
/// most, and costs 0.02.
const DENSITY_EXPONENT: f64 = 0.8;

/// The least density, as a share of the average: nothing is sampled never.
const MIN_DENSITY: f64 = 0.05;

/// How far neighbours are away that tell how many samples a pixel needs, in columns and rows. Of
/// seven scenes with 64 samples, those of 2 to 12 were tried: 2 is too little where paths are
/// noisy, and 8 too much where shapes are small.
const NEIGHBOR_RADIUS: usize = 4;

/// Side of the squares of pixels in each of which [`Target::noise`] holds.
const BLOCK: usize = 8;

/// Shares of the probability 1 − c with which a render may be wrong: by what no sample found; by
/// looks before pixels are told apart, which hardly ever find an image good enough; and by those
/// after, of which the first is meant to come too early.
const WRONG_UNSEEN: f64 = 0.2;
const WRONG_EARLY: f64 = 0.02;
const WRONG_FIRST: f64 = 0.02;
const WRONG_LATER: f64 = 0.76;

/// Shares that what no sample found may have in the square of the error, of which that with the
/// fewest samples is taken: from the greatest on, each this much less than the one before.
const UNSEEN_SHARES: (f64, f64, i32) = (4.0, 0.7, 12);

/// The smallest step of a goal between two looks: each look costs confidence.
const MIN_STEP: f64 = 1.03;

/// From one goal to the next that is considered.
const STEP: f64 = 1.03;

/// Steps of a goal that are considered: up to a thousandfold.
const STEPS: usize = 234;

/// The largest step of a goal between two looks, but when pixels are first told apart.
const LARGEST_STEP: u32 = 2;

/// Powers of the factor by which the variance has still to fall that more samples are taken to
/// bring: points of a sequence are better than independent ones, by which it is reckoned. Of the
/// next round when pixels are told apart, and later; and the least, the likely and the greatest of
/// all that follows.
const FIRST: f64 = 0.7;
const LATER: f64 = 1.0;
const EXPECTED: [f64; 3] = [0.55, 0.85, 1.1];

/// What a look at a film found.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The error of the image.
    pub measured: ErrorEstimate,
    /// How far pixels may be off, in that square of 8 × 8 where they are worst: see
    /// [`Target::noise`].
    pub noise: f64,
    squares: SquaredErrors,
    /// The sum of the squares of errors as it may be, if something is asked of it.
    allowed: Option<f64>,
    /// Ratio of the variance to the allowed one, for each square of pixels; empty if
    /// nothing is asked of them.
    excess_of_squares: Vec<f64>,
}

impl Evaluation {
    /// Returns true if the film is good enough.
    pub fn is_met(&self) -> bool {
        self.greatest_excess() <= 1.0
    }

    fn greatest_excess(&self) -> f64 {
        let of_image = self.excess(1.0, self.squares.fewest);
        self.excess_of_squares.iter().copied().fold(of_image, f64::max)
    }

    /// Returns the ratio of the square of the error to the allowed one, if its noise
    /// is `share` of what it is, and pixels have at least so many samples: 0 if nothing is
    /// asked of it.
    fn excess(&self, share: f64, fewest: u32) -> f64 {
        self.allowed.map_or(0.0, |allowed| self.squares.upper_bound(share, fewest) / allowed)
    }
}

impl Target {
    /// The plan with which a render begins, of which some pixels are vacant: see
    /// [`SamplePlan::vacant`].
    pub fn first_plan(&self, film: &Film, most: u32, vacant: Vec<bool>) -> SamplePlan {
        let goal = FIRST_GOAL.min(most);
        let mut plan = SamplePlan { goal, least: goal, vacant, ..SamplePlan::default() };
        // Nothing is known yet: as much as will be looked at first.
        let wanted = (0..film.region().area()).map(|i| u64::from(plan.wanted(i)));
        plan.expected = [2 * wanted.sum::<u64>(); 3];
        plan
    }

    /// Looks at a film whose plan is fulfilled, of which so many pixels bring their light to each
    /// other. `None` if it has not two halves with samples.
    pub fn evaluate(&self, film: &Film, reuse: u32) -> Option<Evaluation> {
        let squares_of_all = film.squared_errors(self.white, self.budget(film.plan()), reuse)?;
        let allowed = self.error.map(|error| squares_of_all.allowed(error));
        let width = deviations(0.5 * (1.0 - self.confidence));
        let errors = film.square_errors(self.white)?;
        // As many channels as pixels of a square have, at the edges too.
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

    /// With which probabilities a look may find the error of an image less than it is. A single one
    /// has the share of all.
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

    /// What to do after a look that found the film not good enough: the next plan, with at most
    /// `most` samples of a pixel in each half, of which squares of `reuse`² pixels bring their
    /// light to each other. `None` if no pixel may have more.
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
        // The next look has another share in what may be wrong.
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
            // What there is would do for the next look, but that is of another film.
            let more = (MIN_STEP * f64::from(now.least)) as u32;
            next.least = next.least.max(more).max(now.least.saturating_add(1));
        }
        Some(next).filter(|next| model.total(next) > model.total(now))
    }

    /// The variance of the mean luminance of a pixel as its samples tell it; none where the screen
    /// shows no difference.
    fn standard_error(&self, pixel: PixelSums) -> f64 {
        let (mean, error) = pixel.luminance();
        if mean < self.white && error.is_finite() { error * error } else { 0.0 }
    }

    /// Returns the target number of samples of pixels for each of the goal, by what their
    /// neighbours know, outside of the squares of `reuse`² of which they are a part: for the
    /// least error of the image in proportion to the standard deviation of a sample, for the
    /// same error everywhere to the variance; nothing if all are to have the same. It is told
    /// by how much halves differ, which says little of a single pixel, and so by many; and as
    /// much by how samples differ within halves, which says more, and so by the next pixels,
    /// but not how good the sequence of samples is: relative to many. Vacant pixels are no
    /// neighbours.
    fn densities(&self, film: &Film, plan: &SamplePlan, reuse: u32) -> Option<Vec<f32>> {
        if self.uniform {
            return Some(Vec::new());
        }
        let power = if self.noise.is_none() { DENSITY_EXPONENT * 0.5 } else { DENSITY_EXPONENT };
        let errors = film.square_errors(self.white)?.into_iter().map(|e| libm::pow(e, power));
        let errors: Vec<f64> = errors.collect();
        let spread: Vec<f64> =
            film.pixels().map(|pixel| libm::pow(self.standard_error(pixel), power)).collect();
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
        // 1, and 0 where all neighbours are vacant.
        let told = around(&occupied, NEIGHBOR_RADIUS);
        let relative = |d: f64, told: f64| if mean > 0.0 && told > 0.0 { d / mean } else { 1.0 };
        let mixed = |d: f64, told| MIN_DENSITY + (1.0 - MIN_DENSITY) * relative(d, told);
        Some(densities.into_iter().zip(told).map(|(d, told)| mixed(d, told) as f32).collect())
    }
}

/// The sums of the values of the pixels of each square of [`BLOCK`]² pixels, row by row.
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

/// The sum of the values of each pixel and of those at most `reach` columns and rows away.
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

/// What the error of an image will be with more samples, if these are as good as independent ones.
struct Model<'a> {
    film: &'a Film,
    most: u32,
    /// Of each pixel, times its samples.
    variances: Vec<f64>,
    /// The error of each square as it is.
    now: Vec<f64>,
}

impl<'a> Model<'a> {
    /// Of a film whose plan is fulfilled, with the square errors of its pixels.
    fn new(film: &'a Film, errors: Vec<f64>, plan: &SamplePlan, most: u32) -> Self {
        let now = of_squares(film, &errors);
        let mut model = Self { film, most, variances: errors, now };
        for i in 0..model.variances.len() {
            model.variances[i] *= f64::from(model.count(plan, i));
        }
        model
    }

    /// As many samples of a pixel in each half as the plan says, and may be.
    fn count(&self, plan: &SamplePlan, pixel: usize) -> u32 {
        plan.wanted(pixel).min(self.most)
    }

    /// The samples of all pixels in each half.
    fn total(&self, plan: &SamplePlan) -> u64 {
        (0..self.variances.len()).map(|i| u64::from(self.count(plan, i))).sum()
    }

    /// Returns the number of pixels that show more than background; at least 1.
    fn occupied(&self, plan: &SamplePlan) -> usize {
        (0..self.variances.len()).filter(|&i| !plan.is_background_only(i)).count().max(1)
    }

    /// What [`Evaluation::greatest_excess`] will be.
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

    /// The plan with the fewest samples by which the excess falls by this power of what it has to,
    /// if the plan that is fulfilled gives way to another, with another goal and more samples
    /// of each pixel.
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

    /// A plan with the least goal by which no more excess is left than this, as far as goals are
    /// considered; and what is then left.
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
