//! Interpolation of animation keyframes. [glTF 2.0, app. C]

use pt_math::DQuat;

/// Interpolation between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// The value of the previous key.
    Step,
    /// Linear; rotations take the shorter arc at constant speed.
    Linear,
    /// Cubic Hermite spline. Each key has an in-tangent before its value and an out-tangent after
    /// it.
    CubicSpline,
}

impl Interpolation {
    /// Number of elements per key.
    pub(super) fn parts(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

/// Kind of an animated property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AnimatedProperty {
    /// Translation or scale: three numbers.
    Vector,
    /// A quaternion x y z w.
    Rotation,
    /// Weights, one per morph target.
    Weights,
}

/// Keys of a value.
#[derive(Debug)]
pub(super) struct KeyframeTrack {
    /// Times in seconds, strictly increasing.
    times: Vec<f64>,
    /// Numbers of all elements, key by key.
    values: Vec<f64>,
    kind: AnimatedProperty,
    /// Numbers per element.
    width: usize,
    interpolation: Interpolation,
}

impl KeyframeTrack {
    /// Creates keys at times, of which there is at least one; `None` if the number of values does
    /// not match the number of keys.
    pub(super) fn new(
        times: Vec<f64>,
        values: Vec<f64>,
        kind: AnimatedProperty,
        interpolation: Interpolation,
    ) -> Option<Self> {
        let elements = times.len() * interpolation.parts();
        let width = match kind {
            AnimatedProperty::Vector => 3,
            AnimatedProperty::Rotation => 4,
            AnimatedProperty::Weights => values.len().checked_div(elements)?,
        };
        let fits = width > 0 && elements.checked_mul(width) == Some(values.len());
        fits.then_some(Self { times, values, kind, width, interpolation })
    }

    /// Evaluates the keys at a time. The first and the last value are held outside of the keys.
    pub(super) fn at(&self, time: f64) -> Vec<f64> {
        let after = self.times.partition_point(|key| *key <= time);
        let (Some(before), Some(next)) = (after.checked_sub(1), self.times.get(after)) else {
            return self.value(after.saturating_sub(1)).to_vec();
        };
        let duration = next - self.times[before];
        let share = (time - self.times[before]) / duration;
        let (from, to) = (self.value(before), self.value(after));
        match (self.interpolation, self.kind) {
            (Interpolation::Step, _) => from.to_vec(),
            (Interpolation::Linear, AnimatedProperty::Rotation) => {
                slerp(DQuat::from_slice(from), DQuat::from_slice(to), share).to_array().to_vec()
            }
            (Interpolation::Linear, _) => {
                from.iter().zip(to).map(|(a, b)| a + (b - a) * share).collect()
            }
            (Interpolation::CubicSpline, _) => {
                let (leaving, arriving) = (self.element(before, 2), self.element(after, 0));
                let slopes =
                    leaving.iter().zip(arriving).map(|(a, b)| [a * duration, b * duration]);
                let ends = from.iter().zip(to).map(|(a, b)| [*a, *b]);
                ends.zip(slopes).map(|(ends, slopes)| hermite(ends, slopes, share)).collect()
            }
        }
    }

    fn value(&self, key: usize) -> &[f64] {
        self.element(key, self.interpolation.parts() / 2)
    }

