//! Animated transforms.

use pt_math::{DAffine3, Trs};
use thiserror::Error;

/// A keyframe: a transform at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Time in seconds.
    pub time: f64,
    /// Transform at that time.
    pub to_world: DAffine3,
}

/// An animated transform, given by keyframes.
///
/// Between two keys, translations are linear, rotations follow the shorter way around one axis at
/// constant speed, and scale and shear are linear; see [`Trs`]. The transform is constant before
/// the first and after the last key.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    keys: Vec<Key>,
    /// Decomposed transform of each key.
    poses: Vec<Trs>,
}

/// Error of [`Motion::new`].
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{message}")]
pub struct MotionError {
    /// Index of the invalid key.
    pub key: usize,
    /// Problem, expected value and remedy.
    pub message: String,
}

impl Motion {
    /// Maximum number of keys.
    pub const MAX_KEYS: usize = 10_000;

    /// Creates a motion from at least two keys with increasing times.
    ///
    /// # Errors
    /// Returns an error for other numbers or times of keys, for singular transforms, and if only
    /// some of the transforms mirror.
    pub fn new(keys: Vec<Key>) -> Result<Self, MotionError> {
        let refuse = |key, message| Err(MotionError { key, message });
        if !(2..=Self::MAX_KEYS).contains(&keys.len()) {
            let (count, most) = (keys.len(), Self::MAX_KEYS);
            let message = format!(
                "found {count} keys of a motion, expected 2 to {most}; for a static object, give a \
                 transform without a time"
            );
            return refuse(keys.len().min(Self::MAX_KEYS).saturating_sub(1), message);
        }
        let mut poses: Vec<Trs> = Vec::new();
        for (i, key) in keys.iter().enumerate() {
            let before = i.checked_sub(1).map_or(f64::NEG_INFINITY, |i| keys[i].time);
            // NaN compares false.
            if !(key.time > before && key.time.is_finite()) {
                let time = key.time;
                let message = format!(
                    "found key times {before} and {time}, expected finite increasing times"
                );
                return refuse(i, message);
            }
            let Some(pose) = Trs::of(&key.to_world) else {
                let time = key.time;
                let message = format!(
                    "found a transform at time {time} that flattens space, expected an invertible \
                     one"
                );
                return refuse(i, message);
            };
            if poses.first().is_some_and(|first| first.is_mirrored() != pose.is_mirrored()) {
                let message = "found mirrored and unmirrored transforms in one motion, expected \
                               all or none mirrored";
                return refuse(i, message.to_owned());
            }
            poses.push(pose);
        }
        Ok(Self { keys, poses })
    }

    /// Returns the keys in order of time.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Returns true if the transform mirrors space.
    pub fn is_mirrored(&self) -> bool {
        self.poses[0].is_mirrored()
    }

    /// Returns the transform at a time in seconds.
    pub fn at(&self, time: f64) -> DAffine3 {
        let after = self.keys.partition_point(|key| key.time <= time);
        let Some(before) = after.checked_sub(1) else { return self.keys[0].to_world };
        match self.keys.get(after) {
            Some(_) if self.keys[before].time < time => self.between(before, time),
            _ => self.keys[before].to_world,
        }
    }

    /// Returns the transform at a time between key `before` and the next one.
    fn between(&self, before: usize, time: f64) -> DAffine3 {
        let [from, to] = [self.keys[before], self.keys[before + 1]];
        if from.to_world == to.to_world {
            return from.to_world; // to the last bit
        }
        let [start, end] = [from.time, to.time];
        self.poses[before].between(&self.poses[before + 1], (time - start) / (end - start))
    }

    /// Samples the transform from `open` to `close`, in seconds, so densely that it may be
    /// interpolated linearly with an error of at most [`pt_math::POSE_ERROR`]. Times of the result
    /// are fractions of the interval, from 0 to 1. The result is a single key if the transform does
    /// not change in the interval, or the interval is empty.
    pub fn knots(&self, [open, close]: [f64; 2]) -> Vec<Key> {
        let share = |time: f64| (time - open) / (close - open);
        let mut knots = vec![Key { time: 0.0, to_world: self.at(open) }];
        for (i, pair) in self.keys.windows(2).enumerate() {
            let [from, to] = [pair[0].time.max(open), pair[1].time.min(close)];
            if from >= to {
                continue;
            }
            if from > open {
                knots.push(Key { time: share(from), to_world: self.at(from) });
            }
            let whole = f64::from(self.poses[i].steps_to(&self.poses[i + 1]));
            let steps = (whole * (to - from) / (pair[1].time - pair[0].time)).ceil() as u32;
            let inner = (1..steps).map(|k| from + (to - from) * f64::from(k) / f64::from(steps));
            knots.extend(inner.map(|t| Key { time: share(t), to_world: self.between(i, t) }));
        }
        let last = self.keys[self.keys.len() - 1];
        if open < last.time && last.time < close {
            knots.push(Key { time: share(last.time), ..last });
        }
        knots.push(Key { time: 1.0, to_world: self.at(close) });
        // Intervals too short for single precision are removed.
        knots.dedup_by(|later, before| later.time as f32 <= before.time as f32);
        if knots.iter().all(|knot| knot.to_world == knots[0].to_world) {
            knots.truncate(1);
        }
        knots
    }
}

