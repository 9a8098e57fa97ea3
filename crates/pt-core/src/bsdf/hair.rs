//! Scattering by fibres of hair and fur.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, trig};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Number of path classes p of light in the fibre: reflection (R), transmission (TT), transmission
/// with one internal reflection (TRT), and all longer paths together.
const WAYS: usize = 4;
/// Class of the longer paths.
const LONGER: usize = WAYS - 1;
/// Minimum roughness; below it, single precision is not sufficient.
const MIN_ROUGHNESS: f32 = 0.02;
/// Minimum density of a sample. Lower ones occur only in the tails of N, where single precision is
/// not sufficient.
const MIN_DENSITY: f32 = 1e-30;

/// S · cos θi = Σ M_p(θo, θi) A_p(ωo) N_p(φ): a round dielectric fibre with an absorbing interior
/// and tilted scales.
///
/// The fibre is along x; θ is the angle from the plane across it, and φ the angle around it. M is
/// the longitudinal scattering function, N the azimuthal one, and A the attenuation of path class
/// p. The integral over all directions is Σ A_p, which is 1 without absorption: energy is
/// conserved. [Chiang, Bitterli, Tappan & Burley 2016, "A Practical and Controllable Hair and Fur
/// Model for Production Path Tracing"; Marschner et al. 2003, "Light Scattering from Human Hair
/// Fibers"; d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model"; Pharr, Jakob &
/// Humphreys 2023, §9.9]
///
/// The offset across the fibre, h = sin γo, follows from the angle around the fibre between the
/// normal and `wo`; a viewer below the surface sees the edge of the fibre. Light is scattered into
/// all directions, whatever the surface: it represents the whole fibre.
#[derive(Clone, Copy, Debug)]
pub struct Hair {
    /// Absorption coefficient σa, for a fibre of radius 1.
    pub absorption: Spectrum,
    /// Index of refraction, at least 1.
    pub eta: f32,
    /// Longitudinal variance v of path class R.
    pub variance: f32,
    /// Scale s of the logistic distribution of φ.
    pub scale: f32,
    /// Sine of the tilt angle α of the scales.
    pub tilt: f32,
}

/// Terms that depend on the viewer only.
struct ViewTerms {
    /// Sine and cosine of θo.
    theta: [f32; 2],
    /// Sine and cosine of φo.
    phi: [f32; 2],
    /// γo outside, and γt inside of the fibre.
    gamma: [f32; 2],
    /// Attenuation A_p.
    shares: [Spectrum; WAYS],
    /// Probability of sampling each path class.
    chances: [f32; WAYS],
}

impl Hair {
    /// Index of the absorption among the packed parameters.
    pub(crate) const ABSORPTION: usize = 0;

    /// Creates the lobe from perceptually uniform roughnesses β along the fibre and around it, from
    /// 0 to 1, and the tilt of its scales in degrees. [Chiang et al. 2016, §4.1; Pharr, Jakob &
    /// Humphreys 2023, §9.9.1]
    pub fn new(absorption: Spectrum, eta: f32, [along, around]: [f32; 2], degrees: f32) -> Self {
        let [along, around] = [along, around].map(|b| f64::from(b.clamp(MIN_ROUGHNESS, 1.0)));
        let root = 0.726 * along + 0.812 * along * along + 3.7 * libm::pow(along, 20.0);
        let turn = 0.265 * around + 1.194 * around * around + 5.372 * libm::pow(around, 22.0);
        Self {
            absorption,
            eta: eta.max(1.0),
            variance: (root * root) as f32,
            // The logistic distribution has √(π/8) of the width of the normal distribution of the
            // same peak.
            scale: (libm::sqrt(std::f64::consts::PI / 8.0) * turn) as f32,
            tilt: libm::sin(f64::from(degrees).to_radians()) as f32,
        }
    }

    /// Longitudinal variance v of each path class: transmission narrows the distribution, and
    /// internal reflection widens it.
    fn variances(&self) -> [f32; WAYS] {
        let v = self.variance;
        [v, 0.25 * v, 4.0 * v, 4.0 * v]
    }

    /// Sine and cosine of θo for each path class, rotated by the effect of the scales.
    fn tilted(&self, [sin, cos]: [f32; 2]) -> [[f32; 2]; WAYS] {
        let doubled = |[s, c]: [f32; 2]| [2.0 * s * c, (c - s) * (c + s)];
        let once = [self.tilt, ((1.0 - self.tilt) * (1.0 + self.tilt)).max(0.0).sqrt()];
        let twice = doubled(once);
        let [s4, c4] = doubled(twice);
        let turned = |[s, c]: [f32; 2]| [sin * c + cos * s, (cos * c - sin * s).abs()];
        [turned([-twice[0], twice[1]]), turned(once), turned([s4, c4]), [sin, cos]]
    }

