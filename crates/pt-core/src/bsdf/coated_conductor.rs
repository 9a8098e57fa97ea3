//! A metal under a coat of a dielectric.

use std::f32::consts::FRAC_1_PI;

use pt_math::{FloatExt, Pdf, SolidAngle, Spectrum, Vec3, trig, warp};
use pt_scene::material::{Distribution, Masking};

use super::conductor::{half_vector, reflected, reflected_pdf};
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::multiscatter::{Beneath, Gloss, mean_reflectance};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Parameters of a metal and its dielectric coat.
#[derive(Clone, Copy, Debug)]
pub struct Layers {
    /// Index of refraction of the coat over that above it, at least 1.
    pub eta: f32,
    /// Roughness α > 0 of the facets of the coat (GGX).
    pub coat: f32,
    /// Thickness of the coat in mean free paths of absorption; 0 is clear.
    pub thickness: f32,
    /// Real part of the index of refraction of the metal over that above the coat.
    pub metal_eta: Spectrum,
    /// Imaginary part of the index of refraction of the metal over that above the coat.
    pub metal_k: Spectrum,
    /// Roughness α > 0 of the facets of the metal (GGX).
    pub metal: f32,
}

/// A rough metal under a rough dielectric coat.
///
/// Light is reflected by the facets of the coat, or is refracted as by a smooth coat, reflected by
/// the facets of the metal, and reflected back by the coat until it leaves:
///
/// f = f_coat + T(o) T(i) A(o) A(i) f_metal(o', i') / (η² (1 − R A(o) A(i) min(F(o), F(i)))) +
/// f_rest
///
/// where o' and i' are the refracted directions, F = 1 − T is the reflectance of the coat for them,
/// R that of the metal, and A the transmittance of the coat. With smooth coat and metal this is the
/// sum of all interreflections between the two. f_rest is light that meets more than one facet or
/// is totally reflected inside: it leaves diffusely, with the energy that a white metal lacks,
/// times the fraction that the metal does not absorb. [Layers by Weidlich & Wilkie 2007,
/// "Arbitrarily Layered Micro-Facet Surfaces"; the rest as in `multiscatter.rs`]
///
/// Refraction by a rough coat is accounted for as additional roughness of the metal, see
/// `seen_through`.
#[derive(Clone, Copy, Debug)]
pub struct CoatedConductor {
    /// Real and imaginary part of the index of refraction of the metal over that of the coat.
    metal_eta: Spectrum,
    metal_k: Spectrum,
    /// Fraction of the interreflected light that the metal does not absorb.
    again: Spectrum,
    eta: f32,
    /// Roughness of the coat, and of the metal as seen through the coat.
    coat: f32,
    base: f32,
    thickness: f32,
    /// Mean of `DirectionTerms::rest` over diffuse illumination, 2 ∫ rest(cos θ) cos θ d cos θ.
    rest: f32,
}

/// Roughness of a metal seen through a rough coat.
///
/// The slopes of the coat's facets refract light twice, by (1 − cos θ / (η cos θ')) / 2 of the
/// deflection that the same slopes of the metal would cause; variances add up. [After Belcour 2018,
/// "Efficient Rendering of Layered Materials using an Atomic Decomposition with Statistical
/// Operators", §4; here the mean over diffuse illumination]
fn seen_through(eta: f32, coat: f32, metal: f32) -> f32 {
    const STEPS: u16 = 64;
    let square = |i: u16| {
        let cos = (f32::from(i) + 0.5) / f32::from(STEPS);
        let inside = (eta * eta - 1.0 + cos * cos).sqrt();
        2.0 * cos * (0.5 * (1.0 - cos / inside)).powi(2)
    };
    let share = (0..STEPS).map(square).sum::<f32>() / f32::from(STEPS);
    (metal * metal + 2.0 * share * coat * coat).sqrt()
}

/// Fraction that finally escapes, of light that the coat reflects back inside, for a metal of mean
/// reflectance `once`.
///
/// At roughness 1, the metal scatters light in all directions: a fraction 1 − p escapes each time,
/// and r (1 − p) / (1 − p r) in total, with p the reflectance of the coat for diffuse light from
/// inside. At low roughness, the angle performs a random walk around the critical angle until it is
/// below it again: by the generating function of the times of first return, 1 − √(1 − r²) escapes.
/// [Feller 1968, "An Introduction to Probability Theory and Its Applications", vol. 1, §XI.3]
fn held_back(eta: f32, alpha: f32, once: Spectrum) -> Spectrum {
    let p = 1.0 - (1.0 - fresnel::mean_dielectric(eta)) / (eta * eta);
    once.map(|r| {
        let (little, much) = (1.0 - (1.0 - r * r).max(0.0).sqrt(), r * (1.0 - p) / (1.0 - p * r));
        little.lerp(much, alpha.min(1.0))
    })
}

