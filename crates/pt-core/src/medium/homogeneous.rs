//! A homogeneous medium.

use pt_math::{Ray, Spectrum, trig};

use super::MediumSample;

/// Maximum distance in an unbounded medium, in metres: a tenth of a light year. Squares of longer
/// distances soon overflow single precision.
const FARTHEST: f32 = 1e15;

/// Constant extinction and albedo.
#[derive(Clone, Copy, Debug)]
pub struct Homogeneous {
    /// Extinction σt per metre.
    pub extinction: Spectrum,
    /// Single-scattering albedo, the fraction of the extinction that is scattered.
    pub albedo: Spectrum,
    /// Emitted radiance Le of an opaque amount of the medium that only absorbs.
    pub emission: Spectrum,
}

impl Homogeneous {
    /// T = e^(−σt d), with d the length of the interval. [Beer's law]
    #[inline]
    pub fn transmittance(&self, ray: &Ray) -> Spectrum {
        self.along((ray.t_max - ray.t_min) * ray.direction.length())
    }

    #[inline]
    fn along(&self, distance: f32) -> Spectrum {
        let distance = distance.min(FARTHEST);
        self.extinction.map(|sigma| trig::exp(-sigma * distance))
    }

    /// Emitted radiance that reaches the start of a ray from its interval: ∫ T σa Le dt = (1 − T)
    /// (σa / σt) Le.
    pub fn emitted(&self, ray: &Ray) -> Spectrum {
        let distance = ((ray.t_max - ray.t_min) * ray.direction.length()).min(FARTHEST);
        let taken = self.extinction.map(|sigma| -libm::expm1f(-sigma * distance));
        taken * (Spectrum::ONE - self.albedo) * self.emission
    }

    /// Samples a distance by the extinction of one channel, which is selected by the throughput:
    /// the density is the mean of those of the channels. [Veach 1997, §9.2.3: the one-sample model
    /// with the balance heuristic]
    #[inline]
    pub fn sample(&self, ray: &Ray, beta: Spectrum, [u, choice]: [f32; 2]) -> MediumSample {
        if self.albedo.is_black() {
            return MediumSample::Transmitted { weight: self.transmittance(ray) };
        }
        let [r, g, b] = beta.to_array();
        let share = beta / (r + g + b);
        let [sr, sg, sb] = self.extinction.to_array();
        let choice = choice * (r + g + b);
        let sigma = if choice < r {
            sr
        } else if choice < r + g {
            sg
        } else {
            sb
        };
        let unit = ray.direction.length();
        let distance = -trig::ln(1.0 - u) / sigma;
        let t = ray.t_min + distance / unit;
        if t < ray.t_max && distance < FARTHEST {
            let transmittance = self.along(distance);
            let removed = self.extinction * transmittance;
            MediumSample::Scattered { t, weight: balanced(removed, share) * self.albedo }
        } else {
            let transmittance = self.transmittance(ray);
            MediumSample::Transmitted { weight: balanced(transmittance, share) }
        }
    }
}

/// Divides channels by their mean with the weights `share`; zero if the mean underflows.
#[inline]
pub(super) fn balanced(channels: Spectrum, share: Spectrum) -> Spectrum {
    let [r, g, b] = (share * channels).to_array();
    let mean = r + g + b;
    // Divided individually: the inverse of a small mean may be infinite.
    if mean > 0.0 { channels.map(|x| x / mean) } else { Spectrum::ZERO }
}