    fn viewed(&self, wo: Vec3) -> ViewTerms {
        const ALONG: f32 = 1e-15;
        let (sin, cos) = (wo.x, (wo.y * wo.y + wo.z * wo.z).sqrt());
        let phi = if cos > ALONG { [wo.y / cos, wo.z / cos] } else { [0.0, 1.0] };
        let [h, cos_gamma] = if phi[1] > 0.0 { phi } else { [1f32.copysign(phi[0]), 0.0] };
        let eta = self.eta;
        // Across the fibre, the effective index is η′ = √(η² − sin²θo) / cos θo.
        let sin_inside = h * cos / (eta * eta - sin * sin).max(1e-9).sqrt();
        let sin_inside = sin_inside.clamp(-1.0, 1.0);
        let cos_inside = ((1.0 - sin_inside) * (1.0 + sin_inside)).sqrt();
        let cos_theta_inside = (1.0 - (sin / eta) * (sin / eta)).max(1e-8).sqrt();
        let passed = -2.0 * cos_inside / cos_theta_inside;
        let t = self.absorption.map(|a| trig::exp(a * passed));
        let f = fresnel::dielectric((cos * cos_gamma).min(1.0), eta).map_or(1.0, |(f, _)| f);
        let through = t * ((1.0 - f) * (1.0 - f));
        let inside = t * f;
        let returned = through * inside;
        let rest = |channel: f32| channel / (1.0 - channel).max(1e-9);
        let shares = [Spectrum::splat(f), through, returned, returned * inside.map(rest)];
        let most = shares.map(Spectrum::max_channel);
        let sum: f32 = most.iter().sum();
        ViewTerms {
            theta: [sin, cos],
            phi,
            gamma: [trig::atan2(h, cos_gamma), trig::atan2(sin_inside, cos_inside)],
            shares,
            chances: if sum > 0.0 { most.map(|share| share / sum) } else { most },
        }
    }

    /// M_p · N_p.
    fn spread(&self, viewed: &ViewTerms, wi: Vec3) -> [f32; WAYS] {
        let cos_i = (wi.y * wi.y + wi.z * wi.z).sqrt();
        let [sin_phi, cos_phi] = viewed.phi;
        let phi = trig::atan2(wi.y * cos_phi - wi.z * sin_phi, wi.z * cos_phi + wi.y * sin_phi);
        let (tilted, variances) = (self.tilted(viewed.theta), self.variances());
        std::array::from_fn(|p| {
            let along = longitudinal(variances[p], [wi.x, cos_i], tilted[p]);
            let around = if p == LONGER {
                0.5 * FRAC_1_PI
            } else {
                trimmed_logistic(self.scale, wrapped(phi - viewed.turn(p)))
            };
            along * around
        })
    }
}

impl ViewTerms {
    /// Φ(p): angle around the fibre by which a perfectly smooth fibre deflects light.
    fn turn(&self, p: usize) -> f32 {
        let (p, [outside, inside]) = (p as f32, self.gamma);
        2.0 * (p * inside - outside) + p * PI
    }

    /// Returns the path class that `u` selects, and `u` remapped to [0, 1) within that class.
    fn choose(&self, u: f32) -> (usize, f32) {
        let (mut p, mut first, mut end) = (0, 0.0, 0.0);
        for (way, &chance) in self.chances.iter().enumerate() {
            if chance > 0.0 {
                (p, first) = (way, end);
            }
            end += chance;
            if u < end {
                break;
            }
        }
        (p, ((u - first) / self.chances[p]).clamp(0.0, 1.0 - f32::EPSILON))
    }
}

/// M: longitudinal density of θi per cos θi, around −θo. With a = cos θi cos θo / v and b = sin θi
/// sin θo / v, it is I₀(a) e⁻ᵇ / (2v sinh 1/v), rearranged to avoid large exponents. [d'Eon et al.
/// 2011, eq. 7]
fn longitudinal(v: f32, [sin_i, cos_i]: [f32; 2], [sin_o, cos_o]: [f32; 2]) -> f32 {
    // a − b − 1/v = −(1 − cos (θi + θo)) / v.
    let (s, c) = (sin_i + sin_o, cos_i - cos_o);
    let exponent = -(s * s + c * c) / (2.0 * v);
    scaled_bessel(cos_i * cos_o / v) * trig::exp(exponent) / (v * (1.0 - trig::exp(-2.0 / v)))
}