fn distribution(masking: Masking, alpha: f32) -> MicrofacetDistribution {
    MicrofacetDistribution { distribution: Distribution::Ggx, masking, alpha: [alpha; 2] }
}

/// Terms of a direction above the surface.
struct DirectionTerms<'a> {
    w: Vec3,
    /// The direction refracted into the coat.
    bent: Vec3,
    /// F, the reflectance of a smooth coat.
    reflected: f32,
    /// A, the transmittance of the coat.
    kept: f32,
    tables: &'a AlbedoTables,
}

/// Directional albedo tables of the coat and of the metal under it.
struct AlbedoTables {
    gloss: Gloss,
    beneath: Beneath,
}

impl DirectionTerms<'_> {
    /// Fraction that is reflected neither by the coat nor once by white metal.
    #[inline]
    fn rest(&self) -> f32 {
        let seen = (1.0 - self.reflected) * self.tables.beneath.reached(self.w.z);
        (self.tables.gloss.left(self.w) - seen).max(0.0)
    }
}

impl CoatedConductor {
    /// Creates the lobe of a metal and its coat.
    pub fn new(layers: &Layers) -> Self {
        let eta = layers.eta.max(1.0);
        let [metal_eta, metal_k] = [layers.metal_eta, layers.metal_k].map(|x| x * (1.0 / eta));
        let once = mean_reflectance(|cos| fresnel::conductor(cos, metal_eta, metal_k));
        // Light enters steeply and leaves diffusely, as if the coat was twice as thick.
        let once = once * trig::exp(-3.0 * layers.thickness);
        let base = seen_through(eta, layers.coat, layers.metal);
        let again = once * held_back(eta, base, once);
        let (coat, thickness) = (layers.coat, layers.thickness);
        Self { metal_eta, metal_k, again, eta, coat, base, thickness, rest: 0.0 }.with_mean()
    }

    /// Computes the mean of `DirectionTerms::rest`.
    fn with_mean(mut self) -> Self {
        const STEPS: u16 = 128;
        let tables = self.tables();
        let rest = |i: u16| {
            let t = (f32::from(i) + 0.5) / f32::from(STEPS);
            let cos = t * t;
            let w = Vec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
            4.0 * t * cos * self.side(w, &tables).rest()
        };
        self.rest = (0..STEPS).map(rest).sum::<f32>() / f32::from(STEPS);
        self
    }

    fn tables(&self) -> AlbedoTables {
        AlbedoTables {
            gloss: Gloss::new(&self.coat_facets(), self.eta),
            beneath: Beneath::new(&self.metal_facets(), self.eta),
        }
    }

