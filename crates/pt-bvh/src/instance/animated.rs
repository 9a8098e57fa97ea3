//! Instances that move during the exposure; every ray has a time.
//!
//! The transform of an object is piecewise linear in time between keys. So each of its points moves
//! on straight lines, and always lies in the convex hull of its positions at the keys.
//!
//! **Bounds.** The box of [`local_frame`], with its errors, extends along each axis by a convex
//! function of the transform. So between two keys the object is inside of the box around the two
//! boxes. Only the error bound, and ρ ≥ ‖MW − I‖, depend on the transform in other ways. Both are
//! bounded by the condition number c = ‖N‖‖N⁻¹‖ of N, which is the linear part with the axes of the
//! object scaled to about unit length. This scaling changes neither S nor the rounding of an
//! inverse by cofactors, of which ρ ≤ 64·2⁻⁵³·c³ follows by counting its operations (|det N⁻¹| is
//! at most ‖N⁻¹‖³ [Hadamard 1893]). And S ≤ c.
//!
//! **The condition number between two keys.** With H half of the difference of the two N, and N the
//! one in the middle, N + sH = N(I + sN⁻¹H) for |s| ≤ 1. If δ = ‖N⁻¹‖‖H‖ < 1, its inverse is at
//! most ‖N⁻¹‖/(1 − δ) [Neumann's series]: none of the transforms between is singular. If δ is
//! large, both halves of the interval are examined.

use std::sync::Arc;

use pt_math::{Bounds3, DAffine3, DMat3, DVec3, Ray};

use super::local_frame::{self, LocalFrame};
use super::{InstanceHit, TransformError};
use crate::aabb_tree::AabbTree;
use crate::counter::{Counter, Off};
use crate::{BuildError, Bvh};

/// Transform of an object at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionKey {
    /// Time, in any unit.
    pub time: f32,
    /// Transform from object to world coordinates.
    pub to_world: DAffine3,
}

impl MotionKey {
    /// Interpolates the transform at a time from keys of increasing times: linear between two,
    /// constant before the first and after the last.
    ///
    /// # Panics
    /// If there are no keys.
    #[inline]
    pub fn at(keys: &[Self], time: f32) -> DAffine3 {
        let after = keys.partition_point(|key| key.time <= time);
        let Some(to) = keys.get(after) else { return keys[after - 1].to_world };
        let Some(from) = after.checked_sub(1).map(|i| &keys[i]) else { return to.to_world };
        let [start, end, time] = [from.time, to.time, time].map(f64::from);
        let share = (time - start) / (end - start);
        let [a, b] = [from.to_world, to.to_world];
        DAffine3::from_mat3_translation(
            a.matrix3 + (b.matrix3 - a.matrix3) * share,
            a.translation + (b.translation - a.translation) * share,
        )
    }
}

/// Moving object. Between keys its transform is linear in time; before the first and after the last
/// it is constant.
#[derive(Clone, Debug)]
pub struct AnimatedInstance {
    object: Arc<Bvh>,
    keys: Vec<MotionKey>,
    /// Transform of an object with a single key.
    still: Option<LocalFrame>,
    bounds: Bounds3,
    error_bound: f32,
}

impl AnimatedInstance {
    /// Creates a moving object. With one key the object is static.
    ///
    /// # Errors
    /// No keys, or times that do not increase; transforms that are not finite or place the object
    /// too far away; a transform at or between keys that is singular or too ill-conditioned.
    pub fn new(object: Arc<Bvh>, keys: Vec<MotionKey>) -> Result<Self, TransformError> {
        let increase = keys.is_sorted_by(|a, b| a.time < b.time);
        let Some(first) = keys.first().filter(|first| increase && first.time.is_finite()) else {
            return Err(TransformError::Times);
        };
        let placed = LocalFrame::new(&first.to_world, object.bounds())?;
        let (mut bounds, mut error_bound) = (placed.bounds(), placed.error_bound());
        for pair in keys.windows(2) {
            let linear = [0, 1].map(|i| pair[i].to_world.matrix3);
            LocalFrame::new(&pair[1].to_world, object.bounds())?;
            let condition = condition(linear, MAX_HALVES).ok_or(INVERTED)?;
            let residual = 64.0 * f64::EPSILON * condition * condition * condition;
            if residual > local_frame::MAX_RESIDUAL {
                return Err(TransformError::Flat { condition });
            }
            error_bound = error_bound.max(local_frame::error_bound_of(condition));
            if !object.bounds().is_empty() {
                for key in pair {
                    let there = local_frame::world_bounds(&key.to_world, object.bounds(), residual);
                    bounds = bounds.union(there.ok_or(TransformError::TooFar)?);
                }
            }
        }
        let still = (keys.len() == 1).then_some(placed);
        Ok(Self { object, keys, still, bounds, error_bound })
    }

    /// Moving object.
    pub fn object(&self) -> &Arc<Bvh> {
        &self.object
    }

    /// Returns true if there is more than one key.
    pub fn moves(&self) -> bool {
        self.keys.len() > 1
    }

    /// Transform from object to world coordinates at a time.
    #[inline]
    pub fn to_world(&self, time: f32) -> DAffine3 {
        MotionKey::at(&self.keys, time)
    }

    /// World-space box of the object over all times; empty if no ray can hit it.
    pub fn bounds(&self) -> Bounds3 {
        self.bounds
    }

