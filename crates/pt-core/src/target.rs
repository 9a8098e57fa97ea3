//! Error targets: how a render that ends when its image is good enough shares out samples, and when it ends.
//!
//! The film has two halves that know nothing of each other, and their difference tells the error (`film/error_estimate.rs`). Nothing of it
//! may depend on what it judges:
//!
//! * As long as pixels are not told apart, all have the same samples (the pilot). Then how many samples a pixel has follows from
//!   how much the halves of its *neighbours* differed in the pilot, times a goal for all pixels: so its mean is
//!   that of as many samples as something else had decided, which has no bias.
//! * The goal alone depends on the error, which is a sum over all pixels, and to which one adds as little as it is one of
//!   many.
//! * Whoever looks often finds a good moment by chance: looks share the probability with which one may be wrong, so that all
//!   together are wrong in a share 1 − c of renders at most.
//! * What no sample has found is in the error, too (`film/missing_mass.rs`): it says how many samples each pixel needs at least.
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

/// The power of densities that is taken in place of the best one for known variances: it is better where they are guessed from
/// few numbers with long tails, and where more samples are worth more than independent ones. Of five scenes, 0.6 to 1 were tried: it
/// saves a tenth of the samples at most, and costs 0.02.
const DENSITY_EXPONENT: f64 = 0.8;

/// The least density, as a share of the average: nothing is sampled never.
const MIN_DENSITY: f64 = 0.05;

/// How far neighbours are away that tell how many samples a pixel needs, in columns and rows. Of seven scenes with 64
/// samples, those of 2 to 12 were tried: 2 is too little where paths are noisy, and 8 too much where shapes are small.
const NEIGHBOR_RADIUS: usize = 4;

/// Side of the squares of pixels in each of which [`Target::noise`] holds.
const BLOCK: usize = 8;

/// Shares of the probability 1 − c with which a render may be wrong: by what no sample found; by looks before pixels are told
/// apart, which hardly ever find an image good enough; and by those after, of which the first is meant to come too early.
const WRONG_UNSEEN: f64 = 0.2;
const WRONG_EARLY: f64 = 0.02;
const WRONG_FIRST: f64 = 0.02;
const WRONG_LATER: f64 = 0.76;

/// Shares that what no sample found may have in the square of the error, of which that with the fewest samples is taken:
/// from the greatest on, each this much less than the one before.
const UNSEEN_SHARES: (f64, f64, i32) = (4.0, 0.7, 12);

/// The smallest step of a goal between two looks: each look costs confidence.
const MIN_STEP: f64 = 1.03;

/// From one goal to the next that is considered.
const STEP: f64 = 1.03;

/// Steps of a goal that are considered: up to a thousandfold.
const STEPS: usize = 234;

/// The largest step of a goal between two looks, but when pixels are first told apart.
const LARGEST_STEP: u32 = 2;

/// Powers of the factor by which the variance has still to fall that more samples are taken to bring: points of a sequence are
/// better than independent ones, by which it is reckoned. Of the next round when pixels are told apart, and later; and
/// the least, the likely and the greatest of all that follows.
const FIRST: f64 = 0.7;
const LATER: f64 = 1.0;
const EXPECTED: [f64; 3] = [0.55, 0.85, 1.1];

/// What a look at a film found.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The error of the image.
    pub measured: ErrorEstimate,
    /// How far pixels may be off, in that square of 8 × 8 where they are worst: see [`Target::noise`].
    pub noise: f64,
    squares: SquaredErrors,
    /// The sum of the squares of errors as it may be, if something is asked of it.
    allowed: Option<f64>,
    /// How many times as large the variance is as it may be, of each square of pixels; empty if nothing is asked of them.
    excess_of_squares: Vec<f64>,
}

impl Evaluation {
    /// Whether the film is good enough.
    pub fn is_met(&self) -> bool {
        self.greatest_excess() <= 1.0
    }

    fn greatest_excess(&self) -> f64 {
        let of_image = self.excess(1.0, self.squares.fewest);
        self.excess_of_squares.iter().copied().fold(of_image, f64::max)
    }

    /// How many times as large the square of the error is as it may be, if its noise is `share` of what it is, and pixels
    /// have at least so many samples: 0 if nothing is asked of it.
    fn excess(&self, share: f64, fewest: u32) -> f64 {
        self.allowed.map_or(0.0, |allowed| self.squares.upper_bound(share, fewest) / allowed)
    }
}

