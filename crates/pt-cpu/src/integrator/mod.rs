//! Integrators: what light a camera ray carries. They are chosen once per render, so they are an
//! open table.
//!
//! To add one: write its file, add its line to [`INTEGRATORS`].

mod course;
mod direct;
mod normals;
mod path;

use pt_core::Settings;
use pt_math::sampler::Sampler;
use pt_math::{Ray, Spectrum};

use crate::Tracer;

/// The light that a camera ray carries: a pure function of scene, settings, ray and sampler.
pub trait Integrator: Sync {
    /// Radiance along `ray`, whose direction has unit length. The sampler stands behind the
    /// dimensions that the camera took.
    fn li(&self, tracer: &mut Tracer, settings: &Settings, ray: Ray, s: Sampler) -> Spectrum;
}

/// Everything that the command line and the manual need to know about an integrator.
pub struct Registration {
    /// Its name for users.
    pub name: &'static str,
    /// One line for the help.
    pub help: &'static str,
    /// The integrator.
    pub integrator: &'static dyn Integrator,
}

/// All integrators.
pub static INTEGRATORS: &[Registration] = &[
    Registration {
        name: "path",
        help: "light that was scattered up to --max-depth times",
        integrator: &path::Path { depth: u32::MAX },
    },
    Registration {
        name: "direct",
        help: "light that was scattered at most once",
        integrator: &path::Path { depth: 1 },
    },
    Registration {
        name: "normals",
        help: "shading normals as colours: (n + 1) / 2",
        integrator: &normals::Normals,
    },
    Registration {
        name: "cs184",
        help: "light as the program of the university course computes it",
        integrator: &course::Course,
    },
];

/// The integrator of this name.
pub fn find(name: &str) -> Option<&'static dyn Integrator> {
    INTEGRATORS.iter().find(|r| r.name == name).map(|r| r.integrator)
}

/// Dimensions of the sampler that the camera takes: image and lens.
pub(crate) const CAMERA_DIMENSIONS: u32 = 4;

/// Dimensions per bounce: a pair per light sample, a pair for the BSDF, and one for roulette.
fn bounce_dimensions(tracer: &Tracer, settings: &Settings) -> u32 {
    let lights = tracer.scene.lights.as_slice();
    let delta = lights.iter().filter(|l| l.is_delta()).count() as u32;
    let extended = lights.len() as u32 - delta;
    2 * (delta + extended.max(1) * settings.light_samples) + 4
}
