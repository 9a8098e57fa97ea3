//! Rough diffuse reflection.

use std::f32::consts::{FRAC_1_PI, PI};

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, trig, warp};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, padded};

/// Energy-preserving Oren–Nayar: V-shaped cavities with Lambertian walls, with multiple scattering
/// between them. Compared to Lambert's law it is flatter, and brighter towards the light. With ρ =
/// 1 no energy is lost. [Portsmouth, Kutz & Hill 2025, "EON: A Practical Energy-Preserving Rough
/// Diffuse BRDF"; the albedos are the exact ones, not the paper's approximation]
#[derive(Clone, Copy, Debug)]
pub struct Eon {
    /// Albedo ρ ∈ [0, 1] of the walls.
    pub rho: Spectrum,
    /// Roughness r ∈ [0, 1]; 0 is Lambertian.
    pub roughness: f32,
}

/// Coefficient of r in 1/A = 1 + C₁ r.
const C1: f32 = 0.5 - 2.0 / (3.0 * PI);
/// Coefficient of r in the mean of Ê, which is A (1 + C₂ r).
const C2: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// G(μ)/π: the albedo Ê(μ) of light scattered once, with ρ = 1, is A (1 + r G/π).
#[inline]
fn g_over_pi(cos: f32) -> f32 {
    let cos = cos.min(1.0);
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    // (1 − sin³) / cos, without cancellation.
    let cubes = cos * (1.0 + sin + sin * sin) / (1.0 + sin);
    let g = sin * (trig::acos(cos) - sin * cos) + (2.0 / 3.0) * sin * (cubes - 1.0);
    g * FRAC_1_PI
}

impl Eon {
    /// Index of the albedo among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the roughness among the packed parameters.
    pub(crate) const ROUGHNESS: usize = 3;

    /// Probability of uniform hemisphere sampling, for directions that the other map seldom
    /// samples.
    #[inline]
    fn even_probability(&self, mu: f32) -> f32 {
        let at_one = 0.162_925 + mu * (-0.372_058 + mu * (0.538_233 - 0.290_822 * mu));
        trig::powf(self.roughness, 0.1) * at_one
    }

    #[inline]
    fn cosine(&self, mu: f32) -> TransformedCosine {
        let r = self.roughness;
        let b = -1.164_07 + 1.158_59 * mu + (0.150_815 - 0.150_105 * mu) * r;
        let d = 0.540_852 + mu * (-1.016_25 + 0.475_392 * mu);
        TransformedCosine {
            a: 1.0
                + r * (0.303_392
                    + mu * (-0.518_982 + 0.111_709 * mu)
                    + r * (-0.276_266 + 0.335_918 * mu)),
            b: r * b / (mu * mu * mu - 1.435_45),
            c: 1.0 + r * (0.200_13 + mu * (-0.506_373 + 0.261_777 * mu)),
            d: r * d / (-1.074_3 + mu * (0.072_562_8 + mu)),
        }
    }
}

/// Clipped linearly transformed cosine: a cosine distribution transformed by the matrix M, with
/// columns (a, 0, d), (0, c, 0) and (b, 0, 1), of which only directions above the surface are
/// sampled; `wo` lies in the half-plane of +x. [Portsmouth et al. 2025, "clipped linearly
/// transformed cosine"]
struct TransformedCosine {
    a: f32,
    b: f32,
    c: f32,
    d: f32,
}

impl TransformedCosine {
    /// Fraction of the cosine distribution that M maps above the surface.
    #[inline]
    fn above(&self) -> f32 {
        0.5 * (1.0 + 1.0 / (1.0 + self.d * self.d).sqrt())
    }

    /// Samples a direction. Directions above the surface are the image of half of the unit disk and
    /// half of an ellipse.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> Vec3 {
        let [x, y] = warp::concentric_disk(u);
        let s = self.above();
        let edge = (1.0 - y * y).max(0.0).sqrt();
        let x = s * -x + (s - 1.0) * edge;
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        Vec3::new(self.a * x + self.b * z, self.c * y, self.d * x + z).normalize()
    }

    #[inline]
    fn pdf(&self, wi: Vec3) -> f32 {
        let Self { a, b, c, d } = *self;
        let determinant = c * (a - b * d);
        // |M| M⁻¹ wi
        let w = Vec3::new(c * (wi.x - b * wi.z), (a - b * d) * wi.y, c * (a * wi.z - d * wi.x));
        let stretch = determinant / w.length_squared();
        stretch * stretch * w.z.max(0.0) * (FRAC_1_PI / self.above())
    }
}

/// Cosine and sine of the azimuth of `wo`; those of +x at the normal.
#[inline]
fn across(wo: Vec3) -> (f32, f32) {
    let sin = (wo.x * wo.x + wo.y * wo.y).sqrt();
    if sin > 0.0 { (wo.x / sin, wo.y / sin) } else { (1.0, 0.0) }
}

