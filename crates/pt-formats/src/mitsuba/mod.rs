//! Scenes of Mitsuba 3 (XML). [Jakob et al. 2022, "Mitsuba 3 renderer", documentation of
//! version 3.9]
//!
//! ```text
//! XML files ─ read ─▶ Tree of objects with typed parameters ─ scene ─▶ Scene
//!           parameters $name, includes, paths,               references, shapes, materials,
//!           values, transforms                               emitters, sensor, integrator
//! ```
//!
//! A part of the format is read; what is not is an error that names the place and what is
//! supported, so that no picture is silently another one. Parameters that change only how fast
//! an image converges, or how its file is written, are passed over.
//!
//! Coordinates stay as they are, whichever axis the author takes as up. Differences between the
//! two renderers:
//!
//! * Mitsuba's camera looks along +z of its node with +x to the left, ours along −z with +x to the
//!   right: half a turn about y.
//! * Pixels at the edge of the image see light from beyond it through their filter, as with
//!   `sample_border` there.
//! * Parallel light shines along +z of its node there, and along −z here.
//! * A `max_depth` of N there allows N − 1 interactions with surfaces, which is what is counted
//!   here; −1 becomes `u32::MAX`.
//! * The first sensor of a file is the one that Mitsuba uses; here it is the last.
//! * Spectra become colours when they are read, as in Mitsuba's RGB modes: `<spectrum>` with one
//!   number is the equal-energy illuminant where light is emitted, and grey elsewhere.
//! * Images have their upper row at v = 0 there, and at v = 1 here. Meshes keep the texture
//!   coordinates that they have there.
//! * Smooth normals that a mesh lacks are made where it is placed, as there; those of meshes that
//!   move, in their own coordinates.
//! * Of `ellipsoids`, the inner side is seen too.
//! * Disks and cylinders are meshes of 1024 sides here.
//! * Shapes, instances and sensors may move: `<animation>`, which Mitsuba 0.6 had and 3.9 has not.
//! * v runs down the rows of an image there, and up here.
//! * A grid of a medium that is turned ends at its own box here, and at the upright box around it
//!   there.

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
mod sensor;
mod shape;
mod spectrum;
mod texture;
mod value;
mod volume;

use std::path::Path;
use std::sync::Arc;

use super::context::Context;
use crate::{LoadError, Scene};

/// A scene, with what some `$name` stand for.
pub(super) fn parse(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<Scene, LoadError> {
    let tree = read::read(bytes, path, context)?;
    scene::build(&tree)
}
