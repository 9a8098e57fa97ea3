//! Estimate of the remaining time of a render, with an interval.

/// Remaining time in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRemaining {
    /// Lower bound of the interval.
    pub least: f64,
    /// Expected value.
    pub likely: f64,
    /// Upper bound of the interval.
    pub most: f64,
}

/// Estimator of the end of a render.
///
/// The remaining samples are assumed to be as fast as those of the second half of the elapsed time.
/// The width of the interval follows from the variation of the speed between parts of that half,
/// and from the difference between the speed of that half and of the whole. The remaining time may
/// differ by as much as a whole, since the load of a machine persists. (The assumption that the
/// variations of parts cancel was tested on a machine with many builds that came and went: the end
/// then lay in the interval 86 times of 100, and 95 times without the assumption.)
///
/// An adaptive render becomes faster, as more and more pixels need no more samples: its speed is
/// assumed to be a power of the number of completed samples, whose exponent is estimated from the
/// past.
#[derive(Clone, Debug)]
pub struct Eta {
    /// Estimated total number of samples: lower bound, expected value, upper bound.
    totals: [u64; 3],
    is_adaptive: bool,
    /// Times in seconds since the start, and numbers of samples completed then, in order.
    marks: Vec<(f64, u64)>,
}

/// Maximum number of marks; beyond it, every second one is removed.
const MAX_MARKS: usize = 256;

/// Number of parts of the second half of the time, whose speeds are compared.
const PARTS: u32 = 8;

/// Half width of the interval, in standard deviations of the speeds of the parts.
const DEVIATIONS: f64 = 2.0;

/// Minimum half width of the interval: as a fraction of the remaining time, and in seconds.
const MIN_WIDTH: (f64, f64) = (0.05, 0.05);

impl Eta {
    /// Creates the estimator of a render that begins now with `done` of `total` samples.
    pub fn new(done: u64, total: u64, is_adaptive: bool) -> Self {
        Self { totals: [total; 3], is_adaptive, marks: vec![(0.0, done)] }
    }

    /// Sets the estimated total number of samples: lower bound, expected value, upper bound.
    pub fn expect(&mut self, totals: [u64; 3]) {
        self.totals = totals;
    }

    /// Records that `done` samples are completed after `seconds`.
    pub fn mark(&mut self, seconds: f64, done: u64) {
        if self.marks.last().is_none_or(|&(last, before)| seconds > last && done >= before) {
            self.marks.push((seconds, done));
        }
        if self.marks.len() > MAX_MARKS {
            let last = self.marks.len() - 1;
            let mut place = 0..;
            self.marks.retain(|_| place.next().is_none_or(|i| i % 2 == 0 || i == last));
        }
    }

    /// Number of samples completed at a time, interpolated linearly between marks.
    fn done_at(&self, seconds: f64) -> f64 {
        let next = self.marks.partition_point(|&(time, _)| time < seconds);
        match (next.checked_sub(1).and_then(|i| self.marks.get(i)), self.marks.get(next)) {
            (Some(&(t0, n0)), Some(&(t1, n1))) => {
                let share = (seconds - t0) / (t1 - t0);
                n0 as f64 + share * (n1 - n0) as f64
            }
            (Some(&(_, n)), None) | (None, Some(&(_, n))) => n as f64,
            (None, None) => 0.0,
        }
    }

    /// Exponent of the speed as a power of the completed samples, from the last doubling of their
    /// number.
    fn exponent(&self) -> f64 {
        let (&(begin, first), &(now, last)) = (&self.marks[0], &self.marks[self.marks.len() - 1]);
        let done = |share: f64| first as f64 + share * (last - first) as f64;
        let time = |share: f64| {
            let next = self.marks.partition_point(|&(_, n)| (n as f64) < done(share));
            self.marks.get(next).map_or(now, |&(seconds, _)| seconds) - begin
        };
        let (quarter, half, all) = (time(0.25), time(0.5), now - begin);
        // From a quarter to a half, half as many samples were completed as since then.
        let faster = 2.0 * (half - quarter) / (all - half);
        faster.log2().clamp(0.0, 3.0)
    }

