//! Decomposition of affine transforms for interpolation.

use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Affine transform x ↦ R S x + t, with R a rotation and S symmetric: positive definite, or
/// negative definite if the transform mirrors. [Shoemake & Duff 1992, "Matrix Animation and Polar
/// Decomposition", §4 and §5]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trs {
    rotation: DQuat,
    stretch: DMat3,
    translation: DVec3,
    is_mirrored: bool,
}

/// Maximum interpolation error; see [`Trs::steps_to`].
pub const POSE_ERROR: f64 = 1e-5;

impl Trs {
    /// Decomposes a transform; `None` if it is not finite, or singular.
    pub fn of(transform: &DAffine3) -> Option<Self> {
        let m = transform.matrix3;
        let is_mirrored = m.determinant() < 0.0;
        let orthogonal = orthogonal_factor(m)?;
        let rotation = if is_mirrored { -orthogonal } else { orthogonal };
        let stretch = rotation.transpose() * m;
        let stretch = (stretch + stretch.transpose()) * 0.5;
        let rotation = DQuat::from_mat3(&rotation).normalize();
        let translation = transform.translation;
        let is_finite = rotation.is_finite() && stretch.is_finite() && translation.is_finite();
        is_finite.then_some(Self { rotation, stretch, translation, is_mirrored })
    }

    /// Rotation R.
    pub fn rotation(&self) -> DQuat {
        self.rotation
    }

    /// Stretch S.
    pub fn stretch(&self) -> DMat3 {
        self.stretch
    }

    /// Returns true if the transform mirrors.
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// Interpolated transform at `share` in [0, 1] between this pose and another: rotations take
    /// the shorter way around one axis at constant speed [Shoemake 1985, "Animating Rotation with
    /// Quaternion Curves", §3.3], stretches and translations are linear.
    pub fn between(&self, other: &Self, share: f64) -> DAffine3 {
        let rotation = match self.turn_to(other) {
            Some((axis, half)) => {
                let (sin, cos) = libm::sincos(half * share);
                let part = axis * sin;
                self.rotation * DQuat::from_xyzw(part.x, part.y, part.z, cos)
            }
            None => self.rotation,
        };
        let stretch = self.stretch + (other.stretch - self.stretch) * share;
        let translation = self.translation + (other.translation - self.translation) * share;
        DAffine3::from_mat3_translation(DMat3::from_quat(rotation) * stretch, translation)
    }

    /// Number of equal intervals to another pose such that, with linear interpolation in each
    /// interval, no point x is further from its true position than [`POSE_ERROR`] · ‖S‖ · |x|,
    /// where ‖S‖ is the larger Frobenius norm of the two stretches.
    ///
    /// Linear interpolation over an interval h misses a curve by at most h²/8 of its second
    /// derivative. That of R S x is at most (θ²‖S‖ + 2θ‖ΔS‖)|x|, with θ the angle between the
    /// rotations and ΔS the difference of the stretches.
    pub fn steps_to(&self, other: &Self) -> u32 {
        let angle = self.turn_to(other).map_or(0.0, |(_, half)| 2.0 * half);
        let size = frobenius(self.stretch).max(frobenius(other.stretch));
        let change = frobenius(other.stretch - self.stretch);
        let curvature = angle * (angle + 2.0 * change / size);
        (curvature / (8.0 * POSE_ERROR)).sqrt().ceil().max(1.0) as u32
    }

    /// Rotation to another pose: its unit axis before this rotation, and half of its angle, from 0
    /// to π/2; `None` if there is none.
    fn turn_to(&self, other: &Self) -> Option<(DVec3, f64)> {
        let turn = self.rotation.conjugate() * other.rotation;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let sin = turn.xyz().length();
        (sin > MIN_SINE).then(|| (turn.xyz() / sin, libm::atan2(sin, turn.w)))
    }
}

/// Minimum sine of a half angle; below, the axis consists of rounding errors.
const MIN_SINE: f64 = 1e-14;

/// Orthogonal matrix nearest to a matrix, by Newton's method: Q ← (Q + Q⁻ᵀ)/2. [Higham 1986,
/// "Computing the Polar Decomposition—with Applications", §3.1]
///
/// `None` if it does not converge; it converges for nonsingular matrices.
fn orthogonal_factor(m: DMat3) -> Option<DMat3> {
    const MAX_STEPS: usize = 200; // each halves large singular values, then digits double
    const CONVERGED: f64 = 1e-14;
    let mut q = m;
    for _ in 0..MAX_STEPS {
        let next = (q + q.inverse().transpose()) * 0.5;
        if !next.is_finite() {
            return None;
        }
        let change = frobenius(next - q);
        q = next;
        if change <= CONVERGED {
            return Some(q);
        }
    }
    None
}