    #[inline]
    fn side<'a>(&self, w: Vec3, tables: &'a AlbedoTables) -> DirectionTerms<'a> {
        let reflected = fresnel::dielectric(w.z, self.eta).map_or(1.0, |(f, _)| f);
        let sin2 = (w.x * w.x + w.y * w.y) / (self.eta * self.eta);
        let bent = Vec3::new(w.x / self.eta, w.y / self.eta, (1.0 - sin2).max(0.0).sqrt());
        DirectionTerms { w, bent, reflected, kept: trig::exp(-self.thickness / bent.z), tables }
    }

    /// The facets for which the tables of `Gloss` are.
    #[inline]
    fn coat_facets(&self) -> MicrofacetDistribution {
        distribution(Masking::Separable, self.coat)
    }

    #[inline]
    fn metal_facets(&self) -> MicrofacetDistribution {
        distribution(Masking::Correlated, self.base)
    }

    #[inline]
    fn metal(&self, cos: f32) -> Spectrum {
        fresnel::conductor(cos, self.metal_eta, self.metal_k)
    }

    /// Probabilities of sampling the coat, the metal and the rest: their fractions of the scattered
    /// light, by luminance.
    #[inline]
    fn probabilities(&self, o: &DirectionTerms<'_>) -> [f32; 3] {
        const MIN: f32 = 0.02;
        let left = o.tables.gloss.left(o.w);
        let rest = o.rest();
        let metal = self.metal(o.bent.z).luminance() * o.kept * o.kept;
        let shares = [1.0 - left, (left - rest).max(0.0) * metal, rest * self.again.luminance()];
        // A minimum is added to each, as the fractions are totals over all directions and not those
        // of each.
        let shares = shares.map(|x| x + MIN);
        let sum: f32 = shares.iter().sum();
        shares.map(|x| x / sum)
    }

    /// f cos θi of the facets of the coat.
    #[inline]
    fn eval_coat(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(h) = half_vector(wo, wi) else { return 0.0 };
        let f = fresnel::dielectric(wo.dot(h), self.eta).map_or(1.0, |(f, _)| f);
        f * reflected(&self.coat_facets(), wo, wi, h)
    }

    /// Solid angle of a refracted direction over that of the direction itself, dω'/dω.
    #[inline]
    fn eta_scale(&self, i: &DirectionTerms<'_>) -> f32 {
        i.w.z / (self.eta * self.eta * i.bent.z)
    }

    /// f cos θi of the metal under the coat.
    #[inline]
    fn eval_metal(&self, o: &DirectionTerms<'_>, i: &DirectionTerms<'_>) -> Spectrum {
        let Some(h) = half_vector(o.bent, i.bent) else { return Spectrum::ZERO };
        let kept = o.kept * i.kept;
        let metal = self.metal(o.bent.dot(h)) * kept;
        let again = o.reflected.min(i.reflected);
        let all = metal.map(|r| r / (1.0 - r * again).max(f32::MIN_POSITIVE));
        let through = (1.0 - o.reflected) * (1.0 - i.reflected) * self.eta_scale(i);
        all * (through * reflected(&self.metal_facets(), o.bent, i.bent, h))
    }

    /// f cos θi of the light that is scattered more than once.
    #[inline]
    fn eval_rest(&self, o: &DirectionTerms<'_>, i: &DirectionTerms<'_>) -> Spectrum {
        if self.rest > 0.0 {
            self.again * (o.rest() * i.rest() * FRAC_1_PI * i.w.z / self.rest)
        } else {
            Spectrum::ZERO
        }
    }

    #[inline]
    fn eval_sides(&self, o: &DirectionTerms<'_>, i: &DirectionTerms<'_>) -> Spectrum {
        let coat = Spectrum::splat(self.eval_coat(o.w, i.w));
        coat + self.eval_metal(o, i) + self.eval_rest(o, i)
    }

    #[inline]
    fn pdf_sides(&self, o: &DirectionTerms<'_>, i: &DirectionTerms<'_>) -> Pdf<SolidAngle> {
        let by = |distribution: &MicrofacetDistribution, o: Vec3, i: Vec3| {
            half_vector(o, i).map_or(0.0, |h| reflected_pdf(distribution, o, h).get())
        };
        let [coat, base, rest] = self.probabilities(o);
        let of_metal = by(&self.metal_facets(), o.bent, i.bent) * self.eta_scale(i);
        Pdf::new(
            coat * by(&self.coat_facets(), o.w, i.w)
                + base * of_metal
                + rest * warp::cosine_hemisphere_pdf(i.w.z).get(),
        )
    }

    /// Refracts a direction out of the coat; `None` for total internal reflection.
    #[inline]
    fn unbent(&self, w: Vec3) -> Option<Vec3> {
        let [x, y] = [w.x * self.eta, w.y * self.eta];
        let cos2 = 1.0 - (x * x + y * y);
        (w.z > 0.0 && cos2 > 0.0).then(|| Vec3::new(x, y, cos2.sqrt()).normalize())
    }

    fn gold(coat: f32, metal: f32, eta: f32, thickness: f32) -> Layers {
        let metal_eta = Spectrum::rgb(0.143, 0.375, 1.442);
        let metal_k = Spectrum::rgb(3.983, 2.386, 1.603);
        Layers { eta, coat, thickness, metal_eta, metal_k, metal }
    }
}

/// Samples a visible facet and reflects `w` about its normal.
#[inline]
fn by_facet(distribution: &MicrofacetDistribution, w: Vec3, u: [f32; 2]) -> Vec3 {
    let h = distribution.sample_visible(w, u);
    (h * (2.0 * w.dot(h)) - w).normalize()
}

