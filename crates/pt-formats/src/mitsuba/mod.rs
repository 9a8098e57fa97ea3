//! Reader of Mitsuba 3 scenes (XML). [Jakob et al. 2022, "Mitsuba 3 renderer", documentation of
//! version 3.9]
//!
//! ```text
//! XML files ─ read ─▶ Tree of objects with typed parameters ─ scene ─▶ Scene
//!           parameters $name, includes, paths,               references, shapes, materials,
//!           values, transforms                               emitters, sensor, integrator
//! ```
//!
//! A subset of the format is supported. Anything else is an error with its location and the
//! supported alternatives, so that no image differs silently. Parameters that affect only
//! convergence, or the output file, are ignored.
//!
//! Coordinates are kept, regardless of the up axis of the author. Differences between the two
//! renderers:
//!
//! * The camera of Mitsuba faces +z of its node with +x to the left, ours faces −z with +x to the
//!   right: they differ by half a turn about y.
//! * Samples outside of the image contribute to the pixels at its edge through the filter, as with
//!   Mitsuba's `sample_border`.
//! * Directional lights shine along +z of their node in Mitsuba, along −z here.
//! * A `max_depth` of N in Mitsuba allows N − 1 interactions with surfaces, which is the number
//!   used here; −1 becomes `u32::MAX`.
//! * Mitsuba uses the first sensor of a file. By default a scene uses the last one, so the reader
//!   sets `used_camera`.
//! * Spectra become colours when they are read, as in Mitsuba's RGB modes: `<spectrum>` with one
//!   number is the equal-energy illuminant for emission, and grey elsewhere.
//! * The top row of an image is at v = 0 in Mitsuba, at v = 1 here. Meshes keep Mitsuba's texture
//!   coordinates.
//! * Missing smooth normals of a mesh are computed in world space, as in Mitsuba; those of moving
//!   meshes in object space.
//! * The inner side of `ellipsoids` is visible as well.
//! * Disks and cylinders are meshes with 1024 sides.
//! * Shapes, instances and sensors may be animated by `<animation>`, which Mitsuba 0.6 had and 3.9
//!   does not have.
//! * The grid of a rotated medium ends at its own box here, at the axis-aligned bounding box of
//!   that in Mitsuba.

mod bsdf;
mod curves;
mod daylight;
mod ellipsoids;
mod emitter;
mod film;
mod instance;
mod integrator;
mod medium;
mod meter;
mod nesting;
mod object;
mod read;
mod refused;
mod scene;
mod seat;
mod sensor;
mod shape;
mod spectrum;
mod texture;
mod turn;
mod value;
mod volume;

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
    let tree = read::read(bytes, path, context)?;
    scene::build(&tree)
}