#[cfg(test)]
mod tests {
    use pt_math::DVec3;

    use super::*;

    fn turned(time: f64, angle: f64, x: f64) -> Key {
        let to_world = DAffine3::from_translation(DVec3::X * x) * DAffine3::from_rotation_y(angle);
        Key { time, to_world }
    }

    fn linear(knots: &[Key], time: f64) -> DAffine3 {
        let after = knots.partition_point(|k| k.time <= time).min(knots.len() - 1);
        let [a, b] = [after - 1, after].map(|i| knots[i]);
        let s = (time - a.time) / (b.time - a.time);
        DAffine3::from_mat3_translation(
            a.to_world.matrix3 * (1.0 - s) + b.to_world.matrix3 * s,
            a.to_world.translation * (1.0 - s) + b.to_world.translation * s,
        )
    }

    #[test]
    fn knots_follow_the_motion() {
        let keys = vec![turned(1.0, 0.0, 0.0), turned(1.5, 3.0, 1.0), turned(4.0, 2.0, -7.0)];
        let motion = Motion::new(keys).expect("they increase");
        for shutter in [[0.0, 5.0], [1.0, 4.0], [1.2, 1.3], [1.4, 2.0], [3.0, 9.0]] {
            let knots = motion.knots(shutter);
            assert_eq!([knots[0].time, knots[knots.len() - 1].time], [0.0, 1.0]);
            assert!(knots.is_sorted_by(|a, b| a.time < b.time));
            for i in 0..1000 {
                let share = f64::from(i) / 1000.0;
                let want = motion.at(shutter[0] + share * (shutter[1] - shutter[0]));
                let got = linear(&knots, share);
                for p in [DVec3::ONE, DVec3::X, DVec3::new(3.0, -1.0, 2.0)] {
                    let off = got.transform_point3(p).distance(want.transform_point3(p));
                    let most = pt_math::POSE_ERROR * 3f64.sqrt() * p.length();
                    assert!(off <= most + 1e-12, "{shutter:?} {share}: {off} > {most}");
                }
            }
        }
    }

    #[test]
    fn nothing_moves_outside_of_the_keys_or_in_no_time() {
        let motion = Motion::new(vec![turned(1.0, 0.0, 0.0), turned(2.0, 1.0, 1.0)]);
        let motion = motion.expect("they increase");
        for (shutter, key) in [([0.0, 1.0], 0), ([2.0, 9.0], 1), ([1.0, 1.0], 0)] {
            let knots = motion.knots(shutter);
            assert_eq!(knots.len(), 1, "{shutter:?}");
            assert_eq!(knots[0].to_world, motion.keys()[key].to_world);
        }
        assert_eq!(motion.knots([1.5, 1.5])[0].to_world, motion.at(1.5));
    }

    #[test]
    fn keys_that_are_no_motion_are_refused() {
        let at = |time, size| Key { time, to_world: DAffine3::from_scale(DVec3::splat(size)) };
        let cases = [
            (vec![], 0, "found 0 keys of a motion, expected 2 to 10000"),
            (vec![at(0.0, 1.0)], 0, "found 1 keys of a motion"),
            (vec![at(0.0, 1.0), at(0.0, 1.0)], 1, "found key times 0 and 0"),
            (vec![at(2.0, 1.0), at(3.0, 1.0), at(1.0, 1.0)], 2, "found key times 3 and 1"),
            (vec![at(f64::NAN, 1.0), at(0.0, 1.0)], 0, "expected finite increasing times"),
            (vec![at(0.0, 1.0), at(1.0, 0.0)], 1, "at time 1 that flattens space"),
            (vec![at(0.0, 1.0), at(1.0, -1.0)], 1, "mirrored and unmirrored transforms"),
        ];
        for (keys, key, want) in cases {
            let error = Motion::new(keys).expect_err(want);
            assert!(error.key == key && error.message.contains(want), "{error:?}");
        }
    }
}
