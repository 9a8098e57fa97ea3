//! Objects that move while rays are on their way: every ray has a time.
//!
//! The transform of an object is linear between knots in time, so that each of its points moves on
//! straight lines, and is always in the convex hull of where it is at the knots.
//!
//! **Bounds.** The box of [`local_frame`], with its errors, reaches along each axis
//! as far as a convex function of the transform; so what is between two knots is inside of the box
//! around the two boxes. Only the slack, and ρ ≥ ‖MW − I‖, depend on the transform in other ways.
//! Both have bounds by the condition number c = ‖N‖‖N⁻¹‖ of N, which is the linear part with the
//! axes of the object scaled to about unit length: that changes neither S nor the rounding of an
//! inverse by cofactors, of which ρ ≤ 64·2⁻⁵³·c³ follows by counting its operations (|det N⁻¹| is
//! at most ‖N⁻¹‖³ [Hadamard 1893]). And S ≤ c.
//!
//! **The condition number between two knots.** With H half of the difference of the two N, and N
//! the one in the middle, N + sH = N(I + sN⁻¹H) for |s| ≤ 1. Where δ = ‖N⁻¹‖‖H‖ < 1, its inverse is
//! at most ‖N⁻¹‖/(1 − δ) [Neumann's series]: none of the transforms between is flat. Where δ is
//! large, both halves are looked at.

use std::sync::Arc;

use pt_math::{Bounds3, DAffine3, DMat3, DVec3, Ray};

use super::local_frame::{self, LocalFrame};
use super::{InstanceHit, TransformError};
use crate::aabb_tree::AabbTree;
use crate::counter::{Counter, Off};
use crate::{BuildError, Bvh};

/// Where an object is at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionKey {
    /// When, in any unit.
    pub time: f32,
    /// From coordinates of the object to those of the world.
    pub to_world: DAffine3,
}

impl MotionKey {
    /// The transform at a time by knots of increasing times: linear between two, constant before
    /// the first and after the last.
    ///
    /// # Panics
    /// If there are none.
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

/// An object that moves. Between knots its transform is linear in time, before the first and after
/// the last it is constant.
#[derive(Clone, Debug)]
pub struct AnimatedInstance {
    object: Arc<Bvh>,
    keys: Vec<MotionKey>,
    /// If there is one knot.
    still: Option<LocalFrame>,
    bounds: Bounds3,
    error_bound: f32,
}

impl AnimatedInstance {
    /// Moves an object. One knot is an object that stands still.
    ///
    /// # Errors
    /// No knots or times that do not increase; transforms that are not finite, place the object too
    /// far away, or of which one, or one between two of them, has no inverse or one that is not
    /// known well.
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

    /// The object.
    pub fn object(&self) -> &Arc<Bvh> {
        &self.object
    }

    /// Returns true if it has more than one knot.
    pub fn moves(&self) -> bool {
        self.keys.len() > 1
    }

    /// From coordinates of the object to those of the world, at a time.
    #[inline]
    pub fn to_world(&self, time: f32) -> DAffine3 {
        MotionKey::at(&self.keys, time)
    }

    /// A box in the world around all that can be hit at any time; empty when nothing can.
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

/// What is inverted on the way, or as flat as if it were.
const INVERTED: TransformError = TransformError::Flat { condition: f64::INFINITY };
/// How often the way between two knots is halved to find that nothing on it is flat.
const MAX_HALVES: u32 = 12;

/// A bound of the condition numbers, with the axes of the object scaled, of all matrices between
/// two; `None` if one of them may have no inverse.
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

/// Objects that move, ready for queries of rays that have a time.
///
/// The nearest hit is that of a loop over all instances which asks each object for the ray that
/// [`AnimatedInstance::to_object`] returns; of hits with equal t, that on the instance with the
/// least number.
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
    /// Makes instances ready for queries; those in which nothing can be hit are left out and
    /// counted.
    ///
    /// # Errors
    /// Too many instances.
    pub fn build(instances: Vec<AnimatedInstance>) -> Result<Self, BuildError> {
        let at = |i: u32| &instances[i as usize];
        let bounds = |i| Some(at(i).bounds).filter(|bounds| !bounds.is_empty());
        let tree = AabbTree::build(instances.len(), bounds, |i| at(i).error_bound)?;
        Ok(Self { instances, tree })
    }

    /// The nearest hit at a time with t in (`t_min`, `t_max`).
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

    /// The box around everything that can be hit at any time; empty when nothing can.
    pub fn bounds(&self) -> Bounds3 {
        self.tree.bounds()
    }

    /// Instances left out because no ray can hit them.
    pub fn skipped(&self) -> u32 {
        self.tree.skipped()
    }
}
