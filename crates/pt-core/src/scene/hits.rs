//! Points and texture coordinates of hits.

use pt_bvh::Hit;
use pt_math::{Ray, Vec2, Vec3};

use super::RenderScene;
use crate::interaction::Interaction;
use crate::texture_eval_context::TextureEvalContext;

/// A point at which a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitPoint {
    /// World-space position.
    pub p: Vec3,
    /// Unit geometric normal, on the side of the shading normal.
    pub normal: Vec3,
    /// Texture coordinates; on triangles without them, the barycentric ones.
    pub uv: Vec2,
}

impl RenderScene {
    /// Returns the point at which a ray of unit direction hit a primitive, at a time, as far as
    /// queries without further rays need it.
    #[inline]
    pub fn hit_point(&self, ray: &Ray, hit: &Hit, time: f32) -> HitPoint {
        let shapes = &self.shapes;
        let primitive = hit.primitive as usize;
        let (at, uv) = match primitive.checked_sub(shapes.triangles.len()) {
            None => {
                let at = shapes.triangle_point(primitive, hit, true, |n| n);
                (at, shapes.triangle_uv(primitive, hit))
            }
            Some(sphere) if sphere < shapes.spheres.len() => {
                let at = shapes.sphere_point(sphere, ray, hit.t);
                (at, shapes.on_sphere(sphere, at.p.as_vec3()).uv)
            }
            Some(_) => {
                let at = self.interaction(ray, hit, time);
                let uv = self.texture_eval_context(&at, hit, time).uv;
                return HitPoint { p: at.point.p, normal: at.point.normal, uv };
            }
        };
        HitPoint { p: at.p.as_vec3(), normal: at.geometric_normal, uv }
    }

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