impl Target {
    /// The plan with which a render begins, of which some pixels are vacant: see [`SamplePlan::vacant`].
    pub fn first_plan(&self, film: &Film, most: u32, vacant: Vec<bool>) -> SamplePlan {
        let goal = FIRST_GOAL.min(most);
        let mut plan = SamplePlan { goal, least: goal, vacant, ..SamplePlan::default() };
        // Nothing is known yet: as much as will be looked at first.
        let wanted = (0..film.region().area()).map(|i| u64::from(plan.wanted(i)));
        plan.expected = [2 * wanted.sum::<u64>(); 3];
        plan
    }

    /// Looks at a film whose plan is fulfilled, of which so many pixels bring their light to each other. `None` if it has not two
    /// halves with samples.
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

    /// With which probabilities a look may find the error of an image less than it is. A single one has the share of all.
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

    /// What to do after a look that found the film not good enough: the next plan, with at most `most` samples of a pixel in each
    /// half, of which squares of `reuse`² pixels bring their light to each other. `None` if no pixel may have more.
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

    /// The variance of the mean luminance of a pixel as its samples tell it; none where the screen shows no difference.
    fn standard_error(&self, pixel: PixelSums) -> f64 {
        let (mean, error) = pixel.luminance();
        if mean < self.white && error.is_finite() { error * error } else { 0.0 }
    }

    /// How many samples pixels are to have for each of the goal, by what their neighbours know, outside of the squares of
    /// `reuse`² of which they are a part: for the least error of the image in proportion to the standard deviation of a sample, for the
    /// same error everywhere to the variance; nothing if all are to have the same. It is told by how much halves differ, which says little of a single pixel, and so
    /// by many; and as much by how samples differ within halves, which says more, and so by the next pixels, but
    /// not how good the sequence of samples is: relative to many. Vacant pixels are no neighbours.
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

    /// How many pixels are not vacant; at least 1.
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

    /// The plan with the fewest samples by which the excess falls by this power of what it has to, if the plan that is
    /// fulfilled gives way to another, with another goal and more samples of each pixel.
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

    /// A plan with the least goal by which no more excess is left than this, as far as goals are considered; and what is
    /// then left.
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
mod tests {
    use super::*;
    use crate::film::{HalfBuffer, Region};
    use pt_math::Spectrum;
    use pt_testing::Random;

    const TARGET: Target = Target { error: Some(0.01), ..Target::NONE };
    const MAX: u32 = 500;

    /// A film of this size, of which each pixel has as many samples as its plan wants, by what a function says of a pixel's
    /// number and a random number in [0, 1). With the same seed and more samples it has these and more.
    fn film(
        size: [u32; 2],
        plan: SamplePlan,
        seed: u64,
        light: impl Fn(usize, f32) -> f32,
    ) -> Film {
        let mut film = Film::new(Region::full(size)).with_half_buffers();
        for (number, half) in (0..).zip(HalfBuffer::BOTH) {
            let half = film.half_mut(half);
            let first = half.first();
            for tile in &mut half.tiles(u32::MAX, [0; 2]) {
                for pixel in tile.region().pixels() {
                    let i = (pixel[1] * size[0] + pixel[0]) as usize;
                    let mut random = Random::new((seed << 32) + 2 * i as u64 + number);
                    let samples: Vec<_> = (0..plan.wanted(i).min(MAX))
                        .map(|_| Spectrum::splat(light(i, random.unit())))
                        .collect();
                    tile.add(pixel, first, &samples, None);
                }
            }
        }
        film.set_plan(plan);
        film
    }

    fn even(goal: u32) -> SamplePlan {
        SamplePlan { goal, least: goal, ..SamplePlan::default() }
    }

    /// Pixels of which samples are 0 or 2, half and half: the error of an image of 2n samples is 1/√(2n).
    /// It is in the interval as often as is said.
    #[test]
    fn the_error_of_an_image_is_in_the_interval_that_is_told() {
        let mut inside = 0;
        for seed in 0..400 {
            let film = film([30, 20], even(8), seed, |_, u| 0.6 * f32::from(u8::from(u < 0.5)));
            let evaluation = TARGET.evaluate(&film, 1).expect("there are samples");
            let square = |pixel: crate::film::PixelSums| (pixel.mean()[0] - 0.3).powi(2);
            let error = (film.pixels().map(square).sum::<f64>() / 600.0).sqrt() / 0.3;
            assert!((evaluation.measured.error - 0.25).abs() < 0.06, "{evaluation:?}");
            inside +=
                u32::from((evaluation.measured.lower..=evaluation.measured.upper).contains(&error));
        }
        assert!(inside >= 385, "{inside} of 400 are inside");
    }