impl Lobe<'_> for CoatedConductor {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.metal_eta.to_array(), self.metal_k.to_array());
        let [g, h, i] = self.again.to_array();
        let Self { eta, coat, base, thickness, rest, .. } = *self;
        padded([a, b, c, d, e, f, g, h, i, eta, coat, base, thickness, rest])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        let [eta, coat, base, thickness, rest] = [9, 10, 11, 12, 13].map(|i| p[i]);
        let (metal_eta, metal_k, again) = (color(p, 0), color(p, 3), color(p, 6));
        Self { metal_eta, metal_k, again, eta, coat, base, thickness, rest }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Spectrum::ZERO;
        }
        let tables = self.tables();
        self.eval_sides(&self.side(wo, &tables), &self.side(wi, &tables))
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Pdf::ZERO;
        }
        let tables = self.tables();
        self.pdf_sides(&self.side(wo, &tables), &self.side(wi, &tables))
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let tables = self.tables();
        let o = self.side(wo, &tables);
        let [coat, base, _] = self.probabilities(&o);
        let wi = if choice < coat {
            by_facet(&self.coat_facets(), wo, [u, v])
        } else if choice < coat + base {
            self.unbent(by_facet(&self.metal_facets(), o.bent, [u, v]))?
        } else {
            warp::cosine_hemisphere([u, v])
        };
        if wi.z <= 0.0 {
            return None;
        }
        let i = self.side(wi, &tables);
        let pdf = self.pdf_sides(&o, &i);
        let weight = self.eval_sides(&o, &i) / pdf.get();
        pdf.is_positive().then(|| BsdfSample::new(wi, weight, Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.coat.min(self.base)
    }

    fn examples() -> Vec<Self> {
        let white = Layers {
            metal_eta: Spectrum::ZERO,
            metal_k: Spectrum::ONE,
            ..Self::gold(0.15, 0.3, 1.5, 0.01)
        };
        [Self::gold(0.3, 0.15, 1.5, 0.0), Self::gold(0.1, 0.5, 1.8, 0.5), white]
            .iter()
            .map(Self::new)
            .collect()
    }
}

#[cfg(test)]
impl LobeLaws for CoatedConductor {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        let base = seen_through(self.eta, alpha, alpha);
        Some(Self { coat: alpha, base, ..*self }.with_mean().into())
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let tables = self.tables();
        let [coat, base, rest] = self.probabilities(&self.side(wo, &tables));
        if choice < coat {
            coat
        } else if choice < coat + base {
            base
        } else {
            rest
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;
    use crate::bsdf::conductor::{RoughConductor, SmoothConductor};
    use crate::bsdf::mirror::reflect;
    use crate::bsdf::multiscatter_conductor::CompensatedConductor;
    use crate::bsdf::multiscatter_dielectric::CompensatedDielectric;
    use crate::bsdf::rough_dielectric::RoughDielectric;

    const COSINES: [f32; 4] = [1.0, 0.8, 0.5, 0.25];

    fn at(cos: f32) -> Vec3 {
        Vec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos)
    }

    fn white(coat: f32, metal: f32, eta: f32) -> Layers {
        let (metal_eta, metal_k) = (Spectrum::ZERO, Spectrum::ONE);
        Layers { metal_eta, metal_k, ..CoatedConductor::gold(coat, metal, eta, 0.0) }
    }

    /// Albedos of light from a direction: the total one, and that of scattering near the mirror
    /// direction, within a cosine of at least 0.9.
    fn albedos(
        wo: Vec3,
        mut sample: impl FnMut(&mut Random) -> Option<(Vec3, Spectrum)>,
    ) -> [Spectrum; 2] {
        const SAMPLES: u16 = 40_000;
        let mut random = Random::new(3);
        let (mut all, mut near) = (Spectrum::ZERO, Spectrum::ZERO);
        for (wi, weight) in (0..SAMPLES).filter_map(|_| sample(&mut random)) {
            all += weight;
            if wi.dot(reflect(wo)) > 0.9 {
                near += weight;
            }
        }
        [all, near].map(|sum| sum / f32::from(SAMPLES))
    }

    fn unit_3d(random: &mut Random) -> [f32; 3] {
        let [u, v] = random.unit_2d();
        [u, v, random.unit()]
    }

    fn of_lobe(lobe: &CoatedConductor, wo: Vec3) -> [Spectrum; 2] {
        albedos(wo, |random| lobe.sample(wo, unit_3d(random)).map(|s| (s.wi, s.weight)))
    }

