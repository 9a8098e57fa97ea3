//! The perfect mirror.

use pt_math::{Spectrum, Vec3};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, padded};

/// A perfect mirror.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// Reflectance, in [0, 1].
    pub reflectance: Spectrum,
}

/// Reflects `w` about +z.
#[inline]
pub(super) fn reflect(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

impl Mirror {
    /// Index of the reflectance among the packed parameters.
    pub(crate) const REFLECTANCE: usize = 0;
}

impl Lobe<'_> for Mirror {
    const DELTA: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        padded(self.reflectance.to_array())
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { reflectance: color(p, 0) }
    }

    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 3]) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample::new(reflect(wo), self.reflectance, None))
    }

    fn examples() -> Vec<Self> {
        vec![Self { reflectance: Spectrum::ONE }, Self { reflectance: Spectrum::splat(0.5) }]
    }
}

#[cfg(test)]
impl LobeLaws for Mirror {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: true,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn is_lossless(&self, wo: Vec3) -> bool {
        self.reflectance == Spectrum::ONE && wo.z > 0.0
    }
}
