//! A medium that is the same everywhere.

use pt_math::{Ray, Spectrum, trig};

use super::Flight;

/// The same extinction and albedo everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Homogeneous {
    /// Extinction σt per metre.
    pub extinction: Spectrum,
    /// Share of it that is scattered.
    pub albedo: Spectrum,
}

impl Homogeneous {
    /// T = e^(−σt d), with d the length of the interval. [Beer's law]
    #[inline]
    pub fn transmittance(&self, ray: &Ray) -> Spectrum {
        self.along((ray.t_max - ray.t_min) * ray.direction.length())
    }

    #[inline]
    fn along(&self, distance: f32) -> Spectrum {
        // Infinitely far, where there is no extinction, all light arrives.
        let distance = distance.min(f32::MAX);
        self.extinction.map(|sigma| trig::exp(-sigma * distance))
    }

    /// A distance by the extinction of one channel, which is chosen by the throughput: the density is
    /// the mean of those of the channels. [Veach 1997, §9.2.3: the one-sample model with the balance
    /// heuristic]
    #[inline]
    pub fn sample(&self, ray: &Ray, beta: Spectrum, [u, choice]: [f32; 2]) -> Flight {
        if self.albedo.is_black() {
            return Flight::Passed { weight: self.transmittance(ray) };
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
        let sum = |s: Spectrum| s.0.x + s.0.y + s.0.z;
        if t < ray.t_max {
            let transmittance = self.along(distance);
            let removed = self.extinction * transmittance;
            Flight::Scattered { t, weight: removed * self.albedo / sum(share * removed) }
        } else {
            let transmittance = self.transmittance(ray);
            Flight::Passed { weight: transmittance / sum(share * transmittance) }
        }
    }
}
