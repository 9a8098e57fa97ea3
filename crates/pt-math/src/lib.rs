//! Mathematics of the renderer: vectors, rays, warps, distributions, samplers and colour.
//!
//! Conventions, for the whole workspace: right-handed coordinates, +y up in the world, +z along
//! the normal in local frames, radians, linear Rec. 709 colour. Every function is pure, and gives
//! the same bits on every machine: transcendental functions come from [`trig`] (never from the
//! platform's C library), and a fused multiply-add happens only where `mul_add` is written.

pub mod bounds;
pub mod cie;
pub mod color;
pub mod distribution;
pub mod float_error;
pub mod frame;
pub mod lanes;
pub mod measure;
pub mod noise;
pub mod point_mesh;
pub mod ray;
pub mod rays;
pub mod sampler;
pub mod spectrum;
pub mod trig;
pub mod trs;
pub mod warp;

pub use bounds::Bounds3;
pub use frame::Frame;
pub use glam::{
    Affine2, BVec3A, DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, FloatExt, Mat3, Vec2, Vec3,
    Vec3A, Vec4,
};
pub use measure::{Area, Pdf, SolidAngle};
pub use ray::Ray;
pub use rays::{Ray8, RayColumns, Rays};
pub use spectrum::Spectrum;
pub use trs::{POSE_ERROR, Trs};