impl Lobe<'_> for Eon {
    const DELTA: bool = false;
    const DIFFUSE: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [a, b, c] = self.rho.to_array();
        padded([a, b, c, self.roughness])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { rho: color(p, Self::RHO), roughness: p[Self::ROUGHNESS] }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Spectrum::ZERO;
        }
        let r = self.roughness;
        let a = 1.0 / (1.0 + C1 * r);
        let s = wo.x * wi.x + wo.y * wi.y;
        let s_over_t = if s > 0.0 { s / wo.z.max(wi.z) } else { s };
        // Rounding may make this negative for light from the opposite side, at grazing angles.
        let once = self.rho * (a * (1.0 + r * s_over_t).max(0.0));
        // (1 − Ê(o)) (1 − Ê(i)) / (1 − mean): each has the factor A r.
        let lost = |cos: f32| (C1 - g_over_pi(cos)).max(0.0);
        let twice = a * r * lost(wo.z) * lost(wi.z) / (C1 - C2);
        let mean = a * (1.0 + C2 * r);
        let rho = self.rho.0;
        let again = Spectrum(rho * rho * mean / (Vec3::ONE - rho * (1.0 - mean)));
        (once + again * twice) * (FRAC_1_PI * wi.z)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Pdf::ZERO;
        }
        let (c, s) = across(wo);
        let seen = Vec3::new(c * wi.x + s * wi.y, c * wi.y - s * wi.x, wi.z);
        let even = self.even_probability(wo.z);
        let cosine = self.cosine(wo.z).pdf(seen);
        Pdf::new(even * warp::uniform_hemisphere_pdf(wi.z).get() + (1.0 - even) * cosine)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if choice < self.even_probability(wo.z) {
            warp::uniform_hemisphere([u, v])
        } else {
            let (c, s) = across(wo);
            let w = self.cosine(wo.z).sample([u, v]);
            Vec3::new(c * w.x - s * w.y, s * w.x + c * w.y, w.z)
        };
        let pdf = self.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    /// The lobe varies slowly with direction.
    #[inline]
    fn lobe_width(&self) -> f32 {
        0.5
    }

    fn examples() -> Vec<Self> {
        let color = Spectrum::rgb(0.8, 0.0, 0.3);
        let all = [(Spectrum::ONE, 1.0), (color, 0.4), (Spectrum::ONE, 0.05), (color, 0.0)];
        all.map(|(rho, roughness)| Self { rho, roughness }).to_vec()
    }
}

#[cfg(test)]
impl LobeLaws for Eon {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let even = self.even_probability(wo.z);
        if choice < even { even } else { 1.0 - even }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROUGHNESSES: [f32; 5] = [0.0, 0.1, 0.4, 0.8, 1.0];

    fn at_cosine(cos: f32) -> Vec3 {
        Vec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos)
    }

    /// White furnace: no energy is lost, at any roughness and angle.
    #[test]
    fn white_walls_scatter_all_that_arrives() {
        const STEPS: u16 = 1000;
        let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(STEPS);
        for roughness in ROUGHNESSES {
            let lobe = Eon { rho: Spectrum::ONE, roughness };
            for cos in [1.0, 0.8, 0.4, 0.1, 0.01] {
                let mut albedo = 0.0f64;
                for (u, v) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
                    // By angles: f is discontinuous at grazing angles.
                    let (sin, z) = trig::sin_cos(0.5 * PI * middle(u));
                    let (s, c) = trig::sin_cos(PI * middle(v));
                    let f = lobe.eval(at_cosine(cos), Vec3::new(sin * c, sin * s, z));
                    albedo += f64::from(f.0.x * sin * PI * PI);
                }
                albedo /= f64::from(STEPS) * f64::from(STEPS);
                assert!((albedo - 1.0).abs() < 1e-4, "{roughness} {cos}: {albedo}");
            }
        }
    }

    /// Roughness 0 is Lambert's law, for evaluation and sampling.
    #[test]
    fn smooth_walls_are_lambertian() {
        let rho = Spectrum::rgb(0.8, 0.2, 0.5);
        let lobe = Eon { rho, roughness: 0.0 };
        for (wo, wi) in
            [(0.3, 0.9), (1.0, 0.1), (0.01, 0.5)].map(|(o, i)| (at_cosine(o), at_cosine(i)))
        {
            let (f, p) = (lobe.eval(wo, wi), lobe.pdf(wo, wi).get());
            let cosine = wi.z * FRAC_1_PI;
            assert!((f.0 - (rho * cosine).0).abs().max_element() < 1e-6, "{wo} {wi}: {f:?}");
            assert!((p - cosine).abs() < 1e-6, "{wo} {wi}: {p}");
        }
    }

    /// Rough walls reflect light back towards its source: single scattering is 1 + r sin²θ / cos θ
    /// times as strong backwards as sideways.
    #[test]
    fn light_is_sent_back() {
        let (wo, roughness) = (at_cosine(0.2), 1.0);
        let lobe = Eon { rho: Spectrum::splat(0.01), roughness };
        let back = lobe.eval(wo, wo).0.x;
        let aside = lobe.eval(wo, Vec3::new(0.0, wo.x, wo.z)).0.x;
        let want = 1.0 + roughness * wo.x * wo.x / wo.z;
        assert!((back / aside - want).abs() < 0.02 * want, "{} {want}", back / aside);
    }

    /// Importance sampling: sample weights have a smaller second moment than with cosine sampling.
    #[test]
    fn weights_vary_less_than_those_of_cosines() {
        for cos in [0.05, 0.3, 0.9] {
            let (lobe, wo) = (Eon { rho: Spectrum::ONE, roughness: 1.0 }, at_cosine(cos));
            let (mut ours, mut cosines) = (0.0f64, 0.0f64);
            let mut random = pt_testing::Random::new(7);
            for _ in 0..20_000 {
                let [u, v] = random.unit_2d();
                let sample = lobe.sample(wo, [u, v, random.unit()]);
                let weight = sample.map_or(0.0, |s| f64::from(s.weight.0.x));
                ours += weight * weight;
                let wi = warp::cosine_hemisphere([u, v]);
                let pdf = warp::cosine_hemisphere_pdf(wi.z).get();
                let weight = f64::from(lobe.eval(wo, wi).0.x / pdf);
                cosines += weight * weight;
            }
            assert!(ours < cosines, "{cos}: {ours} {cosines}");
        }
    }
}
