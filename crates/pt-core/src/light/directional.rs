//! Parallel light.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Spectrum, Vec3};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, level};
use super::tree::LightBounds;
use super::{Light, LightSample, LightSampleContext, LightTables};

/// Light from a single direction, from infinitely far away.
#[derive(Clone, Copy, Debug)]
pub struct Directional {
    /// Unit vector towards the light.
    pub to_light: Vec3,
    /// Irradiance on a surface that faces the light.
    pub irradiance: Spectrum,
}

impl Light for Directional {
    const DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &LightTables, _: &LightSampleContext, _u: [f32; 2]) -> Option<LightSample> {
        Some(LightSample {
            wi: self.to_light,
            distance: f32::INFINITY,
            end: None,
            radiance: self.irradiance,
            pdf: None,
        })
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        None
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let light = Self { to_light: Vec3::Y, irradiance: Spectrum::ONE };
        vec![(light, LightTables::default())]
    }
}

#[cfg(test)]
impl LightLaws for Directional {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, _: &LightTables, _: DVec3, n: DVec3) -> f64 {
        level(self.irradiance) * self.to_light.as_dvec3().dot(n).max(0.0)
    }
}
