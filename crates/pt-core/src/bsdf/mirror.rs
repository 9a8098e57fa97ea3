//! The perfect mirror.

use pt_math::{Spectrum, Vec3};

use super::{BsdfSample, Lobe, PARAMETERS};

/// Reflects everything about the normal.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// Share of light reflected, in [0, 1].
    pub reflectance: Spectrum,
}

/// The mirror image of `w` about +z.
#[inline]
pub(super) fn reflect(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

impl Lobe for Mirror {
    const DELTA: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let mut p = [0.0; PARAMETERS];
        p[..3].copy_from_slice(&self.reflectance.to_array());
        p
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS]) -> Self {
        Self { reflectance: Spectrum::rgb(p[0], p[1], p[2]) }
    }

    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 2]) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample::new(reflect(wo), self.reflectance, None))
    }

    fn examples() -> Vec<Self> {
        vec![Self { reflectance: Spectrum::ONE }, Self { reflectance: Spectrum::splat(0.5) }]
    }
}
