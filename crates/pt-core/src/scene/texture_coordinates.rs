//! Texture coordinates of hits.

use pt_bvh::Hit;

use super::RenderScene;
use crate::interaction::Interaction;
use crate::texture_eval_context::TextureEvalContext;

impl RenderScene {
    /// Texture coordinates at a hit, at the time of the ray.
    pub fn texture_eval_context(
        &self,
        at: &Interaction,
        hit: &Hit,
        time: f32,
    ) -> TextureEvalContext {
        let shapes = &self.shapes;
        let primitive = hit.primitive as usize;
        let there = match primitive.checked_sub(shapes.triangles.len()) {
            None => shapes.on_triangle(primitive, hit),
            Some(sphere) if sphere < shapes.spheres.len() => shapes.on_sphere(sphere, at.point.p),
            Some(_) => {
                self.with_instances(|placed| placed.texture_eval_context(at.point.p, hit, time))
            }
        };
        TextureEvalContext { point: at.point.p, normal: at.point.normal, ..there }
    }
}
