//! A physically based path tracer.
//!
//! This crate is the public interface of the workspace: it reads scenes, renders them, and writes
//! images.
//!
//! ```
//! use pathtracer::{CompileOptions, Session, Settings, Silent};
//!
//! let scene = pathtracer::default_scene();
//! let options = CompileOptions { resolution: Some([32, 24]), ..CompileOptions::default() };
//! let settings = Settings { spp: 4, ..Settings::default() };
//! let mut session = Session::new(&scene, options, settings)?;
//! session.render(1, 16, &Silent)?;
//! let image = session.image();
//! assert_eq!((image.width, image.height), (32, 24));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Scene`] is the description by its author; [`Session::new`] compiles it. The radiance of a
//! sample is a pure function of the compiled scene, the settings, the pixel and the number of the
//! sample, and sums of samples are exact: the image is the same, bit for bit, for any number of
//! threads.

pub mod checkpoint;
pub mod compat;
pub mod cryptomatte;
pub mod denoise;
pub mod eta;
pub mod explain;
pub mod film_file;
pub mod fingerprint;
pub mod light_groups;
pub mod memory;
mod parts;
pub mod probes;
pub mod provenance;
pub mod queries;
pub mod scene_stats;
mod session;
mod unlit;
mod view;

pub use parts::Part;
pub use pt_bvh::{BuildOptions, Builder, Quality};
pub use pt_core::develop::{radiance, rgba};
pub use pt_core::film::{
    Aov, ErrorEstimate, Film, HalfBuffer, InvalidSamples, Region, aov, groups,
};
pub use pt_core::light::EnvironmentMap;
pub use pt_core::progress::{Observer, ProgressUpdate, Silent};
pub use pt_core::settings::{
    Adaptive, Clamp, DirectLight, Hidden, LightGroup, LightGroups, Roulette, Settings, Target,
};
pub use pt_core::target::Evaluation;
pub use pt_core::{CompileError, CompileOptions, Hierarchies, resolution};
pub use pt_cpu::{
    Feature, INTEGRATORS, MAX_REUSE, MAX_SPLIT, Outcome, Registration, RenderError,
    RenderStatistics, integrator,
};
pub use pt_formats::{
    Attachment, FORMATS, Format, Limits, LoadError, LoadOptions, LoadResult, Numbers, SaveError,
    SceneValues, camera_file, camera_index, is_scene, load, load_with, names_of, parse_with,
    read_content_with, read_values_with, read_with, save, source_file, suggestions, values_of,
    values_of_parts, views,
};
pub use pt_image as image;
pub use pt_io::{WriteError, check_target, file, folder_of, write_atomically};
pub use pt_math::sampler::{HALF_B_OFFSET, SamplerKind};
pub use pt_scene::image::{Image, Samples};
pub use pt_scene::{
    Aperture, Camera, DateTime, Daylight, Filter, Fit, GeoLocation, Hint, IesProfile, Light,
    LightKind, Material, Meter, Object, Placement, Projection, Quantity, RenderHints, Rows, Scene,
    Shared, SkyLayout, SourceFile, Span, TimeRange, Warning,
};
pub use session::{CompiledScene, Session};

/// Returns the scene that is rendered if none is given: a Cornell box with a mirror and a glass
/// sphere, with a resolution and a number of samples that take seconds.
///
/// # Panics
/// Never: the scene is part of the program, and a test reads it.
pub fn default_scene() -> Scene {
    let bytes = include_bytes!("../../../scenes/cornell.dae");
    let path = std::path::Path::new("cornell.dae");
    let mut scene = pt_formats::parse(bytes, path).expect("the embedded scene is valid");
    scene.settings =
        RenderHints { resolution: Some([400, 400]), spp: Some(32), ..RenderHints::default() };
    scene
}

/// Examples of the readme.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
pub struct Readme;