    /// Integral of x^−p over the remaining samples, up to the expected total.
    fn seconds_from(&self, done: f64, p: f64) -> f64 {
        let (a, b) = (done.max(1.0), self.totals[1].max(1) as f64);
        if (p - 1.0).abs() < 1e-3 {
            (b / a).ln()
        } else {
            (b.powf(1.0 - p) - a.powf(1.0 - p)) / (1.0 - p)
        }
    }

    /// Remaining time at the last mark, or `None` if there are too few marks for an estimate.
    pub fn left(&self) -> Option<TimeRemaining> {
        let (&(_, first), &(now, done)) = (self.marks.first()?, self.marks.last()?);
        if self.marks.len() <= PARTS as usize || done == first {
            return None;
        }
        let half = 0.5 * now;
        let speed = (done as f64 - self.done_at(half)) / half;
        let part = half / f64::from(PARTS);
        let at = |i: u32| self.done_at(half + f64::from(i) * part);
        let squares = (0..PARTS).map(|i| ((at(i + 1) - at(i)) / (part * speed) - 1.0).powi(2));
        let variance = squares.sum::<f64>() / f64::from(PARTS - 1);
        let of_halves = ((done - first) as f64 / (now * speed) - 1.0).abs();
        let mut width = MIN_WIDTH.0 + DEVIATIONS * variance.sqrt();
        let mut at_exponents = self.totals.map(|total| total.saturating_sub(done) as f64 / speed);
        if self.is_adaptive {
            let middle = 0.5 * (self.done_at(half) + done as f64);
            let exponent = self.exponent();
            let exponents = [exponent + 1.0, exponent, (exponent - 0.7).max(0.0)];
            at_exponents =
                exponents.map(|p| self.seconds_from(done as f64, p) / speed * middle.powf(p));
        } else {
            width += of_halves;
        }
        let [least, likely, most] = at_exponents;
        if !most.is_finite() {
            return None;
        }
        let least = (least / (1.0 + width) - MIN_WIDTH.1).max(0.0);
        Some(TimeRemaining { least, likely, most: most * (1.0 + width) + MIN_WIDTH.1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_render_ends_when_it_should() {
        let mut eta = Eta::new(100, 1100, false);
        assert_eq!(eta.left(), None);
        for i in 1..=500u32 {
            eta.mark(f64::from(i) * 0.1, 100 + u64::from(i));
            assert!(eta.marks.len() <= MAX_MARKS);
        }
        let left = eta.left().expect("there are marks");
        assert!((left.likely - 50.0).abs() < 1e-6, "{left:?}");
        assert!(
            (47.0..48.0).contains(&left.least) && (52.0..53.0).contains(&left.most),
            "{left:?}"
        );
    }

    #[test]
    fn marks_that_go_back_and_renders_that_stand_still_say_nothing() {
        let mut eta = Eta::new(0, 10, false);
        for i in 0..100 {
            eta.mark(f64::from(i), 0);
        }
        assert_eq!(eta.left(), None);
        eta.mark(50.0, 5);
        assert_eq!(eta.marks.last(), Some(&(99.0, 0)));
        eta.mark(100.0, 10);
        assert!(eta.left().is_some_and(|left| left.likely == 0.0), "{:?}", eta.left());
    }

    /// Speeds that vary at random, like those of machines with other load.
    #[test]
    fn the_end_lies_in_the_interval_nine_times_of_ten() {
        let mut random = pt_testing::Random::new(5);
        let (mut inside, mut all) = (0, 0);
        for _ in 0..200 {
            let mut eta = Eta::new(0, 4000, false);
            let (mut time, mut done, mut reported) = (0.0, 0, Vec::new());
            while done < 4000 {
                time += 0.02 * (0.3 + f64::from(random.unit()));
                done += 20;
                eta.mark(time, done);
                if let Some(left) = eta.left().filter(|_| done >= 400) {
                    reported.push((time, left));
                }
            }
            all += reported.len();
            let is_inside = |(at, left): &&(f64, TimeRemaining)| {
                (left.least..=left.most).contains(&(time - at))
            };
            inside += reported.iter().filter(is_inside).count();
        }
        assert!(inside as f64 >= 0.9 * all as f64, "{inside} of {all}");
    }
}
