//! Shading normals as colours.

use pt_core::Settings;
use pt_math::sampler::Sampler;
use pt_math::{Ray, Spectrum, Vec3};

use super::Integrator;
use crate::Tracer;

/// (n + 1) / 2 of the first hit; black where there is none.
pub(super) struct Normals;

impl Integrator for Normals {
    fn li(&self, tracer: &mut Tracer, _: &Settings, ray: Ray, _: Sampler) -> Spectrum {
        match tracer.intersect(&ray) {
            Some(at) => Spectrum((at.normal + Vec3::ONE) * 0.5),
            None => Spectrum::ZERO,
        }
    }
}
