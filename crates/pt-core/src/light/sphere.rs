//! The glowing sphere.

use std::f32::consts::PI;

use pt_math::interval::gamma;
use pt_math::ray::offset_origin;
use pt_math::{Area, Frame, Pdf, SolidAngle, Spectrum, Vec3, warp};

use super::{Light, LightHit, LightSample, LightTables};

/// A sphere of constant radiance on its outside. Points outside sample the cone under which they
/// see it. [Shirley, Wang & Zimmerman 1996, "Monte Carlo Techniques for Direct Lighting
/// Calculations", §3.2]
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// Radiance of the outside, or of the inside if `inward`.
    pub radiance: Spectrum,
    /// Whether it glows inwards.
    pub inward: bool,
}

impl SphereLight {
    /// 1 − cos of the half angle of the cone under which `p` sees the sphere, without
    /// cancellation for far spheres; `None` from inside.
    #[inline]
    fn one_minus_cos(&self, p: Vec3) -> Option<f32> {
        let distance_squared = (self.center - p).length_squared();
        let sin2 = self.radius * self.radius / distance_squared;
        (sin2 < 1.0).then(|| sin2 / (1.0 + (1.0 - sin2).sqrt()))
    }

    #[inline]
    fn area_pdf(&self) -> Pdf<Area> {
        Pdf::new(1.0 / (4.0 * PI * self.radius * self.radius))
    }

    /// The surface point with normal `n`, moved off the surface in direction `w`.
    #[inline]
    fn end(&self, n: Vec3, w: Vec3) -> Vec3 {
        let offset = n * self.radius;
        let error = (self.center.abs() + offset.abs()) * gamma(5);
        offset_origin(self.center + offset, error, n, w)
    }

    /// From outside: a direction of the cone.
    #[inline]
    fn sample_cone(&self, p: Vec3, u: [f32; 2], one_minus_cos: f32) -> Option<LightSample> {
        let to_center = self.center - p;
        let d = to_center.length();
        let local = warp::uniform_cone(u, one_minus_cos);
        let sin2 = local.x * local.x + local.y * local.y;
        let half_chord = (self.radius * self.radius - d * d * sin2).max(0.0).sqrt();
        let wi = Frame::from_normal(to_center / d).to_world(local);
        let distance = d * local.z - half_chord;
        let n = (p + wi * distance - self.center).normalize();
        (!self.inward).then(|| LightSample {
            wi,
            distance,
            end: Some(self.end(n, -wi)),
            radiance: self.radiance,
            pdf: Some(warp::uniform_cone_pdf(one_minus_cos)),
        })
    }

    /// From inside: a point of the surface.
    #[inline]
    fn sample_surface(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let n = warp::uniform_sphere(u);
        let to_light = self.center + n * self.radius - p;
        let distance = to_light.length();
        let cos = to_light.dot(n) / distance;
        (self.inward && cos > 0.0).then(|| LightSample {
            wi: to_light / distance,
            distance,
            end: Some(self.end(n, -to_light)),
            radiance: self.radiance,
            pdf: Some(self.area_pdf().to_solid_angle(distance * distance, cos)),
        })
    }
}

impl Light for SphereLight {
    const DELTA: bool = false;

    #[inline]
    fn sample(&self, _: &LightTables, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        match self.one_minus_cos(p) {
            Some(c) => self.sample_cone(p, u, c),
            None => self.sample_surface(p, u),
        }
    }

    #[inline]
    fn pdf(&self, _: &LightTables, p: Vec3, _wi: Vec3, hit: Option<LightHit>) -> Pdf<SolidAngle> {
        let Some(hit) = hit else { return Pdf::ZERO };
        match self.one_minus_cos(p) {
            Some(c) => warp::uniform_cone_pdf(c),
            None => self.area_pdf().to_solid_angle(hit.distance_squared, hit.cos),
        }
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let at = |y, radius, inward| Self {
            center: Vec3::new(0.0, y, 0.0),
            radius,
            radiance: Spectrum::splat(2.0),
            inward,
        };
        [at(3.0, 1.0, false), at(500.0, 0.5, false), at(0.5, 2.0, true)]
            .map(|l| (l, LightTables::default()))
            .into()
    }
}
