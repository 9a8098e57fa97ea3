//! Constant hemispherical sky.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Frame, Pdf, SolidAngle, Spectrum, Vec3, warp};
#[cfg(test)]
use std::f64::consts::FRAC_PI_2;

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::tree::LightBounds;
use super::{EscapedRay, Light, LightHit, LightSample, LightSampleContext, LightTables};

/// Constant radiance from all directions above the horizon (+y).
#[derive(Clone, Copy, Debug)]
pub struct HemisphereLight {
    /// Radiance.
    pub radiance: Spectrum,
}

/// Frame in which local +z is up.
const SKY: Frame = Frame { s: Vec3::Z, t: Vec3::X, n: Vec3::Y };

impl Light for HemisphereLight {
    const DELTA: bool = false;

    #[inline]
    fn sample(&self, _: &LightTables, _: &LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        let local = warp::uniform_hemisphere(u);
        Some(LightSample {
            wi: SKY.to_world(local),
            distance: f32::INFINITY,
            end: None,
            radiance: self.radiance,
            pdf: Some(warp::uniform_hemisphere_pdf(local.z)),
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
        if wi.y > 0.0 { warp::uniform_hemisphere_pdf(wi.y) } else { Pdf::ZERO }
    }

    #[inline]
    fn le_infinite(&self, _: &LightTables, ray: EscapedRay) -> Spectrum {
        if ray.direction.y > 0.0 { self.radiance } else { Spectrum::ZERO }
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    fn examples() -> Vec<(Self, LightTables)> {
        vec![(Self { radiance: Spectrum::ONE }, LightTables::default())]
    }
}

#[cfg(test)]
impl LightLaws for HemisphereLight {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    /// Lambert's cosine law over the part of the upper hemisphere that the surface faces.
    fn irradiance(&self, _: &LightTables, _: DVec3, n: DVec3) -> f64 {
        level(self.radiance) * FRAC_PI_2 * (1.0 + n.y)
    }
}
