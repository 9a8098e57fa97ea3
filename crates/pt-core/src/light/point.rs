//! Point light.

#[cfg(test)]
use pt_math::DVec3;
use pt_math::{Spectrum, Vec3};

#[cfg(test)]
use super::laws::{LightGeometry, LightLaws, inverse_square, level};
use super::tree::LightBounds;
use super::{Light, LightSample, LightSampleContext, LightTables};

/// A point light of intensity I, with irradiance I / r².
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// World-space position.
    pub position: Vec3,
    /// Radiant intensity.
    pub intensity: Spectrum,
}

/// Samples a point light of radiant intensity I, by the inverse square law.
#[inline]
pub(super) fn sample_point(position: Vec3, p: Vec3, intensity: Spectrum) -> Option<LightSample> {
    let d = position - p;
    let distance_squared = d.length_squared();
    (distance_squared > 0.0).then(|| {
        let distance = distance_squared.sqrt();
        let radiance = intensity / distance_squared;
        LightSample { wi: d / distance, distance, end: Some(position), radiance, pdf: None }
    })
}

impl Light for PointLight {
    const DELTA: bool = true;

    #[inline]
    fn sample(
        &self,
        _: &LightTables,
        context: &LightSampleContext,
        _u: [f32; 2],
    ) -> Option<LightSample> {
        sample_point(self.position, context.p, self.intensity)
    }

    fn bounds(&self, _: &LightTables) -> Option<LightBounds> {
        Some(LightBounds::of_point(self.position, self.intensity, 1.0))
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let light = Self { position: Vec3::new(0.0, 2.0, 0.0), intensity: Spectrum::splat(3.0) };
        vec![(light, LightTables::default())]
    }
}

#[cfg(test)]
impl LightLaws for PointLight {
    fn depends_on_surface(&self) -> bool {
        false
    }

    fn geometry(&self, _: &LightTables) -> LightGeometry {
        LightGeometry::None
    }

    fn irradiance(&self, _: &LightTables, p: DVec3, n: DVec3) -> f64 {
        level(self.intensity) * inverse_square(self.position, p, n)
    }
}
