//! Shading normals as colours.

use pt_bvh::Hit;
use pt_math::{Ray, Spectrum, Vec3};

use super::{Integrator, Starts};
use crate::Tracer;

/// (n + 1) / 2 of the first hit; black where there is none.
#[derive(Default)]
pub(super) struct Normals {
    hits: Vec<Option<Hit>>,
}

impl Integrator for Normals {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        tracer.intersect(&starts.rays, &mut self.hits);
        let color = |(ray, hit): (&Ray, &Option<Hit>)| match hit {
            Some(hit) => {
                let normal = tracer.scene.interaction(ray, hit).normal;
                Spectrum((normal + Vec3::ONE) * 0.5)
            }
            None => Spectrum::ZERO,
        };
        radiance.clear();
        radiance.extend(starts.rays.iter().zip(&self.hits).map(color));
    }
}