/// Samples the sine of θi from M. [d'Eon et al. 2013, "Importance Sampling for Physically-Based
/// Hair Fiber Models"]
fn sample_longitudinal(v: f32, [sin_o, cos_o]: [f32; 2], [u, w]: [f32; 2]) -> f32 {
    let u = 1.0 - u;
    let fall = (-v * trig::ln(u + (1.0 - u) * trig::exp(-2.0 / v))).clamp(0.0, 2.0);
    let sin = (fall * (2.0 - fall)).sqrt();
    let (_, cos_phi) = trig::sin_cos_tau(w);
    ((fall - 1.0) * sin_o + sin * cos_phi * cos_o).clamp(-1.0, 1.0)
}

/// e⁻ˣ I₀(x) for x ≥ 0, to a relative error of 2·10⁻⁷. [Abramowitz & Stegun 1964, §9.8.1 and
/// §9.8.2]
fn scaled_bessel(x: f32) -> f32 {
    const SMALL: [f32; 7] =
        [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
    const LARGE: [f32; 9] = [
        0.398_942_3,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    const BORDER: f32 = 3.75;
    let polynomial = |c: &[f32], t: f32| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x < BORDER {
        let t = x / BORDER;
        polynomial(&SMALL, t * t) * trig::exp(-x)
    } else {
        polynomial(&LARGE, BORDER / x) / x.sqrt()
    }
}

/// Wraps an angle to [−π, π].
fn wrapped(phi: f32) -> f32 {
    phi - TAU * (phi * (1.0 / TAU)).round()
}

/// Integral of the logistic distribution over [−π, π], tanh π/2s.
fn between(scale: f32) -> f32 {
    let e = trig::exp(-PI / scale);
    (1.0 - e) / (1.0 + e)
}

/// Density of the logistic distribution of this scale, truncated to ±π and normalized.
fn trimmed_logistic(scale: f32, x: f32) -> f32 {
    let e = trig::exp(-x.abs() / scale);
    e / (scale * (1.0 + e) * (1.0 + e) * between(scale))
}

fn sample_trimmed_logistic(scale: f32, u: f32) -> f32 {
    let e = trig::exp(-PI / scale);
    let y = e / (1.0 + e) + u * between(scale);
    (scale * trig::ln(y / (1.0 - y).max(f32::MIN_POSITIVE))).clamp(-PI, PI)
}

impl Lobe<'_> for Hair {
    const DELTA: bool = false;
    const TRANSMITS: bool = true;
    const IS_FIBER: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [r, g, b] = self.absorption.to_array();
        padded([r, g, b, self.eta, self.variance, self.scale, self.tilt])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        let absorption = color(p, Self::ABSORPTION);
        Self { absorption, eta: p[3], variance: p[4], scale: p[5], tilt: p[6] }
    }

    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let viewed = self.viewed(wo);
        let spread = Hair::spread(self, &viewed, wi);
        (0..WAYS).map(|p| viewed.shares[p] * spread[p]).sum()
    }

    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let viewed = self.viewed(wo);
        let spread = Hair::spread(self, &viewed, wi);
        let sum: f32 = (0..WAYS).map(|p| viewed.chances[p] * spread[p]).sum();
        Pdf::new(sum)
    }

    /// Samples a path class by `u[2]`, which is remapped and used again; then θi from M and φ from
    /// N. Directions need three numbers, so that `u[2]` moves them as well.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let viewed = self.viewed(wo);
        let (p, third) = viewed.choose(u[2]);
        let tilted = self.tilted(viewed.theta)[p];
        let sin = sample_longitudinal(self.variances()[p], tilted, [u[0], third]);
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        let phi = if p == LONGER {
            TAU * u[1]
        } else {
            viewed.turn(p) + sample_trimmed_logistic(self.scale, u[1])
        };
        let ([sin_phi, cos_phi], (s, c)) = (viewed.phi, trig::sin_cos(phi));
        let across = [sin_phi * c + cos_phi * s, cos_phi * c - sin_phi * s];
        let wi = Vec3::new(sin, cos * across[0], cos * across[1]).normalize();
        let spread = Hair::spread(self, &viewed, wi);
        let pdf: f32 = (0..WAYS).map(|p| viewed.chances[p] * spread[p]).sum();
        let f: Spectrum = (0..WAYS).map(|p| viewed.shares[p] * spread[p]).sum();
        (pdf > MIN_DENSITY).then(|| BsdfSample::new(wi, f * (1.0 / pdf), Some(Pdf::new(pdf))))
    }

    fn examples() -> Vec<Self> {
        let white = Spectrum::ZERO;
        let brown = Spectrum::rgb(0.84, 1.39, 2.74);
        vec![
            Self::new(white, 1.55, [0.3, 0.3], 2.0),
            Self::new(brown, 1.55, [0.3, 0.3], 2.0),
            Self::new(Spectrum::rgb(0.06, 0.1, 0.2), 1.55, [0.1, 0.2], 3.0),
            Self::new(brown, 1.55, [0.25, 0.1], 0.0),
            Self::new(white, 1.3, [0.7, 1.0], -5.0),
            Self::new(Spectrum::rgb(0.0, 2.0, 300.0), 1.0, [1.0, 0.6], 2.0),
        ]
    }
}

