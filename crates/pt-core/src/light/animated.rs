//! Lights on moving shapes: sampled in the coordinates of the shape, at the time of the path.
//!
//! With M the linear part of the transform, the direction ω' in these coordinates becomes
//! ω = Mω'/|Mω'| in the world, and dω = |det M| / |Mω'|³ dω': a cone scales with its volume, and
//! with the inverse cube of its length.

use pt_math::float_error::EPSILON;
use pt_math::{DAffine3, DVec3, Pdf, SolidAngle, Vec3};

use super::{AnyLight, LightHit, LightSample, LightSampleContext, LightTables};
use crate::id::SurfaceId;
use crate::interaction::Interaction;

/// A light on a moving instance.
#[derive(Clone, Copy, Debug)]
pub struct AnimatedLight {
    /// Index of the instance.
    pub placement: u32,
    /// Surface that emits light.
    pub surface: SurfaceId,
    /// The light, in object space.
    pub light: AnyLight,
}

impl AnimatedLight {
    /// See [`Light::sample`](super::Light::sample); `to_world` is the transform at the time of the
    /// path.
    pub(crate) fn sample(
        &self,
        to_world: &DAffine3,
        tables: &LightTables,
        p: Vec3,
        u: [f32; 2],
    ) -> Option<LightSample> {
        let m = to_world.matrix3;
        let there = m.inverse() * (p.as_dvec3() - to_world.translation);
        let sample =
            self.light.sample(tables, &LightSampleContext::in_space(there.as_vec3()), u)?;
        let wi = m * sample.wi.as_dvec3();
        let length = wi.length();
        let wi = (wi / length).as_vec3();
        let end = to_world.transform_point3(sample.end?.as_dvec3()).as_vec3();
        // In the world, the end of the segment is rounded once more.
        let rounded = EPSILON * (end.abs() + p.abs()).max_element();
        Some(LightSample {
            wi,
            distance: sample.distance * length as f32,
            end: Some(end - wi * (4.0 * rounded)),
            radiance: sample.radiance,
            pdf: sample.pdf.map(|pdf| pdf.scaled_by(stretch(m.determinant(), length))),
        })
    }

    /// See [`Light::pdf`](super::Light::pdf), for a ray from `p` that hit the light at `at`.
    /// `triangle` and `primitive` are those of the object.
    pub(crate) fn pdf(
        &self,
        to_world: &DAffine3,
        tables: &LightTables,
        p: Vec3,
        at: &Interaction,
        (triangle, primitive): (Option<[Vec3; 3]>, u32),
    ) -> Pdf<SolidAngle> {
        let m = to_world.matrix3;
        let inverse = m.inverse();
        let there = inverse * (p.as_dvec3() - to_world.translation);
        let direction = inverse * -at.wo.as_dvec3();
        let length = direction.length().recip();
        let wi = direction * length;
        let normal = (m.transpose() * at.point.normal.as_dvec3()).normalize_or(DVec3::Z);
        let distance = f64::from(at.distance) / length;
        let hit = LightHit {
            distance_squared: (distance * distance) as f32,
            cos: normal.dot(wi).abs() as f32,
            triangle,
            primitive,
        };
        let pdf = self.light.pdf(
            tables,
            &LightSampleContext::in_space(there.as_vec3()),
            wi.as_vec3(),
            Some(hit),
        );
        pdf.scaled_by(stretch(m.determinant(), length))
    }
}

/// Returns dω'/dω, where `length` is |Mω'|.
fn stretch(determinant: f64, length: f64) -> f32 {
    (length * length * length / determinant.abs()) as f32
}
