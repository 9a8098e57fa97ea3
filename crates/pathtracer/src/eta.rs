//! When a render will be done, and how sure that is.

/// Seconds that are left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRemaining {
    /// Hardly less.
    pub least: f64,
    /// The best guess.
    pub likely: f64,
    /// Hardly more.
    pub most: f64,
}

/// Follows a render, and foresees its end.
///
/// What is left is taken to go as fast as the second half of the time so far did. The interval is
/// told from how different the speeds in parts of that half were, and how much it differs from the
/// whole: what comes may be as different, all of it, since loads of machines last. (That parts
/// would even out was tried: on a machine with many builds that came and went, the end then lay in
/// the interval 86 times of 100, and so 95 times.)
///
/// An adaptive render becomes faster, as more and more pixels need no more samples: its speed is
/// taken to grow by a power of what is done, the exponent of which is told from the past.
#[derive(Clone, Debug)]
pub struct Eta {
    /// Hardly less, likely, and hardly more.
    totals: [u64; 3],
    is_adaptive: bool,
    /// Times in seconds from the begin, and samples that were done then, in order.
    marks: Vec<(f64, u64)>,
}

/// Marks that are kept; of more, every second one goes.
const MAX_MARKS: usize = 256;

/// Parts of the second half of the time, the speeds of which are compared.
const PARTS: u32 = 8;

/// Standard deviations of the speeds of parts that the interval spans to each side.
const DEVIATIONS: f64 = 2.0;

/// What the interval spans to each side in any case, as a share of the time that is left, and in
/// seconds.
const MIN_WIDTH: (f64, f64) = (0.05, 0.05);

impl Eta {
    /// Of a render that begins now with `done` of `total` samples.
    pub fn new(done: u64, total: u64, is_adaptive: bool) -> Self {
        Self { totals: [total; 3], is_adaptive, marks: vec![(0.0, done)] }
    }

    /// There will be so many samples: hardly less, likely, and hardly more.
    pub fn expect(&mut self, totals: [u64; 3]) {
        self.totals = totals;
    }

    /// So many samples are done after so many seconds.
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

    /// Samples that were done at a time, between marks in proportion.
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

    /// The power of what is done by which the speed grew while that doubled.
    fn exponent(&self) -> f64 {
        let (&(begin, first), &(now, last)) = (&self.marks[0], &self.marks[self.marks.len() - 1]);
        let done = |share: f64| first as f64 + share * (last - first) as f64;
        let time = |share: f64| {
            let next = self.marks.partition_point(|&(_, n)| (n as f64) < done(share));
            self.marks.get(next).map_or(now, |&(seconds, _)| seconds) - begin
        };
        let (quarter, half, all) = (time(0.25), time(0.5), now - begin);
        // Half as much was done before in half to quarter as since.
        let faster = 2.0 * (half - quarter) / (all - half);
        faster.log2().clamp(0.0, 3.0)
    }

    /// The integral of x^−p over what is left until the likely end.
    fn seconds_from(&self, done: f64, p: f64) -> f64 {
        let (a, b) = (done.max(1.0), self.totals[1].max(1) as f64);
        if (p - 1.0).abs() < 1e-3 {
            (b / a).ln()
        } else {
            (b.powf(1.0 - p) - a.powf(1.0 - p)) / (1.0 - p)
        }
    }

    /// What is left, as of the last mark; `None` as long as nothing can be said.
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

    /// Speeds that change at random, as those of machines with other work do.
    #[test]
    fn the_end_lies_in_the_interval_nine_times_of_ten() {
        let mut random = pt_testing::Random::new(5);
        let (mut inside, mut all) = (0, 0);
        for _ in 0..200 {
            let mut eta = Eta::new(0, 4000, false);
            let (mut time, mut done, mut told) = (0.0, 0, Vec::new());
            while done < 4000 {
                time += 0.02 * (0.3 + f64::from(random.unit()));
                done += 20;
                eta.mark(time, done);
                if let Some(left) = eta.left().filter(|_| done >= 400) {
                    told.push((time, left));
                }
            }
            all += told.len();
            let is_inside = |(at, left): &&(f64, TimeRemaining)| {
                (left.least..=left.most).contains(&(time - at))
            };
            inside += told.iter().filter(is_inside).count();
        }
        assert!(inside as f64 >= 0.9 * all as f64, "{inside} of {all}");
    }
}