fn frobenius(m: DMat3) -> f64 {
    m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(axis: DVec3, angle: f64) -> DMat3 {
        DMat3::from_axis_angle(axis.normalize(), angle)
    }

    /// Rotated, sheared, stretched and mirrored transforms.
    fn transforms() -> Vec<DAffine3> {
        let shear =
            DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::new(-0.2, 0.4, 1.0));
        let size = DMat3::from_diagonal(DVec3::new(1e3, 0.02, -3.0));
        [
            DMat3::IDENTITY,
            turn(DVec3::ONE, 2.0) * 0.01,
            turn(DVec3::new(1.0, -2.0, 0.3), 3.1) * shear,
            turn(DVec3::Z, -1.0) * size * turn(DVec3::Y, 0.3),
            -DMat3::IDENTITY,
        ]
        .map(|m| DAffine3::from_mat3_translation(m, DVec3::new(1.0, -2.0, 3.0)))
        .to_vec()
    }

    fn distance(a: &DAffine3, b: &DAffine3) -> f64 {
        let size = frobenius(b.matrix3);
        frobenius(a.matrix3 - b.matrix3) / size + (a.translation - b.translation).length()
    }

    #[test]
    fn a_pose_is_put_together_as_it_was() {
        for a in transforms() {
            let pose = Trs::of(&a).expect("it has an inverse");
            assert_eq!(pose.is_mirrored(), a.matrix3.determinant() < 0.0);
            assert!((DMat3::from_quat(pose.rotation).determinant() - 1.0).abs() < 1e-12);
            assert!(distance(&pose.between(&pose, 0.3), &a) < 1e-11, "{a:?}");
            for b in transforms()
                .iter()
                .filter(|b| b.matrix3.determinant() * a.matrix3.determinant() > 0.0)
            {
                let other = Trs::of(b).expect("it has an inverse");
                assert!(distance(&pose.between(&other, 0.0), &a) < 1e-11);
                assert!(distance(&pose.between(&other, 1.0), b) < 1e-11);
            }
        }
    }

    #[test]
    fn what_is_flat_has_no_pose() {
        for flat in [DMat3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, 0.0, 2.0)), DMat3::NAN] {
            assert_eq!(Trs::of(&DAffine3::from_mat3(flat)), None);
        }
    }

    #[test]
    fn turns_go_the_shorter_way_at_constant_speed() {
        let axis = DVec3::new(0.48, 0.6, 0.64);
        let at = |angle| DAffine3::from_mat3(turn(axis, angle));
        let [from, to] = [at(-0.5), at(2.4)].map(|t| Trs::of(&t).expect("it turns"));
        for share in [0.0, 0.25, 0.7, 1.0] {
            let want = at(-0.5 + 2.9 * share);
            assert!(distance(&from.between(&to, share), &want) < 1e-13, "{share}");
            assert!(distance(&to.between(&from, 1.0 - share), &want) < 1e-13, "{share}");
        }
    }

    /// Between the ends of each interval, points are within the stated error of straight lines, and
    /// with half as many intervals some are not.
    #[test]
    fn parts_are_as_straight_as_promised() {
        for (a, b) in transforms().iter().zip(transforms().iter().skip(1).take(2)) {
            let [from, to] = [a, b].map(|t| Trs::of(t).expect("it has an inverse"));
            let n = from.steps_to(&to);
            let size = frobenius(from.stretch).max(frobenius(to.stretch));
            let worst = |n: u32| {
                let at =
                    |i: u32, part: f64| from.between(&to, (f64::from(i) + part) / f64::from(n));
                let off = |i| {
                    let line = (at(i, 0.0).matrix3 + at(i, 1.0).matrix3) * 0.5;
                    frobenius(line - at(i, 0.5).matrix3)
                };
                (0..n).map(off).fold(0.0, f64::max) / size
            };
            // The Frobenius norm is up to √3 times the largest stretch of a vector.
            assert!(worst(n) <= POSE_ERROR * 3f64.sqrt(), "{n}: {}", worst(n));
            assert!(n == 1 || worst(n / 2) > POSE_ERROR, "{n}: {}", worst(n / 2));
        }
    }
}
