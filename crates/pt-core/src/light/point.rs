//! The point light.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::{Light, LightHit, LightSample, LightTables};

/// A point of intensity I: irradiance I / r².
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Where it is.
    pub position: Vec3,
    /// Radiant intensity.
    pub intensity: Spectrum,
}

impl Light for Point {
    const DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &LightTables, p: Vec3, _u: [f32; 2]) -> Option<LightSample> {
        let d = self.position - p;
        let distance_squared = d.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let distance = distance_squared.sqrt();
        let radiance = self.intensity / distance_squared;
        Some(LightSample {
            wi: d / distance,
            distance,
            end: Some(self.position),
            radiance,
            pdf: None,
        })
    }

    #[inline]
    fn pdf(&self, _: &LightTables, _p: Vec3, _wi: Vec3, _: Option<LightHit>) -> Pdf<SolidAngle> {
        Pdf::ZERO
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let light = Self { position: Vec3::new(0.0, 2.0, 0.0), intensity: Spectrum::splat(3.0) };
        vec![(light, LightTables::default())]
    }
}
