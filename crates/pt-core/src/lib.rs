//! The compiled scene and everything in it: lobes, lights, the camera, and the film that collects
//! samples of it.
//!
//! ```text
//! pt_scene::Scene ─ compile ─▶ RenderScene ─ a backend ─▶ Film ─ develop ─▶ images
//! ```
//!
//! A [`RenderScene`] is made of flat tables linked by [`id::Id`]s, is never edited, and is all
//! that a backend reads.

pub mod bsdf;
pub mod camera;
pub mod camera_motion;
pub mod compile;
pub mod develop;
pub mod film;
pub mod filter;
pub mod footprint;
pub mod id;
pub mod laid;
mod levels;
pub mod light;
pub mod material;
pub mod medium;
pub mod meter;
pub mod parametrization;
pub mod phase;
pub mod placed;
pub mod procedural;
pub mod progress;
mod pyramid;
pub mod scene;
pub mod settings;
pub mod shapes;
pub mod target;
mod terminator;
pub mod texels;
pub mod texture;
mod wedge;

pub use camera::Camera;
pub use compile::{CompileError, CompileOptions, Compiled, MAX_COPIED, compile};
pub use film::{Film, Region};
pub use progress::{Advance, Observer};
pub use scene::{Interaction, RenderScene};
pub use settings::Settings;