    /// The ray at a time in coordinates of the object, with the same t; see
    /// [`Instance::to_object`](crate::Instance::to_object).
    #[inline]
    pub fn to_object(&self, ray: &Ray, time: f32) -> Ray {
        if let Some(still) = &self.still {
            return still.local_ray(ray);
        }
        let to_world = self.to_world(time);
        local_frame::ray_to_local(&to_world.matrix3.inverse(), to_world.translation, ray)
    }
}

/// Error for a motion that passes through a singular transform, or one too close to it.
const INVERTED: TransformError = TransformError::Flat { condition: f64::INFINITY };
/// Maximum number of bisections between two keys in the search for singular transforms.
const MAX_HALVES: u32 = 12;

/// Upper bound of the condition numbers, with the axes of the object scaled, of all matrices
/// between two; `None` if one of them may be singular.
fn condition([a, b]: [DMat3; 2], halves: u32) -> Option<f64> {
    const SMALL: f64 = 0.25;
    let middle = (a + b) * 0.5;
    let lengths =
        DVec3::new(middle.x_axis.length(), middle.y_axis.length(), middle.z_axis.length());
    let scaled = |m: DMat3| m * DMat3::from_diagonal(lengths.recip());
    let inverse = local_frame::norm(scaled(middle).inverse());
    let delta = inverse * local_frame::norm(scaled(b - a)) * 0.5;
    // NaN compares false.
    if delta <= SMALL {
        let largest = local_frame::norm(scaled(a)).max(local_frame::norm(scaled(b)));
        return Some(largest * inverse / (1.0 - delta));
    }
    let halves = halves.checked_sub(1)?;
    Some(condition([a, middle], halves)?.max(condition([middle, b], halves)?))
}

/// Moving objects, prepared for queries of rays that have a time.
///
/// The nearest hit is that of a loop over all instances that intersects each object with the ray of
/// [`AnimatedInstance::to_object`]; of hits with equal t, that on the instance with the least
/// number.
///
/// ```
/// use std::sync::Arc;
///
/// use pt_bvh::{BuildOptions, Bvh, Geometry, MotionKey, AnimatedBvh, AnimatedInstance, Sphere};
/// use pt_math::{DAffine3, DVec3, Ray, Vec3};
///
/// let ball = [Sphere { center: Vec3::ZERO, radius: 1.0 }];
/// let geometry = Geometry { spheres: &ball, ..Geometry::default() };
/// let ball = Arc::new(Bvh::build(geometry, &BuildOptions::default())?);
/// let at = |time, z| MotionKey { time, to_world: DAffine3::from_translation(DVec3::Z * z) };
/// let moving = AnimatedInstance::new(ball, vec![at(0.0, 4.0), at(1.0, 8.0)])?;
/// let scene = AnimatedBvh::build(vec![moving])?;
///
/// let ray = Ray::new(Vec3::ZERO, Vec3::Z);
/// let t = |time| scene.intersect(&ray, time).map(|hit| hit.hit.t);
/// assert_eq!([t(0.0), t(0.5), t(2.0)], [Some(3.0), Some(5.0), Some(7.0)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct AnimatedBvh {
    instances: Vec<AnimatedInstance>,
    tree: AabbTree,
}

impl AnimatedBvh {
    /// Builds the tree over instances. Objects that no ray can hit are left out and counted.
    ///
    /// # Errors
    /// Too many instances.
    pub fn build(instances: Vec<AnimatedInstance>) -> Result<Self, BuildError> {
        let at = |i: u32| &instances[i as usize];
        let bounds = |i| Some(at(i).bounds).filter(|bounds| !bounds.is_empty());
        let tree = AabbTree::build(instances.len(), bounds, |i| at(i).error_bound)?;
        Ok(Self { instances, tree })
    }

    /// Returns the nearest hit at a time with t in (`t_min`, `t_max`).
    pub fn intersect(&self, ray: &Ray, time: f32) -> Option<InstanceHit> {
        self.nearest(ray, time, &mut Off)
    }

    /// Returns true if anything is hit at a time with t in (`t_min`, `t_max`).
    pub fn occluded(&self, ray: &Ray, time: f32) -> bool {
        self.any(ray, time, &mut Off)
    }

    /// [`Self::intersect`], which adds the number of primitives tested to `tests`.
    pub fn intersect_counted(&self, ray: &Ray, time: f32, tests: &mut u64) -> Option<InstanceHit> {
        self.nearest(ray, time, tests)
    }

    /// [`Self::occluded`], which adds the number of primitives tested to `tests`.
    pub fn occluded_counted(&self, ray: &Ray, time: f32, tests: &mut u64) -> bool {
        self.any(ray, time, tests)
    }

    fn nearest(&self, ray: &Ray, time: f32, counter: &mut impl Counter) -> Option<InstanceHit> {
        let t = |hit: &InstanceHit| hit.hit.t;
        self.tree.nearest(ray, t, |instance, ray| {
            let moving = &self.instances[instance as usize];
            let hit = moving.object.nearest(&moving.to_object(ray, time), counter)?;
            Some(InstanceHit { instance, hit })
        })
    }

    fn any(&self, ray: &Ray, time: f32, counter: &mut impl Counter) -> bool {
        self.tree.any(ray, |instance, ray| {
            let moving = &self.instances[instance as usize];
            moving.object.any(&moving.to_object(ray, time), counter)
        })
    }

    /// The instances.
    pub fn instances(&self) -> &[AnimatedInstance] {
        &self.instances
    }

    /// Box around all objects over all times; empty if no ray can hit any.
    pub fn bounds(&self) -> Bounds3 {
        self.tree.bounds()
    }

    /// Number of instances left out because no ray can hit them.
    pub fn skipped(&self) -> u32 {
        self.tree.skipped()
    }
}
