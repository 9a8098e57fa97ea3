//! Scene and settings of a render, and hits of rays.

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::light::AnyLight;
use pt_core::{Interaction, RenderScene, Settings};

/// Scene and settings of a render.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) scene: &'a RenderScene,
    pub(super) settings: &'a Settings,
}

/// Infinite lights.
pub(super) type Skies = [Id<AnyLight>];

/// A surface hit by a ray.
#[derive(Clone, Copy)]
pub(super) struct SurfaceHit<'a> {
    pub(super) at: &'a Interaction,
    pub(super) hit: &'a Hit,
    /// Time of the path.
    pub(super) time: f32,
}
