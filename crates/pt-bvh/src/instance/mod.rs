//! Instances: objects that are built once and placed many times, as two levels of trees.
//!
//! The upper level is a [`UserBvh`] whose primitives are instances. It passes transformed rays to
//! the [`Bvh`] of the object. Directions keep their length in the object's units, so that t is the
//! same on both levels.

mod animated;
mod local_frame;

use std::sync::Arc;

use pt_math::{Bounds3, DAffine3, Ray};
use thiserror::Error;

pub use self::animated::{AnimatedBvh, AnimatedInstance, MotionKey};
use self::local_frame::LocalFrame;
use crate::{Bvh, Hit, UserBvh, UserPrimitives};

/// Reason for which a transform is rejected.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum TransformError {
    /// A coefficient is infinite or NaN.
    #[error("the transform has coefficients that are not finite")]
    NotFinite,
    /// The inverse does not exist, or is too ill-conditioned.
    #[error(
        "the transform makes objects flat, or does so on its way: its condition number {condition:e} is above 2^24"
    )]
    Flat {
        /// ‖M‖·‖M⁻¹‖ in the maximum norm, M being the linear part; infinite without an inverse.
        condition: f64,
    },
    /// The object would not be within [`LARGEST_COORDINATE`](crate::LARGEST_COORDINATE).
    #[error("the transform places the object beyond 2^60")]
    TooFar,
    /// There is no key, or the times are not finite and increasing.
    #[error("the times of knots must be finite and increase, and there must be one")]
    Times,
}

/// An object, placed in the world by an affine transform.
#[derive(Clone, Debug)]
pub struct Instance {
    object: Arc<Bvh>,
    to_world: DAffine3,
    placement: LocalFrame,
}

/// Nearest intersection with instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceHit {
    /// Number of the instance.
    pub instance: u32,
    /// Hit on the object; t is that of the ray in the world.
    pub hit: Hit,
}

/// Instances, prepared for ray queries.
///
/// The nearest hit is that of a loop over all instances that intersects each object with the ray of
/// [`Instance::to_object`]; of hits with equal t, that on the instance with the least number. If
/// instances move or objects change, call [`UserBvh::update`].
///
/// ```
/// use std::sync::Arc;
///
/// use pt_bvh::{BuildOptions, Bvh, Geometry, Instance, InstanceBvh, Sphere};
/// use pt_math::{DAffine3, DVec3, Ray, Vec3};
///
/// let ball = [Sphere { center: Vec3::ZERO, radius: 1.0 }];
/// let geometry = Geometry { spheres: &ball, ..Geometry::default() };
/// let ball = Arc::new(Bvh::build(geometry, &BuildOptions::default())?);
/// let at = |z| DAffine3::from_translation(DVec3::Z * z);
/// let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.5));
/// let instances =
///     vec![Instance::new(ball.clone(), at(9.0))?, Instance::new(ball, at(5.0) * flat)?];
/// let mut scene = InstanceBvh::build(instances)?;
///
/// let ray = Ray::new(Vec3::ZERO, Vec3::Z);
/// let hit = scene.intersect(&ray).unwrap();
/// assert_eq!((hit.instance, hit.hit.t), (1, 4.5));
///
/// scene.update(|instances| instances[1].set_transform(at(20.0)))??;
/// assert_eq!(scene.intersect(&ray).map(|hit| hit.instance), Some(0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type InstanceBvh = UserBvh<Vec<Instance>>;

impl Instance {
    /// Places an object; `to_world` maps its coordinates to those of the world.
    ///
    /// # Errors
    /// A transform that is not finite, is singular or too ill-conditioned, or places the object too
    /// far away.
    pub fn new(object: Arc<Bvh>, to_world: DAffine3) -> Result<Self, TransformError> {
        let placement = LocalFrame::new(&to_world, object.bounds())?;
        Ok(Self { object, to_world, placement })
    }

    /// Replaces the transform.
    ///
    /// # Errors
    /// Same as [`Self::new`]; the instance is then unchanged.
    pub fn set_transform(&mut self, to_world: DAffine3) -> Result<(), TransformError> {
        self.placement = LocalFrame::new(&to_world, self.object.bounds())?;
        self.to_world = to_world;
        Ok(())
    }

    /// Placed object.
    pub fn object(&self) -> &Arc<Bvh> {
        &self.object
    }

    /// Transform from object to world coordinates.
    pub fn to_world(&self) -> DAffine3 {
        self.to_world
    }

    /// World-space box of the object; empty if no ray can hit it.
    pub fn bounds(&self) -> Bounds3 {
        self.placement.bounds()
    }

    /// The ray in coordinates of the object, with the same t. A direction that becomes shorter than
    /// 2⁻¹⁰⁰ is replaced by 0, so that nothing is hit, since its digits would be lost.
    #[inline]
    pub fn to_object(&self, ray: &Ray) -> Ray {
        self.placement.local_ray(ray)
    }
}

impl UserPrimitives for Vec<Instance> {
    type Hit = InstanceHit;

    fn len(&self) -> usize {
        self.len()
    }

    fn bounds(&self, instance: u32) -> Option<Bounds3> {
        Some(self[instance as usize].bounds()).filter(|bounds| !bounds.is_empty())
    }

    fn error_bound(&self, instance: u32) -> f32 {
        self[instance as usize].placement.error_bound()
    }

    fn intersect(&self, instance: u32, ray: &Ray) -> Option<InstanceHit> {
        let Instance { object, placement, .. } = &self[instance as usize];
        object.intersect(&placement.local_ray(ray)).map(|hit| InstanceHit { instance, hit })
    }

    fn t(hit: &InstanceHit) -> f32 {
        hit.hit.t
    }

    fn occluded(&self, instance: u32, ray: &Ray) -> bool {
        let Instance { object, placement, .. } = &self[instance as usize];
        object.occluded(&placement.local_ray(ray))
    }
}
