//! Transform of an object: rays from the world to it, and its box in the world, with the error
//! bounds that make the two consistent.
//!
//! Let the object have the box b, with |b| its largest coordinate and D its longest edge; let M be
//! the linear part of the transform, T its translation, and W the inverse of M as it is stored; all
//! norms are maximum norms. A ray o + t·d is passed to the object as o' + t·d' with o' = W(o − T)
//! and d' = W·d, computed in double precision and then rounded.
//!
//! **Distance of a hit from b, in the object.** Let R_k be the largest distance along axis k from
//! o' to a corner of b, and s_k the slope of the ray against the axis z of its largest component.
//! By the argument in [`crate::ray`], the point o' + t·d' of a hit is off by the rounding of
//! sheared vertices, up to ε(2R_k + 5s_k·R_z), and by an error along the ray, up to 14ε·s_k·max R.
//! A ray that hits comes as far as b along all axes: s_k·R_z ≤ R_k + D and max R ≤ R_z + D, but for
//! these very errors. So it is outside by at most ε(21R_k + 33D).
//!
//! **In the world.** Rounding o' and d' moves the point by ε(2R_k + |b|). With ρ ≥ ‖MW − I‖,
//! mapping it back by M instead of W⁻¹ moves it by ρ‖M‖·|b|. And Σ|M_ik|·R_k ≤ S·R with R the
//! largest distance from o to a corner of the box in the world, S = ‖|M|·|W|‖ [Skeel 1979, "Scaling
//! for Numerical Stability in Gaussian Elimination"], which is at most 3 for every scale along the
//! axes of the object followed by a rotation. The rounding of double precision is less than that by
//! the limit on ‖M‖‖W‖. Together:
//!
//!   25ε·S·R  +  |M|·(33D + |b|)ε  +  ρ‖M‖·|b|,
//!
//! of which the first term is the error bound of the instance, and the others widen its box.

use pt_math::float_error::EPSILON;
use pt_math::{Bounds3, DAffine3, DMat3, DVec3, Ray, Vec3};

use super::TransformError;
use crate::geometry::{in_range, outward};

/// Largest accepted ‖M‖‖W‖.
const MAX_CONDITION: f64 = (1u32 << 24) as f64;
/// Largest accepted ‖MW − I‖ and ‖WM − I‖.
pub(super) const MAX_RESIDUAL: f64 = 1.0 / 1024.0;
/// Minimum length of directions in the object; shorter ones lose digits to underflow.
const MIN_DIRECTION: f32 = 1.0 / (1u128 << 100) as f32;

/// Transform prepared for rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalFrame {
    translation: DVec3,
    /// The inverse W.
    inverse: DMat3,
    bounds: Bounds3,
    error_bound: f32,
}

impl LocalFrame {
    /// Prepares the transform of an object with a box, which may be empty.
    pub(super) fn new(to_world: &DAffine3, object: Bounds3) -> Result<Self, TransformError> {
        if !to_world.is_finite() {
            return Err(TransformError::NotFinite);
        }
        let (m, translation) = (to_world.matrix3, to_world.translation);
        let inverse = m.inverse();
        let condition = norm(m) * norm(inverse);
        let residual = residual(m, inverse).max(self::residual(inverse, m));
        // NaN compares false.
        if !(condition <= MAX_CONDITION && residual <= MAX_RESIDUAL) {
            let condition = if condition.is_nan() { f64::INFINITY } else { condition };
            return Err(TransformError::Flat { condition });
        }
        let bounds = if object.is_empty() {
            object
        } else {
            world_bounds(to_world, object, residual).ok_or(TransformError::TooFar)?
        };
        let error_bound = error_bound_of(norm(m.abs() * inverse.abs()));
        Ok(Self { translation, inverse, bounds, error_bound })
    }

    /// See [`super::Instance::bounds`].
    pub(super) fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// See [`crate::UserPrimitives::error_bound`].
    pub(super) fn error_bound(&self) -> f32 {
        self.error_bound
    }

    /// See [`super::Instance::to_object`].
    #[inline]
    pub(super) fn local_ray(&self, ray: &Ray) -> Ray {
        ray_to_local(&self.inverse, self.translation, ray)
    }
}

/// Transforms a ray to the coordinates of an object with this W and T.
#[inline]
pub(super) fn ray_to_local(inverse: &DMat3, translation: DVec3, ray: &Ray) -> Ray {
    let origin = *inverse * (ray.origin.as_dvec3() - translation);
    let direction = (*inverse * ray.direction.as_dvec3()).as_vec3();
    let is_long = direction.abs().max_element() >= MIN_DIRECTION;
    let direction = if is_long { direction } else { Vec3::ZERO };
    Ray { origin: origin.as_vec3(), direction, ..*ray }
}

