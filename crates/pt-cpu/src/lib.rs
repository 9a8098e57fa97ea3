//! The CPU backend: integrators, and the loop that runs them over the pixels of a film.
//!
//! ```text
//! render: passes → tiles → batches of samples → Integrator::radiance → Film
//! ```

mod adaptive;
mod aov;
mod background;
mod batch;
mod distant;
pub mod integrator;
mod light_groups;
mod render;
mod replay;
mod reuse_tiles;
mod sample_range;
pub mod trace;
mod tracer;

pub use integrator::{
    CameraRays, Feature, INTEGRATORS, Integrator, MAX_REUSE, MAX_SPLIT, Registration, ReuseGroup,
    TracedIntegrator, uses_mis_compensation,
};
pub use light_groups::LightGroups;
pub use render::{Outcome, RenderError, RenderStatistics, Renderer};
pub use tracer::Tracer;
