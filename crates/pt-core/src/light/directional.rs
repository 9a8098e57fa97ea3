//! Parallel light.

use pt_math::{Spectrum, Vec3};

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

    fn examples() -> Vec<(Self, LightTables)> {
        let light = Self { to_light: Vec3::Y, irradiance: Spectrum::ONE };
        vec![(light, LightTables::default())]
    }
}
