//! Shading normals as colours.

use pt_bvh::Hit;
use pt_core::settings::Hidden;
use pt_core::{RenderScene, Settings};
use pt_math::{Rays, Spectrum, Vec3};

use super::transparency::Transparency;
use super::{CameraRays, Integrator, alpha};
use crate::Tracer;

/// (n + 1) / 2 of the first hit; black without a hit.
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
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        let rays = Rays::from(&camera_rays.rays);
        alpha::first_hits(tracer, camera_rays, self.hidden, &mut self.hits);
        self.transparency.of_first_hits(&self.hits);
        let color = |(i, hit): (usize, &Option<Hit>)| match hit {
            Some(hit) => {
                let normal =
                    tracer.scene.interaction(&rays.get(i), hit, camera_rays.time(i)).normal;
                // Interpolated normals are longer than 1 by rounding.
                Spectrum(((normal + Vec3::ONE) * 0.5).max(Vec3::ZERO))
            }
            None => Spectrum::ZERO,
        };
        radiance.clear();
        radiance.extend(self.hits.iter().enumerate().map(color));
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}
