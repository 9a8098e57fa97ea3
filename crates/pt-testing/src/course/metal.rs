//! Microfacet metal of the course's handout.

use std::f64::consts::PI;

use pt_math::DVec3;

use super::{around, unit};
use crate::Random;

/// Metal with Beckmann's microfacet distribution.
#[derive(Clone, Copy, Debug)]
pub struct BeckmannMetal {
    /// Roughness.
    pub alpha: f64,
    /// Real part of the index of refraction, by channel.
    pub eta: DVec3,
    /// Imaginary part of the index of refraction, by channel.
    pub k: DVec3,
}

impl BeckmannMetal {
    fn d(&self, cos: f64) -> f64 {
        let (a2, c2) = (self.alpha * self.alpha, cos * cos);
        libm::exp(-(1.0 / c2 - 1.0) / a2) / (PI * a2 * c2 * c2)
    }

    /// Smith's Λ with π in place of √π, as in the handout.
    fn lambda(&self, cos: f64) -> f64 {
        let a = 1.0 / (self.alpha * (1.0 / (cos * cos) - 1.0).max(1e-30).sqrt());
        0.5 * (libm::erf(a) - 1.0 + libm::exp(-a * a) / (a * PI))
    }

    fn fresnel(&self, c: f64) -> DVec3 {
        let (squares, cross) = (self.eta * self.eta + self.k * self.k, 2.0 * self.eta * c);
        let rs = (squares - cross + c * c) / (squares + cross + c * c);
        let rp = (squares * (c * c) - cross + 1.0) / (squares * (c * c) + cross + 1.0);
        0.5 * (rs + rp)
    }

    /// BSDF; the Fresnel term uses the angle to the surface normal.
    pub(super) fn f(&self, n: DVec3, wo: DVec3, wi: DVec3) -> DVec3 {
        let (co, ci) = (wo.dot(n), wi.dot(n));
        if co <= 0.0 || ci <= 0.0 {
            return DVec3::ZERO;
        }
        let g = 1.0 / (1.0 + self.lambda(co) + self.lambda(ci));
        let d = self.d((wo + wi).normalize().dot(n));
        self.fresnel(ci) * (d * g / (4.0 * co * ci))
    }

    /// Samples a direction; returns it and its density.
    pub(super) fn sample(&self, n: DVec3, wo: DVec3, r: &mut Random) -> Option<(DVec3, f64)> {
        let tan2 = -self.alpha * self.alpha * libm::log(1.0 - unit(r));
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let h = around(n, (1.0 - cos * cos).sqrt(), 2.0 * PI * unit(r), cos);
        let wi = 2.0 * wo.dot(h) * h - wo;
        let is_above = wi.dot(n) > 0.0 && wo.dot(n) > 0.0;
        is_above.then(|| (wi, self.d(cos) * cos / (4.0 * wi.dot(h))))
    }
}
