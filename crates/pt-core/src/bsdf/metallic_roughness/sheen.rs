//! The sheen of cloth, with facets along the normal. [Estevez & Kulla 2017, "Production Friendly
//! Microfacet Sheen BRDF"; glTF 2.0, KHR_materials_sheen]

use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use pt_math::{FloatExt, Vec3, trig};

/// Cosines of the table of albedos, uniform in their square roots: albedos change most at grazing
/// angles.
const COSINES: usize = 48;
/// Roughnesses of the table, uniform from [`MIN`] to 1.
const ROUGHNESSES: usize = 17;
/// Minimum roughness; below it, sheen is visible at grazing angles only.
const MIN: f32 = 0.07;
/// Side of the grid of integration directions of albedos.
const GRID: u16 = 96;

/// Sheen of full amount.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheen {
    /// α, the square of the roughness.
    alpha: f32,
    /// Position of the roughness in the table.
    place: f32,
}

static ALBEDOS: LazyLock<Box<[[f32; COSINES]; ROUGHNESSES]>> = LazyLock::new(|| {
    let middle = |i: u16| (f32::from(i) + 0.5) / f32::from(GRID);
    let albedo = |sheen: Sheen, cos: f32| {
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        // Grazing directions, into which most light is scattered, are sampled more densely.
        let weight = |u: f32, v: f32| {
            let z = u * u;
            let (sin_phi, cos_phi) = trig::sin_cos(TAU * v);
            let sin = (1.0 - z * z).sqrt();
            let wi = Vec3::new(sin * cos_phi, sin * sin_phi, z);
            f64::from(sheen.raw(wo, wi) * TAU * 2.0 * u)
        };
        let row = |v: u16| (0..GRID).map(|u| weight(middle(u), middle(v))).sum::<f64>();
        ((0..GRID).map(row).sum::<f64>() / f64::from(GRID).powi(2)) as f32
    };
    let of = |r: usize| {
        let t = r as f32 / (ROUGHNESSES - 1) as f32;
        let sheen = Sheen::new(MIN.lerp(1.0, t));
        std::array::from_fn(|i| albedo(sheen, (i as f32 / (COSINES - 1) as f32).powi(2).max(1e-5)))
    };
    Box::new(std::array::from_fn(of))
});

impl Sheen {
    #[inline]
    pub(super) fn new(roughness: f32) -> Self {
        let roughness = roughness.clamp(MIN, 1.0);
        let place = (roughness - MIN) / (1.0 - MIN) * (ROUGHNESSES - 1) as f32;
        Self { alpha: roughness * roughness, place }
    }

    /// Λ, fitted by Estevez & Kulla to facets in rows. [glTF 2.0, KHR_materials_sheen, "Sheen
    /// visibility"]
    #[inline]
    fn lambda(self, cos: f32) -> f32 {
        const SMOOTH: [f32; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        const ROUGH: [f32; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        let t = (1.0 - self.alpha) * (1.0 - self.alpha);
        let [a, b, c, d, e]: [f32; 5] = std::array::from_fn(|i| ROUGH[i].lerp(SMOOTH[i], t));
        let l = |x: f32| a / (1.0 + b * trig::powf(x, c)) + d * x + e;
        let exponent =
            if cos < 0.5 { l(cos.max(0.0)) } else { 2.0 * l(0.5) - l((1.0 - cos).max(0.0)) };
        trig::exp(exponent)
    }

    /// f cos θi for two directions above the surface, by the formulas, which gain energy at grazing
    /// angles.
    #[inline]
    fn raw(self, wo: Vec3, wi: Vec3) -> f32 {
        let h = (wo + wi).normalize();
        let inverse = self.alpha.recip();
        let sin = ((1.0 - h.z) * (1.0 + h.z)).max(0.0).sqrt();
        let d = (2.0 + inverse) * trig::powf(sin, inverse) / (2.0 * PI);
        let seen = 1.0 + self.lambda(wo.z) + self.lambda(wi.z);
        let f = d / (seen * 4.0 * wo.z);
        if f.is_finite() { f } else { 0.0 }
    }

    /// Albedo of the formulas at a cosine.
    #[inline]
    fn raw_albedo(self, cos: f32) -> f32 {
        let x = cos.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f32;
        let (i, r) = ((x as usize).min(COSINES - 2), (self.place as usize).min(ROUGHNESSES - 2));
        let [a, b] = [r, r + 1].map(|r| {
            let row = &ALBEDOS[r];
            row[i].lerp(row[i + 1], x - i as f32)
        });
        a.lerp(b, self.place - r as f32)
    }

    /// Directional albedo at a cosine, at most 1.
    #[inline]
    pub(super) fn albedo(self, cos: f32) -> f32 {
        self.raw_albedo(cos).min(1.0)
    }

    /// f cos θi for two directions above the surface, scaled down in directions in which the
    /// formulas gain energy.
    #[inline]
    pub(super) fn eval(self, wo: Vec3, wi: Vec3) -> f32 {
        let held = |cos: f32| self.raw_albedo(cos).max(1.0).recip();
        self.raw(wo, wi) * held(wo.z) * held(wi.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table agrees with integrals of the formulas on a grid of 400 × 400 directions, in double
    /// precision.
    #[test]
    fn albedos_are_those_of_the_formulas() {
        for (roughness, cos, wanted) in [
            (0.2, 0.1, 0.5597),
            (0.3, 0.3, 0.2199),
            (0.5, 0.3, 0.3214),
            (0.5, 0.6, 0.1416),
            (0.7, 1.0, 0.0852),
            (1.0, 0.05, 0.8273),
            (1.0, 1.0, 0.1638),
        ] {
            let albedo = Sheen::new(roughness).raw_albedo(cos);
            assert!((albedo - wanted).abs() < 0.012, "{roughness} {cos}: {albedo}, {wanted}");
        }
    }
}
