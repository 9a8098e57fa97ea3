//! Metals.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::fresnel;
use super::microfacet::Beckmann;
use super::mirror::reflect;
use super::{BsdfSample, Lobe, PARAMETERS};

/// A smooth metal: a mirror with the Fresnel reflectance of η + ik.
#[derive(Clone, Copy, Debug)]
pub struct SmoothConductor {
    /// Real part of the index of refraction.
    pub eta: Spectrum,
    /// Imaginary part.
    pub k: Spectrum,
    /// Tint.
    pub reflectance: Spectrum,
}

/// A metal of Beckmann microfacets:  f = F D G / (4 cos θo cos θi).
/// [Cook & Torrance 1982; Walter et al. 2007, eq. 20]
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    /// The metal of the facets.
    pub metal: SmoothConductor,
    /// Their distribution.
    pub facets: Beckmann,
}

fn pack(metal: &SmoothConductor, alpha: f32) -> [f32; PARAMETERS] {
    let [a, b, c] = metal.eta.to_array();
    let [d, e, f] = metal.k.to_array();
    let [g, h, i] = metal.reflectance.to_array();
    [a, b, c, d, e, f, g, h, i, alpha, 0.0]
}

#[inline]
fn metal(p: &[f32; PARAMETERS]) -> SmoothConductor {
    SmoothConductor {
        eta: Spectrum::rgb(p[0], p[1], p[2]),
        k: Spectrum::rgb(p[3], p[4], p[5]),
        reflectance: Spectrum::rgb(p[6], p[7], p[8]),
    }
}

impl SmoothConductor {
    #[inline]
    fn fresnel(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos, self.eta, self.k) * self.reflectance
    }

    fn gold() -> Self {
        Self {
            eta: Spectrum::rgb(0.143, 0.375, 1.442),
            k: Spectrum::rgb(3.983, 2.386, 1.603),
            reflectance: Spectrum::ONE,
        }
    }

    /// η → 0: reflects everything.
    fn perfect() -> Self {
        Self { eta: Spectrum::ZERO, k: Spectrum::ONE, reflectance: Spectrum::ONE }
    }
}

impl Lobe for SmoothConductor {
    const DELTA: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        pack(self, 0.0)
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS]) -> Self {
        metal(p)
    }

    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 2]) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample::new(reflect(wo), self.fresnel(wo.z), None))
    }

    fn examples() -> Vec<Self> {
        vec![Self::gold(), Self::perfect()]
    }
}

/// The facet that mirrors `wo` into `wi`, if both are above the surface.
#[inline]
pub(super) fn half_vector(wo: Vec3, wi: Vec3) -> Option<Vec3> {
    (wo.z > 0.0 && wi.z > 0.0).then(|| (wo + wi).normalize())
}

/// p(wi) = D(h) cos θh / (4 wo·h). [Walter et al. 2007, eq. 14 and 24]
#[inline]
pub(super) fn reflected_pdf(facets: Beckmann, wo: Vec3, h: Vec3) -> Pdf<SolidAngle> {
    Pdf::new(facets.pdf(h) / (4.0 * wo.dot(h)))
}

impl Lobe for RoughConductor {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        pack(&self.metal, self.facets.alpha)
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS]) -> Self {
        Self { metal: metal(p), facets: Beckmann { alpha: p[9] } }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let Some(h) = half_vector(wo, wi) else { return Spectrum::ZERO };
        let d = self.facets.d(h) * self.facets.g(wo, wi) / (4.0 * wo.z);
        self.metal.fresnel(wo.dot(h)) * d
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        half_vector(wo, wi).map_or(Pdf::ZERO, |h| reflected_pdf(self.facets, wo, h))
    }

    /// Draws a facet, and reflects: the weight is F G (wo·h) / (cos θo cos θh).
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        let h = self.facets.sample(u);
        let cos_h = wo.dot(h);
        let wi = h * (2.0 * cos_h) - wo;
        if wo.z <= 0.0 || wi.z <= 0.0 || cos_h <= 0.0 {
            return None;
        }
        let weight = self.facets.g(wo, wi) * cos_h / (wo.z * h.z);
        let pdf = Some(reflected_pdf(self.facets, wo, h));
        Some(BsdfSample::new(wi, self.metal.fresnel(cos_h) * weight, pdf))
    }

    fn examples() -> Vec<Self> {
        let with = |metal, alpha| Self { metal, facets: Beckmann { alpha } };
        let (gold, perfect) = (SmoothConductor::gold(), SmoothConductor::perfect());
        vec![with(gold, 0.25), with(perfect, 0.6), with(perfect, 0.1)]
    }
}