/// Error bound of an instance with this S, or this bound of it.
pub(super) fn error_bound_of(s: f64) -> f32 {
    28.0 * EPSILON * s as f32
}

/// Maximum norm: the largest sum of magnitudes of a row.
pub(super) fn norm(m: DMat3) -> f64 {
    (m.abs() * DVec3::ONE).max_element()
}

/// Upper bound of ‖ab − I‖: the computed value plus its error.
fn residual(a: DMat3, b: DMat3) -> f64 {
    norm(a * b - DMat3::IDENTITY) + 2.0 * f64::EPSILON * norm(a.abs() * b.abs())
}

/// World-space box of the object, widened by the second and third term of the error of hits. The
/// coefficients are rounded up by more than the omitted terms: products of errors, underflow, and
/// the rounding of this function. `None` if coordinates become too large.
pub(super) fn world_bounds(to_world: &DAffine3, object: Bounds3, residual: f64) -> Option<Bounds3> {
    let (m, translation) = (to_world.matrix3, to_world.translation);
    let [low, high] = [object.min, object.max].map(Vec3::as_dvec3);
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let size = low.abs().max(high.abs()).max_element();
    let edge = (high - low).max_element();
    let epsilon = f64::from(EPSILON);
    let underflow = 8.0 * f64::from(f32::MIN_POSITIVE);
    let in_object = (36.0 * edge + 2.0 * size) * epsilon + underflow;
    let mapped = norm(m) * size * (2.0 * residual + epsilon);
    let rounded = translation.abs() * (8.0 * f64::EPSILON);
    let error = m.abs() * DVec3::splat(in_object) + mapped + rounded;
    let middle = m * center + translation;
    let extent = m.abs() * half + error;
    let bounds = outward(middle - extent, middle + extent);
    (in_range(bounds.min) && in_range(bounds.max)).then_some(bounds)
}

#[cfg(test)]
mod tests {
    use pt_math::DQuat;

    use super::*;

    fn turned(scale: DVec3, translation: DVec3) -> DAffine3 {
        let turn = DQuat::from_rotation_arc(DVec3::Z, DVec3::new(0.48, 0.6, 0.64));
        DAffine3::from_scale_rotation_translation(scale, turn, translation)
    }

    const CUBE: Bounds3 = Bounds3 { min: Vec3::NEG_ONE, max: Vec3::ONE };

    #[test]
    fn carried_rays_keep_their_parameter() {
        let to_world = turned(DVec3::new(100.0, 0.01, -3.0), DVec3::new(5.0, 6.0, 7.0));
        let placement = LocalFrame::new(&to_world, CUBE).expect("not flat");
        let ray = Ray::to(Vec3::new(4.0, -2.0, 1.0), Vec3::new(0.3, 0.1, -2.0), 8.0);
        let carried = placement.local_ray(&ray);
        assert_eq!((carried.t_min, carried.t_max), (ray.t_min, ray.t_max));
        for t in [0.0, 0.5, 8.0] {
            let there = to_world.transform_point3(carried.at(t).as_dvec3());
            assert!((there - ray.at(t).as_dvec3()).length() < 1e-4, "{t} {there}");
        }
    }

    /// The box contains all corners, and is hardly larger than the box around them.
    #[test]
    fn boxes_are_tight() {
        let to_world = turned(DVec3::splat(3.0), DVec3::new(5.0, 6.0, 7.0));
        let bounds = LocalFrame::new(&to_world, CUBE).expect("not flat").bounds();
        let corners = (0..8).map(|i| {
            let sign = |bit: i32| if i & bit == 0 { -1.0 } else { 1.0 };
            to_world.transform_point3(DVec3::new(sign(1), sign(2), sign(4))).as_vec3()
        });
        let tight: Bounds3 = corners.collect();
        assert_eq!(bounds.union(tight), bounds);
        assert!((bounds.diagonal() - tight.diagonal()).max_element() < 3e-4);
    }

    /// Rotations and scales of the object's axes do not add to the error of hits.
    #[test]
    fn slack_grows_with_shear_only() {
        let error_bound = |scale| {
            let to_world = turned(scale, DVec3::ZERO);
            LocalFrame::new(&to_world, CUBE).expect("not flat").error_bound() / EPSILON
        };
        assert!((28.0..=84.0).contains(&error_bound(DVec3::ONE)));
        assert!(
            (error_bound(DVec3::new(1e3, 1e-3, -1.0)) / error_bound(DVec3::ONE) - 1.0).abs() < 1e-5
        );
    }
}
