//! A disk at infinity, such as the sun.

use std::f32::consts::PI;

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Frame, Pdf, SolidAngle, Spectrum, Vec3, trig, warp};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::tree::LightBounds;
use super::{EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables};

/// Constant radiance from all directions within an angle θ of one direction, visible to rays that
/// leave the scene.
#[derive(Clone, Copy, Debug)]
pub struct DistantDisk {
    /// Unit vector towards the centre of the disk.
    pub to_light: Vec3,
    /// 1 − cos θ.
    pub one_minus_cos: f32,
    /// Radiance.
    pub radiance: Spectrum,
}

impl DistantDisk {
    /// Smallest angular radius of a disk, in radians, that directions in single precision resolve:
    /// to 0.2 % of the disk. That of the sun is 4.65e-3.
    pub const MIN_ANGLE: f32 = 1e-4;

    /// Creates a disk with an angular radius from [`Self::MIN_ANGLE`] to π/2, from the irradiance
    /// on a surface that faces it: E = π L sin² θ.
    pub fn new(to_light: Vec3, angular_radius: f32, irradiance: Spectrum) -> Self {
        let (sin, _) = trig::sin_cos(angular_radius);
        Self::of_radiance(to_light, angular_radius, irradiance / (PI * sin * sin))
    }

    /// Creates a disk with such an angular radius, from its radiance.
    pub fn of_radiance(to_light: Vec3, angular_radius: f32, radiance: Spectrum) -> Self {
        let (half_sin, _) = trig::sin_cos(0.5 * angular_radius);
        Self { to_light, one_minus_cos: 2.0 * half_sin * half_sin, radiance }
    }

    /// Returns true if a unit vector points at the disk. It uses 1 − cos = |a − b|²/2, which has no
    /// cancellation; the rim is extended by the rounding error of a direction.
    #[inline]
    fn contains(&self, d: Vec3) -> bool {
        const ROUNDING: f32 = 3.0 * f32::EPSILON;
        let widened = (2.0 * self.one_minus_cos).sqrt() + ROUNDING;
        (d - self.to_light).length_squared() <= widened * widened
    }
}

impl Light for DistantDisk {
    const DELTA: bool = false;

    #[inline]
    fn sample(&self, _: &LightTables, _: &LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        let local = warp::uniform_cone(u, self.one_minus_cos);
        Some(LightSample {
            wi: Frame::from_normal(self.to_light).to_world(local),
            distance: f32::INFINITY,
            end: None,
            radiance: self.radiance,
            pdf: Some(warp::uniform_cone_pdf(self.one_minus_cos)),
        })
    }

    #[inline]
    fn pdf(
        &self,
        _: &LightTables,
        _: &LightSampleContext,
        wi: Vec3,
        _: Option<LightHit>,
    ) -> Pdf<SolidAngle> {
        if self.contains(wi) { warp::uniform_cone_pdf(self.one_minus_cos) } else { Pdf::ZERO }
    }

    #[inline]
    fn le_infinite(&self, _: &LightTables, ray: EscapedRay) -> Spectrum {
        if self.contains(ray.direction) { self.radiance } else { Spectrum::ZERO }
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    /// The sun, a wide disk, and a hemisphere.
    fn examples() -> Vec<(Self, LightTables)> {
        let to_light = Vec3::new(0.48, 0.8, -0.36);
        [4.65e-3, 0.7, 0.5 * PI]
            .map(|angle| (Self::new(to_light, angle, Spectrum::splat(3.0)), LightTables::default()))
            .into()
    }
}

#[cfg(test)]
impl LightLaws for DistantDisk {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    /// Irradiance of a sphere at distance 1 whose radius is the sine of the angle.
    fn irradiance(&self, _: &LightTables, _: DVec3, n: DVec3) -> f64 {
        let cos = 1.0 - f64::from(self.one_minus_cos);
        let radius = (1.0 - cos * cos).sqrt().min(1.0 - 1e-9);
        let center = self.to_light.as_dvec3();
        level(self.radiance) * pt_testing::irradiance::of_sphere(center, radius, DVec3::ZERO, n)
    }
}