#[cfg(test)]
impl LobeLaws for Hair {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            // The scales point to the tip, and h depends on `wo` only.
            is_reciprocal: false,
            has_delta_part: false,
            maps: SamplingMaps::OfThreeNumbers,
            max_albedo: CONSERVING,
            can_be_lossless: true,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn is_lossless(&self, _: Vec3) -> bool {
        self.absorption.is_black()
    }
}

#[cfg(test)]
mod tests {
    use pt_math::DVec3;
    use pt_testing::Random;

    use super::*;

    /// Roughnesses along and around the fibre, from smooth to rough.
    const ROUGHNESSES: [[f32; 2]; 6] =
        [[0.1, 0.1], [0.1, 1.0], [0.3, 0.3], [0.4, 0.1], [0.7, 0.9], [1.0, 1.0]];

    fn fibre(absorption: f32, roughnesses: [f32; 2], degrees: f32) -> Hair {
        Hair::new(Spectrum::splat(absorption), 1.55, roughnesses, degrees)
    }

    /// Sine of the midpoint of cell `i` of `n` of the angles from −π/2 to π/2.
    fn theta(i: u32, n: u32) -> f64 {
        ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * std::f64::consts::PI
    }

    /// Direction of an angle from the plane across the fibre and an angle around the fibre.
    fn direction(theta: f64, phi: f64) -> Vec3 {
        let (sin, cos) = libm::sincos(theta);
        let (across, up) = libm::sincos(phi);
        DVec3::new(sin, cos * across, cos * up).as_vec3()
    }

    /// The integral of a function over the sphere, by θ and φ.
    fn integral(n: [u32; 2], f: impl Fn(Vec3) -> f32) -> f64 {
        let turn = std::f64::consts::TAU;
        let ring = |i: u32| {
            let theta = theta(i, n[0]);
            let phi = |j: u32| (f64::from(j) + 0.5) / f64::from(n[1]) * turn;
            let sum: f64 = (0..n[1]).map(|j| f64::from(f(direction(theta, phi(j))))).sum();
            sum * libm::cos(theta)
        };
        let cell = std::f64::consts::PI / f64::from(n[0]) * turn / f64::from(n[1]);
        (0..n[0]).map(ring).sum::<f64>() * cell
    }

    /// White furnace: for a fibre without absorption, the integral of S · cos θi over all
    /// directions is 1 for every h, and so is its mean.
    #[test]
    fn a_white_fibre_loses_nothing() {
        let mut random = Random::new(1);
        for roughnesses in ROUGHNESSES {
            for degrees in [0.0, 2.0, 8.0] {
                let hair = fibre(0.0, roughnesses, degrees);
                for _ in 0..3 {
                    let wo = random.direction();
                    let found = integral([600, 600], |wi| hair.eval(wo, wi).max_channel());
                    assert!((found - 1.0).abs() < 2e-3, "{hair:?} {wo}: {found}");
                }
            }
        }
    }

    /// The density integrates to 1, with any absorption.
    #[test]
    fn the_density_is_one() {
        let mut random = Random::new(2);
        for roughnesses in ROUGHNESSES {
            for absorption in [0.0, 0.5, 20.0] {
                let hair = fibre(absorption, roughnesses, 2.0);
                let wo = random.direction();
                let found = integral([600, 600], |wi| hair.pdf(wo, wi).get());
                assert!((found - 1.0).abs() < 2e-3, "{hair:?} {wo}: {found}");
            }
        }
    }

