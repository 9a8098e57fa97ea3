//! The spot light.

use pt_math::{Spectrum, Vec3, trig};

use super::point::sample_point;
use super::{Light, LightSample, LightTables};

/// A point whose intensity falls with the angle θ to its axis as cosᵉ θ, and is zero outside of
/// its cone. [COLLADA 1.4.1 specification, `<spot>`]
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Where it is.
    pub position: Vec3,
    /// Unit vector along which it shines.
    pub axis: Vec3,
    /// Radiant intensity along the axis.
    pub intensity: Spectrum,
    /// Cosine of half the opening angle of the cone.
    pub cos_cutoff: f32,
    /// Exponent e.
    pub exponent: f32,
}

impl Light for Spot {
    const DELTA: bool = true;

    #[inline]
    fn sample(&self, _: &LightTables, p: Vec3, _u: [f32; 2]) -> Option<LightSample> {
        let on_axis = sample_point(self.position, p, self.intensity)?;
        let cos = -on_axis.wi.dot(self.axis);
        if cos <= self.cos_cutoff {
            return None;
        }
        // A cone wider than a hemisphere has no cosine to fall by beyond it.
        let falloff =
            if self.exponent == 0.0 { 1.0 } else { trig::powf(cos.max(0.0), self.exponent) };
        Some(LightSample { radiance: on_axis.radiance * falloff, ..on_axis })
    }

    fn examples() -> Vec<(Self, LightTables)> {
        let light = Self {
            position: Vec3::new(0.0, 2.0, 0.0),
            axis: Vec3::NEG_Y,
            intensity: Spectrum::splat(3.0),
            cos_cutoff: 0.5,
            exponent: 2.0,
        };
        vec![(light, LightTables::default())]
    }
}
