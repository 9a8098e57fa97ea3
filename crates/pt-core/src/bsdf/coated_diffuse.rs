//! A diffuse base under a smooth coat of a dielectric.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::mirror::reflect;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// A smooth dielectric coat over a diffuse base: specular reflection by Fresnel's equations, and
/// transmitted light that the base scatters and the coat reflects internally until it leaves.
///
/// f = (1 − F(θo)) (1 − F(θi)) ρ / (π η² (1 − ρ Fᵢ)), where Fᵢ is the internal reflectance of the
/// coat for diffuse light. Energy is conserved: with ρ = 1 all light leaves. [Mitsuba 3's
/// "plastic"; the sum of internal reflections goes back to Saunderson 1942]
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse {
    /// Albedo ρ of the base.
    rho: Spectrum,
    /// Tint of the specular reflection.
    specular: Spectrum,
    /// Index of refraction of the coat over that above it.
    eta: f32,
    /// Fᵢ, the internal reflectance for diffuse light.
    inside: f32,
    /// True if the base colours internally reflected light again; otherwise ρ Fᵢ is Fᵢ.
    nonlinear: bool,
}

impl CoatedDiffuse {
    /// Index of the albedo of the base among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the tint of the coat among the packed parameters.
    pub(crate) const SPECULAR: usize = 3;

    /// Creates a base of albedo `rho` under a coat with index `eta` and tint `specular`. Without
    /// `nonlinear`, internally reflected light is not coloured again by the base: ρ Fᵢ is Fᵢ.
    pub fn new(rho: Spectrum, specular: Spectrum, eta: f32, nonlinear: bool) -> Self {
        // (1 − Fᵢ) η² is the transmittance for diffuse light from outside.
        let inside = 1.0 - (1.0 - diffuse_reflectance(eta)) / (eta * eta);
        Self { rho, specular, eta, inside, nonlinear }
    }

    /// ρ / (η² (1 − ρ Fᵢ)).
    #[inline]
    fn base(&self) -> Spectrum {
        let again = if self.nonlinear { self.rho } else { Spectrum::ONE } * self.inside;
        Spectrum(self.rho.0 / ((Spectrum::ONE - again).0 * (self.eta * self.eta)))
    }

    /// 1 − F, the transmittance of the coat.
    #[inline]
    fn transmitted(&self, cos: f32) -> f32 {
        1.0 - self.reflected(cos)
    }

    #[inline]
    fn reflected(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| f)
    }

    /// Probability of choosing the mirror: its fraction of the scattered light, by luminance.
    #[inline]
    fn mirror_probability(&self, f: f32) -> f32 {
        let mirror = f * self.specular.luminance();
        let base = (1.0 - f) * self.base().luminance();
        if mirror + base > 0.0 { mirror / (mirror + base) } else { 0.0 }
    }
}

/// Reflectance for diffuse light of an interface with index `eta` over that of this side: 2 ∫ F(cos
/// θ) cos θ d cos θ.
fn diffuse_reflectance(eta: f32) -> f32 {
    const STEPS: u32 = 20_000;
    let cos = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let of = |c: f64| f64::from(fresnel::dielectric(c as f32, eta).map_or(1.0, |(f, _)| f));
    ((0..STEPS).map(|i| 2.0 * cos(i) * of(cos(i))).sum::<f64>() / f64::from(STEPS)) as f32
}

impl Lobe<'_> for CoatedDiffuse {
    const DELTA: bool = false;
    const DIFFUSE: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.rho.to_array(), self.specular.to_array());
        padded([a, b, c, d, e, f, self.eta, self.inside, f32::from(u8::from(self.nonlinear))])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            rho: color(p, Self::RHO),
            specular: color(p, Self::SPECULAR),
            eta: p[6],
            inside: p[7],
            nonlinear: p[8] != 0.0,
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Spectrum::ZERO;
        }
        self.base() * (self.transmitted(wo.z) * self.transmitted(wi.z) * FRAC_1_PI * wi.z)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Pdf::ZERO;
        }
        let q = self.mirror_probability(self.reflected(wo.z));
        warp::cosine_hemisphere_pdf(wi.z).scaled_by(1.0 - q)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let f = self.reflected(wo.z);
        let q = self.mirror_probability(f);
        if choice < q {
            return Some(BsdfSample::new(reflect(wo), self.specular * (f / q), None));
        }
        let wi = warp::cosine_hemisphere([u, v]);
        let pdf = warp::cosine_hemisphere_pdf(wi.z).scaled_by(1.0 - q);
        let weight = self.base() * ((1.0 - f) * self.transmitted(wi.z) / (1.0 - q));
        pdf.is_positive().then(|| BsdfSample::new(wi, weight, Some(pdf)))
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::ONE, Spectrum::ONE, 1.5, true),
            Self::new(Spectrum::rgb(0.8, 0.4, 0.1), Spectrum::splat(0.5), 1.9, true),
            Self::new(Spectrum::rgb(0.1, 0.3, 0.8), Spectrum::ONE, 1.3, false),
        ]
    }
}

#[cfg(test)]
impl LobeLaws for CoatedDiffuse {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: true,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, _: f32) -> f32 {
        1.0 - self.mirror_probability(self.reflected(wo.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fit of Egan & Hilgeman as given by Jensen et al. 2001, "A Practical Model for Subsurface
    /// Light Transport", §2.
    #[test]
    fn diffuse_reflectance_is_that_of_the_literature() {
        let from_inside = |e: f32| -1.4399 / (e * e) + 0.7099 / e + 0.6681 + 0.0636 * e;
        for eta in [1.2, 1.33, 1.5, 1.8] {
            let [out, inside] = [diffuse_reflectance(eta), diffuse_reflectance(1.0 / eta)];
            assert!((inside - from_inside(eta)).abs() < 5e-3, "{eta}: {inside}");
            assert!((inside - (1.0 - (1.0 - out) / (eta * eta))).abs() < 1e-4, "{eta}: {out}");
        }
    }

    /// White furnace: a white base under a clear coat scatters all incident light, from any
    /// direction.
    #[test]
    fn nothing_is_lost_under_a_clear_coat() {
        const STEPS: u16 = 20_000;
        for eta in [1.2, 1.5, 2.4] {
            let lobe = CoatedDiffuse::new(Spectrum::ONE, Spectrum::ONE, eta, true);
            for wo in [Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.8, 0.598, 0.05).normalize()] {
                // Integrated over the cosine only: the base is isotropic.
                let base = (0..STEPS).map(|i| {
                    let cos = (f32::from(i) + 0.5) / f32::from(STEPS);
                    let wi = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                    f64::from(lobe.eval(wo, wi).0.x) * std::f64::consts::TAU / f64::from(STEPS)
                });
                let all = base.sum::<f64>() + f64::from(lobe.reflected(wo.z));
                assert!((all - 1.0).abs() < 1e-5, "{eta} {wo}: {all}");
            }
        }
    }
}
