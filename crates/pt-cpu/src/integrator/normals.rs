//! Shading normals as colours.

use pt_bvh::Hit;
use pt_math::{Rays, Spectrum, Vec3};

use super::{Integrator, Starts, holes};
use crate::Tracer;

/// (n + 1) / 2 of the first hit; black where there is none.
#[derive(Default)]
pub(super) struct Normals {
    hits: Vec<Option<Hit>>,
}

impl Integrator for Normals {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        let rays = Rays::from(&starts.rays);
        holes::first_hits(tracer, starts, &mut self.hits);
        let color = |(i, hit): (usize, &Option<Hit>)| match hit {
            Some(hit) => {
                let normal = tracer.scene.interaction(&rays.get(i), hit, starts.time(i)).normal;
                Spectrum((normal + Vec3::ONE) * 0.5)
            }
            None => Spectrum::ZERO,
        };
        radiance.clear();
        radiance.extend(self.hits.iter().enumerate().map(color));
    }
}