    /// Returns an element of a key.
    fn element(&self, key: usize, element: usize) -> &[f64] {
        let index = key * self.interpolation.parts() + element;
        &self.values[index * self.width..][..self.width]
    }
}

/// Cubic polynomial with the given values and slopes at 0 and 1.
fn hermite([from, to]: [f64; 2], [leaving, arriving]: [f64; 2], t: f64) -> f64 {
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * from
        + (t3 - 2.0 * t2 + t) * leaving
        + (3.0 * t2 - 2.0 * t3) * to
        + (t3 - t2) * arriving
}

/// Spherical linear interpolation along the shorter arc. [Shoemake 1985, "Animating Rotation with
/// Quaternion Curves", §3.3]
fn slerp(from: DQuat, to: DQuat, share: f64) -> DQuat {
    /// Cosine above which linear interpolation is used.
    const STRAIGHT: f64 = 1.0 - 1e-12;
    let (from, to) = (from.normalize(), to.normalize());
    let to = if from.dot(to) < 0.0 { -to } else { to };
    let cos = from.dot(to);
    if cos > STRAIGHT {
        return from + (to - from) * share;
    }
    let angle = libm::acos(cos);
    let [a, b] = [1.0 - share, share].map(|share| libm::sin(share * angle) / libm::sin(angle));
    from * a + to * b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(values: &[f64], kind: AnimatedProperty, interpolation: Interpolation) -> KeyframeTrack {
        KeyframeTrack::new(vec![1.0, 3.0], values.to_vec(), kind, interpolation).expect("they fit")
    }

    #[test]
    fn nothing_changes_outside_of_the_keys() {
        let linear = keys(&[2.0, 6.0], AnimatedProperty::Weights, Interpolation::Linear);
        let found = [-1.0, 1.0, 1.5, 3.0, 9.0].map(|time| linear.at(time)[0]);
        assert_eq!(found, [2.0, 2.0, 3.0, 6.0, 6.0]);
        let step = keys(&[2.0, 6.0], AnimatedProperty::Weights, Interpolation::Step);
        assert_eq!([0.0, 2.9, 3.0].map(|time| step.at(time)[0]), [2.0, 2.0, 6.0]);
        let one = KeyframeTrack::new(
            vec![1.0],
            vec![4.0, 5.0],
            AnimatedProperty::Weights,
            Interpolation::Linear,
        );
        assert_eq!(one.map(|keys| keys.at(1.0)), Some(vec![4.0, 5.0]));
    }

    /// x³ has the slope 3 at 1 and 27 at 3, where it is 1 and 27.
    #[test]
    fn splines_are_cubic() {
        let values = [9.0, 1.0, 3.0, 27.0, 27.0, 9.0];
        let spline = keys(&values, AnimatedProperty::Weights, Interpolation::CubicSpline);
        for time in [1.0, 1.25, 2.0, 2.9, 3.0] {
            assert!((spline.at(time)[0] - time * time * time).abs() < 1e-12, "{time}");
        }
    }

    #[test]
    fn rotations_turn_the_shorter_way_at_constant_speed() {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        for sign in [1.0, -1.0] {
            let to = (quarter * sign).to_array();
            let values = [DQuat::IDENTITY.to_array(), to].concat();
            let turn = keys(&values, AnimatedProperty::Rotation, Interpolation::Linear);
            let found = DQuat::from_slice(&turn.at(1.5));
            let wanted = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_8);
            assert!(
                found.abs_diff_eq(wanted, 1e-12) || found.abs_diff_eq(-wanted, 1e-12),
                "{found}"
            );
        }
    }

    #[test]
    fn numbers_are_those_of_all_keys() {
        let linear = Interpolation::Linear;
        assert!(
            KeyframeTrack::new(vec![0.0, 1.0], vec![0.0; 6], AnimatedProperty::Vector, linear)
                .is_some()
        );
        assert!(
            KeyframeTrack::new(vec![0.0, 1.0], vec![0.0; 5], AnimatedProperty::Vector, linear)
                .is_none()
        );
        assert!(
            KeyframeTrack::new(vec![0.0, 1.0], vec![0.0; 3], AnimatedProperty::Weights, linear)
                .is_none()
        );
        assert!(
            KeyframeTrack::new(vec![0.0, 1.0], Vec::new(), AnimatedProperty::Weights, linear)
                .is_none()
        );
        assert!(
            KeyframeTrack::new(vec![0.0], vec![0.0; 3], AnimatedProperty::Rotation, linear)
                .is_none()
        );
    }
}