    /// Random walk between the two layers: facets of both that lose nothing, and absorption in the
    /// coat. Its weight is of power, without the factor by which refraction scales radiance.
    fn walk(layers: &Layers, wo: Vec3, random: &mut Random) -> Option<(Vec3, Spectrum)> {
        const MAX: u8 = 100;
        let ggx = |alpha| MicrofacetDistribution::isotropic(Distribution::Ggx, alpha);
        let (reflectance, transmittance) = (Spectrum::ONE, Spectrum::ONE);
        let (eta, distribution) = (layers.eta, ggx(layers.coat));
        let coat = CompensatedDielectric {
            once: RoughDielectric { reflectance, transmittance, eta, distribution },
        };
        let [metal_eta, k] = [layers.metal_eta, layers.metal_k].map(|x| x * (1.0 / eta));
        let metal = SmoothConductor { eta: metal_eta, k, reflectance };
        let metal =
            CompensatedConductor::new(RoughConductor { metal, distribution: ggx(layers.metal) });
        let mut weight = Spectrum::ONE;
        let mut from = wo;
        for _ in 0..MAX {
            let s = coat.sample(from, unit_3d(random))?;
            weight *= s.weight * s.eta_scale;
            if s.wi.z > 0.0 {
                return Some((s.wi, weight));
            }
            let up = metal.sample(-s.wi, unit_3d(random))?;
            let way = layers.thickness * (1.0 / s.wi.z.abs() + 1.0 / up.wi.z);
            weight *= up.weight * trig::exp(-way);
            from = -up.wi;
        }
        None
    }

    /// Sum of all interreflections between a smooth coat and a smooth metal: F + T² R / (1 − R F).
    #[test]
    fn smooth_layers_have_their_closed_form() {
        let layers = CoatedConductor::gold(1e-3, 1e-3, 1.5, 0.1);
        let lobe = CoatedConductor::new(&layers);
        for cos in COSINES {
            let (f, cos_t) = fresnel::dielectric(cos, 1.5).unwrap();
            let kept = trig::exp(-0.2 / cos_t);
            let metal = lobe.metal(cos_t) * kept;
            let want = metal.map(|r| f + (1.0 - f) * (1.0 - f) * r / (1.0 - r * f));
            let [found, _] = of_lobe(&lobe, at(cos));
            let error = (found.0 - want.0).abs().max_element();
            assert!(error < 0.01, "{cos}: {found:?} {want:?}");
        }
    }

    /// White furnace.
    #[test]
    fn white_metal_under_a_clear_coat_loses_nothing() {
        for (coat, metal) in [(1e-3, 1e-3), (1e-3, 0.4), (0.15, 0.05), (0.4, 0.4), (0.1, 1.0)] {
            for eta in [1.0, 1.33, 1.5, 2.0] {
                let lobe = CoatedConductor::new(&white(coat, metal, eta));
                for cos in COSINES {
                    let [albedo, _] = of_lobe(&lobe, at(cos));
                    assert!(
                        (0.98..1.02).contains(&albedo.0.x),
                        "{coat} {metal} {eta} {cos}: {albedo:?}"
                    );
                }
            }
        }
    }

    /// Total albedo and albedo near the mirror direction agree with random walks of light between
    /// the facets of the two layers.
    #[test]
    fn light_is_scattered_as_by_walks_between_coat_and_metal() {
        const ROUGHNESSES: [[f32; 2]; 6] =
            [[0.02, 0.02], [0.02, 0.3], [0.14, 0.045], [0.2, 0.2], [0.4, 0.1], [0.1, 0.6]];
        let worst = COSINES.map(|cos| {
            let mut worst = 0.0f32;
            for [coat, metal] in ROUGHNESSES {
                for (eta, thickness) in [(1.5, 0.0), (1.5, 0.2), (1.8, 0.01)] {
                    let layers = CoatedConductor::gold(coat, metal, eta, thickness);
                    let (lobe, wo) = (CoatedConductor::new(&layers), at(cos));
                    let walks = albedos(wo, |random| walk(&layers, wo, random));
                    for (found, wanted) in of_lobe(&lobe, wo).into_iter().zip(walks) {
                        worst = worst.max((found.0 - wanted.0).abs().max_element());
                    }
                }
            }
            worst
        });
        assert!(worst.iter().all(|worst| *worst < 0.082), "{worst:?}");
    }
}
