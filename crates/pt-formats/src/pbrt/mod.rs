//! Reader of pbrt-v4 scenes. [Pharr, Jakob & Humphreys, "Physically Based Rendering", 4th ed. 2023,
//! and the documentation of its file format, pbrt.org/fileformat-v4]
//!
//! ```text
//! files ─ token ─▶ directives ─ read ─▶ shapes, materials … as written ─ scene ─▶ Scene
//!         words    entity     state:                             by name    all names are known
//!                  typed      transforms, attributes,                       at the end
//!                  parameters instances, includes
//! ```
//!
//! Unsupported content is an error with its location and the value found. Approximations are
//! reported as warnings. Parameters that affect only convergence, or the output file, are ignored.
//!
//! Coordinates are kept. Differences between the two renderers:
//!
//! * Cameras of pbrt-v4 face +z, with +x to the right and +y up; ours face −z. One axis changes its
//!   sign, so the transform from our camera's node to the world mirrors.
//! * Spectra become colours when they are read, as in the reader of Mitsuba scenes. An `rgb` light
//!   has that colour in both renderers, since the sensor sees the white of the colour space as
//!   (1, 1, 1); other spectra of light are scaled to luminance 1 in both.
//! * `maxdepth` counts interactions of a path, as here.
//! * Roughness is √α in pbrt-v4 unless `remaproughness` is false.
//! * v increases upwards in images of both renderers, but downwards on our analytic sphere: spheres
//!   with textures are meshes.

mod arguments;
mod camera;
mod color;
mod color_space;
mod content;
mod curve;
mod displace;
mod emission;
mod entity;
mod film;
mod hair;
mod lens;
mod light;
mod mapping;
mod material;
mod measured_media;
mod media;
mod medium;
mod medium_emission;
mod named_spectra;
mod parameter;
mod position;
mod quadric;
mod read;
mod scene;
mod shape;
mod sparse;
mod state;
mod subdivision;
mod subsurface;
mod texture;
mod token;
mod types;
mod upsample;
mod white_balance;
mod world;

use std::path::Path;
use std::sync::Arc;

use pt_scene::Scene;

use crate::LoadError;
use crate::shared::context::LoadContext;

/// Parses a scene.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    read::read(bytes, path, context)?.finish()
}
