//! The compiled scene and everything in it: lobes, lights, the camera, and the film that
//! accumulates samples.
//!
//! ```text
//! pt_scene::Scene ─ compile ─▶ RenderScene ─ a backend ─▶ Film ─ develop ─▶ images
//! ```
//!
//! A [`RenderScene`] consists of flat tables linked by [`id::Id`]s. It is immutable, and all that a
//! backend reads.

pub mod bsdf;
mod byte_levels;
pub mod camera;
pub mod camera_motion;
pub mod compile;
pub mod develop;
pub mod film;
pub mod filter;
pub mod footprint;
pub mod id;
pub mod image_texture;
pub mod instances;
pub mod interaction;
pub mod light;
pub mod material;
pub mod medium;
pub mod meter;
mod mipmap;
pub mod phase;
mod procedural;
pub mod progress;
pub mod scene;
pub mod settings;
pub mod shapes;
pub mod surface;
pub mod target;
mod terminator;
pub mod texture;
pub mod texture_eval_context;
pub mod texture_mapping;
pub mod texture_record;
mod wedge;

pub use camera::Camera;
pub use compile::{
    CompileError, CompileOptions, Compiled, Earlier, Hierarchies, Kept, MAX_FLATTENED_TRIANGLES,
    compile, compile_camera, compile_edited, resolution,
};
pub use film::{Film, Region};
pub use interaction::Interaction;
pub use progress::{Observer, ProgressUpdate};
pub use scene::RenderScene;
pub use settings::Settings;