    /// Samples of a white fibre have weight 1, as the density is proportional to the lobe; with
    /// absorption, weights are at most 1.
    #[test]
    fn weights_are_what_is_not_absorbed() {
        let mut random = Random::new(3);
        for roughnesses in ROUGHNESSES {
            for absorption in [0.0, 0.7] {
                let hair = fibre(absorption, roughnesses, 2.0);
                for _ in 0..2000 {
                    let wo = random.direction();
                    let [u, v] = random.unit_2d();
                    let Some(s) = hair.sample(wo, [u, v, random.unit()]) else { continue };
                    let weight = s.weight.max_channel();
                    assert!(weight < 1.0 + 1e-5, "{hair:?} {wo}: {s:?}");
                    assert!(absorption > 0.0 || weight > 1.0 - 1e-5, "{hair:?} {wo}: {s:?}");
                }
            }
        }
    }

    /// The mean of a function of directions agrees between samples and integration.
    #[test]
    fn samples_integrate_as_the_lobe_does() {
        const SAMPLES: u32 = 200_000;
        let mut random = Random::new(4);
        let light = |wi: Vec3| 1.0 + wi.x + 0.5 * wi.y * wi.z - 0.25 * wi.z;
        for roughnesses in ROUGHNESSES {
            let hair = fibre(0.4, roughnesses, 3.0);
            let wo = random.direction();
            let expected = integral([600, 600], |wi| hair.eval(wo, wi).max_channel() * light(wi));
            let mut sum = 0.0;
            for _ in 0..SAMPLES {
                let [u, v] = random.unit_2d();
                if let Some(s) = hair.sample(wo, [u, v, random.unit()]) {
                    sum += f64::from(s.weight.max_channel() * light(s.wi));
                }
            }
            let found = sum / f64::from(SAMPLES);
            assert!((found / expected - 1.0).abs() < 0.01, "{hair:?} {wo}: {found} {expected}");
        }
    }

    /// At normal incidence, a smooth fibre reflects and transmits by Fresnel's equations.
    #[test]
    fn a_smooth_fibre_is_glass() {
        let hair = fibre(0.0, [0.05, 0.05], 0.0);
        let shares = hair.viewed(Vec3::Z).shares.map(Spectrum::max_channel);
        let f = (0.55f32 / 2.55).powi(2);
        let t = (1.0 - f) * (1.0 - f);
        for (found, expected) in shares.into_iter().zip([f, t, t * f, t * f * f / (1.0 - f)]) {
            assert!((found - expected).abs() < 1e-6, "{shares:?}");
        }
        // Off the centre, reflected light is mirrored about the normal, and transmitted light is
        // refracted twice.
        let gamma = 0.6f64;
        let wo = direction(0.0, gamma);
        let mirrored = direction(0.0, -gamma);
        let inside = libm::asin(libm::sin(gamma) / 1.55);
        let bent = direction(0.0, gamma + 2.0 * (inside - gamma) + std::f64::consts::PI);
        for peak in [mirrored, bent] {
            let at = |by: f64| {
                let (sin, cos) = libm::sincos(by);
                let [y, z] = [f64::from(peak.y), f64::from(peak.z)];
                let wi = DVec3::new(0.0, y * cos + z * sin, z * cos - y * sin).as_vec3();
                hair.eval(wo, wi).max_channel()
            };
            assert!(at(0.0) > at(0.02) && at(0.0) > at(-0.02), "{peak}");
        }
    }

    /// Scales rotate reflected light by twice their angle, and transmitted light in the opposite
    /// direction.
    #[test]
    fn scales_turn_light_along_the_fibre() {
        let hair = fibre(0.0, [0.1, 0.3], 3.0);
        let tilted =
            hair.tilted([0.0, 1.0]).map(|[sin, _]| libm::asin(f64::from(sin)).to_degrees());
        for (found, expected) in tilted.into_iter().zip([-6.0, 3.0, 12.0, 0.0]) {
            assert!((found - expected).abs() < 1e-4, "{tilted:?}");
        }
    }

    /// e⁻ˣ I₀(x) = 1/π ∫₀^π e^(x (cos t − 1)) dt.
    #[test]
    fn the_bessel_function_is_its_integral() {
        for x in [0.0f32, 0.1, 1.0, 3.7, 3.8, 10.0, 200.0, 5000.0] {
            const STEPS: u32 = 20_000;
            let value = |i: u32| {
                let t = (f64::from(i) + 0.5) / f64::from(STEPS) * std::f64::consts::PI;
                libm::exp(f64::from(x) * (libm::cos(t) - 1.0))
            };
            let expected = (0..STEPS).map(value).sum::<f64>() / f64::from(STEPS);
            let found = f64::from(scaled_bessel(x));
            assert!((found / expected - 1.0).abs() < 1e-6, "{x}: {found} {expected}");
        }
    }
}
