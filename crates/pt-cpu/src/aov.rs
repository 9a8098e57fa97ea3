//! AOVs: the first surfaces of samples, for the channels of a film other than radiance.

use pt_bvh::Hit;
use pt_core::film::{FirstHit, Tile};
use pt_core::settings::Hidden;
use pt_core::{Interaction, RenderScene};
use pt_math::sampler::Sampler;
use pt_math::{Ray, Rays, Spectrum};

use crate::integrator::{CAMERA_DIMENSIONS, CameraRays, alpha};
use crate::sample_range::SampleRange;
use crate::tracer::Tracer;

/// Computes AOVs; the fields are buffers.
#[derive(Default)]
pub(crate) struct Aovs {
    hits: Vec<Option<Hit>>,
}

impl Aovs {
    /// Adds the AOVs of a batch to its tile.
    pub(crate) fn add(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        batch: &[SampleRange],
        hidden: Hidden,
        tile: &mut Tile,
    ) {
        let rays = Rays::from(&camera_rays.rays);
        alpha::first_hits(tracer, camera_rays, hidden, &mut self.hits);
        let samples =
            batch.iter().flat_map(|range| range.samples.clone().map(move |sample| (range, sample)));
        for (i, ((range, sample), hit)) in samples.zip(&self.hits).enumerate() {
            if let Some(hit) = hit
                && range.kept.contains(&sample)
            {
                let (sampler, time) = (camera_rays.samplers.get(i), camera_rays.time(i));
                let seen = first_hit(tracer.scene, &rays.get(i), hit, time, sampler);
                tile.add_aovs(range.pixel, sample, &seen);
            }
        }
    }
}

fn first_hit(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32, sampler: Sampler) -> FirstHit {
    let at = scene.interaction(ray, hit, time);
    FirstHit {
        albedo: albedo(scene, &at, hit, time, sampler.at_dimension(CAMERA_DIMENSIONS)),
        normal: at.normal,
        geometric_normal: at.point.normal,
        depth: at.distance,
        position: at.point.p,
        uv: scene.texture_eval_context(&at, hit, time).uv,
        motion: scene.image_motion(at.point.p, hit.primitive, time).unwrap_or_default(),
        primitive: hit.primitive,
        object: scene.object(hit.primitive),
        material: scene.surfaces[at.surface].lobe.index() as u32,
        scene_material: scene.surface_materials[at.surface.index()],
    }
}

/// Weight of one direction sampled from the BSDF, whose mean is the albedo. For diffuse and smooth
/// surfaces it is the same in every direction.
fn albedo(
    scene: &RenderScene,
    at: &Interaction,
    hit: &Hit,
    time: f32,
    mut sampler: Sampler,
) -> Spectrum {
    let [[x, y], [z, choice]] = [sampler.next_2d(), sampler.next_2d()];
    let cone = scene.uses_footprints().then(|| scene.camera_cone(-at.wo, time));
    let width = cone.map(|cone| cone.width_at(at.distance));
    let materials = scene.evaluate_material(at, hit, time, choice, width);
    let bsdf = scene.bsdf(at, materials.as_ref());
    let scattered = bsdf.sample([x, y, z]);
    scattered.map_or(Spectrum::ZERO, |s| s.weight * s.eta_scale)
}