    /// Samples far beyond white change nothing that can be seen; where one half is there and the other is not, the
    /// whole difference counts.
    #[test]
    fn what_is_beyond_white_is_white() {
        let bright = film([4, 4], even(8), 1, |_, u| 5.0 + u);
        let evaluation = TARGET.evaluate(&bright, 1).expect("there are samples");
        assert_eq!((evaluation.measured.error, evaluation.is_met()), (0.0, true));
        let mut one_half = Film::new(Region::full([1, 1])).with_half_buffers();
        for (half, light) in HalfBuffer::BOTH.into_iter().zip([20.0, 0.5]) {
            let half = one_half.half_mut(half);
            half.tiles(1, [0; 2])[0].add([0, 0], 0, &[Spectrum::splat(light)], None);
        }
        assert_eq!(one_half.square_errors(1.0), Some(vec![3.0 * 0.25]));
        assert_eq!(one_half.square_errors(100.0).map(|e| e[0] < 0.04), Some(true));
    }

    #[test]
    fn a_pixel_has_no_say_in_its_own_samples() {
        for reuse in [1, 2, 4] {
            let densities = |own: f32| {
                let light = |i: usize, u: f32| if i == 21 * 40 + 17 { own * u } else { 0.3 * u };
                let film = film([40, 30], even(8), 9, light);
                TARGET.densities(&film, &even(8), reuse).expect("there are samples")
            };
            let (quiet, loud) = (densities(0.1), densities(0.9));
            let share = |d: f32| f64::from(d) - MIN_DENSITY;
            let relative = |d: &[f32], i: usize| share(d[i]) / share(d[0]);
            let has_changed =
                |i: usize| (relative(&quiet, i) / relative(&loud, i) - 1.0).abs() > 1e-5;
            let changed: Vec<_> = (0..quiet.len()).filter(|&i| has_changed(i)).collect();
            assert!(!changed.is_empty());
            for i in changed {
                let off = (i / 40).abs_diff(21).max((i % 40).abs_diff(17));
                assert!(
                    off >= reuse as usize && off < NEIGHBOR_RADIUS + reuse as usize,
                    "{reuse}: {i}"
                );
            }
        }
    }

    /// A quarter of the image has ten times the noise of the rest: its densities are 10 to the power [`DENSITY_EXPONENT`] times as
    /// large, less what [`MIN_DENSITY`] takes.
    #[test]
    fn samples_go_where_the_noise_is() {
        let noisy = |i: usize| i % 40 < 10;
        let light = |i: usize, u: f32| 0.5 + (u - 0.5) * if noisy(i) { 0.8 } else { 0.08 };
        let film = film([40, 32], even(16), 2, light);
        let target = Target { error: Some(0.03), ..TARGET };
        let evaluation = target.evaluate(&film, 1).expect("there are samples");
        let plan = target.next_plan(&film, &evaluation, 1, MAX).expect("there is more to do");
        let densities = plan.densities.clone().expect("pixels are told apart");
        let mean = |is: bool| {
            let pixels = (0..40 * 32).filter(|&i| noisy(i) == is && !(6..14).contains(&(i % 40)));
            let (sum, n) = pixels.fold((0.0, 0.0), |(sum, n), i| (sum + densities[i], n + 1.0));
            sum / n
        };
        assert!(mean(true) > 5.0 * mean(false), "{plan:?}");
        assert!((0..40 * 32).all(|i| plan.wanted(i) >= 16));
    }

    /// The left half of the image is dark and vacant: densities of the rest are as if it were not there, a pixel in the midst of vacant ones is
    /// like most, and vacant pixels have two samples in each half.
    #[test]
    fn vacant_pixels_are_no_neighbours() {
        const ALONE: usize = 15 * 40 + 6;
        let is_vacant = |i: usize| i % 40 < 20 && i != ALONE;
        let light = |i: usize, u: f32| if is_vacant(i) { 0.0 } else { u };
        let vacant: Vec<bool> = (0..40 * 30).map(is_vacant).collect();
        let all = film([40, 30], even(16), 4, light);
        let densities = |vacant| {
            let plan = SamplePlan { vacant, ..even(16) };
            TARGET.densities(&all, &plan, 1).expect("there are samples")
        };
        let (with, without) = (densities(vacant.clone()), densities(Vec::new()));
        let edge = |densities: &[f32]| -> f32 {
            (0..30).map(|y| densities[y * 40 + 20] / densities[y * 40 + 32]).sum::<f32>() / 30.0
        };
        assert!((edge(&with) - 1.0).abs() < 0.1, "{}", edge(&with));
        assert!(edge(&without) < 0.75, "{}", edge(&without));
        assert_eq!(with[ALONE], 1.0);
        let target = Target { error: Some(0.03), ..TARGET };
        let film = film([40, 30], SamplePlan { vacant, ..even(16) }, 4, light);
        let evaluation = target.evaluate(&film, 1).expect("there are samples");
        let next = target.next_plan(&film, &evaluation, 1, MAX).expect("there is more to do");
        assert!(next.densities.is_some());
        for i in 0..40 * 30 {
            assert_eq!(next.wanted(i) == 2, is_vacant(i), "{i}: {}", next.wanted(i));
        }
    }

