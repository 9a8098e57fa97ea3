//! The CPU backend: integrators, and the loop that runs them over the pixels of a film.
//!
//! ```text
//! render: passes → tiles → batches of samples → Integrator::radiance → Film
//! ```

mod batch;
mod distant;
mod first_hits;
mod groups;
mod halves;
pub mod integrator;
mod light_groups;
mod render;
mod replay;
pub mod trace;
mod tracer;
mod vacant;

pub use integrator::{
    Does, Group, INTEGRATORS, Integrator, MAX_REUSE, MAX_SPLIT, Recording, Registration, Starts,
    compensates,
};
pub use light_groups::LightGroups;
pub use render::{Progress, RenderError, Renderer, Statistics};
pub use tracer::Tracer;
