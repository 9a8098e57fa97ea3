//! Scenes of pbrt-v4. [Pharr, Jakob & Humphreys, "Physically Based Rendering", 4th ed. 2023, and
//! the documentation of its file format, pbrt.org/fileformat-v4]
//!
//! ```text
//! files ─ token ─▶ directives ─ read ─▶ shapes, materials … as written ─ scene ─▶ Scene
//!         words    entity     state:                             by name    all names are known
//!                  typed      transforms, attributes,                       at the end
//!                  parameters instances, includes
//! ```
//!
//! What is not read is an error that names the place and what there is. What becomes something like
//! it has a warning. Parameters that change only how fast an image converges, or how its file is
//! written, are passed over.
//!
//! Coordinates stay as they are. Differences between the two renderers:
//!
//! * Cameras look along +z there, with +x to the right and +y up, and along −z here: one axis
//!   changes its sign, so that space is mirrored on its way from our camera's node to the world.
//! * Spectra become colours when they are read, as in the reader of Mitsuba scenes. An `rgb` light
//!   is that colour here and there, since the sensor sees the white of the colour space as (1, 1,
//!   1); other spectra of light are scaled to luminance 1 there, and so here.
//! * `maxdepth` counts interactions of a path, as is done here.
//! * Roughness is √α there unless `remaproughness` is false.
//! * v runs up the rows of an image there and here, and down on the sphere that has a ray test of
//!   its own here: spheres with textures are meshes.

mod arguments;
mod camera;
mod color;
mod color_space;
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
mod medium;
mod medium_emission;
mod named_spectra;
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
mod upsample;
mod white_balance;

use std::path::Path;
use std::sync::Arc;

use super::context::Context;
use crate::{LoadError, Scene};

/// A scene.
pub(super) fn parse(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<Scene, LoadError> {
    read::read(bytes, path, context)?.finish()
}