    /// Rounds of a render whose samples are independent: they end, and the last look has found what was asked for.
    #[test]
    fn rounds_come_to_an_end() {
        let light = |i: usize, u: f32| 0.4 + (u - 0.5) * (i % 7) as f32 * 0.1;
        let of = |error, noise| Target { error, noise, ..TARGET };
        for target in [of(Some(0.02), None), of(None, Some(0.03)), of(Some(0.03), Some(0.05))] {
            let mut plan = target.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
            for round in 0.. {
                assert!(round < 30, "{target}: no end");
                let film = film([24, 16], plan, 3, light);
                let evaluation = target.evaluate(&film, 1).expect("there are samples");
                let Some(next) =
                    (!evaluation.is_met()).then(|| target.next_plan(&film, &evaluation, 1, MAX))
                else {
                    assert!(target.error.is_none_or(|error| evaluation.measured.error <= error));
                    assert!(target.noise.is_none_or(|noise| evaluation.noise <= noise));
                    break;
                };
                plan = next.expect("more is allowed");
            }
        }
    }

    /// Pixels of a column see a lamp, and one sample in twenty of another pixel its reflection, without which the error is one
    /// and a half times as large as is allowed: hardly a render ends before that is found.
    #[test]
    fn what_a_single_pixel_hides_is_found_before_a_render_ends() {
        const HIDES: usize = 9 * 24 + 7;
        let light = |i: usize, u: f32| match i {
            HIDES => 4.0 * f32::from(u8::from(u < 0.05)),
            _ if i.is_multiple_of(24) => 4.0,
            _ => 0.3 + (u - 0.5) * 0.05,
        };
        let shown = |i: usize| match i {
            HIDES => 0.2,
            _ if i.is_multiple_of(24) => 1.0,
            _ => 0.3,
        };
        let target = Target { error: Some(0.02), ..TARGET };
        let (mut ended, mut budget) = (0, 0);
        for seed in 0..60 {
            let mut plan = target.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
            let film = loop {
                let film = film([24, 16], plan, seed, light);
                let evaluation = target.evaluate(&film, 1).expect("there are samples");
                if evaluation.is_met() {
                    break Some(film);
                }
                match target.next_plan(&film, &evaluation, 1, MAX) {
                    Some(next) => plan = next,
                    None => break None,
                }
            };
            let Some(film) = film else { continue };
            let off =
                |(i, pixel): (usize, PixelSums)| (pixel.mean()[0].min(1.0) - shown(i)).powi(2);
            let error = film.pixels().enumerate().map(off).sum::<f64>();
            let all = (0..24 * 16).map(|i| shown(i) * shown(i)).sum::<f64>();
            ended += 1;
            budget += u32::from((error / all).sqrt() > 0.02);
        }
        assert!(ended >= 50 && budget <= 3, "{ended} of 60 ended, {budget} of these wrongly");
    }

    #[test]
    fn no_pixel_has_more_samples_than_it_may() {
        let mut plan = TARGET.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
        let mut rounds = 0;
        loop {
            let film = film([24, 16], plan.clone(), 6, |_, u| u);
            let evaluation = TARGET.evaluate(&film, 1).expect("there are samples");
            assert!(!evaluation.is_met());
            match TARGET.next_plan(&film, &evaluation, 1, MAX) {
                Some(next) => plan = next,
                None => break,
            }
            rounds += 1;
            assert!(rounds < 60, "{plan:?}");
        }
        assert!((0..24 * 16).all(|i| plan.wanted(i) >= MAX), "{plan:?}");
    }

    #[test]
    fn sums_around_are_those_of_a_plain_loop() {
        let mut random = Random::new(8);
        for (width, height) in [(1, 1), (7, 3), (3, 9), (12, 10)] {
            let values: Vec<f64> = (0..width * height).map(|_| f64::from(random.unit())).collect();
            for reach in [0, 1, 4] {
                let near = |i: usize, j: usize| {
                    (i / width).abs_diff(j / width) <= reach
                        && (i % width).abs_diff(j % width) <= reach
                };
                for (i, sum) in sums_around(&values, width, reach).into_iter().enumerate() {
                    let plain: f64 =
                        (0..values.len()).filter(|&j| near(i, j)).map(|j| values[j]).sum();
                    assert!((sum - plain).abs() < 1e-12, "{width} {height} {reach} {i}");
                }
            }
        }
    }
}
