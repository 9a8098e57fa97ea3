//! Shading normals as colours.

use pt_bvh::Hit;
use pt_core::settings::Hidden;
use pt_core::{RenderScene, Settings};
use pt_math::{Rays, Spectrum, Vec3};

use super::transparency::Transparency;
use super::{Integrator, Starts, holes};
use crate::Tracer;

/// (n + 1) / 2 of the first hit; black where there is none.
pub(super) struct Normals {
    hits: Vec<Option<Hit>>,
    hidden: Hidden,
    transparency: Transparency,
}

impl Normals {
    pub(super) fn new(scene: &RenderScene, settings: &Settings) -> Self {
        let transparency = Transparency::new(scene, settings);
        Self { hits: Vec::new(), hidden: settings.hidden, transparency }
    }
}

impl Integrator for Normals {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        let rays = Rays::from(&starts.rays);
        holes::first_hits(tracer, starts, self.hidden, &mut self.hits);
        self.transparency.of_first_hits(&self.hits);
        let color = |(i, hit): (usize, &Option<Hit>)| match hit {
            Some(hit) => {
                let normal = tracer.scene.interaction(&rays.get(i), hit, starts.time(i)).normal;
                // Interpolated ones are longer than 1 by their rounding.
                Spectrum(((normal + Vec3::ONE) * 0.5).max(Vec3::ZERO))
            }
            None => Spectrum::ZERO,
        };
        radiance.clear();
        radiance.extend(self.hits.iter().enumerate().map(color));
    }

    fn transparencies(&self) -> &[f32] {
        self.transparency.shares()
    }
}
